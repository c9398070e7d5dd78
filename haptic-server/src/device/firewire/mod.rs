//! The original Omni on FireWire, without the vendor's software.
//!
//! | file | work |
//! |---|---|
//! | `registers` | addresses, identification, serial number |
//! | `packet` | what goes over the two isochronous channels |

pub mod packet;
pub mod registers;
