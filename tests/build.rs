//! Compiles the plain C kernels that the sweeps are measured against (`src/kernels/plain.c`) for this very processor.
//!
//! `-fno-math-errno` lets the compiler vectorise square roots: a stronger opponent than plain `-O3`.

fn main() {
    println!("cargo:rerun-if-changed=src/kernels/plain.c");
    cc::Build::new()
        .file("src/kernels/plain.c")
        .opt_level(3)
        .flag("-march=native")
        .flag("-fno-math-errno")
        .std("c11")
        .compile("plain_kernels");
}
