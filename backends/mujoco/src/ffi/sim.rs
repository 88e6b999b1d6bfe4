//! One simulation's model and data, as seen inside a batch call.

use std::marker::PhantomData;

use crate::field::Field;
use mujoco_rs::mujoco_c::{
    mj_contactForce, mj_forward, mj_isPyramidal, mj_isSparse, mj_step, mj_step1, mj_step2,
    mjContact, mjData, mjModel,
};

/// Index of the first warning about bad numbers: `qpos`, `qvel`, `qacc`, `ctrl`.
const WARN_BADQPOS: usize = 3;
/// `mjMAXVAL`: a larger magnitude counts as bad.
const MAX_VALUE: f64 = 1e10;

/// Largest entry of a contact's Jacobian that counts as rounding, m/rad or 1.
const NO_LEVER: f64 = 1e-12;

/// Whether MuJoCo's own check calls a number bad: not finite, or above 1e10.
#[must_use]
pub fn is_bad(x: f64) -> bool {
    x.is_nan() || x.abs() > MAX_VALUE
}

/// One simulation's model and data during [`Batch::apply`](super::Batch::apply).
///
/// The pointers remain pointers, since MuJoCo writes through its own copies of them. Slices are
/// made for the duration of a borrow.
pub struct Sim<'a> {
    m: *const mjModel,
    d: *mut mjData,
    borrow: PhantomData<&'a mut mjData>,
}

/// Accessors of arrays of `mjData`: `name`, length in `mjModel`, documentation.
macro_rules! arrays {
    ($($name:ident, $len:ident $(* $factor:literal)?, $doc:literal;)*) => {$(
        #[doc = $doc]
        #[must_use]
        pub fn $name(&self) -> &[f64] {
            // SAFETY: `m` and `d` are live and belong together; the array holds that many doubles,
            // and `&self` excludes writers.
            unsafe { slice((*self.d).$name, (*self.m).$len as usize $(* $factor)?) }
        }
    )*};
}

impl Sim<'_> {
    /// A view of one simulation.
    ///
    /// # Safety
    /// `m` and `d` are live, belong together, and are nobody else's while the view lives.
    pub(super) unsafe fn new(m: *const mjModel, d: *mut mjData) -> Self {
        Self {
            m,
            d,
            borrow: PhantomData,
        }
    }

    arrays! {
        qpos, nq, "Positions, `nq`.";
        qvel, nv, "Velocities, `nv`.";
        sensordata, nsensordata, "Readings of the stages computed last.";
    }

    /// Simulated time, s.
    #[must_use]
    pub fn time(&self) -> f64 {
        // SAFETY: `d` is live.
        unsafe { (*self.d).time }
    }

    /// Command, generalised force and the read-only state, for a hook:
    /// `(qpos, qvel, ctrl, qfrc_applied)`.
    pub fn hook_view(&mut self) -> (&[f64], &[f64], &mut [f64], &mut [f64]) {
        // SAFETY: four disjoint arrays of `d`, borrowed from `self` together.
        unsafe {
            let (m, d) = (&*self.m, self.d);
            (
                slice((*d).qpos, m.nq as usize),
                slice((*d).qvel, m.nv as usize),
                slice_mut((*d).ctrl, m.nu as usize),
                slice_mut((*d).qfrc_applied, m.nv as usize),
            )
        }
    }

    /// Commands, `nu`.
    pub fn ctrl(&mut self) -> &mut [f64] {
        // SAFETY: `nu` doubles, borrowed from `self`.
        unsafe { slice_mut((*self.d).ctrl, (*self.m).nu as usize) }
    }

    /// Commands, and what actuators remember of earlier ones: activations, `na`, and the buffers of
    /// delays.
    pub fn command_memory(&mut self) -> (&[f64], &mut [f64], &mut [f64]) {
        // SAFETY: three disjoint arrays of `d`, borrowed from `self` together.
        unsafe {
            let (m, d) = (&*self.m, self.d);
            (
                slice((*d).ctrl, m.nu as usize),
                slice_mut((*d).act, m.na as usize),
                slice_mut((*d).history, m.nhistory as usize),
            )
        }
    }

    /// Applied wrenches, `nbody x 6`: force, then torque.
    pub fn wrenches(&mut self) -> &mut [f64] {
        // SAFETY: `6 nbody` doubles, borrowed from `self`.
        unsafe { slice_mut((*self.d).xfrc_applied, (*self.m).nbody as usize * 6) }
    }

    /// Sets an entry of a field that may change during a rollout; other fields are ignored.
    ///
    /// The field has separate values in this simulation ([`super::Batch::expand`]).
    pub fn write_live(&mut self, field: Field, entry: usize, value: f64) {
        // SAFETY: `m` is live; its arrays have the lengths compared with, and belong to this
        // simulation alone where they are expanded, as the caller promises.
        unsafe {
            let m = &*self.m;
            let (array, len) = match field {
                Field::GeomFriction => (m.geom_friction, 3 * m.ngeom),
                Field::GeomSolref => (m.geom_solref, 2 * m.ngeom),
                Field::DofDamping => (m.dof_damping, m.nv),
                Field::DofFrictionloss => (m.dof_frictionloss, m.nv),
                Field::JntStiffness => (m.jnt_stiffness, m.njnt),
                _ => return,
            };
            if entry < len as usize {
                *array.add(entry) = value;
            }
        }
    }

    /// One physics step.
    pub fn step(&mut self) {
        // SAFETY: `m` and `d` are live and belong together.
        unsafe { mj_step(self.m, self.d) };
    }

    /// The half of a step that needs no command: positions, velocities and their sensors.
    pub fn step1(&mut self) {
        // SAFETY: `m` and `d` are live and belong together.
        unsafe { mj_step1(self.m, self.d) };
    }

    /// The other half, after [`Sim::step1`] or [`Sim::forward`] on the present state.
    pub fn step2(&mut self) {
        // SAFETY: `m` and `d` are live and belong together.
        unsafe { mj_step2(self.m, self.d) };
    }

    /// Computes everything that follows from the current state and command.
    pub fn forward(&mut self) {
        // SAFETY: `m` and `d` are live and belong together.
        unsafe { mj_forward(self.m, self.d) };
    }

    /// The bad number that MuJoCo has warned about since the last reset; it makes the state
    /// worthless.
    #[must_use]
    pub fn bad_number(&self) -> Option<BadNumber> {
        // SAFETY: `d` is live; an array of plain counters is read.
        let warnings = unsafe { &(&(*self.d).warning)[WARN_BADQPOS..] };
        let kinds = [
            BadNumber::Position,
            BadNumber::Velocity,
            BadNumber::Acceleration,
            BadNumber::Command,
        ];
        let seen = warnings.iter().position(|w| w.number > 0);
        if let Some(first) = seen {
            return kinds.get(first).copied();
        }
        if self.qpos().iter().any(|&x| is_bad(x)) {
            return Some(BadNumber::Position);
        }
        self.qvel()
            .iter()
            .any(|&x| is_bad(x))
            .then_some(BadNumber::Velocity)
    }

    /// Sum of the normal forces between the geoms of two bodies, N, as of the last
    /// [`Sim::forward`].
    ///
    /// A contact that acts on no joint counts as none, since its force is undetermined. An example
    /// is a frictionless object that slides along a table and cannot leave it.
    #[must_use]
    pub fn contact_force(&self, bodies: [usize; 2]) -> f64 {
        let mut sum = 0.0;
        // SAFETY: `ncon` contacts in the array; geom indices are checked to be of geoms (a flex has
        // -1) before they index `geom_bodyid`.
        unsafe {
            let (m, d) = (&*self.m, self.d);
            for i in 0..(*d).ncon {
                let contact = &*(*d).contact.add(i as usize);
                let [a, b] = contact.geom;
                if a < 0 || b < 0 {
                    continue;
                }
                let pair = [a, b].map(|g| *m.geom_bodyid.add(g as usize) as usize);
                let own = pair == bodies || pair == [bodies[1], bodies[0]];
                if own && self.acts(contact) {
                    let mut force = [0.0; 6];
                    mj_contactForce(self.m, d, i, &raw mut force);
                    sum += force[0];
                }
            }
        }
        sum
    }

    /// Whether a contact acts on some degree of freedom.
    fn acts(&self, contact: &mjContact) -> bool {
        let Ok(first) = usize::try_from(contact.efc_address) else {
            return false;
        };
        // SAFETY: the rows of a contact that is in the problem lie within those of its Jacobian,
        // dense (`nv` a row) or sparse.
        unsafe {
            let (d, nv) = (&*self.d, (*self.m).nv as usize);
            let dim = contact.dim as usize;
            let rows = match mj_isPyramidal(self.m) {
                1 if dim > 1 => 2 * (dim - 1),
                _ => dim,
            };
            (first..first + rows).any(|row| {
                let (start, len) = match mj_isSparse(self.m) {
                    0 => (row * nv, nv),
                    _ => (
                        *d.efc_J_rowadr.add(row) as usize,
                        *d.efc_J_rownnz.add(row) as usize,
                    ),
                };
                (start..start + len).any(|entry| (*d.efc_J.add(entry)).abs() > NO_LEVER)
            })
        }
    }
}

/// Which number of a state is bad.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BadNumber {
    /// A position.
    Position,
    /// A velocity.
    Velocity,
    /// An acceleration.
    Acceleration,
    /// A command or an applied force.
    Command,
}

/// A slice of an array of MuJoCo, which is null if empty.
///
/// # Safety
/// `ptr` holds `len` doubles that nobody writes for `'a`, or is null or `len` 0.
unsafe fn slice<'a>(ptr: *const f64, len: usize) -> &'a [f64] {
    if ptr.is_null() || len == 0 {
        return &[];
    }
    // SAFETY: as promised by the caller.
    unsafe { std::slice::from_raw_parts(ptr, len) }
}

/// As `slice` above, for writing.
///
/// # Safety
/// `ptr` holds `len` doubles that only the result touches for `'a`, or is null or `len` 0.
pub(super) unsafe fn slice_mut<'a>(ptr: *mut f64, len: usize) -> &'a mut [f64] {
    if ptr.is_null() || len == 0 {
        return &mut [];
    }
    // SAFETY: as promised by the caller.
    unsafe { std::slice::from_raw_parts_mut(ptr, len) }
}
