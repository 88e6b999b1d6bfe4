//! An empty crate whose manifest selects features of third-party crates.
//!
//! cargo builds a crate once for each set of features, and a part of the workspace asks for fewer
//! features than the whole. A call that names this package beside the part uses the third-party
//! crates of the whole. Features of the workspace's own crates stay those of the part.
