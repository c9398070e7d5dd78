//! Contract tests of the paper: each equation, algorithm and table of Zhang et al., through sim-core's public face,
//! against numbers obtained another way. `docs/paper.md` lists them.

mod algorithm1;
mod algorithm2;
mod eq1;
mod eq2;
mod eq3;
mod fig8;
mod mechanics;
mod readings;
mod table1;
mod table2;
mod tissue_rig;
