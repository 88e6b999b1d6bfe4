//! The catalogue of effects: what a real machine does and its model may lack.

pub mod effects;
