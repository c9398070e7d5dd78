//! A node's vector as four numbers, x y z 0: one 256-bit register, never across two cache lines.

use crate::vector::Vec3;

/// x, y, z and a zero.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(align(32))]
pub(crate) struct Node(pub(crate) [f64; 4]);

impl Node {
    /// The three numbers.
    pub(crate) fn vector(&self) -> Vec3 {
        Vec3::new(self.0[0], self.0[1], self.0[2])
    }
}

impl From<&Vec3> for Node {
    fn from(v: &Vec3) -> Self {
        Self([v.x, v.y, v.z, 0.0])
    }
}

impl std::ops::AddAssign<Vec3> for Node {
    fn add_assign(&mut self, v: Vec3) {
        for (own, v) in self.0.iter_mut().zip(v.iter()) {
            *own += v;
        }
    }
}
