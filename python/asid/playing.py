"""Explorers, policies and metrics of one's own, as functions of Python.

They act on the environments of the tasks, in the simulator: what they find is a motion and what it tells. A real
machine plays the commands of `asid.explore`.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asid.environments import ExplorationVectorEnv
from asid.errors import UsageError

Array = NDArray[Any]

#: From observations (episodes x entries) to actions (episodes x entries, from -1 to 1).
Policy = Callable[[Array], Array]

#: Makes a policy, and may try as much as it likes in the batch that it is given.
Explorer = Callable[[ExplorationVectorEnv], Policy]

#: From one episode's observations (steps + 1 x entries) and actions (steps x entries) to a number.
Metric = Callable[[Array, Array], float]


@dataclasses.dataclass(frozen=True, eq=False)
class Played:
    """Episodes that a policy has played."""

    unknowns: list[str]
    """Names of the unknowns."""
    observations: Array
    """Episodes x steps + 1 x entries; the first row is the start."""
    actions: Array
    """Episodes x steps x entries, from -1 to 1."""
    rewards: Array
    """Episodes x steps."""
    expected_std: Array
    """Standard deviation of each unknown that the whole episode is expected to leave, in prior deviations: episodes x unknowns."""
    metric: Array | None
    """The metric of each episode, where there is one."""


def play(
    task: str,
    policy: Policy | None = None,
    *,
    explorer: Explorer | None = None,
    metric: Metric | None = None,
    episodes: int = 64,
    seed: int = 0,
    **settings: Any,
) -> Played:
    """Plays a policy, or the one that an explorer makes, in a batch of episodes whose unknowns are drawn from the prior.

    Args:
        task: name of the task.
        policy: from observations to actions, for the whole batch at once.
        explorer: makes the policy in place of ``policy``.
        metric: a number of each episode, from its observations and actions.
        episodes: episodes side by side.
        seed: seed of all chance of the environments.
        settings: those of `ExplorationVectorEnv`, such as ``backend="mujoco"``.
    """
    if (policy is None) == (explorer is None):
        raise UsageError("policy: give a policy or an explorer that makes one, and not both")
    environment = ExplorationVectorEnv(task, episodes, **settings)
    if policy is None:
        assert explorer is not None
        policy = explorer(environment)
    observation, _ = environment.reset(seed=seed)
    observations, actions, rewards = [observation], [], []
    for _ in range(environment.episodes.horizon):
        action = np.asarray(policy(observation), np.float32)
        if action.shape != environment.action_space.shape:
            raise UsageError(
                f"policy: it must give actions of the shape {environment.action_space.shape}, not {action.shape}"
            )
        observation, reward, _, _, info = environment.step(action)
        observations.append(info.get("final_obs", observation))
        actions.append(np.clip(action, -1.0, 1.0))
        rewards.append(reward)
    seen, done = np.stack(observations, 1), np.stack(actions, 1)
    return Played(
        unknowns=[name for name, _ in environment.episodes.unknowns],
        observations=seen,
        actions=done,
        rewards=np.stack(rewards, 1),
        expected_std=info["expected_std"],
        metric=None if metric is None else np.array([metric(s, a) for s, a in zip(seen, done, strict=True)]),
    )
