//! The slow process: tissue, attachments, suture line, wound control; mesh import.

pub mod mesh_obj;
pub mod session;
