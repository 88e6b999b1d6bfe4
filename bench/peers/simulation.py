"""Many simulations of one scene, each with its own value of the unknowns, stepped by MuJoCo's own threads.

Two of MuJoCo's interfaces do it: `mujoco.rollout` over a list of models, and `mujoco.batch`. Both take all simulations of a
control step in as few calls as they allow. The third is `mj_step` called from Python, for a single environment.
"""

import copy

import mujoco
import numpy as np
from mujoco import rollout

FULL = mujoco.mjtState.mjSTATE_FULLPHYSICS.value


class MassProperties:
    """Mass properties of a body as functions of a geom's coordinate.

    The first moment is linear in it and the second moment about the body's frame quadratic, so that three compiled models
    tell all: an episode then costs no compilation.
    """

    def __init__(self, spec, geom, index):
        spec = spec.copy()
        element = spec.geom(geom)
        self.body = element.parent.name
        points, first, second = (-0.1, 0.0, 0.1), [], []
        for value in points:
            element.pos[index] = value
            body = spec.compile().body(self.body)
            self.mass, center = float(body.mass[0]), body.ipos
            turn = np.empty(9)
            mujoco.mju_quat2Mat(turn, body.iquat)
            turn = turn.reshape(3, 3)
            first.append(center)
            second.append(turn @ np.diag(body.inertia) @ turn.T + self._shift(center[None])[0])
        self.center = np.polynomial.polynomial.polyfit(points, np.array(first), 1)
        self.moment = np.polynomial.polynomial.polyfit(points, np.array(second).reshape(3, 9), 2)

    def _shift(self, center):
        square = (center**2).sum(axis=1)[:, None, None] * np.eye(3)
        return self.mass * (square - center[:, :, None] * center[:, None, :])

    def at(self, values):
        """Centre (n x 3), principal moments (n x 3) and their orientation (n x 4)."""
        center = np.polynomial.polynomial.polyval(values, self.center).T
        moment = np.polynomial.polynomial.polyval(values, self.moment).T.reshape(-1, 3, 3) - self._shift(center)
        principal, axes = np.linalg.eigh(moment)
        axes[:, :, 0] *= np.sign(np.linalg.det(axes))[:, None]
        quaternions = np.empty((len(values), 4))
        for quaternion, matrix in zip(quaternions, axes):
            mujoco.mju_mat2Quat(quaternion, matrix.ravel())
        return center, principal, quaternions


class Fields:
    """Model fields (name, row, values) that the unknowns decide."""

    def __init__(self, problem):
        self.problem = problem
        self.masses = [
            MassProperties(problem.spec, u.geom, u.index) if u.attribute == "pos" else None for u in problem.unknowns
        ]
        self.derived = any(self.masses)

    def of(self, theta):
        """For values `theta` (n x unknowns)."""
        out = []
        for column, unknown, mass in zip(theta.T, self.problem.unknowns, self.masses):
            geom = self.problem.model.geom(unknown.geom).id
            name = f"geom_{unknown.attribute}"
            out.append((name, (geom, unknown.index), column))
            if mass:
                body = self.problem.model.body(mass.body).id
                center, principal, quaternions = mass.at(column)
                out += [("body_ipos", body, center), ("body_inertia", body, principal), ("body_iquat", body, quaternions)]
        return out


def write(models, fields):
    """Writes the fields of `Fields.of` into one model each."""
    for name, row, values in fields:
        for model, value in zip(models, values):
            getattr(model, name)[row] = value


class StepSimulations:
    """`mujoco.mj_step`: one simulation after the other, a frame a call."""

    name = "mj_step"

    def __init__(self, problem, n):
        self.problem, self.n = problem, n
        self.fields = Fields(problem)
        self.models = [copy.copy(problem.model) for _ in range(n)]
        self.data = [mujoco.MjData(model) for model in self.models]

    def begin(self, theta, qpos):
        write(self.models, self.fields.of(theta))
        for model, data, row in zip(self.models, self.data, qpos):
            if self.fields.derived:
                mujoco.mj_setConst(model, data)
            mujoco.mj_resetData(model, data)
            data.qpos[:] = row

    def step(self, control):
        p = self.problem
        out = np.empty((self.n, p.frames, p.model.nq))
        for i, (model, data) in enumerate(zip(self.models, self.data)):
            for frame in range(p.frames):
                data.ctrl[:] = control[i, frame]
                mujoco.mj_step(model, data, nstep=p.substeps)
                out[i, frame] = data.qpos
        return out


class RolloutSimulations:
    """`mujoco.rollout`: a model a simulation, a control step a call."""

    name = "mujoco.rollout"

    def __init__(self, problem, n):
        self.problem, self.n = problem, n
        self.fields = Fields(problem)
        self.models = [copy.copy(problem.model) for _ in range(n)]
        self.data = [mujoco.MjData(problem.model) for _ in range(problem.threads)]
        self.pool = rollout.Rollout(nthread=problem.threads)
        width = mujoco.mj_stateSize(problem.model, FULL)
        self.state = np.zeros((n, width))
        self.steps = problem.frames * problem.substeps
        self.states = np.empty((n, self.steps, width))
        self.sensors = np.empty((n, self.steps, problem.model.nsensordata))

    def begin(self, theta, qpos):
        """Starts at unknowns `theta` (n x d) and positions `qpos` (n x nq), at rest."""
        write(self.models, self.fields.of(theta))
        if self.fields.derived:
            for model in self.models:
                mujoco.mj_setConst(model, self.data[0])
        self.state[:] = 0.0
        self.state[:, 1 : 1 + self.problem.model.nq] = qpos

    def step(self, control):
        """A control step with commands (n x frames x nu); positions at the ends of frames (n x frames x nq)."""
        p = self.problem
        self.pool.rollout(
            self.models,
            self.data,
            self.state,
            np.repeat(control, p.substeps, axis=1),
            skip_checks=True,
            nstep=self.steps,
            state=self.states,
            sensordata=self.sensors,
        )
        self.state[:] = self.states[:, -1]
        return self.states[:, p.substeps - 1 :: p.substeps, 1 : 1 + p.model.nq].copy()


class BatchSimulations:
    """`mujoco.batch`: expanded model fields, a frame a call."""

    name = "mujoco.batch"

    def __init__(self, problem, n):
        from mujoco.batch import Batch

        self.problem, self.n = problem, n
        self.fields = Fields(problem)
        self.batch = Batch(problem.model, n, problem.threads)
        self.qpos, self.ctrl = self.batch.bind("qpos"), self.batch.bind("ctrl")

    def begin(self, theta, qpos):
        for name, row, values in self.fields.of(theta):
            row = row if isinstance(row, tuple) else (row,)
            self.batch.expand(name)[(slice(None), *row)] = values
        if self.fields.derived:
            self.batch.set_const()
        self.batch.reset(stage=mujoco.mjtStage.mjSTAGE_NONE.value)
        self.qpos[:] = qpos

    def step(self, control):
        p = self.problem
        out = np.empty((self.n, p.frames, p.model.nq))
        for frame in range(p.frames):
            self.ctrl[:] = control[:, frame]
            self.batch.step(nstep=p.substeps)
            out[:, frame] = self.qpos
        return out


INTERFACES = {kind.name: kind for kind in (RolloutSimulations, BatchSimulations, StepSimulations)}
