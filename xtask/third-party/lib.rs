//! Nothing: what counts is which features the manifest asks for. cargo builds a crate once for each set of features, and
//! a part of the workspace asks for fewer of them than the whole. A call that names this package beside the part gets
//! the third-party crates of the whole; features of the workspace's own crates stay those of the part.
