"""The machines and effects that :mod:`exported` measures: each effect that MJCF can say, at a machine in which it matters."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

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
    Case("arm", ("geometry@lower:x=0.02,z=-0.01,turn_x=0.1,turn_z=-0.05",)),
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
