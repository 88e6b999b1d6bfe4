//! Messages of ROS 2: their [`definition`]s, their encoding ([`cdr`]), and series of a topic's
//! numbers ([`stream`]).

pub mod cdr;
pub mod definition;
mod orientation;
pub mod stream;
pub mod topics;
