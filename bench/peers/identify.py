"""Identification from a log with MuJoCo's own toolbox, `mujoco.sysid`, knowing what ASID's identifiers know.

The same readings are compared with the same weights (each difference divided by the tracker's noise, rotations as
rotations, the first reading included), the start pose is estimated along within the same bounds, and the prior is the same
box. The toolbox's start is the middle of the box and the pose that the first reading shows.
"""

import csv
import io
import time

import numpy as np
from mujoco import sysid

import rotation

# Bounds of the start pose around what the first reading shows, in deviations of that reading: ASID's.
START_BOUND = 6.0


class Log:
    """Commands and tracked readings of an episode whose rows are frames."""

    def __init__(self, problem, path):
        with open(path, encoding="utf-8") as file:
            rows = list(csv.reader(file))
        header, table = rows[0], np.array([[float(x or "nan") for x in row] for row in rows[1:]])
        column = {name: i for i, name in enumerate(header)}
        model = problem.model
        names = [model.actuator(i).name for i in range(model.nu)]
        self.frames = len(table) - 1
        control = table[:, [column[f"ctrl.{name}"] for name in names]]
        # Commands hold for a frame; the toolbox takes one a physics step, and ignores the last.
        self.control = np.concatenate([np.repeat(control[:-1], problem.substeps, axis=0), control[-1:]])
        self.times = np.arange(len(self.control)) * model.opt.timestep
        self.readings = [table[:, [column[f"{s.name}.{i}"] for i in range(s.length)]] for s in problem.signals]


def identify(problem, path, difference):
    """Fits; the estimates, their 95 % intervals, seconds, and simulations of the episode.

    `difference` is the step of the toolbox's finite differences in deviations of the prior or of the first reading; none
    leaves its default, 1.5e-8.
    """
    log = Log(problem, path)
    model = problem.model
    evaluations = 0
    begin, cpu = time.perf_counter(), time.process_time()
    parameters = _parameters(problem, log)
    control = sysid.TimeSeries(log.times, log.control)
    # The toolbox wants readings of all sensors; `differences` compares those that are tracked.
    measured = sysid.TimeSeries(
        log.times,
        np.zeros((len(log.times), model.nsensordata)),
        sysid.TimeSeries.compute_all_sensor_mapping(model),
    )
    home = sysid.create_initial_state(model, problem.home_qpos)
    sequences = sysid.ModelSequences(problem.task, problem.spec.copy(), "log", home, control, measured)

    def roll(models, datas, control_signal, initial_states, param_dicts, **mappings):
        nonlocal evaluations
        evaluations += len(models)
        starts = np.stack([_start(p) for p in param_dicts])
        states = np.tile(home, (len(models), 1))
        states[:, 1 : 1 + model.nq] = problem.place(starts)
        return sysid.sysid_rollout(models, datas, control_signal, list(states), **mappings)

    def differences(params, predicted, measured, _model, _all, state):
        first = problem.place(_start(params)[None])
        qpos = np.concatenate([first, state[problem.substeps - 1 :: problem.substeps, 1 : 1 + model.nq]])
        return _whitened(problem, qpos, log.readings), measured, measured

    residual = sysid.build_residual_fn(
        models_sequences=[sequences],
        custom_rollout=roll,
        modify_residual=differences,
        resample_true=False,
        n_threads=problem.threads,
    )
    options = {"output": io.StringIO()} | ({} if difference is None else {"eps": difference})
    found, result = sysid.optimize(parameters, residual, verbose=False, **options)
    seconds, cpu = time.perf_counter() - begin, time.process_time() - cpu
    vector = found.as_vector()
    final = residual(vector, found)[0]
    _, half = sysid.calculate_intervals(final, np.asarray(result.jac))
    half = np.asarray(half).ravel()
    out = []
    for i, unknown in enumerate(problem.unknowns):
        low, high = (unknown.from_scaled(vector[i] + s * half[i]) for s in (-1.0, 1.0))
        out.append({"estimate": float(unknown.from_scaled(vector[i])), "interval95": [float(low), float(high)]})
    deviation = float(np.sqrt(np.mean(np.concatenate(final) ** 2)))
    return {"parameters": out, "seconds": seconds, "cpu_seconds": cpu, "simulations": evaluations, "residual": deviation}


def _parameters(problem, log):
    """Unknowns and start pose, scaled to deviations of the prior and of the first reading: one step suits all."""
    parameters = sysid.ParameterDict()
    bound = problem.unknowns[0].to_scaled(problem.unknowns[0].high)
    for unknown in problem.unknowns:

        def write(spec, parameter, unknown=unknown):
            value = float(unknown.from_scaled(parameter.value[0]))
            getattr(spec.geom(unknown.geom), unknown.attribute)[unknown.index] = value

        parameters.add(sysid.Parameter(unknown.name, 0.0, -bound, bound, modifier=write))
    located = problem.locate(np.concatenate([r[0] for r in log.readings]))
    noise = np.array([problem.signals[1 if name == "yaw" else 0].noise for name in problem.start_names])
    start = sysid.Parameter("start", np.zeros(len(located)), -START_BOUND, START_BOUND)
    start.min_value, start.max_value = -START_BOUND * np.ones(len(located)), START_BOUND * np.ones(len(located))
    start.located, start.noise = located, noise
    parameters.add(start)
    return parameters


def _start(parameters):
    start = parameters["start"]
    return start.located + start.noise * start.value


def _whitened(problem, qpos, readings):
    parts = []
    for signal, observed in zip(problem.signals, readings):
        predicted = qpos[:, signal.at : signal.at + signal.length]
        if signal.length == 4:
            turn = rotation.multiply(predicted, rotation.conjugate(observed))
            parts.append(rotation.to_vector(turn) / signal.noise)
        else:
            parts.append((predicted - observed) / signal.noise)
    return np.concatenate(parts, axis=1)
