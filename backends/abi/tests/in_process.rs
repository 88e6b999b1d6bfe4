//! A Rust engine through its own table, exported and imported again within one process.
//!
//! No library is loaded and nothing is compiled, so that Miri can run all of it: `cargo xtask
//! miri`.

#![allow(clippy::unwrap_used)]

use std::path::Path;
use std::sync::{Arc, Mutex};

use asid_abi::export::{Export, table};
use asid_abi::{Engine, table as abi};
use asid_core::simulator::{ExternalForce, ParameterChange, StepHook, StepView};
use asid_core::{
    Backend, BatchConfig, Capabilities, Control, Error, Layout, Model, Recording, Result, Rollout,
    Scene, Simulator, Snapshot, Status, Target,
};
use free_flight::FreeFlight;

/// The unmodified engine.
struct Sound;

impl Export for Sound {
    fn backend() -> Result<&'static dyn Backend> {
        Ok(&FreeFlight)
    }
}

/// A table that lives as long as the process, referenced so that Miri reports no leak.
fn keep(table: abi::Backend) -> &'static abi::Backend {
    static KEPT: Mutex<Vec<&'static abi::Backend>> = Mutex::new(Vec::new());
    let table = Box::leak(Box::new(table));
    KEPT.lock().unwrap().push(table);
    table
}

fn engine<E: Export>() -> Engine {
    let table = keep(table::<E>("an engine"));
    // SAFETY: a table that was just made, and is leaked.
    unsafe { Engine::from_table(table, Path::new("libengine.so")) }.unwrap()
}

fn scene() -> Scene {
    Scene::from_xml(
        "two bodies",
        r#"<mujoco><option timestep="0.01"/><worldbody>
        <body name="a" pos="0 0 1"><freejoint name="a"/>
          <inertial pos="0.1 0 0" mass="2" diaginertia="0.1 0.2 0.25"/></body>
        <body name="b" pos="1 0 1"><freejoint name="b"/>
          <inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/><site name="tip" pos="0 0 0.3"/></body>
        </worldbody><sensor><framepos name="tip" objtype="site" objname="tip"/>
        <framequat name="turn" objtype="xbody" objname="a"/></sensor></mujoco>"#,
        &[],
    )
    .unwrap()
}

fn batch(model: &dyn Model, size: usize) -> Box<dyn Simulator> {
    let targets: Vec<Target> = ["body/a/mass", "option/gravity/2"]
        .iter()
        .map(|t| t.parse().unwrap())
        .collect();
    model
        .simulator(&BatchConfig {
            size,
            threads: 2,
            targets,
        })
        .unwrap()
}

/// A force that depends on the state.
struct Drag;

impl StepHook for Drag {
    fn before_step(&self, row: usize, step: usize, view: &mut StepView<'_>) {
        for (force, speed) in view.force.iter_mut().zip(view.qvel) {
            *force -= 0.1 * speed * (1 + row + step) as f64 + view.time;
        }
    }
}

/// The results of all operations of a batch, as numbers.
fn everything(backend: &dyn Backend) -> Vec<f64> {
    let model = backend.load(&scene()).unwrap();
    let mut sim = batch(&*model, 3);
    let record = model
        .layout()
        .recording(&["tip", "turn", "qvel.a"])
        .unwrap();
    let width = record.width();
    let all = [0, 1, 2];
    let mut numbers = vec![model.nominal(&"body/a/mass".parse().unwrap()).unwrap()];
    sim.set_parameters(&all, &[2.0, -9.8, 1.0, -5.0, 3.0, 0.0])
        .unwrap();
    sim.set_state(
        &[0, 2],
        &[0.5; 28],
        &(0..24).map(|i| f64::from(i) / 10.0).collect::<Vec<_>>(),
    )
    .unwrap();
    let wrench = vec![0.3; 3 * 4 * 6];
    let heavier = [4.0, 5.0, 6.0];
    let mut out = vec![0.0; 3 * 4 * width];
    let forces = [ExternalForce {
        body: 1,
        wrench: &wrench,
    }];
    let changes = [ParameterChange {
        frame: 2,
        column: 0,
        values: &heavier,
    }];
    let rollout = Rollout {
        forces: &forces,
        changes: &changes,
        hook: Some(&Drag),
        ..Rollout::new(&all, 4, 2, Control::Shared(&[]), &record)
    };
    sim.rollout(&rollout, &mut out).unwrap();
    numbers.extend(&out);

    let saved = sim.save(&[0, 2]).unwrap();
    let mut other = batch(&*model, 2);
    other.load(&saved, &[1, 0], &[0, 1]).unwrap();
    other.copy_state(&[0], &[1]).unwrap();
    let mut read = vec![0.0; 2 * width];
    other.read(&[0, 1], &record, &mut read).unwrap();
    numbers.extend(&read);
    drop(other);

    sim.reset(&[1]).unwrap();
    sim.read(&[0, 1], &record, &mut read).unwrap();
    numbers.extend(&read);
    numbers.push(sim.steps_taken() as f64);
    numbers
}

#[test]
fn loaded_is_linked_to_the_bit() {
    let loaded = engine::<Sound>().backend("loaded");
    assert_eq!(loaded.name(), "loaded");
    assert_eq!(loaded.capabilities(), FreeFlight.capabilities());
    let linked = FreeFlight.load(&scene()).unwrap();
    assert_eq!(loaded.load(&scene()).unwrap().layout(), linked.layout());
    let bits = |numbers: Vec<f64>| numbers.into_iter().map(f64::to_bits).collect::<Vec<_>>();
    assert_eq!(bits(everything(&*loaded)), bits(everything(&FreeFlight)));
}

#[test]
fn one_simulation_diverges_alone() {
    let model = engine::<Sound>().backend("e").load(&scene()).unwrap();
    // More simulations than statuses are requested at a time.
    let mut sim = batch(&*model, 66);
    let all: Vec<usize> = (0..66).collect();
    let mut qpos = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0].repeat(132);
    let mut qvel = vec![0.0; 66 * 12];
    (qpos[65 * 14], qvel[65 * 12]) = (9.9e9, 5e9);
    sim.set_state(&all, &qpos, &qvel).unwrap();
    let record = model.layout().recording(&["qpos.a"]).unwrap();
    let mut out = vec![0.0; 66 * 4 * 7];
    let rollout = Rollout::new(&all, 4, 1, Control::Shared(&[]), &record);
    sim.rollout(&rollout, &mut out).unwrap();
    let gone: Vec<usize> = all
        .iter()
        .copied()
        .filter(|&s| !sim.status()[s].is_running())
        .collect();
    assert_eq!(gone, [65]);
    assert!(
        matches!(&sim.status()[65], Status::Diverged { time, message }
            if (*time - 0.03).abs() < 1e-9 && message.contains("not finite")),
        "{:?}",
        sim.status()[65]
    );
    let last = |sim: usize| out[(sim + 1) * 4 * 7 - 1];
    assert!(last(65).is_nan() && last(64).is_finite());
    sim.reset(&[65]).unwrap();
    assert!(sim.status()[65].is_running());
}

#[test]
fn wrong_calls_stop_at_the_adapter() {
    let backend = engine::<Sound>().backend("e");
    let model = backend.load(&scene()).unwrap();
    let mut sim = batch(&*model, 2);
    let record = model.layout().recording(&["tip"]).unwrap();
    let said = |result: Result<()>| result.unwrap_err().to_string();
    assert_eq!(
        said(sim.set_parameters(&[0], &[1.0])),
        "parameters has 1 values where 2 are needed"
    );
    assert!(said(sim.set_parameters(&[0], &[f64::NAN, 1.0])).contains("NaN"));
    assert!(said(sim.reset(&[2])).contains("below 2"));
    assert!(said(sim.reset(&[1, 0])).contains("increasing"));
    assert!(said(sim.set_state(&[0], &[0.0; 14], &[0.0; 12])).contains("quaternion"));
    assert!(said(sim.read(&[0], &record, &mut [0.0; 2])).contains("output has 2"));
    assert!(said(sim.copy_state(&[0], &[0])).contains("from and to"));
    let snapshot = sim.save(&[0]).unwrap();
    assert!(said(sim.load(&snapshot, &[1], &[0])).contains("row 1 of a snapshot with 1"));
    let other = backend.load(&scene()).unwrap();
    let mut of_other = batch(&*other, 2);
    assert!(said(of_other.load(&snapshot, &[0], &[0])).contains("another scene"));
    // The engine's own errors name the file.
    assert_eq!(
        said(sim.set_parameters(&[0], &[-1.0, 0.0])),
        "parameter `body/mass`: -1 is not physical (plugin libengine.so)"
    );
    let unknown = model.nominal(&"geom/x/mass".parse().unwrap()).unwrap_err();
    assert!(unknown.to_string().contains("(plugin libengine.so)"));
}

#[test]
fn what_is_not_claimed_is_refused_before_the_engine_is_called() {
    unsafe extern "C" fn never(
        _: *mut abi::Batch,
        _: *const abi::Rollout,
        _: *mut f64,
        _: *mut abi::Error,
    ) -> abi::Code {
        abi::PANIC
    }
    unsafe extern "C" fn never_read(
        _: *mut abi::Batch,
        _: *const u64,
        _: u64,
        _: *const abi::Channel,
        _: u64,
        _: u64,
        _: *mut f64,
        _: *mut abi::Error,
    ) -> abi::Code {
        abi::PANIC
    }
    let mut table = table::<Sound>("an engine");
    table.rollout = Some(never);
    table.read = Some(never_read);
    // SAFETY: a table that was just made, and is leaked.
    let engine = unsafe { Engine::from_table(keep(table), Path::new("libengine.so")) }.unwrap();
    let model = engine.backend("e").load(&scene()).unwrap();
    let mut sim = batch(&*model, 1);
    let record = model.layout().recording(&["contact.a/b"]).unwrap();
    let mut out = [0.0];
    let rollout = Rollout::new(&[0], 1, 1, Control::Shared(&[]), &record);
    let expected = "backend `free-flight` cannot record contact forces (plugin libengine.so)";
    let said = sim.rollout(&rollout, &mut out).unwrap_err().to_string();
    assert_eq!(said, expected);
    let said = sim.read(&[0], &record, &mut out).unwrap_err().to_string();
    assert_eq!(said, expected);
    assert_eq!(sim.steps_taken(), 0);
}

#[test]
fn targets_that_the_engine_does_not_name_are_named_by_the_host() {
    let mut table = table::<Sound>("an engine");
    unsafe extern "C" fn nameless(
        _: *const abi::Model,
        _: *const abi::BatchConfig,
        _: *mut *mut abi::Batch,
        _: *mut abi::Error,
    ) -> abi::Code {
        abi::PARAMETER
    }
    table.make_batch = Some(nameless);
    // SAFETY: a table that was just made, and is leaked.
    let engine = unsafe { Engine::from_table(keep(table), Path::new("lib.so")) }.unwrap();
    let model = engine.backend("e").load(&scene()).unwrap();
    let config = BatchConfig {
        size: 1,
        threads: 1,
        targets: vec!["geom/g/friction/2".parse().unwrap()],
    };
    let error = model.simulator(&config).err().unwrap().to_string();
    assert!(
        error.starts_with("parameter `geom/g/friction/2`: "),
        "{error}"
    );
}

/// Symptom: of two columns for one target an engine kept the last, and the other was lost silently.
#[test]
fn a_target_that_is_named_twice_stops_at_the_adapter() {
    let model = engine::<Sound>().backend("e").load(&scene()).unwrap();
    let twice = ["option/gravity/2", "body/a/mass", "option/gravity/2"];
    let config = BatchConfig {
        size: 1,
        threads: 1,
        targets: twice.iter().map(|t| t.parse().unwrap()).collect(),
    };
    let error = model.simulator(&config).err().unwrap().to_string();
    assert_eq!(error, "parameter `option/gravity/2`: is named twice");
}

#[test]
fn a_snapshot_outlives_batch_and_model() {
    let backend = engine::<Sound>().backend("e");
    let model = backend.load(&scene()).unwrap();
    let snapshot = batch(&*model, 1).save(&[0]).unwrap();
    let mut sim = batch(&*model, 1);
    drop(model);
    sim.load(&snapshot, &[0], &[0]).unwrap();
    drop(sim);
    assert_eq!(snapshot.rows(), 1);
}

/// An engine that panics in rollouts of thirteen frames, and returns NaN in those of fourteen.
struct Faulty;
struct FaultyModel(Arc<dyn Model>);
struct FaultySimulator(Box<dyn Simulator>);

impl Export for Faulty {
    fn backend() -> Result<&'static dyn Backend> {
        Ok(&Faulty)
    }
}

impl Backend for Faulty {
    fn name(&self) -> &str {
        "faulty"
    }
    fn version(&self) -> String {
        "1".into()
    }
    fn capabilities(&self) -> Capabilities {
        FreeFlight.capabilities()
    }
    fn load(&self, scene: &Scene) -> Result<Arc<dyn Model>> {
        assert!(scene.name() != "panics", "no such luck");
        Ok(Arc::new(FaultyModel(FreeFlight.load(scene)?)))
    }
}

impl Model for FaultyModel {
    fn layout(&self) -> &Layout {
        self.0.layout()
    }
    fn nominal(&self, target: &Target) -> Result<f64> {
        self.0.nominal(target)
    }
    fn simulator(&self, config: &BatchConfig) -> Result<Box<dyn Simulator>> {
        Ok(Box::new(FaultySimulator(self.0.simulator(config)?)))
    }
}

impl Simulator for FaultySimulator {
    fn layout(&self) -> &Layout {
        self.0.layout()
    }
    fn batch_size(&self) -> usize {
        self.0.batch_size()
    }
    fn set_parameters(&mut self, sims: &[usize], values: &[f64]) -> Result<()> {
        self.0.set_parameters(sims, values)
    }
    fn reset(&mut self, sims: &[usize]) -> Result<()> {
        self.0.reset(sims)
    }
    fn set_state(&mut self, sims: &[usize], qpos: &[f64], qvel: &[f64]) -> Result<()> {
        self.0.set_state(sims, qpos, qvel)
    }
    fn rollout(&mut self, rollout: &Rollout<'_>, out: &mut [f64]) -> Result<()> {
        assert!(rollout.frames != 13, "thirteen frames");
        self.0.rollout(rollout, out)?;
        if rollout.frames == 14 {
            out[14 * rollout.record.width() - 1] = f64::NAN;
        }
        Ok(())
    }
    fn read(&mut self, sims: &[usize], record: &Recording, out: &mut [f64]) -> Result<()> {
        self.0.read(sims, record, out)
    }
    fn save(&mut self, sims: &[usize]) -> Result<Snapshot> {
        self.0.save(sims)
    }
    fn load(&mut self, snapshot: &Snapshot, rows: &[usize], sims: &[usize]) -> Result<()> {
        self.0.load(snapshot, rows, sims)
    }
    fn copy_state(&mut self, from: &[usize], to: &[usize]) -> Result<()> {
        self.0.copy_state(from, to)
    }
    fn status(&self) -> &[Status] {
        self.0.status()
    }
    fn steps_taken(&self) -> u64 {
        self.0.steps_taken()
    }
}

fn roll(sim: &mut dyn Simulator, model: &dyn Model, frames: usize) -> Result<()> {
    let record = model.layout().recording(&["tip"])?;
    let mut out = vec![0.0; frames * record.width()];
    sim.rollout(
        &Rollout::new(&[0], frames, 1, Control::Shared(&[]), &record),
        &mut out,
    )
}

#[test]
fn a_panic_poisons_the_batch_and_nothing_else() {
    let backend = engine::<Faulty>().backend("e");
    let model = backend.load(&scene()).unwrap();
    let mut sim = batch(&*model, 1);
    let mut other = batch(&*model, 1);
    roll(&mut *sim, &*model, 3).unwrap();
    assert_eq!(
        roll(&mut *sim, &*model, 13).unwrap_err().to_string(),
        "plugin libengine.so: rollout: panicked: thirteen frames"
    );
    assert_eq!(
        sim.reset(&[0]).unwrap_err().to_string(),
        "plugin libengine.so: reset: not called, for the engine panicked before: thirteen frames"
    );
    roll(&mut *other, &*model, 3).unwrap();
    let bad = Scene::from_xml("panics", scene().xml(), &[]).unwrap();
    let error = backend.load(&bad).err().unwrap().to_string();
    assert_eq!(error, "plugin libengine.so: load: panicked: no such luck");
}

#[test]
fn a_reading_that_is_no_number_is_the_engines_fault() {
    let model = engine::<Faulty>().backend("e").load(&scene()).unwrap();
    let mut sim = batch(&*model, 1);
    assert_eq!(
        roll(&mut *sim, &*model, 14).unwrap_err().to_string(),
        "plugin libengine.so: rollout: reads NaN for sensor `tip` of simulation 0 in frame 13, which it says is running"
    );
}

#[test]
fn a_panic_of_the_host_in_a_hook_passes_by_the_engine() {
    struct Panics;
    impl StepHook for Panics {
        fn before_step(&self, _: usize, step: usize, _: &mut StepView<'_>) {
            assert!(step < 2, "the host's own");
        }
    }
    let model = engine::<Sound>().backend("e").load(&scene()).unwrap();
    let mut sim = batch(&*model, 1);
    let record = model.layout().recording(&["tip"]).unwrap();
    let mut out = vec![0.0; 5 * 3];
    let rollout = Rollout {
        hook: Some(&Panics),
        ..Rollout::new(&[0], 5, 1, Control::Shared(&[]), &record)
    };
    let caught = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
        sim.rollout(&rollout, &mut out)
    }));
    let said = caught.unwrap_err();
    assert_eq!(said.downcast_ref::<&str>(), Some(&"the host's own"));
    roll(&mut *sim, &*model, 3).unwrap();
}

/// A C host that keeps a handle too long gets an error, not a crash.
#[test]
fn handles_that_were_destroyed_are_not_found() {
    let t = keep(table::<Sound>("an engine"));
    let mut error = abi::Error {
        subject: [0; 256],
        message: [0; 1024],
    };
    let (name, xml) = (c"s", std::ffi::CString::new(scene().xml()).unwrap());
    let scene = abi::Scene {
        size: size_of::<abi::Scene>() as u64,
        name: name.as_ptr(),
        xml: xml.as_ptr(),
        directory: std::ptr::null(),
        world: None,
    };
    let config = abi::BatchConfig {
        size: size_of::<abi::BatchConfig>() as u64,
        batch_size: 2,
        threads: 1,
        target_count: 0,
        targets: std::ptr::null(),
    };
    let (mut model, mut batch) = (std::ptr::null_mut(), std::ptr::null_mut());
    let sims = [0_u64, 1];
    // SAFETY: every pointer is as the header requires, or a handle that the table gave, destroyed
    // or not.
    unsafe {
        assert_eq!(t.load.unwrap()(&scene, &mut model, &mut error), abi::OK);
        let make = t.make_batch.unwrap();
        assert_eq!(make(model, &config, &mut batch, &mut error), abi::OK);
        let reset = t.reset.unwrap();
        assert_eq!(reset(batch, sims.as_ptr(), 2, &mut error), abi::OK);
        let destroy = t.destroy_batch.unwrap();
        destroy(batch);
        destroy(batch);
        assert_eq!(reset(batch, sims.as_ptr(), 2, &mut error), abi::SHAPE);
        assert_eq!(t.diverged_count.unwrap()(batch), 1);
        assert_eq!(t.steps_taken.unwrap()(batch), 0);
        let mut status = [abi::Status {
            diverged: 0,
            padding: 0,
            time: 0.0,
            message: [0; 256],
        }];
        t.status.unwrap()(batch, 0, 1, status.as_mut_ptr());
        assert_eq!(status[0].diverged, 1);
        // A handle of another kind is not found either.
        assert_eq!(
            reset(model.cast(), sims.as_ptr(), 2, &mut error),
            abi::SHAPE
        );
        t.destroy_model.unwrap()(model);
        t.destroy_model.unwrap()(model);
        assert!(t.layout.unwrap()(model).is_null());
        assert_eq!(make(model, &config, &mut batch, &mut error), abi::SHAPE);
        // Null is not a handle, and null arrays are detected.
        assert_eq!(
            reset(std::ptr::null_mut(), std::ptr::null(), 2, &mut error),
            abi::SHAPE
        );
    }
}

/// Symptom: a bit of a later version would have been taken for one that the host has for itself.
#[test]
fn a_later_table_claims_what_this_version_knows() {
    let mut later = *keep(table::<Sound>("an engine"));
    later.abi_minor = 7;
    later.capabilities |= Capabilities::LIVE_PARAMETERS.bits() | (1 << 40);
    // SAFETY: a complete table.
    let engine = unsafe { Engine::from_table(keep(later), Path::new("lib.so")) }.unwrap();
    assert_eq!(engine.capabilities(), FreeFlight.capabilities());
}

#[test]
fn wrong_tables_are_refused_with_a_reason() {
    let refuse = |spoil: &dyn Fn(&mut abi::Backend)| {
        // The unmodified table is kept as well, because what it points to has no other owner.
        let mut table = *keep(table::<Sound>("an engine"));
        spoil(&mut table);
        let table = keep(table);
        // SAFETY: a complete table; the spoilt part is what is being checked.
        match unsafe { Engine::from_table(table, Path::new("lib.so")) } {
            Err(Error::Plugin { message, .. }) => message,
            other => format!("{other:?}"),
        }
    };
    assert!(refuse(&|t| t.abi_major = 2).contains("version 2.0 of the engine ABI"));
    let cut = refuse(&|t| t.size = 96);
    assert!(cut.contains("cut short: 96 bytes"), "{cut}");
    assert!(refuse(&|t| t.rollout = None).contains("`rollout` (NULL)"));
    assert!(refuse(&|t| t.save = None).contains("`save` (NULL)"));
    assert!(refuse(&|t| t.name = std::ptr::null()).contains("name is missing"));
    assert!(refuse(&|t| t.name = c"My Engine".as_ptr()).contains("`My Engine` is no name"));
    assert!(refuse(&|t| t.version = c"\xff".as_ptr()).contains("not UTF-8"));
    // SAFETY: null is allowed.
    let null = unsafe { Engine::from_table(std::ptr::null(), Path::new("lib.so")) };
    assert!(null.unwrap_err().to_string().contains("NULL"));
    // A larger table of a later minor version is read as far as it is known.
    assert!(refuse(&|t| (t.abi_minor, t.size) = (7, t.size + 64)).starts_with("Ok"));
    // Optional functions may be omitted.
    assert!(
        refuse(&|t| {
            t.capabilities &= !Capabilities::EXACT_SNAPSHOT.bits();
            (
                t.save,
                t.restore,
                t.destroy_snapshot,
                t.copy_state,
                t.layout,
            ) = (None, None, None, None, None);
        })
        .starts_with("Ok")
    );
}
