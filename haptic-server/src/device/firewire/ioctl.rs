//! The edge to the kernel's FireWire character device: requests as structures, with their sizes and offsets asserted.
//!
//! | request | number | structure |
//! |---|---|---|
//! | information, generation of the bus | 0x00 | [`Info`], 40 bytes, filling a [`BusReset`] |
//! | send a transaction | 0x01 | [`Request`], 40 bytes |
//! | isochronous context: make, queue, start, stop | 0x08, 0x09, 0x0a, 0x0b | 32, 24, 16, 4 bytes |
//! | reserve channel and bandwidth | 0x0d | [`Resource`], 24 bytes |
//!
//! Written down from the interface's description (type `#`, 64-bit Linux); no header is used. The only unsafe code of the
//! driver: the numbers and sizes below are what the kernel expects, pointers live as long as the call, and the mapped buffer
//! is read and written through volatile accesses within its bounds.
//! Deliberately absent: what is sent and when (`node.rs`).
#![expect(unsafe_code, reason = "a character device is driven by ioctl and a shared buffer")]

use rustix::fd::{AsFd, BorrowedFd, OwnedFd};
use rustix::io::Errno;
use rustix::ioctl::{Opcode, Setter, Updater, ioctl, opcode};
use rustix::mm::{MapFlags, ProtFlags, mmap, munmap};
use std::ffi::c_void;
use std::mem::offset_of;
use std::ptr::null_mut;

const GROUP: u8 = b'#';

/// Question for information; the version is the one of the interface that we speak.
#[repr(C)]
#[derive(Clone, Copy, Default)]
struct Info {
    version: u32,
    rom_length: u32,
    rom: u64,
    bus_reset: u64,
    closure: u64,
    card: u32,
    padding: u32,
}

/// State of the bus after its last reset.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct BusReset {
    closure: u64,
    kind: u32,
    pub(super) node_id: u32,
    pub(super) local_node_id: u32,
    manager: u32,
    resources: u32,
    root: u32,
    /// Transactions carry it.
    pub(super) generation: u32,
    padding: u32,
}

#[repr(C)]
#[derive(Clone, Copy, Default)]
struct Request {
    code: u32,
    length: u32,
    address: u64,
    closure: u64,
    data: u64,
    generation: u32,
    padding: u32,
}

#[repr(C)]
#[derive(Clone, Copy, Default)]
struct Context {
    kind: u32,
    header_size: u32,
    channel: u32,
    speed: u32,
    closure: u64,
    handle: u32,
    padding: u32,
}

#[repr(C)]
#[derive(Clone, Copy, Default)]
struct Queue {
    packets: u64,
    data: u64,
    size: u32,
    handle: u32,
}

#[repr(C)]
#[derive(Clone, Copy, Default)]
struct Start {
    cycle: i32,
    sync: u32,
    tags: u32,
    handle: u32,
}

#[repr(C)]
#[derive(Clone, Copy, Default)]
struct Resource {
    closure: u64,
    channels: u64,
    bandwidth: u32,
    handle: u32,
}

const _: () = assert!(size_of::<Info>() == 40 && offset_of!(Info, bus_reset) == 16 && offset_of!(Info, card) == 32);
const _: () = assert!(size_of::<BusReset>() == 40 && offset_of!(BusReset, generation) == 32);
const _: () = assert!(size_of::<Request>() == 40 && offset_of!(Request, address) == 8);
const _: () = assert!(offset_of!(Request, data) == 24 && offset_of!(Request, generation) == 32);
const _: () =
    assert!(size_of::<Context>() == 32 && offset_of!(Context, closure) == 16 && offset_of!(Context, handle) == 24);
const _: () = assert!(size_of::<Queue>() == 24 && offset_of!(Queue, size) == 16);
const _: () = assert!(size_of::<Start>() == 16 && offset_of!(Start, handle) == 12);
const _: () = assert!(size_of::<Resource>() == 24 && offset_of!(Resource, bandwidth) == 16);

const INFO: Opcode = opcode::read_write::<Info>(GROUP, 0x00);
const REQUEST: Opcode = opcode::write::<Request>(GROUP, 0x01);
const CONTEXT: Opcode = opcode::read_write::<Context>(GROUP, 0x08);
const QUEUE: Opcode = opcode::read_write::<Queue>(GROUP, 0x09);
const START: Opcode = opcode::write::<Start>(GROUP, 0x0a);
const STOP: Opcode = opcode::write::<u32>(GROUP, 0x0b);
const RESOURCE: Opcode = opcode::read_write::<Resource>(GROUP, 0x0d);

/// Version of the interface: the first that tells how many quadlets a packet had.
const VERSION: u32 = 5;
/// S100.
const SPEED: u32 = 0;
/// Every tag is received.
const ALL_TAGS: u32 = 15;

/// An open `/dev/fw*`.
#[derive(Debug)]
pub(super) struct Cdev {
    fd: OwnedFd,
}

impl AsFd for Cdev {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.fd.as_fd()
    }
}

/// Kind of an isochronous context.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ContextKind {
    Transmit = 0,
    Receive = 1,
}

impl Cdev {
    pub(super) fn new(fd: OwnedFd) -> Self {
        Self { fd }
    }

    fn update<const OPCODE: Opcode, T>(&self, value: &mut T) -> Result<(), Errno> {
        // SAFETY: every opcode above was made of the type that it is called with here, whose layout is asserted.
        unsafe { ioctl(&self.fd, Updater::<OPCODE, T>::new(value)) }
    }

    fn set<const OPCODE: Opcode, T>(&self, value: T) -> Result<(), Errno> {
        // SAFETY: as above; the kernel reads the value and keeps nothing of it.
        unsafe { ioctl(&self.fd, Setter::<OPCODE, T>::new(value)) }
    }

    /// State of the bus.
    pub(super) fn bus(&self) -> Result<BusReset, Errno> {
        let mut bus = BusReset::default();
        let mut info =
            Info { version: VERSION, bus_reset: (&raw mut bus).expose_provenance() as u64, ..Info::default() };
        self.update::<INFO, _>(&mut info)?;
        // The kernel has written through the address: read what is there now.
        // SAFETY: `bus` is a live local, aligned, of integers only.
        Ok(unsafe { (&raw const bus).read_volatile() })
    }

    /// Sends a transaction; the answer comes as an event with the same closure.
    pub(super) fn request(
        &self,
        code: u32,
        address: u64,
        data: &[u8],
        length: u32,
        generation: u32,
    ) -> Result<(), Errno> {
        let data = if data.is_empty() { 0 } else { data.as_ptr().expose_provenance() as u64 };
        self.set::<REQUEST, _>(Request { code, length, address, closure: address, data, generation, padding: 0 })
    }

    /// Makes a context.
    pub(super) fn context(&self, kind: ContextKind, channel: u8, header_size: u32) -> Result<u32, Errno> {
        let channel = u32::from(channel);
        let mut context = Context { kind: kind as u32, header_size, channel, speed: SPEED, ..Context::default() };
        self.update::<CONTEXT, _>(&mut context)?;
        Ok(context.handle)
    }

    /// Queues packets whose payload begins at `at` in the mapped buffer.
    pub(super) fn queue(&self, handle: u32, controls: &[u32], buffer: &Mapping, at: usize) -> Result<(), Errno> {
        let data = buffer.address(at).ok_or(Errno::INVAL)?;
        let packets = controls.as_ptr().expose_provenance() as u64;
        let size = u32::try_from(size_of_val(controls)).map_err(|_| Errno::INVAL)?;
        let mut queue = Queue { packets, data, size, handle };
        self.update::<QUEUE, _>(&mut queue)?;
        // What the kernel has not taken.
        if queue.size == 0 { Ok(()) } else { Err(Errno::NOSPC) }
    }

    pub(super) fn start(&self, handle: u32) -> Result<(), Errno> {
        self.set::<START, _>(Start { cycle: -1, sync: 0, tags: ALL_TAGS, handle })
    }

    pub(super) fn stop(&self, handle: u32) -> Result<(), Errno> {
        self.set::<STOP, _>(handle)
    }

    /// Asks for any channel and for bandwidth; the answer comes as an event.
    pub(super) fn reserve(&self, bandwidth: u32) -> Result<(), Errno> {
        let mut resource = Resource { channels: u64::MAX, bandwidth, ..Resource::default() };
        self.update::<RESOURCE, _>(&mut resource)
    }

    /// Maps the buffer of this file's context.
    pub(super) fn map(&self, len: usize) -> Result<Mapping, Errno> {
        let flags = ProtFlags::READ | ProtFlags::WRITE;
        // SAFETY: a new mapping at an address of the kernel's choice touches no memory of ours.
        let start = unsafe { mmap(null_mut(), len, flags, MapFlags::SHARED, &self.fd, 0) }?;
        Ok(Mapping { start: start.cast(), len })
    }
}

/// The buffer that kernel and program share.
#[derive(Debug)]
pub(super) struct Mapping {
    start: *mut u8,
    len: usize,
}

// SAFETY: the mapping is owned, and used through `&self` and `&mut self` by one thread at a time.
unsafe impl Send for Mapping {}

impl Mapping {
    fn address(&self, at: usize) -> Option<u64> {
        (at < self.len).then(|| (self.start.expose_provenance() + at) as u64)
    }

    /// Copies out of it; beyond its end there are zeros.
    pub(super) fn read(&self, at: usize, into: &mut [u8]) {
        for (i, byte) in into.iter_mut().enumerate() {
            // SAFETY: the index lies within the mapping; the device may write meanwhile, hence volatile.
            *byte = if at + i < self.len { unsafe { self.start.add(at + i).read_volatile() } } else { 0 };
        }
    }

    /// Copies into it, up to its end.
    pub(super) fn write(&mut self, at: usize, from: &[u8]) {
        for (i, byte) in from.iter().enumerate().take(self.len.saturating_sub(at)) {
            // SAFETY: the index lies within the mapping.
            unsafe { self.start.add(at + i).write_volatile(*byte) };
        }
    }
}

impl Drop for Mapping {
    fn drop(&mut self) {
        // SAFETY: the mapping is ours alone and is not used after this. It cannot fail for a range that was mapped.
        let _ = unsafe { munmap(self.start.cast::<c_void>(), self.len) };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_numbers_of_the_requests_are_those_of_the_interface() {
        // Direction (write 1, read 2) << 30 | size << 16 | type << 8 | number.
        assert_eq!(INFO, 0xc028_2300);
        assert_eq!(REQUEST, 0x4028_2301);
        assert_eq!(CONTEXT, 0xc020_2308);
        assert_eq!(QUEUE, 0xc018_2309);
        assert_eq!(START, 0x4010_230a);
        assert_eq!(STOP, 0x4004_230b);
        assert_eq!(RESOURCE, 0xc018_230d);
    }

    #[test]
    fn a_file_that_is_no_bus_refuses_every_request() {
        let file = std::fs::File::open("/dev/null").expect("every Linux has it");
        let cdev = Cdev::new(OwnedFd::from(file));
        assert_eq!(cdev.bus().err(), Some(Errno::NOTTY));
        assert_eq!(cdev.reserve(1).err(), Some(Errno::NOTTY));
        assert!(cdev.context(ContextKind::Receive, 1, 4).is_err() && cdev.stop(0).is_err());
    }

    #[test]
    fn the_buffer_ends_where_it_ends() {
        let folder = tempfile::tempfile().expect("a file");
        folder.set_len(4096).expect("room");
        let cdev = Cdev::new(OwnedFd::from(folder));
        let mut buffer = cdev.map(4096).expect("a file can be mapped");
        buffer.write(4094, &[1, 2, 3, 4]);
        let mut back = [9; 4];
        buffer.read(4094, &mut back);
        assert_eq!(back, [1, 2, 0, 0]);
        assert!(buffer.address(4095).is_some() && buffer.address(4096).is_none());
    }
}
