//! rapier as an engine plugin.
//!
//! It is the code that the default features link in, behind the C ABI.

asid_abi::export_backend!(
    "rapier 0.36, single precision, pure Rust",
    Ok(asid_rapier::Rapier)
);
