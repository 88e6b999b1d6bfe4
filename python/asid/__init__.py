"""Active exploration for system identification, and diagnosis of the sim-to-real gap.

>>> import asid
>>> found = asid.diagnose("studies/servo-pendulum")
>>> print(found.sentence)
>>> print(found.frame("hypotheses"))
"""

from typing import TYPE_CHECKING

from asid._native import __version__, backends, tasks
from asid.calls import compare, diagnose, explore, identify, run
from asid.errors import AsidError, UsageError
from asid.program import program

if TYPE_CHECKING:
    from asid.playing import play

try:
    from asid.environments import register as _register
except ImportError:
    # Without gymnasium there are no environments, and all else is there.
    pass
else:
    _register()

__all__ = [
    "AsidError",
    "UsageError",
    "__version__",
    "backends",
    "compare",
    "diagnose",
    "explore",
    "identify",
    "play",
    "program",
    "run",
    "tasks",
]


def __getattr__(name: str) -> object:
    # `play` needs gymnasium, which is told where it is used.
    if name == "play":
        from asid.playing import play

        return play
    raise AttributeError(f"module 'asid' has no attribute '{name}'")
