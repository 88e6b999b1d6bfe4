//! Commands on any machine: a study or a model file in place of a task.

pub mod explore;
pub mod export;
pub mod identify;
pub mod motion_config;
mod motion_page;
mod named;
pub mod sensors;
pub mod setup;
mod standstill;
mod subject;

pub use named::{missing, path_of, refuse_log};
pub use subject::{Subject, is_study, no_study};
