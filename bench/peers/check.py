"""Does the peer do the same work? Reference episodes are played again and compared."""

import numpy as np

from fisher import Episodes


def check(problem, interface):
    """Largest deviations from the reference: commands (rad), tracked positions (m) and returns (nat)."""
    reference = problem.reference
    theta, starts, actions = reference["theta"], reference["starts"], reference["actions"]
    episodes = Episodes(problem, interface, len(theta))
    at = problem.signals[0].at
    positions = [episodes.begin(theta, starts)[:, at : at + 3]]
    commands, rewards = [], []
    commander = episodes.commander.commands

    def remember(rows):
        commands.append(commander(rows))
        return commands[-1]

    episodes.commander.commands = remember
    for rows in actions:
        qpos, reward = episodes.step(rows)
        positions.append(qpos[:, at : at + 3])
        rewards.append(reward)
    largest = lambda a, b: float(np.abs(np.array(a) - b).max())
    return {
        "commands": largest(commands, reference["commands"]),
        "positions": largest(positions, reference["positions"]),
        "returns": largest(np.sum(rewards, axis=0), reference["rewards"].sum(axis=0)),
    }
