//! What every message has in common: header, version, layout hash, validation.
//!
//! A message is `#[repr(C)]`, holds integers and floats only, and begins with a [`Header`].
//! The layout hash is FNV-1a (64 bit) over the field names and types in order, so that two builds
//! whose structs have the same size but another meaning refuse each other. A reader copies a
//! message once and then validates the copy: it never trusts the writer.

use iceoryx2::prelude::ZeroCopySend;

/// Version of the wire. Raised with every change of a message.
pub const WIRE_VERSION: u32 = 4;

/// First four bytes of every message: `HSUT` in little-endian order.
pub const WIRE_MAGIC: u32 = u32::from_le_bytes(*b"HSUT");

/// The first field of every message.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[type_name("suture.v4.Header")]
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
pub trait Message: Field + Sized {
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

/// What every field type of a message can do: start empty, and say whether it may be used.
pub trait Field: Copy {
    /// Zero.
    const EMPTY: Self;
    /// Whether every number in it is finite.
    fn is_usable(&self) -> bool;
    /// Builds a value from arbitrary bits, for tests that play a hostile writer.
    #[cfg(test)]
    fn from_bits(bits: &mut dyn FnMut() -> u64) -> Self;
}

macro_rules! integer_field {
    ($($ty:ty),*) => {$(
        impl Field for $ty {
            const EMPTY: Self = 0;
            fn is_usable(&self) -> bool {
                true
            }
            #[cfg(test)]
            fn from_bits(bits: &mut dyn FnMut() -> u64) -> Self {
                bits() as $ty
            }
        }
    )*};
}
integer_field!(u32, u64);

macro_rules! float_field {
    ($($ty:ty as $bits:ty),*) => {$(
        impl Field for $ty {
            const EMPTY: Self = 0.0;
            fn is_usable(&self) -> bool {
                self.is_finite()
            }
            #[cfg(test)]
            fn from_bits(bits: &mut dyn FnMut() -> u64) -> Self {
                <$ty>::from_bits(bits() as $bits)
            }
        }
    )*};
}
float_field!(f32 as u32, f64 as u64);

impl<T: Field, const N: usize> Field for [T; N] {
    const EMPTY: Self = [T::EMPTY; N];
    fn is_usable(&self) -> bool {
        self.iter().all(Field::is_usable)
    }
    #[cfg(test)]
    fn from_bits(bits: &mut dyn FnMut() -> u64) -> Self {
        std::array::from_fn(|_| T::from_bits(bits))
    }
}

impl Field for Header {
    const EMPTY: Self = Self { magic: 0, version: 0, layout_hash: 0, length: 0, sequence: 0, time_ns: 0 };
    fn is_usable(&self) -> bool {
        true
    }
    #[cfg(test)]
    fn from_bits(bits: &mut dyn FnMut() -> u64) -> Self {
        Self {
            magic: bits() as u32,
            version: bits() as u32,
            layout_hash: bits(),
            length: bits(),
            sequence: bits(),
            time_ns: bits(),
        }
    }
}

/// Defines a `#[repr(C)]` part of a message: its name on the wire, its layout text, its empty value, its
/// number check.
macro_rules! pod {
    ($(#[$meta:meta])* pub struct $name:ident as $wire:literal { $($(#[$fmeta:meta])* pub $field:ident : $ty:ty,)* }) => {
        $(#[$meta])*
        #[repr(C)]
        #[derive(Clone, Copy, Debug, PartialEq, ZeroCopySend)]
        #[type_name($wire)]
        pub struct $name { $($(#[$fmeta])* pub $field: $ty,)* }

        impl Default for $name {
            fn default() -> Self {
                <Self as $crate::wire::Field>::EMPTY
            }
        }

        impl $name {
            /// Name of this type in shared memory: stable across Rust paths, raised with the wire version.
            pub const TYPE_NAME: &'static str = $wire;

            /// Field names and types in order; input of the layout hash.
            pub const LAYOUT: &'static str =
                concat!(stringify!($name), "{", $(stringify!($field), ":", stringify!($ty), ";",)* "}");

            /// Name of the first field that holds a number which is not finite.
            #[must_use]
            pub fn first_unusable(&self) -> Option<&'static str> {
                $(if !$crate::wire::Field::is_usable(&self.$field) { return Some(stringify!($field)); })*
                None
            }
        }

        impl $crate::wire::Field for $name {
            const EMPTY: Self = Self { $($field: <$ty as $crate::wire::Field>::EMPTY,)* };
            fn is_usable(&self) -> bool {
                self.first_unusable().is_none()
            }
            #[cfg(test)]
            fn from_bits(bits: &mut dyn FnMut() -> u64) -> Self {
                Self { $($field: <$ty as $crate::wire::Field>::from_bits(bits),)* }
            }
        }

        // Padding would carry whatever was in memory across the process boundary.
        const _: () = assert!(size_of::<$name>() == 0 $(+ size_of::<$ty>())*, "padding inside a message");
    };
}
pub(crate) use pod;

/// Makes a `pod!` struct with a `header` field a [`Message`]: name, parts whose layout counts, and the
/// range checks beyond finiteness (`|message| -> Option<&'static str>`).
macro_rules! message {
    ($ty:ident, $name:literal, parts: [$($part:ident),*], check: $check:expr) => {
        impl $crate::wire::Message for $ty {
            const NAME: &'static str = $name;
            const LAYOUT_HASH: u64 = {
                let hash = $crate::wire::fnv1a(Self::LAYOUT);
                $(let hash = hash.rotate_left(1) ^ $crate::wire::fnv1a($part::LAYOUT);)*
                hash
            };
            fn header(&self) -> &$crate::wire::Header {
                &self.header
            }
            fn header_mut(&mut self) -> &mut $crate::wire::Header {
                &mut self.header
            }
            fn first_bad_field(&self) -> Option<&'static str> {
                let check: fn(&$ty) -> Option<&'static str> = $check;
                self.first_unusable().or_else(|| check(self))
            }
        }
    };
}
pub(crate) use message;

#[cfg(test)]
mod tests;
