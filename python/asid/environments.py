"""Exploration episodes of every task as gymnasium environments: ``asid/RodBalancing-v0`` and so on.

An episode is one exploration of a task whose unknowns are drawn from the prior. A reward is the information that the step
tells about them, by the objective (``a-optimal``, ``d-optimal`` or ``trace``), so that an agent learns to move where it
learns the most. Observations are readings of the trackers with their noise, the share of the episode that is over, and
``-log`` of the standard deviation that each unknown is expected to have by now, in prior deviations.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from asid import _native
from asid.errors import UsageError

#: Largest seed that is drawn for the batch.
_SEEDS = 2**63

Floats = NDArray[np.float32]


def name(task: str) -> str:
    """The environment's name: ``asid/RodBalancing-v0`` of the task ``rod-balancing``."""
    return f"asid/{''.join(word.capitalize() for word in task.split('-'))}-v0"


def register() -> None:
    """Registers an environment for each task; one that is registered already stays as it is."""
    for task, _ in _native.tasks():
        if name(task) not in gymnasium.registry:
            gymnasium.register(
                id=name(task),
                entry_point="asid.environments:ExplorationEnv",
                vector_entry_point="asid.environments:ExplorationVectorEnv",
                kwargs={"task": task},
                # The horizon is part of the task and the time is observed: its end is an end, not a cut.
                max_episode_steps=None,
            )


def _spaces(episodes: _native.Episodes) -> tuple[Any, Any]:
    entries = sum(count for _, count in episodes.entries)
    observation = Box(-np.inf, np.inf, (entries,), np.float32)
    return observation, Box(-1.0, 1.0, (len(episodes.actions),), np.float32)


def _expected_std(episodes: _native.Episodes, observations: Floats) -> Floats:
    """The expected standard deviations that observations end with, in prior deviations."""
    result: Floats = np.exp(-observations[:, -len(episodes.unknowns) :])
    return result


class ExplorationEnv(gymnasium.Env[Floats, Floats]):
    """One episode at a time; a batch of many is several times faster an episode, see `ExplorationVectorEnv`.

    Args:
        task: name of the task.
        backend: engine, ``rapier`` (the default) or ``mujoco``.
        objective: what a step is paid for: ``a-optimal`` (the default), ``d-optimal`` or ``trace``.
        form: ``trajectory`` (the default) or ``one-step``: which derivative the information is made of.
        nuisance: whether the start pose is estimated along (the default).
        threads: threads of the simulator; 0 for one a core.
    """

    metadata: dict[str, Any] = {"render_modes": []}

    def __init__(
        self,
        task: str,
        *,
        backend: str | None = None,
        objective: str | None = None,
        form: str | None = None,
        nuisance: bool | None = None,
        threads: int = 1,
    ) -> None:
        self.episodes = _native.Episodes(
            task, 1, backend=backend, objective=objective, form=form, nuisance=nuisance, threads=threads
        )
        self.observation_space, self.action_space = _spaces(self.episodes)
        self._seeded = False

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Floats, dict[str, Any]]:
        """Begins an episode with unknowns and a start pose of its own; no options are known."""
        super().reset(seed=seed)
        if seed is not None or not self._seeded:
            self.episodes.seed(int(self.np_random.integers(_SEEDS)))
            self._seeded = True
        observations = self.episodes.reset()
        return observations[0], self._info(observations)

    def step(self, action: Floats) -> tuple[Floats, float, bool, bool, dict[str, Any]]:
        """One control step; the action's entries from -1 to 1 stand for the task's ranges."""
        actions = np.asarray(action, np.float32)[None]
        _, rewards, terminated, truncated, reached = self.episodes.step(actions)
        return reached[0], float(rewards[0]), bool(terminated[0]), bool(truncated[0]), self._info(reached)

    def _info(self, observations: Floats) -> dict[str, Any]:
        return {"expected_std": _expected_std(self.episodes, observations)[0]}


class ExplorationVectorEnv(VectorEnv[Floats, Floats, NDArray[Any]]):
    """A batch of episodes that the simulator steps as a whole, on all cores and without the interpreter's lock.

    All episodes have the task's horizon, so that they end and begin together, in the same step: ``info["final_obs"]`` has
    the last observations. An episode that diverges is terminated with a reward of 0, and stays so until the horizon.
    Arguments are those of `ExplorationEnv`, with ``num_envs`` episodes.
    """

    metadata: dict[str, Any] = {"render_modes": [], "autoreset_mode": AutoresetMode.SAME_STEP}

    def __init__(
        self,
        task: str,
        num_envs: int = 64,
        *,
        backend: str | None = None,
        objective: str | None = None,
        form: str | None = None,
        nuisance: bool | None = None,
        threads: int = 0,
    ) -> None:
        self.episodes = _native.Episodes(
            task, num_envs, backend=backend, objective=objective, form=form, nuisance=nuisance, threads=threads
        )
        self.num_envs = num_envs
        self.single_observation_space, self.single_action_space = _spaces(self.episodes)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._seeded = False

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Floats, dict[str, Any]]:
        """Begins all episodes; a list of seeds stands for one seed, since one stream draws for the whole batch."""
        if options and "reset_mask" in options:
            raise UsageError("options: reset_mask: the episodes of a batch begin together; leave it out")
        if isinstance(seed, Sequence):
            words = [0 if s is None else s + 1 for s in seed]
            seed = int(np.random.SeedSequence(words).generate_state(1)[0])
        super().reset(seed=seed)
        if seed is not None or not self._seeded:
            self.episodes.seed(int(self.np_random.integers(_SEEDS)))
            self._seeded = True
        observations = self.episodes.reset()
        return observations, {"expected_std": _expected_std(self.episodes, observations)}

    def step(self, actions: Floats) -> tuple[Floats, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """One control step of all episodes: ``actions`` is episodes x entries, from -1 to 1."""
        stepped = self.episodes.step(np.ascontiguousarray(actions, np.float32))
        observations, rewards, terminated, truncated, reached = stepped
        info: dict[str, Any] = {"expected_std": _expected_std(self.episodes, reached)}
        over = terminated | truncated
        if over.any():
            info["final_obs"], info["_final_obs"] = reached, over
        return observations, rewards, terminated, truncated, info
