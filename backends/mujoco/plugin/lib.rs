//! MuJoCo as an engine plugin.
//!
//! It is the code that `--features mujoco` links in, behind the C ABI. With `asid --plugin
//! libasid_engine_mujoco.so` a binary without MuJoCo gains it at run time.

asid_abi::export_backend!(
    "MuJoCo 3.17, double precision, the reference engine",
    asid_mujoco::MujocoBackend::new()
);
