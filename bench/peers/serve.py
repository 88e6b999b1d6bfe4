"""The peer's process: reads one request a line, answers with one line of JSON.

It stays alive between requests, so that imports and compilation of the scene are nobody's time.
"""

import json
import os
import platform
import sys
import traceback
from importlib.metadata import version

# One thread for small matrices; MuJoCo's threads do the physics.
for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"

PACKAGES = ("mujoco", "stable-baselines3", "torch", "numpy", "scipy")


def answer(request, problems):
    """One request: `start`, `check`, `explore` or `identify`."""
    kind = request["do"]
    if kind == "start":
        from explore import warm_up

        warm_up()
        return {"python": platform.python_version()} | {name: version(name) for name in PACKAGES}
    from problem import Problem
    from simulation import INTERFACES

    path = request["problem"]
    if path not in problems:
        problems[path] = Problem(path)
    problem = problems[path]
    if kind == "check":
        from check import check

        return check(problem, INTERFACES[request["interface"]])
    if kind == "explore":
        from explore import train

        return train(problem, INTERFACES[request["interface"]], request["steps"], request["seed"])
    if kind == "identify":
        from identify import identify

        return identify(problem, request["log"], request["difference"])
    raise ValueError(f"unknown request {kind}")


def main():
    problems = {}
    # Libraries may print: answers have the original standard output to themselves.
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    for line in sys.stdin:
        try:
            reply = answer(json.loads(line), problems)
        except Exception as error:  # The other side has to hear of any.
            traceback.print_exc()
            reply = {"error": f"{type(error).__name__}: {error}"}
        print(json.dumps(reply), file=answers, flush=True)


if __name__ == "__main__":
    main()
