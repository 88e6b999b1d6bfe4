//! The force that a model lacks, as a hidden state, and the effects that explain it.
//!
//! A replay asks whether a model, run open loop from an episode's first row, matches the log. Here
//! the question is local: which force is missing *now*? That force is a hidden state next to
//! position and speed, estimated by a smoother. Effects are columns of one linear regression on its
//! innovations. The few leading ones are inserted into the model and fitted.
//!
//! From the bottom up:
//!
//! - Rows and states: [`tangent`] (states), [`walk`] (rows), [`segments`] (where bodies touch) and
//!   [`scatter`] (how far their replays can be repeated).
//! - Estimator: [`step_map`] (the model over a row and its derivatives), [`smoother`], [`initial`],
//!   `one_step` (how derivatives are computed), [`step_error`] (the engine's own error),
//!   [`context`] and [`estimate`] (trajectory, force and noise), [`fitted_value`] and [`fit`] (a
//!   model with its values).
//! - Search: [`evidence`], [`trace`], [`columns`], [`screen`], [`search`], [`selection`],
//!   [`detection`] (detection limits), [`rehearsal`] (what a screening would report for machines
//!   like this one).
//! - The rest: `steps` (encoder steps), `picture` (what the report draws of the force), `left`
//!   (what could be learned of the rest), [`pipeline`].

pub mod budget;
pub mod columns;
pub mod context;
pub mod detection;
pub mod estimate;
pub mod evidence;
pub mod fit;
pub mod fitted_value;
pub mod half_step;
pub mod initial;
mod islands;
mod left;
pub mod one_step;
mod picture;
pub mod pipeline;
pub mod rehearsal;
pub mod scales;
pub mod scatter;
pub mod screen;
pub mod search;
pub mod segments;
pub mod selection;
pub mod smoother;
pub mod step_error;
pub mod step_map;
mod steps;
pub mod tangent;
mod touching;
pub mod trace;
pub mod walk;
