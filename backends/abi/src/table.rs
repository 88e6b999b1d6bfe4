//! The structures of `asid_backend.h` in Rust.
//!
//! They match field for field, in the same order and with the same names except for Rust's style. A
//! test compiles the header and compares every size and offset. The header documents what the
//! fields mean and from which thread a function may be called; this is not repeated here.

use std::ffi::{c_char, c_void};

use asid_core::Capabilities;

/// Version of the ABI. Another major version is refused; a smaller minor version is read as far as
/// it goes.
pub const ABI_MAJOR: u32 = 1;
/// Minor version; grows when fields are added at the end of a structure.
pub const ABI_MINOR: u32 = 0;
/// Name of the exported function.
pub const ENTRY: &str = "asid_backend_entry";
/// Type of the exported function.
pub type EntryFn = unsafe extern "C" fn() -> *const Backend;
/// No index.
pub const NONE: u64 = u64::MAX;

/// `asid_code`: the kind of an error.
pub type Code = i32;
/// No error.
pub const OK: Code = 0;
/// The scene is refused.
pub const SCENE: Code = 1;
/// A target or its value makes no sense.
pub const PARAMETER: Code = 2;
/// A setting is out of its domain.
pub const CONFIG: Code = 3;
/// The engine cannot do this.
pub const INCAPABLE: Code = 4;
/// An array or an index does not fit.
pub const SHAPE: Code = 5;
/// Something is not installed.
pub const MISSING: Code = 6;
/// The work failed.
pub const FAILED: Code = 7;
/// A defect of the engine.
pub const PANIC: Code = 8;

/// Joint kinds in the header's order.
pub mod joint_kind {
    /// Six degrees of freedom.
    pub const FREE: i32 = 0;
    /// Three rotations.
    pub const BALL: i32 = 1;
    /// One rotation.
    pub const HINGE: i32 = 2;
    /// One translation.
    pub const SLIDE: i32 = 3;
}

/// Shapes in the header's order.
pub mod geom_kind {
    /// Half space.
    pub const PLANE: i32 = 0;
    /// Height field.
    pub const HEIGHT_FIELD: i32 = 1;
    /// Sphere.
    pub const SPHERE: i32 = 2;
    /// Capsule along z.
    pub const CAPSULE: i32 = 3;
    /// Ellipsoid.
    pub const ELLIPSOID: i32 = 4;
    /// Cylinder along z.
    pub const CYLINDER: i32 = 5;
    /// Box.
    pub const BOX: i32 = 6;
    /// Triangle mesh.
    pub const MESH: i32 = 7;
}

/// Drives in the header's order.
pub mod actuator_kind {
    /// Force is the command.
    pub const MOTOR: i32 = 0;
    /// Position servo.
    pub const POSITION: i32 = 1;
    /// Velocity servo.
    pub const VELOCITY: i32 = 2;
    /// Something else.
    pub const OTHER: i32 = 3;
}

/// Channels in the header's order.
pub mod channel_kind {
    /// All entries of a sensor.
    pub const SENSOR: i32 = 0;
    /// Positions.
    pub const QPOS: i32 = 1;
    /// Velocities.
    pub const QVEL: i32 = 2;
    /// Normal force between two bodies.
    pub const CONTACT: i32 = 3;
}

macro_rules! c_structs {
    ($($(#[$doc:meta])* $name:ident = $c_name:literal { $($field:ident : $type:ty),* $(,)? })*) => {
        $(
            $(#[$doc])*
            #[repr(C)]
            #[derive(Clone, Copy)]
            #[allow(missing_docs, reason = "fields are documented in the header")]
            pub struct $name { $(pub $field: $type),* }
        )*

        /// Name of each structure and its fields in the header, with size and offsets in bytes.
        #[must_use]
        pub fn shapes() -> Vec<Shape> {
            vec![$(Shape {
                name: $c_name,
                size: size_of::<$name>(),
                fields: vec![$((stringify!($field), std::mem::offset_of!($name, $field))),*],
            }),*]
        }
    };
}

/// Memory layout of a structure, for comparison with the header.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Shape {
    /// Name in the header.
    pub name: &'static str,
    /// Bytes.
    pub size: usize,
    /// Name and offset of each field.
    pub fields: Vec<(&'static str, usize)>,
}

/// An opaque handle of the engine.
#[repr(C)]
pub struct Model {
    _opaque: [u8; 0],
}
/// An opaque handle of the engine.
#[repr(C)]
pub struct Batch {
    _opaque: [u8; 0],
}
/// An opaque handle of the engine.
#[repr(C)]
pub struct Snapshot {
    _opaque: [u8; 0],
}

/// `asid_step_hook`.
pub type StepHook = unsafe extern "C" fn(*mut c_void, u64, u64, *mut StepView);

c_structs! {
    /// Why a call failed.
    Error = "asid_error" {
        subject: [c_char; 256],
        message: [c_char; 1024],
    }
    /// A body of a document.
    Body = "asid_body" {
        name: *const c_char, parent: u64, pos: [f64; 3], quat: [f64; 4], mass: f64,
        com: [f64; 3], inertia: [f64; 6], moments: [f64; 3], iquat: [f64; 4], inertial: i32, padding: i32,
    }
    /// A joint of a document.
    Joint = "asid_joint" {
        name: *const c_char, body: u64, kind: i32, limited: i32, qpos: u64, qvel: u64,
        pos: [f64; 3], axis: [f64; 3], range: [f64; 2], ref_: f64, springref: f64,
        stiffness: f64, damping: f64, armature: f64, frictionloss: f64,
    }
    /// A shape of a document.
    Geom = "asid_geom" {
        name: *const c_char, body: u64, kind: i32, condim: i32, pos: [f64; 3], quat: [f64; 4],
        size: [f64; 3], mass: f64, inertia: [f64; 3], friction: [f64; 3], contype: u32,
        conaffinity: u32, priority: i32, padding: i32,
    }
    /// A site of a document.
    Site = "asid_site" {
        name: *const c_char, body: u64, pos: [f64; 3], quat: [f64; 4],
    }
    /// A drive of a document.
    Actuator = "asid_actuator" {
        name: *const c_char, kind_name: *const c_char, kind: i32, ctrl_limited: i32,
        force_limited: i32, padding: i32, joint: u64, gear: f64, kp: f64, kv: f64,
        ctrl_range: [f64; 2], force_range: [f64; 2],
    }
    /// A sensor of a document.
    Sensor = "asid_sensor" {
        name: *const c_char, kind: *const c_char, object_kind: *const c_char, object: u64,
        address: u64, length: u64,
    }
    /// A starting state of a document.
    Keyframe = "asid_keyframe" {
        name: *const c_char, qpos: *const f64, qvel: *const f64, ctrl: *const f64,
    }
    /// The host's reading of a document.
    World = "asid_world" {
        size: u64, timestep: f64, gravity: [f64; 3], nq: u64, nv: u64, nu: u64,
        nsensordata: u64, qpos0: *const f64,
        nbody: u64, bodies: *const Body, njoint: u64, joints: *const Joint,
        ngeom: u64, geoms: *const Geom, nsite: u64, sites: *const Site,
        nactuator: u64, actuators: *const Actuator, nsensor: u64, sensors: *const Sensor,
        nkeyframe: u64, keyframes: *const Keyframe,
        nleft_out: u64, left_out: *const *const c_char,
    }
    /// A document to load.
    Scene = "asid_scene" {
        size: u64, name: *const c_char, xml: *const c_char, directory: *const c_char,
        world: Option<unsafe extern "C" fn(*const Scene, *mut Error) -> *const World>,
    }
    /// A joint's name and kind.
    LayoutJoint = "asid_layout_joint" {
        name: *const c_char, body: *const c_char, kind: i32, padding: i32,
    }
    /// A drive's name and range.
    LayoutActuator = "asid_layout_actuator" {
        name: *const c_char, ctrl_limited: i32, padding: i32, ctrl_range: [f64; 2],
    }
    /// A sensor's name and length.
    LayoutSensor = "asid_layout_sensor" {
        name: *const c_char, kind: *const c_char, length: u64,
    }
    /// Names and places of a loaded scene.
    Layout = "asid_layout" {
        size: u64, timestep: f64, nbody: u64, bodies: *const *const c_char,
        ngeom: u64, geoms: *const *const c_char, njoint: u64, joints: *const LayoutJoint,
        nactuator: u64, actuators: *const LayoutActuator,
        nsensor: u64, sensors: *const LayoutSensor,
        nkeyframe: u64, keyframes: *const Keyframe,
    }
    /// What a parameter changes.
    Target = "asid_target" {
        element: *const c_char, name: *const c_char, attribute: *const c_char, index: u64,
        object: u64,
    }
    /// How a batch is made.
    BatchConfig = "asid_batch_config" {
        size: u64, batch_size: u64, threads: u64, target_count: u64, targets: *const Target,
    }
    /// What is recorded.
    Channel = "asid_channel" { kind: i32, padding: i32, a: u64, b: u64 }
    /// A wrench on a body.
    Force = "asid_force" { body: u64, wrench: *const f64 }
    /// A parameter's new value.
    Change = "asid_change" { frame: u64, column: u64, values: *const f64 }
    /// What a hook sees.
    StepView = "asid_step_view" {
        time: f64, qpos: *const f64, qvel: *const f64, ctrl: *mut f64, force: *mut f64,
    }
    /// Commands in, readings out.
    Rollout = "asid_rollout" {
        size: u64, count: u64, sims: *const u64, frames: u64, substeps: u64,
        control: *const f64, shared_control: i32, padding: i32,
        force_count: u64, forces: *const Force, change_count: u64, changes: *const Change,
        hook: Option<StepHook>, hook_context: *mut c_void,
        channel_count: u64, channels: *const Channel, width: u64,
    }
    /// State of one simulation.
    Status = "asid_status" {
        diverged: i32, padding: i32, time: f64, message: [c_char; 256],
    }
    /// The table of an engine.
    Backend = "asid_backend" {
        abi_major: u32, abi_minor: u32, size: u64,
        name: *const c_char, version: *const c_char, about: *const c_char, capabilities: u64,
        get_extension: Option<unsafe extern "C" fn(*const c_char) -> *const c_void>,
        load: Option<unsafe extern "C" fn(*const Scene, *mut *mut Model, *mut Error) -> Code>,
        destroy_model: Option<unsafe extern "C" fn(*mut Model)>,
        layout: Option<unsafe extern "C" fn(*const Model) -> *const Layout>,
        nominal: Option<unsafe extern "C" fn(*const Model, *const Target, *mut f64, *mut Error) -> Code>,
        make_batch: Option<unsafe extern "C" fn(*const Model, *const BatchConfig, *mut *mut Batch, *mut Error) -> Code>,
        destroy_batch: Option<unsafe extern "C" fn(*mut Batch)>,
        set_parameters: Option<unsafe extern "C" fn(*mut Batch, *const u64, u64, *const f64, *mut Error) -> Code>,
        reset: Option<unsafe extern "C" fn(*mut Batch, *const u64, u64, *mut Error) -> Code>,
        set_state: Option<unsafe extern "C" fn(*mut Batch, *const u64, u64, *const f64, *const f64, *mut Error) -> Code>,
        rollout: Option<unsafe extern "C" fn(*mut Batch, *const Rollout, *mut f64, *mut Error) -> Code>,
        read: Option<unsafe extern "C" fn(*mut Batch, *const u64, u64, *const Channel, u64, u64, *mut f64, *mut Error) -> Code>,
        save: Option<unsafe extern "C" fn(*mut Batch, *const u64, u64, *mut *mut Snapshot, *mut Error) -> Code>,
        restore: Option<unsafe extern "C" fn(*mut Batch, *const Snapshot, *const u64, *const u64, u64, *mut Error) -> Code>,
        destroy_snapshot: Option<unsafe extern "C" fn(*mut Snapshot)>,
        copy_state: Option<unsafe extern "C" fn(*mut Batch, *const u64, *const u64, u64, *mut Error) -> Code>,
        status: Option<unsafe extern "C" fn(*const Batch, u64, u64, *mut Status)>,
        diverged_count: Option<unsafe extern "C" fn(*const Batch) -> u64>,
        steps_taken: Option<unsafe extern "C" fn(*const Batch) -> u64>,
    }
}

// SAFETY: a table is immutable for the life of the process, its functions may be called from any
// thread as the header says, and what it points to is static.
unsafe impl Sync for Backend {}
// SAFETY: as above.
unsafe impl Send for Backend {}

/// Capabilities that an engine can claim over this table, whose hook cannot access parameters.
#[must_use]
pub fn capabilities() -> Capabilities {
    Capabilities::all() - Capabilities::LIVE_PARAMETERS
}
