"""The commands as functions. Each returns what the program writes as ``result.json``, and knows its folder.

Every option of the command line is an argument: ``--real-effect X`` is ``real_effect="X"``, one that repeats takes a
list, and one of ``NAME=VALUE`` a dictionary: ``truth={"mass_offset": 0.06}``, ``set={"explorer.iterations": 10}``.
Without ``out`` the folder is a temporary one that is gone with the result.
"""

from __future__ import annotations

import json
import shutil
import tempfile
import weakref
from collections.abc import Iterable
from pathlib import Path
from typing import Any, TypeVar

from asid.program import Option, arguments, call
from asid.records import Result
from asid.results import Comparison, Diagnosis, ExploredTask, Identification, Motion, Run, StudyIdentification

R = TypeVar("R", bound=Result)

Paths = str | Path | Iterable[str | Path]


def diagnose(study: str | Path | None = None, *, out: str | Path | None = None, progress: bool = False, **options: Option) -> Diagnosis:
    """Finds where model and logs disagree, which effect causes it, and how far the gap shrinks with it.

    Args:
        study: a folder with ``study.toml``, or the file; or leave it out and give ``task="rod-balancing"``.
        out: folder for the result, new or empty.
        progress: whether bars of progress go to standard error.
        options: those of ``asid diagnose``, such as ``minutes=1``, ``without=["gravity-tilt"]``, ``backend="mujoco"``.

    Ctrl-C ends the search, and the answer is what is known by then; a second one raises ``KeyboardInterrupt``.
    """
    folder, value = _work("diagnose", [study] if study is not None else [], out, progress, options)
    return _result(Diagnosis, folder, value)


def identify(
    subject: str | Path, *, log: Paths = (), out: str | Path | None = None, progress: bool = False, **options: Option
) -> Identification | StudyIdentification:
    """Estimates the unknowns of a task from logs of the real machine, or those of a study from its own logs.

    Args:
        subject: a task, or a study.
        log: logs of the real machine, for a task.
        out: folder for the result, new or empty.
        progress: whether bars of progress go to standard error.
        options: those of ``asid identify``, such as ``identifier="reps"``.
    """
    logs: list[str | Path] = [log] if isinstance(log, (str, Path)) else list(log)
    folder, value = _work("identify", [subject], out, progress, {**options, "log": logs})
    if "study" in value:
        return _result(StudyIdentification, folder, value)
    return _result(Identification, folder, value)


def explore(
    subject: str | Path | None = None, *, out: str | Path | None = None, progress: bool = False, **options: Option
) -> ExploredTask | Motion:
    """Makes the commands of a motion that tells the most, for a task or for any machine.

    Args:
        subject: a task, or a study; or leave it out and give ``model="arm.xml"`` and ``unknown=["geom/bob/mass:0.1:1"]``.
        out: folder for the result, new or empty.
        progress: whether bars of progress go to standard error.
        options: those of ``asid explore``, such as ``explorer="multisine"`` or ``limit_speed=["elbow:2"]``.

    The commands are ``result.log("commands")``.
    """
    folder, value = _work("explore", [subject] if subject is not None else [], out, progress, options)
    if "machine" in value:
        return _result(Motion, folder, value)
    return _result(ExploredTask, folder, value)


def run(task: str, *, out: str | Path | None = None, progress: bool = False, **options: Option) -> Run:
    """Explores, identifies, solves, and tries the task once in a simulated real world.

    Args:
        task: a task, see `tasks`.
        out: folder for the result, new or empty.
        progress: whether bars of progress go to standard error.
        options: those of ``asid run``, such as ``backend="mujoco"``, ``seed=1``, ``truth={"mass_offset": 0.06}``.
    """
    folder, value = _work("run", [task], out, progress, options)
    return _result(Run, folder, value)


def compare(*tasks: str, out: str | Path | None = None, progress: bool = False, **options: Option) -> Comparison:
    """Compares methods head to head, over tasks, conditions, worlds, engines and seeds.

    Args:
        tasks: all where none is named.
        out: folder for the result; one that holds a part of the comparison is gone on with.
        progress: whether bars of progress go to standard error.
        options: those of ``asid compare``, such as ``method=["asid", "dr"]``, ``seeds=3``, ``quick=True``.
    """
    folder, value = _work("compare", list(tasks), out, progress, options)
    return _result(Comparison, folder, value)


def _work(
    command: str, subjects: list[Any], out: str | Path | None, progress: bool, options: dict[str, Option]
) -> tuple[_Folder, dict[str, Any]]:
    """Runs a command into a folder, and returns that with what ``result.json`` holds."""
    folder = _Folder.of(command, out)
    words: list[str | Path] = [command, "--json", "--out", folder.path]
    if not progress:
        words.append("--quiet")
    try:
        # Subjects stand behind the options: a path may begin with a dash.
        call([*words, *arguments(options), "--", *subjects], progress)
        value = json.loads((folder.path / "result.json").read_text(encoding="utf-8"))
    except BaseException:
        folder.remove()
        raise
    return folder, value


class _Folder:
    """Where a result is written: what the caller chose, or a temporary folder."""

    def __init__(self, path: Path, temporary: Path | None) -> None:
        self.path = path
        self.temporary = temporary

    @classmethod
    def of(cls, command: str, out: str | Path | None) -> _Folder:
        if out is not None:
            return cls(Path(out), None)
        temporary = Path(tempfile.mkdtemp(prefix=f"asid-{command}-"))
        return cls(temporary / "result", temporary)

    def remove(self) -> None:
        """Removes a temporary folder, and no other."""
        if self.temporary is not None:
            shutil.rmtree(self.temporary, ignore_errors=True)


def _result(kind: type[R], folder: _Folder, value: dict[str, Any]) -> R:
    """The result of a folder; a temporary one is removed with it."""
    result = kind.from_json(value)
    object.__setattr__(result, "folder", folder.path)
    weakref.finalize(result, folder.remove)
    return result
