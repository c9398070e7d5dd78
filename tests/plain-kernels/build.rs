//! Compiles the plain C kernels (`src/plain.c`) for this very processor, which may therefore not run elsewhere.
//!
//! `-fno-math-errno` lets the compiler vectorise square roots: a stronger opponent than plain `-O3`.

fn main() {
    println!("cargo:rerun-if-changed=src/plain.c");
    cc::Build::new()
        .file("src/plain.c")
        .opt_level(3)
        .flag("-march=native")
        .flag("-fno-math-errno")
        .std("c11")
        .compile("plain_kernels");
}
