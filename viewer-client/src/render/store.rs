//! Buffers that grow when they must and are written in place otherwise.

use crate::gpu::Gpu;
use wgpu::{Buffer, BufferUsages};

/// A binding of nothing is not allowed.
const LEAST_BYTES: u64 = 64;

/// A buffer with room to spare.
pub(super) struct Store {
    buffer: Buffer,
    label: &'static str,
    usage: BufferUsages,
}

impl Store {
    pub(super) fn new(gpu: &Gpu, label: &'static str, usage: BufferUsages) -> Self {
        let usage = usage | BufferUsages::COPY_DST;
        Self { buffer: make(gpu, label, usage, LEAST_BYTES), label, usage }
    }

    /// Makes room for as many bytes; what was inside may be lost. Says whether the buffer is another one now.
    pub(super) fn reserve(&mut self, gpu: &Gpu, bytes: u64) -> Room {
        if bytes <= self.buffer.size() {
            return Room::Same;
        }
        // A quarter more, so that a growing line does not ask again with every point.
        let wanted = (bytes + bytes / 4).min(self.most(gpu)).max(bytes);
        self.buffer = make(gpu, self.label, self.usage, wanted.next_multiple_of(wgpu::COPY_BUFFER_ALIGNMENT));
        Room::Other
    }

    /// Largest buffer that can be bound as this one is.
    fn most(&self, gpu: &Gpu) -> u64 {
        let limits = gpu.device.limits();
        if self.usage.contains(BufferUsages::STORAGE) {
            limits.max_storage_buffer_binding_size.min(limits.max_buffer_size)
        } else {
            limits.max_buffer_size
        }
    }

    /// Makes room and writes.
    pub(super) fn fill(&mut self, gpu: &Gpu, bytes: &[u8]) -> Room {
        let room = self.reserve(gpu, bytes.len() as u64);
        if !bytes.is_empty() {
            gpu.queue.write_buffer(&self.buffer, 0, bytes);
        }
        room
    }

    pub(super) fn buffer(&self) -> &Buffer {
        &self.buffer
    }
}

/// Whether a buffer had to be replaced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Room {
    /// It is the old one.
    Same,
    /// It is another one: bindings must be made anew.
    Other,
}

fn make(gpu: &Gpu, label: &'static str, usage: BufferUsages, size: u64) -> Buffer {
    gpu.device.create_buffer(&wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false })
}
