//! The real hidraw path, opt-in: a HID arm made by the kernel's `/dev/uhid`, found, opened, read, written, unplugged, and
//! plugged in again at another node.
//!
//! Needs the module uhid and the right to open `/dev/uhid`; `guest` runs it in a virtual machine of its own:
//! `cargo test -p suture-tests --test device -- --ignored uhid`. The messages are the kernel's `struct uhid_event`, packed: kind
//! (u32), then name (128 bytes), place (64), serial (64), length of the descriptor (u16), bus (u16), vendor, product, version,
//! country (u32), descriptor; or length (u16) and report; or report (4096 bytes), length (u16), type.

use haptic_server::device::hid::known::HidRole;
use haptic_server::device::hid::port::{HidOpener, choose, list};
use haptic_server::device::hid::report::{ArmOrder, ArmReport};
use haptic_server::device::wire::{LONGEST, Opener, WireError, WirePort};
use std::fs::{File, OpenOptions};
use std::io::{Read, Write};
use std::time::Duration;
use suture_tests::processes::wait_for;

const LIMIT: Duration = Duration::from_secs(60);
const REPORTS: i16 = 2_000;
const DESTROY: u32 = 1;
const OUTPUT: u32 = 6;
const CREATE: u32 = 11;
const INPUT: u32 = 12;
const BUS_USB: u16 = 3;
const LONGEST_EVENT: usize = 4_380;
/// 64 bytes in, 64 bytes out, of a maker's own usage.
const DESCRIPTOR: [u8; 28] = [
    0x06, 0xab, 0xff, 0x0a, 0x00, 0x02, 0xa1, 0x01, 0x75, 0x08, 0x15, 0x00, 0x26, 0xff, 0x00, 0x95, 0x40, 0x09, 0x01,
    0x81, 0x02, 0x95, 0x40, 0x09, 0x02, 0x91, 0x02, 0xc0,
];

fn create() -> Vec<u8> {
    let padded = |text: &str, len: usize| {
        let mut bytes = text.as_bytes().to_vec();
        bytes.resize(len, 0);
        bytes
    };
    let mut event = CREATE.to_ne_bytes().to_vec();
    event.extend(padded("Arm of a test", 128));
    event.extend(padded("", 64));
    event.extend(padded("1", 64));
    event.extend((DESCRIPTOR.len() as u16).to_ne_bytes());
    event.extend(BUS_USB.to_ne_bytes());
    for number in [0x16c0_u32, 0x0486, 1, 0] {
        event.extend(number.to_ne_bytes());
    }
    event.extend(DESCRIPTOR);
    event
}

fn input(report: &[u8; 64]) -> Vec<u8> {
    let mut event = INPUT.to_ne_bytes().to_vec();
    event.extend(64_u16.to_ne_bytes());
    event.extend(report);
    event
}

/// Reads events until a report of the host comes.
fn output(uhid: &mut File) -> Vec<u8> {
    loop {
        let mut event = [0; LONGEST_EVENT];
        let read = uhid.read(&mut event).expect("an event");
        if read > 4 && event[..4] == OUTPUT.to_ne_bytes() {
            let length = usize::from(u16::from_ne_bytes([event[4_100], event[4_101]]));
            return event[4..4 + length].to_vec();
        }
    }
}

/// Sends a report and reads it at the other end.
fn assert_arrives(encoder: i16, uhid: &mut File, port: &mut impl WirePort) {
    let mut report = [0; 64];
    report[..2].copy_from_slice(&encoder.to_le_bytes());
    uhid.write_all(&input(&report)).expect("a report");
    let mut buffer = [0; LONGEST];
    let len = port.receive(&mut buffer, Duration::from_secs(10)).expect("the wire works");
    assert_eq!(ArmReport::parse(&buffer[..len]).map(|r| r.encoders[0]), Some(encoder), "{len} bytes");
}

#[test]
#[ignore = "needs /dev/uhid: the kernel's module and the right to open it"]
fn an_arm_of_the_kernel_is_found_read_written_unplugged_and_found_again() {
    let Ok(mut uhid) = OpenOptions::new().read(true).write(true).open("/dev/uhid") else {
        println!("skipped: /dev/uhid is missing or may not be opened (modprobe uhid, run as root)");
        return;
    };
    uhid.write_all(&create()).expect("the kernel takes the device");
    // udev makes the node and its rights in its own time.
    let (mut opener, mut port) = wait_for(LIMIT, || {
        let opener = HidOpener::new(choose(&list().ok()?, HidRole::Arm, None).ok()?).ok()?;
        let port = opener.open_first().ok()?;
        Some((opener, port))
    })
    .expect("the arm is found and opened");
    for i in 0..REPORTS {
        assert_arrives(i, &mut uhid, &mut port);
    }
    let order = ArmOrder::Drive([100, -200, 300]).encode();
    port.send(order.bytes()).expect("the wire works");
    assert_eq!(output(&mut uhid)[..8], order.bytes()[..8]);
    uhid.write_all(&DESTROY.to_ne_bytes()).expect("the kernel takes it away");
    let gone = wait_for(LIMIT, || port.receive(&mut [0; LONGEST], Duration::ZERO).err());
    assert!(matches!(gone, Some(WireError::Gone | WireError::Os(_))), "{gone:?}");
    assert!(opener.open().is_err(), "it is not there");
    // The broken port is still open, so the kernel must take another node.
    uhid.write_all(&create()).expect("the kernel takes the device again");
    let mut again = wait_for(LIMIT, || opener.open().ok()).expect("it is found and opened again");
    assert_arrives(-7, &mut uhid, &mut again);
    println!("{REPORTS} reports in order, one written, unplugged: {gone:?}, open again: {opener:?}");
}
