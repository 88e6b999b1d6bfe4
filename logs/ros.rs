//! Messages of ROS 2: what they are made of ([`definition`]), how they lie in bytes ([`cdr`]), and the series of numbers that a
//! topic's messages make ([`stream`]).

pub mod cdr;
pub mod definition;
pub mod stream;
pub mod topics;
