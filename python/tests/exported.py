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

from exported_cases import CASES, MACHINES, NOISE, PERIOD, ROWS, TIMESTEP, Case, Machine

from asid.program import call

#: The noise's.
SEED = 1
#: Two logs, whose commands differ in speed.
EPISODES = (0, 1)


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
