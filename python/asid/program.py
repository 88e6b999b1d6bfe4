"""The program ``asid`` that lies in this package, and how a function calls it.

A function runs the program beside this process, for three reasons. An engine that ends its process, as MuJoCo does on a
fatal error, ends that of the program and not a notebook with a day's work in it. Ctrl-C does what it does at a
terminal: a diagnosis then answers with what is known by then. And the answer is, to the byte, that of the command
line, because it is the command line.
"""

from __future__ import annotations

import json
import numbers
import os
import signal
import subprocess
import sys
import threading
import warnings
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import IO

from asid.errors import AsidError, UsageError

#: What may stand for one option: repeated where it is a list, ``NAME=VALUE`` each where it is a mapping.
Option = str | int | float | bool | Path | Iterable["str | Path"] | Mapping[str, object] | None

#: How the program begins a line that stops nothing.
WARNING = "asid: warning:"


def program() -> Path:
    """The program's file: ``ASID`` in the environment, else the one of this package."""
    chosen = os.environ.get("ASID")
    name = "asid.exe" if os.name == "nt" else "asid"
    path = Path(chosen) if chosen else Path(__file__).parent / "bin" / name
    if not path.exists():
        raise AsidError(f"{path}: the program is not there; install the wheel, or set ASID to the file of one")
    return path


def arguments(options: Mapping[str, Option]) -> list[str]:
    """Options of the command line: ``real_effect=["a", "b"]`` is ``--real-effect a --real-effect b``."""
    words: list[str] = []
    for name, value in options.items():
        option = "--" + name.rstrip("_").replace("_", "-")
        if value is None or value is False:
            continue
        if value is True:
            words.append(option)
        elif isinstance(value, Mapping):
            words += [f"{option}={key}={_text(inner)}" for key, inner in value.items()]
        # A number of NumPy is no `int`, and none can be iterated over.
        elif isinstance(value, (str, int, float, numbers.Number, os.PathLike)):
            words.append(f"{option}={_text(value)}")
        else:
            words += [f"{option}={_text(item)}" for item in value]
    return words


def _text(value: object) -> str:
    """A value as TOML and the command line write it; a text that is the whole value has no quotes there."""
    if hasattr(value, "tolist") and not isinstance(value, numbers.Number):
        # A truth value or an array of NumPy.
        value = value.tolist()
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (list, tuple)):
        return "[" + ",".join(_quoted(item) for item in value) + "]"
    return os.fspath(value) if isinstance(value, os.PathLike) else str(value)


def _quoted(item: object) -> str:
    """An item of a list as TOML writes it; a string of JSON is one of TOML."""
    if isinstance(item, (str, os.PathLike)):
        return json.dumps(os.fspath(item), ensure_ascii=False)
    return _text(item)


def call(words: Iterable[str | Path], progress: bool = False) -> str:
    """Runs the program and returns its standard output; bars of progress go to standard error where asked for.

    What the program warns of becomes a warning of Python.

    Raises:
        UsageError: the call was wrong.
        AsidError: the work failed.
        KeyboardInterrupt: Ctrl-C, where the program does not answer with what it knows by then.
    """
    command = [str(program()), *map(str, words)]
    # A session of its own: a terminal's Ctrl-C reaches this process alone, which passes it on once. A second one would
    # end the program at once.
    child = subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        encoding="utf-8",
        start_new_session=True,
    )
    said: list[str] = []
    assert child.stdout is not None and child.stderr is not None
    listener = threading.Thread(target=_listen, args=(child.stderr, said, progress), daemon=True)
    listener.start()
    interrupted = False
    try:
        output = child.stdout.read()
        status = child.wait()
    except KeyboardInterrupt:
        interrupted = True
        output, status = _end(child)
    except BaseException:
        child.kill()
        child.wait()
        raise
    listener.join()
    child.stdout.close()
    child.stderr.close()
    if status == 0:
        for line in said:
            if line.startswith(WARNING):
                warnings.warn(line.removeprefix(WARNING).strip(), stacklevel=4)
        return output
    if interrupted:
        raise KeyboardInterrupt
    raise _error(status, said)


def _end(child: subprocess.Popen[str]) -> tuple[str, int]:
    """Passes an interruption on, and waits for what the program makes of it; a second one ends it."""
    assert child.stdout is not None
    child.send_signal(signal.SIGINT)
    try:
        return child.stdout.read(), child.wait()
    except BaseException:
        child.kill()
        child.wait()
        raise


def _listen(stream: IO[str], said: list[str], progress: bool) -> None:
    """Collects what the program says beside its result."""
    for line in stream:
        said.append(line)
        if progress:
            sys.stderr.write(line)


def _error(status: int, said: list[str]) -> AsidError:
    """The exception of a program that failed: its line, without its name."""
    lines = [line.strip() for line in said if line.strip() and not line.startswith(WARNING)]
    if status < 0:
        return AsidError(f"the program was ended by signal {-status}" + (f": {lines[-1]}" if lines else ""))
    line = lines[-1].removeprefix("asid: ") if lines else f"the program ended with status {status}"
    return UsageError(line) if status == 2 else AsidError(line)
