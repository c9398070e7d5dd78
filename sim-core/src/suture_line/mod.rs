//! The suture line (Zhang et al., §2.1): Follow the Leader for its free part, one scalar tension where it is
//! taut, capstan friction at every suture point it runs through.

pub mod follow_the_leader;
pub mod line;
pub mod tension;
