//! Eyes of the virtual hand: reads the tissue port of the server that runs and writes what is seen to standard output.

fn main() {
    virtual_omni::sight::tell(&mut std::io::stdout());
}
