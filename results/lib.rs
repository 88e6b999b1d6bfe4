//! What a diagnosis writes, as types that go to JSON and back.
//!
//! - [`diagnosis`] is `result.json`: the answer.
//! - [`evidence`] is `evidence.json`: what the decision rests on.
//! - [`trace`] is `trace.json`: what the pictures of the report need besides.
//! - [`naming`] says how sets of effects read.
//! - [`view`] is the part of it that the 3-D view needs.
//!
//! The diagnosis fills them, the command line writes them, the report reads them. A number that is not finite
//! is `null` in JSON and comes back as NaN ([`nullable`]).

pub mod diagnosis;
pub mod evidence;
pub mod naming;
pub mod nullable;
pub mod trace;
pub mod view;
