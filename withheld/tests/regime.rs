//! Regimes of motion against closed forms: a fall, a turning pendulum, a servo at its limit.

use asid_withheld::anatomy::Anatomy;
use asid_withheld::gap::Refit;
use asid_withheld::machine::{Half, Machine};
use asid_withheld::motion::Motion;
use asid_withheld::regime::{Watch, places};
use asid_withheld::simulate::watched;
use asid_withheld::world::World;

/// Gravity, m/s².
const G: f64 = 9.81;
/// Rows of an episode, 10 ms apart.
const ROWS: usize = 101;

fn machine(model: &'static str, noise: &'static [(&'static str, f64)]) -> Anatomy {
    let machine = Machine {
        name: "under test",
        about: "",
        half: Half::Training,
        model,
        parameters: &[],
        noise,
        commands: &[],
        starts: &[],
        contacts: &[],
        seconds: 1.0,
        rate: 100.0,
    };
    Anatomy::of(&machine).expect("a model")
}

/// Regimes of all sensors at all rows.
fn regimes(anatomy: &Anatomy, qpos: &[f64], command: impl Fn(usize) -> f64) -> Vec<String> {
    let motions = [Motion {
        qpos: qpos.to_vec(),
        qvel: vec![0.0; anatomy.nv],
        commands: (0..ROWS * anatomy.drives.len()).map(command).collect(),
        rows: ROWS,
        period: 0.01,
    }];
    let mut world = World::new(anatomy, &[], 5e-4, "implicitfast").expect("a world");
    let mut watch = Watch::new(anatomy, &motions);
    let look = &mut |sim: &_, step| watch.look(sim, step);
    watched(anatomy, &mut world, &motions, look).expect("a run");
    watch.regimes()
}

const BALL: &str = r#"<mujoco><option timestep="0.001"/><worldbody><geom name="floor" type="plane" size="1 1 1"/>
    <body name="ball" pos="0 0 1"><freejoint name="ball"/><geom name="ball" type="sphere" size="0.1" mass="1"/></body></worldbody>
    <sensor><framepos name="p" objtype="xbody" objname="ball"/><framequat name="r" objtype="xbody" objname="ball"/></sensor></mujoco>"#;

#[test]
fn a_ball_is_free_until_it_has_fallen_to_the_floor() {
    let anatomy = machine(BALL, &[("p", 0.001), ("r", 0.001)]);
    let drop = 0.4;
    let found = regimes(
        &anatomy,
        &[0.0, 0.0, 0.1 + drop, 1.0, 0.0, 0.0, 0.0],
        |_| 0.0,
    );
    assert_eq!(found.len(), 2 * ROWS);
    // The ball lands at sqrt(2 h / g), known to one row.
    let lands = ((2.0 * drop / G).sqrt() * 100.0).ceil() as usize;
    for (row, both) in found.chunks_exact(2).enumerate() {
        let expected = match row {
            // Three hundredths of the episode.
            0..4 => "start",
            r if r < lands => "free",
            // The contact gives way, and the ball stays on the ground.
            r if r > lands + 1 => "contact ball/world",
            _ => continue,
        };
        assert_eq!(both, [expected; 2], "row {row}");
    }
}

const PENDULUM: &str = r#"<mujoco><option timestep="0.001"/><worldbody><body name="rod"><joint name="j" axis="0 1 0"/>
    <inertial pos="0 0 -0.25" mass="1" diaginertia="1e-6 1e-6 1e-6"/></body></worldbody>
    <sensor><jointpos name="q" joint="j"/></sensor></mujoco>"#;

#[test]
fn a_pendulum_turns_round_twice_in_a_period() {
    let anatomy = machine(PENDULUM, &[("q", 0.001)]);
    let found = regimes(&anatomy, &[0.05], |_| 0.0);
    // The period 2 pi sqrt(l / g) is 1.003 s. The pendulum reverses after half a period and at the
    // end of the episode.
    let half = std::f64::consts::PI * (0.25 / G).sqrt() * 100.0;
    for (row, regime) in found.iter().enumerate() {
        // The speed is sin(pi t / T) of the largest, with half a period T. It is below 0.03 for
        // 0.03 / pi of T, half a row, to each side.
        let near = (row as f64 - half).abs();
        match regime.as_str() {
            "reversal" => assert!(near < 1.0, "row {row}"),
            "standing" => assert!(row >= ROWS - 2, "row {row}"),
            "start" => assert!(row < 4),
            other => assert_eq!(other, "moving", "row {row}"),
        }
    }
    assert!(found.iter().any(|r| r == "reversal"));
}

const SERVO: &str = r#"<mujoco><option timestep="0.001" gravity="0 0 0"/><worldbody><body name="rod"><joint name="j" axis="0 1 0" damping="1"/>
    <geom size="0.1" pos="0 0 -0.25"/></body></worldbody><actuator><position name="s" joint="j" kp="10" forcerange="-2 2"/></actuator>
    <sensor><jointpos name="q" joint="j"/></sensor></mujoco>"#;

#[test]
fn a_servo_is_saturated_while_its_error_asks_for_more_than_its_force() {
    let anatomy = machine(SERVO, &[("q", 0.001)]);
    // The servo holds its position, then gets a step of 3 rad. It saturates beyond 2 N m / 10 N
    // m/rad.
    let found = regimes(&anatomy, &[0.0], |row| if row < 50 { 0.0 } else { 3.0 });
    assert!(found[4..49].iter().all(|r| r == "standing"), "{found:?}");
    assert!(found[51..60].iter().all(|r| r == "saturated"), "{found:?}");
}

#[test]
fn shares_of_places_are_those_of_the_squared_residual() {
    let anatomy = machine(BALL, &[("p", 0.001), ("r", 0.001)]);
    // Two rows of p.0 p.1 p.2 r.0 r.1 r.2 r.3.
    let mut residual = vec![0.0; 14];
    (residual[0], residual[7], residual[13]) = (1.0, 2.0, 1.0);
    let left = Refit {
        values: Vec::new(),
        excess: 1.0,
        residual,
    };
    let regimes = ["free", "free", "contact a/b", "free"].map(str::to_owned);
    let found: Vec<(String, String, f64)> = places(&anatomy, &left, &regimes)
        .into_iter()
        .map(|p| (p.signal, p.regime, p.share))
        .collect();
    let place = |s: &str, r: &str, x: f64| (s.to_owned(), r.to_owned(), x);
    assert_eq!(found[0], place("p.0", "contact a/b", 4.0 / 6.0));
    assert_eq!(found.len(), 3);
    assert!(found.contains(&place("p.0", "free", 1.0 / 6.0)));
    assert!(found.contains(&place("r.3", "free", 1.0 / 6.0)));
}
