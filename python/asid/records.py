"""How a ``result.json`` becomes dataclasses: numbers as floats, lists of numbers as arrays, tables by pandas.

JSON has no number that is not finite. The program writes ``null`` for one; where a field is a number, ``null`` is NaN,
and where it is ``float | None``, it is ``None``: there is no such value.
"""

from __future__ import annotations

import dataclasses
import json
import types
import typing
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeVar, Union

import numpy as np

if TYPE_CHECKING:
    import pandas

R = TypeVar("R", bound="Record")

#: Types of the fields of classes that have been read.
_HINTS: dict[type, dict[str, Any]] = {}


class Record:
    """A part of a result."""

    @classmethod
    def from_json(cls: type[R], value: dict[str, Any]) -> R:
        """Makes one from what ``json.load`` gives; a field that the file lacks takes its default."""
        hints = _hints(cls)
        given = {}
        for field in dataclasses.fields(cls):  # type: ignore[arg-type]
            if field.name in value:
                given[field.name] = _convert(hints[field.name], value[field.name])
        return cls(**given)


class Result(Record):
    """A ``result.json`` with the folder that it lies in."""

    folder: Path

    @classmethod
    def read(cls: type[R], folder: str | Path) -> R:
        """Reads the result of a folder, such as one that the program has written with ``--out``."""
        folder = Path(folder)
        value = json.loads((folder / "result.json").read_text(encoding="utf-8"))
        result = cls.from_json(value)
        object.__setattr__(result, "folder", folder)
        return result

    @property
    def report(self) -> Path:
        """The page of the result: one file that opens offline."""
        return self.folder / "report.html"

    def frame(self, name: str) -> pandas.DataFrame:
        """A list of records as a table, one row each: ``diagnosis.frame("hypotheses")``."""
        rows = getattr(self, name)
        if not isinstance(rows, list) or not all(isinstance(row, Record) for row in rows):
            raise TypeError(f"{type(self).__name__}.{name} is no list of records")
        return _pandas().DataFrame([_row(row) for row in rows])

    def log(self, name: str) -> pandas.DataFrame:
        """A log of the folder as a table, such as ``explored.log("commands")``: a row a time, NaN where a reading is missing."""
        path = self.folder / (name if "." in name else f"{name}.csv")
        if not path.exists():
            known = ", ".join(sorted(p.stem for p in self.folder.glob("*.csv"))) or "none"
            raise FileNotFoundError(f"{path}: no such log; there are: {known}")
        return _pandas().read_csv(path)


def _row(record: Record) -> dict[str, Any]:
    """The fields of a record; those of a record in it stand beside them, as ``gap.nominal``."""
    row: dict[str, Any] = {}
    for field in dataclasses.fields(record):  # type: ignore[arg-type]
        value = getattr(record, field.name)
        if isinstance(value, Record):
            row.update({f"{field.name}.{key}": inner for key, inner in _row(value).items()})
        else:
            row[field.name] = value
    return row


def _pandas() -> Any:
    try:
        import pandas
    except ImportError as error:
        raise ImportError("tables need pandas: pip install pandas, or asid[pandas]") from error
    return pandas


def _hints(cls: type) -> dict[str, Any]:
    if cls not in _HINTS:
        _HINTS[cls] = typing.get_type_hints(cls)
    return _HINTS[cls]


def _convert(hint: Any, value: Any) -> Any:
    """A value of a file as its field has it."""
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if origin in (Union, types.UnionType):
        if value is None:
            return None
        (inner,) = [a for a in arguments if a is not type(None)]
        return _convert(inner, value)
    if hint is float:
        return float("nan") if value is None else float(value)
    if origin is np.ndarray:
        return np.array(value, dtype=float)
    if origin is list:
        return [_convert(arguments[0], item) for item in value]
    if origin is dict:
        return {key: _convert(arguments[1], item) for key, item in value.items()}
    if origin is tuple:
        return tuple(_convert(a, item) for a, item in zip(arguments, value, strict=True))
    if isinstance(hint, type) and issubclass(hint, Record):
        return hint.from_json(value)
    if origin is Literal or hint in (int, bool, str, Any):
        return value
    raise TypeError(f"no way to read a value of type {hint}")
