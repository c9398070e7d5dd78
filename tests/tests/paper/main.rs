//! Contract tests of the paper: each equation, algorithm and table of Zhang et al., through sim-core's public face,
//! against numbers obtained another way. `docs/paper.md` lists them.

mod eq1;
mod eq2;
mod eq3;
mod table2;
