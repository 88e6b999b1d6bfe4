"""Exported MJCF in MuJoCo's own Python package: one small machine an effect, and the gaps of both models on the same log.

    target/python/tests/bin/python python/tests/exported.py     # the table of docs/any-machine.md

``asid export`` writes the refined model as MJCF. The package ``mujoco`` loads that document and records a log with it,
with noise of a seed. Then two replays of this log are measured: the document's, by the package, and the refined model's, by ASID,
which integrates the effect by its own law. A gap is the root mean square of what is off, in units of the noise, so that a
right model has 1, and two models that are ``d`` deviations apart have 1 and the root of 1 + d².
"""

from __future__ import annotations

import json
import math
import tempfile
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from asid.program import call

#: Two links that hang: the shoulder by a torque, the elbow by a servo.
ARM = """<mujoco><option timestep="0.002" integrator="implicitfast"/>
  <default><joint damping="0.05" armature="0.01"/><geom type="capsule" size="0.02"/></default>
  <worldbody><body name="upper" pos="0 0 1"><joint name="shoulder" axis="0 1 0" limited="true" range="-170 170"/>
    <geom name="upper" fromto="0 0 0 0 0 -0.3" mass="0.6"/>
    <body name="lower" pos="0 0 -0.3"><joint name="elbow" axis="0 1 0"/>
      <geom name="lower" fromto="0 0 0 0 0 -0.3" mass="0.4"/></body></body></worldbody>
  <actuator><motor name="push" joint="shoulder" gear="2" ctrllimited="true" ctrlrange="-2 2"/>
    <position name="hold" joint="elbow" kp="8" kv="0.4" ctrllimited="true" ctrlrange="-2 2"/></actuator>
  <sensor><jointpos name="q1" joint="shoulder"/><jointpos name="q2" joint="elbow"/>
    <jointvel name="v1" joint="shoulder"/><jointvel name="v2" joint="elbow"/>
    <framepos name="tip" objtype="geom" objname="lower"/></sensor></mujoco>
"""

#: A puck that falls 20 mm onto a soft board, bounces and slides.
PUCK = """<mujoco><option timestep="0.002"/><worldbody>
  <geom name="board" type="plane" size="2 2 0.1" solref="0.04 0.3" friction="0.3 0.005 0.0001"/>
  <body name="puck" pos="0 0 0.02"><freejoint name="slide"/>
    <geom name="puck" type="cylinder" size="0.05 0.02" mass="0.2" solref="0.04 0.3"
      friction="0.3 0.005 0.0001"/></body></worldbody>
  <sensor><framepos name="place" objtype="body" objname="puck"/>
    <framelinvel name="speed" objtype="body" objname="puck"/></sensor></mujoco>
"""

#: A ball that rolls and spins, with friction against both.
BALL = """<mujoco><option timestep="0.002"/><worldbody>
  <geom name="board" type="plane" size="9 9 0.1" condim="6" friction="0.6 0.02 0.004"/>
  <body name="ball" pos="0 0 0.05"><freejoint name="roll"/>
    <geom name="ball" type="sphere" size="0.05" mass="0.2" condim="6" friction="0.6 0.02 0.004"/></body></worldbody>
  <sensor><framepos name="place" objtype="body" objname="ball"/>
    <frameangvel name="turn" objtype="body" objname="ball"/></sensor></mujoco>
"""

#: Deviations of the readings: an encoder's and a tracker's millimetre or milliradian, and their speeds over 0.1 s.
NOISE = {"q1": 1e-3, "q2": 1e-3, "v1": 1e-2, "v2": 1e-2, "tip": 1e-3, "place": 1e-3, "speed": 1e-2, "turn": 1e-2}

#: Rows of a log, and the time between two of them, s.
ROWS, PERIOD = 200, 0.01
#: Time step of the machines, s.
TIMESTEP = 0.002
#: The noise's.
SEED = 1
#: Two logs, whose commands differ in speed.
EPISODES = (0, 1)


@dataclass(frozen=True)
class Machine:
    """A model without the effect, and where its logs begin."""

    xml: str
    qpos: dict[str, list[float]]
    qvel: dict[str, list[float]]

    def commands(self, model: mujoco.MjModel, episode: int) -> np.ndarray:
        """The push begins at its most, the servo where its joint is, so that nothing between them is stretched."""
        t = PERIOD * np.arange(ROWS) * (4 + 2 * episode)
        return np.stack([0.9 * np.cos(t), 0.9 * np.sin(t)], axis=1)[:, : model.nu]


#: Distance of two replays, in units of the noise, that tells nothing: rounding, and the difference of two roots near 1.
SAME = 0.05

MACHINES = {
    "arm": Machine(ARM, {"shoulder": [0.0], "elbow": [0.0]}, {"shoulder": [0.0], "elbow": [0.0]}),
    "puck": Machine(PUCK, {"slide": [0, 0, 0.04, 1, 0, 0, 0]}, {"slide": [0.8, 0.1, 0, 0, 0, 0]}),
    "ball": Machine(BALL, {"roll": [0, 0, 0.05, 1, 0, 0, 0]}, {"roll": [0.8, 0, 0, 0, 16, 20]}),
}

@dataclass(frozen=True)
class Case:
    """Effects at a machine, and values of its model."""

    machine: str
    effects: tuple[str, ...]
    values: tuple[tuple[str, float], ...] = ()
    #: Most distance of the two replays, in units of the noise, where the document says another law than the effect.
    most: float = SAME
    #: What differs then.
    why: str = ""

    @property
    def name(self) -> str:
        """The effects and values, for the table."""
        return ", ".join(f"`{part}`" for part in [*self.effects, *(f"{t} = {x}" for t, x in self.values)])


LAG = "half a time step: MuJoCo takes the filter at the start of a step, not its mean"
FRICTION = "MuJoCo's friction is a soft constraint, which creeps where the joint stops"

CASES = [
    Case("arm", ("viscous-friction@shoulder:damping=0.3",)),
    Case("arm", ("armature@elbow:inertia=0.02",)),
    Case("arm", ("mass@upper:factor=1.4",)),
    Case("arm", ("inertia@upper:factor=1.5",)),
    Case("arm", ("center-of-mass@lower:x=0.01,z=-0.03",)),
    Case("arm", ("payload@lower:mass=0.2,moment_z=-0.02",)),
    Case("arm", ("gravity-tilt:pitch=0.1,roll=-0.05",)),
    Case("arm", ("constant-force@lower:z=1.5",)),
    Case("arm", ("servo-stiffness@hold:factor=0.6",)),
    Case("arm", ("servo-damping@hold:damping=0.2",)),
    Case("arm", ("joint-stiffness@shoulder:stiffness=3,rest=0.4",)),
    Case("arm", ("joint-stiffness@elbow:stiffness=2,rest=-0.3,cubic=4",)),
    Case("arm", ("actuator-gain@push:gain=0.7",)),
    Case("arm", ("actuator-gain@hold:gain=0.8",)),
    Case("arm", ("actuator-bias@push:bias=0.2",)),
    Case("arm", ("actuator-bias@hold:bias=-0.1",)),
    Case("arm", ("actuator-saturation@push:limit=1.1",)),
    Case("arm", ("actuator-saturation@hold:limit=0.9",)),
    Case("arm", ("actuator-delay@push:delay=0.013",)),
    Case("arm", ("actuator-delay@hold:delay=0.0305",)),
    Case("arm", ("actuator-lag@push:time_constant=0.1",), most=8, why=LAG),
    Case("arm", ("actuator-lag@hold:time_constant=0.1",), most=2, why=LAG),
    Case("arm", ("sensor-delay@q1:delay=0.02",)),
    Case("arm", ("sensor-delay@v2:delay=0.013",), most=1.5, why="between rows: ASID has a cubic through four rows, MuJoCo its steps"),
    Case("arm", ("coulomb-friction@shoulder:force=0.4",), most=1.5, why=FRICTION),
    Case("arm", ("stribeck-friction@shoulder:coulomb=0.4",), most=1.5, why=FRICTION),
    Case("arm", ("stribeck-friction@shoulder:breakaway=0.2,coulomb=0.4",), most=8, why="what holds at rest beyond the sliding friction is left out"),
    Case("arm", ("backlash@elbow:width=0.1",), most=8, why="impacts at the ends of the gap come a time step earlier or later"),
    Case("arm", ("joint-compliance@elbow:compliance=0.05",), most=0.2, why="another integration of the same spring"),
    Case("puck", ("sliding-friction@board:factor=0.5",)),
    Case("puck", ("contact-stiffness@board:factor=0.5",)),
    Case("puck", ("contact-restitution@board:factor=0.5",)),
    Case("ball", ("torsional-friction@board:factor=0.5",)),
    Case("ball", ("rolling-friction@board:factor=0.5",)),
    Case(
        "arm",
        ("actuator-gain@hold:gain=0.9", "actuator-delay@hold:delay=0.01", "joint-stiffness@shoulder:stiffness=1,rest=0.5"),
        (("joint/shoulder/damping", 0.2), ("actuator/hold/kp", 11.0), ("geom/upper/mass", 0.8)),
    ),
]


def begin(model: mujoco.MjModel, machine: Machine, first: np.ndarray) -> mujoco.MjData:
    """The start of a log: its state, and what remembers has seen nothing but the first command and the first readings."""
    data = mujoco.MjData(model)
    for name, qpos in machine.qpos.items():
        joint = model.joint(name)
        at, speed = joint.qposadr[0], joint.dofadr[0]
        data.qpos[at : at + len(qpos)] = qpos
        data.qvel[speed : speed + len(machine.qvel[name])] = machine.qvel[name]
    for i in range(model.nu):
        if model.actuator_historyadr[i] >= 0:
            held = np.full((model.actuator_history[i, 0], 1), first[i])
            mujoco.mj_initCtrlHistory(model, data, i, None, held)
        if model.actuator_actadr[i] >= 0:
            data.act[model.actuator_actadr[i]] = first[i]
    delays = model.sensor_delay.copy()
    if delays.any():
        model.sensor_delay[:] = 0
        fresh = mujoco.MjData(model)
        fresh.qpos[:], fresh.qvel[:] = data.qpos, data.qvel
        mujoco.mj_forward(model, fresh)
        model.sensor_delay[:] = delays
        for i in np.flatnonzero(model.sensor_historyadr >= 0):
            at, size = model.sensor_adr[i], model.sensor_dim[i]
            held = np.tile(fresh.sensordata[at : at + size], (model.sensor_history[i, 0], 1))
            mujoco.mj_initSensorHistory(model, data, i, None, held, 0.0)
    return data


def replay(document: Path, machine: Machine, episode: int) -> dict[str, np.ndarray]:
    """Readings of each sensor at the rows of a log: of the state before the row's command acts."""
    model = mujoco.MjModel.from_xml_path(str(document))
    commands = machine.commands(model, episode)
    data = begin(model, machine, commands[0])
    read = {model.sensor(i).name: [] for i in range(model.nsensor)}
    for command in commands:
        data.ctrl[:] = command
        mujoco.mj_forward(model, data)
        for name, rows in read.items():
            rows.append(data.sensor(name).data.copy())
        mujoco.mj_step(model, data, round(PERIOD / model.opt.timestep))
    return {name: np.array(rows) for name, rows in read.items()}


def gap(logs: list[dict[str, np.ndarray]], replays: list[dict[str, np.ndarray]]) -> float:
    """Root mean square of what is off, in units of the noise."""
    pairs = zip(logs, replays, strict=True)
    off = [((log[name] - replayed[name]) / NOISE[name]).ravel() for log, replayed in pairs for name in log]
    return float(np.sqrt(np.mean(np.concatenate(off) ** 2)))


def write_log(path: Path, machine: Machine, commands: np.ndarray, names: list[str], log: dict[str, np.ndarray]) -> None:
    """The log as CSV, with the state that it begins in."""
    columns = {"time": [f"{PERIOD * k:.2f}" for k in range(ROWS)]}
    for i, name in enumerate(names):
        columns[f"ctrl.{name}"] = [repr(float(x)) for x in commands[:, i]]
    for name, rows in log.items():
        for k in range(rows.shape[1]):
            column = name if rows.shape[1] == 1 else f"{name}.{k}"
            columns[column] = [repr(float(x)) for x in rows[:, k]]
    for kind, state in [("qpos", machine.qpos), ("qvel", machine.qvel)]:
        for joint, values in state.items():
            for k, x in enumerate(values):
                column = f"{kind}.{joint}" if len(values) == 1 else f"{kind}.{joint}.{k}"
                columns[column] = [repr(float(x))] + [""] * (ROWS - 1)
    rows = [",".join(cells) for cells in zip(*columns.values(), strict=True)]
    path.write_text("\n".join([",".join(columns), *rows]) + "\n", encoding="utf-8")


def refined(case: Case, folder: Path, timestep: float) -> Path:
    """The machine with its effects, as ``asid diagnose`` writes it."""
    xml = MACHINES[case.machine].xml.replace(f'timestep="{TIMESTEP}"', f'timestep="{timestep}"')
    (folder / "nominal.xml").write_text(xml, encoding="utf-8")
    text = 'model = "nominal.xml"\n'
    for target, value in case.values:
        text += f'\n[[parameter]]\ntarget = "{target}"\nvalue = {value}\n'
    for spec in case.effects:
        name, _, values = spec.partition(":")
        effect, _, site = name.partition("@")
        pairs = [value.split("=") for value in values.split(",")]
        inner = ", ".join(f"{key} = {float(value)}" for key, value in pairs)
        text += f'\n[[effect]]\neffect = "{effect}"\nsite = "{site}"\nparameters = {{ {inner} }}\n'
    path = folder / "refined.toml"
    path.write_text(text, encoding="utf-8")
    return path


@dataclass(frozen=True)
class Row:
    """What was measured of a case: gaps on the logs, in units of the noise."""

    case: Case
    #: Of the machine without the effects.
    nominal: float
    #: Of the refined model, in ASID.
    refined: float
    #: Of the exported document, in MuJoCo's package.
    exported: float

    @property
    def apart(self) -> float:
        """Distance of the two replays. The noise is the same in both gaps."""
        return math.sqrt(abs(self.refined**2 - self.exported**2))


def measure(case: Case, folder: Path, timestep: float = TIMESTEP) -> Row:
    """Exports, records, and replays in both."""
    machine = MACHINES[case.machine]
    model, document = refined(case, folder, timestep), folder / "exported.xml"
    call(["export", model, "--mjcf", document])
    compiled = mujoco.MjModel.from_xml_path(str(document))
    names = [compiled.actuator(i).name for i in range(compiled.nu)]
    noise = np.random.default_rng(SEED)
    exact = [replay(document, machine, episode) for episode in EPISODES]
    without = [replay(folder / "nominal.xml", machine, episode) for episode in EPISODES]
    logs = [{name: rows + NOISE[name] * noise.standard_normal(rows.shape) for name, rows in e.items()} for e in exact]
    for episode, log in zip(EPISODES, logs, strict=True):
        write_log(folder / f"log_{episode}.csv", machine, machine.commands(compiled, episode), names, log)
    noises = "\n".join(f"{name} = {NOISE[name]}" for name in logs[0])
    text = f'model = "refined.toml"\ntrain = ["log_0.csv"]\ntest = ["log_1.csv"]\n\n[noise]\n{noises}\n'
    (folder / "study.toml").write_text(text, encoding="utf-8")
    gaps = json.loads(call(["export", folder, "--mjcf", folder / "again.xml", "--json"]))["gap"]
    return Row(
        case,
        nominal=gap(logs, without),
        # Both episodes have as many readings.
        refined=math.sqrt(sum(row["refined"] ** 2 for row in gaps) / len(gaps)),
        exported=gap(logs, exact),
    )


def main() -> None:
    """Prints the table."""
    print(f"MuJoCo {mujoco.__version__}, seed {SEED}\n")
    print("| effect | gap without it | refined model, ASID | exported, `mujoco` | apart | at half the time step | because |")
    print("|---|--:|--:|--:|--:|--:|---|")
    for case in CASES:
        rows = []
        for timestep in [TIMESTEP, TIMESTEP / 2]:
            with tempfile.TemporaryDirectory() as folder:
                rows.append(measure(case, Path(folder), timestep))
        row, finer = rows
        apart = f"{row.apart:.2f} | {finer.apart:.2f} | {case.why}"
        beyond = "" if row.apart <= case.most else f" **beyond {case.most}**"
        print(f"| {case.name} | {row.nominal:.1f} | {row.refined:.3f} | {row.exported:.3f} | {apart}{beyond} |", flush=True)


if __name__ == "__main__":
    main()
