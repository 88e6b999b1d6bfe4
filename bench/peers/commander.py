"""The hand's commander: differential inverse kinematics by damped least squares on the commanded joints, vectorised.

The formulas are those of ASID's `CartesianController` and `Steering`, for all episodes of a batch at once, so that Python's
cost a call is shared by them. Feed-forward: commands depend on the actions alone, and one set serves all copies of an
episode.
"""

from dataclasses import dataclass

import mujoco
import numpy as np

import rotation

DAMPING = 0.02
GAIN = 10.0
POSTURE_GAIN = 1.0
MAX_ACCELERATION = 5.0
MAX_JOINT_SPEED = 2.175


@dataclass(frozen=True)
class Workspace:
    """Where the hand may go, m, and how far in a control step."""

    x: tuple
    y: tuple
    max_step: float = 0.04
    reach: float = 0.74


WORKSPACES = {
    "rod-balancing": Workspace(x=(0.30, 0.70), y=(-0.4, 0.4)),
    "sphere-striking": Workspace(x=(0.30, 0.70), y=(-0.46, 0.26)),
}


class Chain:
    """Hinges from the world to a site."""

    def __init__(self, model, site):
        site = model.site(site)
        body, path = int(site.bodyid[0]), []
        while body > 0:
            path.append(body)
            body = int(model.body_parentid[body])
        self.links, self.qpos, self.joints = [], [], []
        for body in reversed(path):
            count, joint = model.body_jntnum[body], model.body_jntadr[body]
            if count > 1 or (count and model.jnt_type[joint] != mujoco.mjtJoint.mjJNT_HINGE):
                raise ValueError("a chain has one hinge a body")
            hinge = None
            if count:
                self.joints.append(int(joint))
                self.qpos.append(int(model.jnt_qposadr[joint]))
                axis = model.jnt_axis[joint]
                cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
                hinge = (model.jnt_pos[joint].copy(), axis.copy(), cross, cross @ cross)
            pose = (model.body_pos[body].copy(), rotation.to_matrix(model.body_quat[body]))
            self.links.append((*pose, hinge))
        self.tip = site.pos.copy()
        self.range = model.jnt_range[self.joints]

    def forward(self, q):
        """Position (n x 3), rotation (n x 3 x 3) and Jacobian (n x 6 x joints) of the site at joints `q` (n x joints)."""
        n = len(q)
        turn, at = np.broadcast_to(np.eye(3), (n, 3, 3)), np.zeros((n, 3))
        anchors, axes, k = [], [], 0
        for offset, rest, hinge in self.links:
            at = at + turn @ offset
            turn = turn @ rest
            if hinge is None:
                continue
            anchor, axis, cross, square = hinge
            anchors.append(at + turn @ anchor)
            axes.append(turn @ axis)
            s, c = np.sin(q[:, k, None, None]), 1.0 - np.cos(q[:, k, None, None])
            turn = turn + s * (turn @ cross) + c * (turn @ square)
            at = anchors[-1] - turn @ anchor
            k += 1
        position = at + turn @ self.tip
        axes = np.stack(axes, axis=-1)
        arms = position[:, :, None] - np.stack(anchors, axis=-1)
        linear = np.cross(axes, arms, axis=1)
        return position, turn, np.concatenate([linear, axes], axis=1)


class EngineChain(Chain):
    """The same for one posture, by MuJoCo itself: what a single environment does."""

    def __init__(self, model, site):
        super().__init__(model, site)
        self.model, self.data, self.site = model, mujoco.MjData(model), model.site(site).id
        self.jacobian = np.zeros((6, model.nv))
        self.dofs = model.jnt_dofadr[self.joints]

    def forward(self, q):
        self.data.qpos[self.qpos] = q[0]
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)
        mujoco.mj_jacSite(self.model, self.data, self.jacobian[:3], self.jacobian[3:], self.site)
        position, turn = self.data.site_xpos[self.site], self.data.site_xmat[self.site].reshape(3, 3)
        return position[None].copy(), turn[None].copy(), self.jacobian[None, :, self.dofs]


def chain_to_hand(problem, n):
    """The hand's kinematics for `n` postures at once, in the way that is quickest for as many."""
    return (EngineChain if n == 1 else Chain)(problem.model, "ee")


class Commander:
    """Commands of `n` episodes."""

    def __init__(self, problem, n):
        model = problem.model
        self.workspace = WORKSPACES[problem.task]
        self.chain = chain_to_hand(problem, n)
        self.dt, self.frames, self.n = problem.frame_period, problem.frames, n
        self.largest = problem.action[:, 1]
        self.home = problem.home_qpos[self.chain.qpos]
        position, turn, _ = self.chain.forward(self.home[None])
        self.home_position, self.home_turn = position[0], turn[0]
        self.ctrl = problem.home_ctrl
        # A servo trails its command by (kv + damping) / kp seconds; commands lead by as much.
        self.actuators = [
            next(i for i in range(model.nu) if model.actuator_trnid[i, 0] == joint) for joint in self.chain.joints
        ]
        dofs = model.jnt_dofadr[self.chain.joints]
        gains, biases = model.actuator_gainprm[self.actuators], model.actuator_biasprm[self.actuators]
        self.lead = (model.dof_damping[dofs] - biases[:, 2]) / gains[:, 0]
        self.ctrl_range = model.actuator_ctrlrange[self.actuators]
        self.reset()

    def reset(self):
        self.q = np.tile(self.home, (self.n, 1))
        self.position = np.tile(self.home_position, (self.n, 1))
        self.velocity = np.zeros((self.n, 3))

    def commands(self, actions):
        """Commands (n x frames x nu) of a control step; actions are displacements in the plane, m."""
        way = np.zeros((self.n, 3))
        way[:, :2] = np.clip(actions, -self.largest, self.largest)
        length = np.linalg.norm(way, axis=1, keepdims=True)
        way *= np.minimum(self.workspace.max_step / np.maximum(length, 1e-12), 1.0)
        wanted = way / (self.frames * self.dt)
        out = np.tile(self.ctrl, (self.n, self.frames, 1))
        for frame in range(self.frames):
            out[:, frame, self.actuators] = self._follow(self._next(wanted))
        return out

    def _next(self, wanted):
        """Where the reference is after a frame, within the largest acceleration and the workspace."""
        change, limit = wanted - self.velocity, MAX_ACCELERATION * self.dt
        size = np.linalg.norm(change, axis=1, keepdims=True)
        change = change * np.minimum(limit / np.maximum(size, 1e-12), 1.0)
        at = self.position + (self.velocity + change) * self.dt
        at[:, 0] = np.clip(at[:, 0], *self.workspace.x)
        at[:, 1] = np.clip(at[:, 1], *self.workspace.y)
        shrink = np.minimum(self.workspace.reach / np.hypot(at[:, 0], at[:, 1]), 1.0)
        at[:, :2] *= shrink[:, None]
        return at

    def _follow(self, target):
        """Moves the joints towards `target` (n x 3) within a frame: J^T (J J^T + damping^2)^-1, and home besides."""
        dt = self.dt
        self.velocity = (target - self.position) / dt
        position, turn, jacobian = self.chain.forward(self.q)
        linear = self.velocity + GAIN * (self.position - position)
        angular = GAIN * rotation.matrix_to_vector(self.home_turn @ np.swapaxes(turn, 1, 2))
        posture = POSTURE_GAIN * (self.home - self.q)
        error = np.concatenate([linear, angular], axis=1)[:, :, None] - jacobian @ posture[:, :, None]
        transposed = np.swapaxes(jacobian, 1, 2)
        gram = jacobian @ transposed + DAMPING**2 * np.eye(6)
        speed = posture + (transposed @ np.linalg.solve(gram, error))[:, :, 0]
        fastest = np.abs(speed).max(axis=1, keepdims=True)
        scale = np.minimum(MAX_JOINT_SPEED / np.maximum(fastest, 1e-12), 1.0)
        before = self.q
        self.q = np.clip(before + scale * speed * dt, *self.chain.range.T)
        ctrl = before + (self.q - before) / dt * (dt / 2.0 + self.lead)
        # Where the joints are too slow the reference waits for them.
        self.position = self.position + (target - self.position) * scale
        self.velocity = self.velocity * scale
        return np.clip(ctrl, *self.ctrl_range.T)
