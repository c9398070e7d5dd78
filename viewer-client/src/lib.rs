//! Looks at a running server through shared memory. Depends on `protocol` only: a viewer that is late, dead or
//! attached ten times costs the servo nothing. Deliberately absent: drawing.
