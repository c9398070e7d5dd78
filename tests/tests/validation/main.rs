//! What the validation part of the accuracy report says, on coarse meshes: cases V1 to V6 against published figures and
//! closed forms.

mod cases;
