//! The tissue process.

fn main() {}
