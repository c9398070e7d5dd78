//! Layouts are told apart, sizes are fixed, and no message that must not be used passes.

use super::*;
use crate::pointer_hand::PointerHand;
use crate::scene_frame::{FrameHeader, FrameNode, MAX_NODES, MAX_OUTLINE_WORDS, OutlineHeader};
use crate::servo_state::{DeviceState, HandleState, MAX_HANDLES, ServoState};
use crate::session_command::{CommandAnswer, SessionCommand};
use crate::tissue_port::{HandlePort, TissuePort};
use crate::wound_report::{LedgerRow, MAX_LEDGER_ROWS, MAX_LINE_POINTS, WoundReport};
use proptest::prelude::*;
use std::fmt::Debug;

#[test]
fn sizes_are_those_of_the_wire_version() {
    let sizes = [
        size_of::<Header>(),
        size_of::<DeviceState>(),
        size_of::<HandleState>(),
        size_of::<ServoState>(),
        size_of::<HandlePort>(),
        size_of::<TissuePort>(),
        size_of::<LedgerRow>(),
        size_of::<WoundReport>(),
        size_of::<FrameNode>(),
        size_of::<FrameHeader>(),
        size_of::<OutlineHeader>(),
        size_of::<SessionCommand>(),
        size_of::<PointerHand>(),
        size_of::<CommandAnswer>(),
    ];
    // Whoever changes one of these raises WIRE_VERSION and the type names with it.
    assert_eq!(sizes, [40, 152, 88, 776, 200, 1008, 176, 14384, 28, 56, 64, 48, 72, 152]);
}

#[test]
fn type_names_carry_the_wire_version() {
    let names = [
        DeviceState::TYPE_NAME,
        HandleState::TYPE_NAME,
        ServoState::TYPE_NAME,
        HandlePort::TYPE_NAME,
        TissuePort::TYPE_NAME,
        LedgerRow::TYPE_NAME,
        WoundReport::TYPE_NAME,
        FrameNode::TYPE_NAME,
        FrameHeader::TYPE_NAME,
        OutlineHeader::TYPE_NAME,
        SessionCommand::TYPE_NAME,
        PointerHand::TYPE_NAME,
        CommandAnswer::TYPE_NAME,
    ];
    for (i, name) in names.iter().enumerate() {
        assert!(name.starts_with(&format!("suture.v{WIRE_VERSION}.")), "{name}");
        assert!(!names[..i].contains(name), "{name} is used twice");
    }
}

/// The same fields and sizes as a base message, each with one difference of meaning.
#[expect(dead_code, unreachable_pub, reason = "the macro makes whole public types; only the hash is of interest")]
mod layouts {
    use crate::wire::Header;
    use iceoryx2::prelude::ZeroCopySend;

    macro_rules! variant {
        ($module:ident, $part_field:ident : $part_ty:ty, $first:ident : $first_ty:ty, $second:ident : $second_ty:ty) => {
            pub mod $module {
                use super::*;
                pod! {
                    /// Part.
                    pub struct Part as "suture.test.Part" {
                        /// A field.
                        pub $part_field: $part_ty,
                    }
                }
                pod! {
                    /// Message.
                    pub struct Whole as "suture.test.Whole" {
                        /// Header.
                        pub header: Header,
                        /// A field.
                        pub $first: $first_ty,
                        /// A field.
                        pub $second: $second_ty,
                        /// A part.
                        pub part: Part,
                    }
                }
                message!(Whole, "whole", parts: [Part], check: |_| None);
            }
        };
    }
    variant!(base, y: f64, a: f64, b: f64);
    variant!(same, y: f64, a: f64, b: f64);
    variant!(renamed, y: f64, c: f64, b: f64);
    variant!(swapped, y: f64, b: f64, a: f64);
    variant!(retyped, y: f64, a: u64, b: f64);
    variant!(part_renamed, z: f64, a: f64, b: f64);
}

#[test]
fn layout_hash_sees_names_order_types_and_parts() {
    let base = layouts::base::Whole::LAYOUT_HASH;
    assert_eq!(base, layouts::same::Whole::LAYOUT_HASH);
    for (what, other, size) in [
        ("renamed", layouts::renamed::Whole::LAYOUT_HASH, size_of::<layouts::renamed::Whole>()),
        ("swapped", layouts::swapped::Whole::LAYOUT_HASH, size_of::<layouts::swapped::Whole>()),
        ("retyped", layouts::retyped::Whole::LAYOUT_HASH, size_of::<layouts::retyped::Whole>()),
        ("part renamed", layouts::part_renamed::Whole::LAYOUT_HASH, size_of::<layouts::part_renamed::Whole>()),
    ] {
        assert_eq!(size, size_of::<layouts::base::Whole>());
        assert_ne!(base, other, "{what}");
    }
}

#[test]
fn fnv1a_gives_the_published_values() {
    // Test vectors of the FNV authors (64 bit, 1a).
    assert_eq!(fnv1a(""), 0xcbf2_9ce4_8422_2325);
    assert_eq!(fnv1a("a"), 0xaf63_dc4c_8601_ec8c);
    assert_eq!(fnv1a("foobar"), 0x8594_4171_f739_67e8);
}

#[test]
fn each_header_field_is_checked() {
    let mut good = SessionCommand { command: 1, ..SessionCommand::EMPTY };
    good.stamp(1, 2);
    assert_eq!(good.validate(), Ok(()));
    let spoilt = |change: fn(&mut Header)| {
        let mut bad = good;
        change(&mut bad.header);
        bad.validate().unwrap_err()
    };
    assert!(matches!(spoilt(|h| h.magic ^= 1), WireError::Magic { .. }));
    assert!(matches!(spoilt(|h| h.version += 1), WireError::Version { found } if found == WIRE_VERSION + 1));
    assert!(matches!(spoilt(|h| h.layout_hash ^= 1), WireError::Layout { .. }));
    assert!(matches!(spoilt(|h| h.length += 1), WireError::Length { .. }));
}

/// Bits that break naive readers, small numbers that pass, and anything.
fn hostile_bits() -> impl Strategy<Value = u64> {
    prop_oneof![
        6 => 0_u64..8,
        1 => prop_oneof![
            Just(f64::NAN.to_bits()), Just(f64::INFINITY.to_bits()), Just(f64::NEG_INFINITY.to_bits()),
            Just((-0.0_f64).to_bits()), Just(1e308_f64.to_bits()), Just(f64::MIN_POSITIVE.to_bits()),
            Just(u64::from(f32::NAN.to_bits())), Just(u64::MAX), Just(u64::from(u32::MAX)),
        ],
        1 => any::<u64>(),
    ]
}

/// A message of hostile content; `stamped` ones have a good header.
fn hostile<M: Message>(bits: &[u64], stamped: bool) -> M {
    let mut source = bits.iter().copied().cycle();
    let mut message = M::from_bits(&mut || source.next().unwrap_or(0));
    if stamped {
        message.stamp(bits[0], bits[0]);
    }
    message
}

/// What passes has only finite numbers, judged by its printed form.
fn passes_only_finite<M: Message + Debug>(bits: &[u64], stamped: bool) -> Result<Option<M>, TestCaseError> {
    let message: M = hostile(bits, stamped);
    if message.validate().is_err() {
        return Ok(None);
    }
    let text = format!("{message:?}");
    prop_assert!(!text.contains("NaN") && !text.contains("inf"), "{}", text);
    Ok(Some(message))
}

proptest! {
    #[test]
    fn nothing_unusable_passes(
        bits in proptest::collection::vec(hostile_bits(), 1..40),
        stamped in prop_oneof![3 => Just(true), 1 => Just(false)],
    ) {
        if let Some(m) = passes_only_finite::<ServoState>(&bits, stamped)? {
            prop_assert!(m.handle_count as usize <= MAX_HANDLES && m.mode <= 5 && m.port_rung <= 4);
        }
        if let Some(m) = passes_only_finite::<TissuePort>(&bits, stamped)? {
            prop_assert!(m.handle_count as usize <= MAX_HANDLES);
            prop_assert!(m.handles.iter().all(|h| h.mode == 0 || h.mass_kg > 0.0));
        }
        if let Some(m) = passes_only_finite::<WoundReport>(&bits, stamped)? {
            prop_assert!(m.row_count as usize <= MAX_LEDGER_ROWS && m.line_point_count as usize <= MAX_LINE_POINTS);
        }
        if let Some(m) = passes_only_finite::<FrameHeader>(&bits, stamped)? {
            prop_assert!(m.node_count as usize <= MAX_NODES);
        }
        if let Some(m) = passes_only_finite::<OutlineHeader>(&bits, stamped)? {
            prop_assert!(m.words() <= MAX_OUTLINE_WORDS as u64);
        }
        if let Some(m) = passes_only_finite::<SessionCommand>(&bits, stamped)? {
            prop_assert!((1..=9).contains(&m.command));
        }
        if let Some(m) = passes_only_finite::<PointerHand>(&bits, stamped)? {
            prop_assert!(m.buttons <= 7 && m.sender != 0);
        }
    }
}

#[test]
fn hostile_messages_do_pass_when_their_bits_are_harmless() {
    // Guards the property above against rejecting everything.
    assert_eq!(hostile::<ServoState>(&[1, 2, 3], true).validate(), Ok(()));
    assert_eq!(hostile::<TissuePort>(&[1, 2, 3], true).validate(), Ok(()));
    assert_eq!(hostile::<WoundReport>(&[1, 2], true).validate(), Ok(()));
    assert_eq!(hostile::<SessionCommand>(&[1, 2, 3], true).validate(), Ok(()));
    assert_eq!(hostile::<PointerHand>(&[1, 2, 3], true).validate(), Ok(()));
    assert!(hostile::<SessionCommand>(&[1, 2, 3], false).validate().is_err());
}
