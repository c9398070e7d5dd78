//! Support of the tests: closed forms, a reference integrator that shares no code with sim-core, generators of
//! small networks, recorded data beside the repository, and processes in a sandbox. The latency harness's parts
//! stand here too, so that its binary only starts them.

pub mod accuracy;
pub mod closed_forms;
pub mod generators;
pub mod harness;
pub mod instructions;
pub mod kernels;
pub mod processes;
pub mod reference;
pub mod shared;
