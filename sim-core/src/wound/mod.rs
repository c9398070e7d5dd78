//! The wound once it is sutured (Zhang et al., §2.3): the data form of Table 1, tied stitches, and the suture
//! control strategy of Algorithm 2.

pub mod adjust;
pub mod control;
pub mod ledger;
pub mod stitch;
