//! Nothing: what counts is which features the manifest asks for.
//!
//! cargo builds a crate once for each set of features. A part of the workspace asks for fewer of them than the whole, and
//! nearly all third-party crates would be built anew for it. A call that names this package beside the part gets
//! the crates of the whole; features of the workspace's own crates stay those of the part.
