//! What every message has in common: header, version, layout hash, validation.
//!
//! A message is `#[repr(C)]`, holds integers and floats only, and begins with a [`Header`].
//! The layout hash is FNV-1a (64 bit) over the field names and types in order, so that two builds
//! whose structs have the same size but another meaning refuse each other. A reader copies a
//! message once and then validates the copy: it never trusts the writer.

use iceoryx2::prelude::ZeroCopySend;

/// Version of the wire. Raised with every change of a message.
pub const WIRE_VERSION: u32 = 1;

/// First four bytes of every message: `HSUT` in little-endian order.
pub const WIRE_MAGIC: u32 = u32::from_le_bytes(*b"HSUT");

/// The first field of every message.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ZeroCopySend)]
pub struct Header {
    /// [`WIRE_MAGIC`].
    pub magic: u32,
    /// [`WIRE_VERSION`] of the writer.
    pub version: u32,
    /// FNV-1a hash of the message's field names and types.
    pub layout_hash: u64,
    /// Size of the whole message in bytes.
    pub length: u64,
    /// Counts up by one per message of this writer, from 1.
    pub sequence: u64,
    /// `CLOCK_MONOTONIC` of the writer at completion, nanoseconds.
    pub time_ns: u64,
}

/// A message of fixed layout with a [`Header`] in front.
pub trait Message: Copy + Sized {
    /// Stable name of the message type, without version.
    const NAME: &'static str;
    /// FNV-1a hash of field names and types.
    const LAYOUT_HASH: u64;
    /// The header of this message.
    fn header(&self) -> &Header;
    /// Mutable access for the writer.
    fn header_mut(&mut self) -> &mut Header;
    /// First numeric field that is not usable (not finite, count above capacity, unknown code).
    fn first_bad_field(&self) -> Option<&'static str>;

    /// Fills the header; the writer's last act before it publishes.
    fn stamp(&mut self, sequence: u64, time_ns: u64) {
        *self.header_mut() = Header {
            magic: WIRE_MAGIC,
            version: WIRE_VERSION,
            layout_hash: Self::LAYOUT_HASH,
            length: size_of::<Self>() as u64,
            sequence,
            time_ns,
        };
    }

    /// Checks a private copy of a received message.
    ///
    /// # Errors
    /// [`WireError`] names the first thing that is wrong.
    fn validate(&self) -> Result<(), WireError> {
        let h = self.header();
        if h.magic != WIRE_MAGIC {
            return Err(WireError::Magic { found: h.magic });
        }
        if h.version != WIRE_VERSION {
            return Err(WireError::Version { found: h.version });
        }
        if h.layout_hash != Self::LAYOUT_HASH {
            return Err(WireError::Layout { message: Self::NAME });
        }
        if h.length != size_of::<Self>() as u64 {
            return Err(WireError::Length { message: Self::NAME, found: h.length });
        }
        match self.first_bad_field() {
            Some(field) => Err(WireError::Field { message: Self::NAME, field }),
            None => Ok(()),
        }
    }
}

/// Why a received message was rejected.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum WireError {
    /// Not one of our messages.
    #[error("message does not begin with the magic number (found {found:#010x}); the writer is not a suture server")]
    Magic {
        /// What was found instead.
        found: u32,
    },
    /// Writer and reader were built from different wire versions.
    #[error("message has wire version {found}, this program speaks {WIRE_VERSION}; use binaries of one build")]
    Version {
        /// The writer's version.
        found: u32,
    },
    /// Same version but another field layout.
    #[error("message {message} has another field layout; use binaries of one build")]
    Layout {
        /// Message name.
        message: &'static str,
    },
    /// Length field disagrees with the layout.
    #[error("message {message} says it is {found} bytes long")]
    Length {
        /// Message name.
        message: &'static str,
        /// Stated length.
        found: u64,
    },
    /// A value that must not be used.
    #[error("message {message}: field {field} is not finite, out of range or an unknown code")]
    Field {
        /// Message name.
        message: &'static str,
        /// Field name.
        field: &'static str,
    },
}

/// FNV-1a, 64 bit, at compile time.
#[must_use]
pub const fn fnv1a(text: &str) -> u64 {
    let bytes = text.as_bytes();
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    let mut i = 0;
    while i < bytes.len() {
        hash ^= bytes[i] as u64;
        hash = hash.wrapping_mul(0x0000_0100_0000_01b3);
        i += 1;
    }
    hash
}

/// Defines a `#[repr(C)]` part of a message and its layout text.
macro_rules! pod {
    ($(#[$meta:meta])* pub struct $name:ident { $($(#[$fmeta:meta])* pub $field:ident : $ty:ty,)* }) => {
        $(#[$meta])*
        #[repr(C)]
        #[derive(Clone, Copy, Debug, PartialEq, ::iceoryx2::prelude::ZeroCopySend)]
        pub struct $name { $($(#[$fmeta])* pub $field: $ty,)* }

        impl $name {
            /// Field names and types in order; input of the layout hash.
            pub const LAYOUT: &'static str = concat!(stringify!($name), "{", $(stringify!($field), ":", stringify!($ty), ";",)* "}");
        }
    };
}
pub(crate) use pod;
