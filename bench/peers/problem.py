"""A problem as `asid-bench` describes it: the scene, the unknowns, the protocol and the settings of both sides.

Everything that decides how much work an environment step is comes from that description, so that it cannot differ from
what the Rust side does. What is written here a second time (the commander and where the hand may go) is compared with
reference episodes before anything is measured.
"""

import json
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

# Standard deviation of a uniform variable on [0, 1]; unknowns are scaled to unit deviation under their prior.
UNIFORM_STD = 1.0 / np.sqrt(12.0)
# Largest prior-scaled coordinate.
SCALED_BOUND = 0.5 / UNIFORM_STD


@dataclass
class Unknown:
    """A number of the scene with a uniform prior."""

    name: str
    geom: str
    attribute: str
    index: int
    low: float
    high: float

    def to_scaled(self, value):
        return ((value - self.low) / (self.high - self.low) - 0.5) / UNIFORM_STD

    def from_scaled(self, z):
        return self.low + np.clip(z * UNIFORM_STD + 0.5, 0.0, 1.0) * (self.high - self.low)


@dataclass
class Signal:
    """A tracked sensor: where its reading lies in `qpos`, and its noise (m, or rad for an orientation)."""

    name: str
    at: int
    length: int
    noise: float


class Problem:
    """A task with its scene compiled."""

    def __init__(self, path):
        folder = Path(path).parent
        with open(path, encoding="utf-8") as file:
            given = json.load(file)
        self.task = given["task"]
        self.threads = given["threads"]
        self.scene = str(folder / given["scene"])
        self.model = mujoco.MjModel.from_xml_path(self.scene)
        self.spec = mujoco.MjSpec.from_file(self.scene)
        self.unknowns = [_unknown(p) for p in given["parameters"]]
        self.action = np.array([c["range"] for c in given["action"]], float)
        self.start_names = [c["name"] for c in given["start"]]
        self.start = np.array([c["range"] for c in given["start"]], float)
        self.horizon = given["horizon"]
        self.frames = given["frames_per_step"]
        self.frame_period = given["frame_period"]
        self.substeps = round(self.frame_period / self.model.opt.timestep)
        self.signals = [_signal(self.model, s) for s in given["signals"]]
        fisher = given["fisher"]
        kind = (fisher["objective"], fisher["form"], fisher["nuisance"], fisher["roughness"])
        if kind != ("d-optimal", "trajectory", False, True):
            raise ValueError(f"objective, form, nuisance and roughness {kind} are not written here")
        self.delta = fisher["delta"]
        self.ppo = given["ppo"]
        self.environments = given["environments"]
        self.reference = {k: np.array(v, float) for k, v in given["reference"].items()}
        key = self.model.key(0)
        self.home_qpos, self.home_ctrl = key.qpos.copy(), key.ctrl.copy()

    def place(self, starts):
        """`qpos` (n x nq) of the home posture with the object at each start pose (n x coordinates)."""
        at = self.signals[0].at
        qpos = np.tile(self.home_qpos, (len(starts), 1))
        columns = {name: starts[:, i] for i, name in enumerate(self.start_names)}
        qpos[:, at], qpos[:, at + 1] = columns["x"], columns["y"]
        half = columns.get("yaw", np.zeros(len(starts))) / 2.0
        qpos[:, at + 3 : at + 7] = 0.0
        qpos[:, at + 3], qpos[:, at + 6] = np.cos(half), np.sin(half)
        return qpos

    def locate(self, reading):
        """The start pose that a tracked reading (its row) shows."""
        found = {"x": reading[0], "y": reading[1]}
        if "yaw" in self.start_names:
            w, x, y, z = reading[3:7]
            found["yaw"] = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
        return np.array([found[name] for name in self.start_names])


def _unknown(given):
    if given["element"] != "geom" or given["targets"] != 1 or not given["linear"]:
        raise ValueError(f"unknown {given['name']}: only one number of a geom with a linear prior is written here")
    low, high = given["range"]
    return Unknown(given["name"], given["object"], given["attribute"], given["index"], low, high)


def _signal(model, given):
    """A pose sensor of a free body's frame reads a part of `qpos`, without the lag of `sensordata` in a rollout."""
    sensor = model.sensor(given["sensor"])
    kind, is_frame = int(sensor.type[0]), int(sensor.objtype[0]) == mujoco.mjtObj.mjOBJ_XBODY
    parts = {int(mujoco.mjtSensor.mjSENS_FRAMEPOS): (0, 3), int(mujoco.mjtSensor.mjSENS_FRAMEQUAT): (3, 4)}
    joint = model.body_jntadr[int(sensor.objid[0])] if is_frame else -1
    if kind not in parts or joint < 0 or model.jnt_type[joint] != mujoco.mjtJoint.mjJNT_FREE:
        raise ValueError(f"sensor {given['sensor']} is not the position or orientation of a free body's frame")
    first, length = parts[kind]
    return Signal(given["sensor"], int(model.jnt_qposadr[joint]) + first, length, given["noise"])
