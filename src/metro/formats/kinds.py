"""What a data file may hold: the columns of each kind of table, and the checks that each must pass."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pandas as pd

from metro.formats.errors import FormatError
from metro.formats.packets import Note
from metro.joint_columns import (
    JOINT_COLUMNS,
    PLACE,
    POSITIONS,
    TURNED,
    fault_of,
    fault_of_cut,
    fault_of_poses,
    fault_of_targets,
)
from metro.spelling import resembling


@dataclass(frozen=True)
class Kind:
    """A kind of table of the data contract.

    Attributes
    ----------
    title : what to call such a file in a message.
    required, optional : column names, units in the names.
    instead : those of the optional ones that take the place of the required ones where they are there.
    rising : the column that grows strictly from row to row, or "".
    whole : columns that hold whole numbers.
    least : the smallest number of rows.
    samples : rows are samples, and one that lacks a value is left out as one that the logger lost.
    fault : says which of its columns are lacking beyond those that are required, by the names that are there.
    """

    title: str
    required: tuple[str, ...]
    optional: tuple[str, ...] = ()
    rising: str = ""
    whole: tuple[str, ...] = ()
    least: int = 8
    samples: bool = False
    fault: Callable[[Sequence[str]], str] = lambda _names: ""
    instead: tuple[str, ...] = ()

    @property
    def columns(self) -> tuple[str, ...]:
        """All columns that it may have."""
        return (*self.required, *self.optional)

    @property
    def expected(self) -> str:
        """The required columns, as a message lists them."""
        listed = ", ".join(self.required)
        return f"{listed} (or {', '.join(self.instead)} in their place)" if self.instead else listed

    def lacking(self, names: Collection[str]) -> list[str]:
        """Return the required columns that are not among ``names``."""
        if self.instead and all(name in names for name in self.instead):
            return []
        return [name for name in self.required if name not in names]


SIGMAS = ("sigma_x_mm", "sigma_y_mm", "sigma_z_mm")
OF_A_POSE = (
    *("t_s", "temperature_c", "sigma_mm", *SIGMAS, "target", "point"),
    *("distance_mm", "station", "payload_kg"),
)
KINDS: dict[str, Kind] = {
    "force": Kind(
        "a force record", ("t_s", "fx_n", "fy_n", "fz_n"), ("spindle_deg",), rising="t_s", samples=True
    ),
    "robot": Kind("a robot log", ("t_s",), JOINT_COLUMNS, rising="t_s", samples=True, fault=fault_of_cut),
    "joints": Kind("a joint log", ("t_s",), JOINT_COLUMNS, rising="t_s", samples=True, fault=fault_of),
    "path": Kind("a path", ("point", "pass", "x_mm", "y_mm", "z_mm"), whole=("point", "pass"), least=2),
    "profile": Kind("a profile", ("x_mm", "z_mm"), rising="x_mm"),
    "slopes": Kind(
        "slope readings",
        ("x1_mm", "y1_mm", "x2_mm", "y2_mm", "slope_urad"),
        ("line",),
        whole=("line",),
        least=4,
    ),
    "poses": Kind(
        "measured poses",
        PLACE,
        (*POSITIONS, *TURNED, "q1", "q2", "q3", "q4", *OF_A_POSE),
        whole=("target", "point", "station"),
        samples=True,
        fault=fault_of_poses,
        instead=("distance_mm",),
    ),
    "targets": Kind("targets", (), (*POSITIONS, *PLACE, *TURNED), least=1, fault=fault_of_targets),
    "cloud": Kind("a point cloud", ("x_mm", "y_mm", "z_mm"), least=3),
    "record": Kind("a hammer record", ("t_s", "force_n", "response"), rising="t_s"),
    "frf": Kind("an FRF", ("frequency_hz", "real", "imag"), ("coherence",), rising="frequency_hz"),
}


# Column → what its values lie between, where nothing else is possible.
RANGES = {
    "frequency_hz": (0.0, np.inf),
    "coherence": (0.0, 1.0 + 1e-6),
    **dict.fromkeys(("sigma_mm", *SIGMAS, "distance_mm", "payload_kg"), (0.0, np.inf)),
}


@dataclass(frozen=True)
class Raw:
    """What a reader found: numeric columns by contract name, and what the place of a row is called."""

    frame: pd.DataFrame
    place: Callable[[int], str]


def columns_to_read(path: Path, kind: Kind, names: Sequence[str]) -> list[str]:
    """Pick the kind's columns out of those a file has (lower case, stripped); the others are ignored.

    Raises
    ------
    FormatError
        Where a required column is missing or a wanted one appears twice.
    """
    missing = kind.lacking(names)
    if missing:
        present = ", ".join(name for name in names if name) or "none"
        spare = [name for name in names if name not in kind.columns]
        near = {name: resembling(name, spare) for name in missing}
        meant = ", ".join(f'"{other}" for {name}' for name, other in near.items() if other)
        hint = f" (did you mean {meant}? Name it so, or map it under files in batch.yaml)" if meant else ""
        message = f"lacks the column {', '.join(missing)} of {kind.title}{hint}: found the columns {present}"
        raise FormatError(path, f"{message}, expected {kind.expected}")
    wanted = [name for name in (*kind.required, *kind.optional) if name in names]
    _check_whole_kind(path, kind, wanted, names)
    for name in wanted:
        if list(names).count(name) > 1:
            raise FormatError(path, f"column {name}: found {list(names).count(name)} times, expected once")
    return wanted


def _check_whole_kind(path: Path, kind: Kind, wanted: Sequence[str], names: Sequence[str]) -> None:
    if fault := kind.fault(wanted):
        present = ", ".join(name for name in names if name) or "none"
        raise FormatError(path, f"lacks of {kind.title}: {fault}; found the columns {present}")


def checked(
    path: Path, kind: Kind, raw: Raw, least: int, after: float = -np.inf, *, head: bool = False
) -> pd.DataFrame:
    """Check a table and return it as the contract has it.

    It is a whole one, or a piece that comes ``after`` a value of the column that rises, or its ``head``: a
    record may begin with samples that lack a value, as where a filter has to fill.

    A cloud's rows without coordinates are dropped, their number is in ``attrs["dropped"]``; so are samples
    that lack a value, which a note states (:class:`metro.formats.packets.Note`). Where the last row is such a
    sample, ``attrs["torn"]`` says so. Everywhere else a value that is not finite is an error, but for the
    0 Hz line of an FRF, where integration divides by zero.

    Raises
    ------
    FormatError
        With the place of the first offending row, or where fewer than ``least`` rows remain.
    """
    frame = raw.frame
    blank = [name for name in kind.optional if name in frame and frame[name].isna().all()]
    frame = frame.drop(columns=blank)
    if blank and len(frame):  # what has no value in any row is not there
        there = [str(name) for name in frame]
        _check_whole_kind(path, kind, there, there)
    if kind.title == KINDS["cloud"].title:
        frame = _without_missing(frame)
    elif kind.samples:
        raw = _whole_samples(path, Raw(frame, raw.place), most=head)
        frame, least = raw.frame, 0 if head and len(frame) else least
    _check_finite(path, frame, raw.place)
    at_least(path, kind, len(frame), least)
    if kind.rising:
        _check_rising(path, frame, kind.rising, raw.place, after)
    whole = [name for name in kind.whole if name in frame]
    for name in whole:
        _check_whole(path, frame, name, raw.place)
    for name, (low, high) in RANGES.items():
        if name in frame:
            _check_range(path, frame, name, (low, high), raw.place)
    return frame.astype(dict.fromkeys(whole, np.int64)) if whole else frame


def at_least(path: Path, kind: Kind, rows: int, least: int) -> None:
    """Raise a FormatError where a table has fewer than ``least`` rows."""
    if rows < least:
        raise FormatError(path, f"found {rows} rows, expected at least {least} in {kind.title}")


def _without_missing(frame: pd.DataFrame) -> pd.DataFrame:
    finite = np.ones(len(frame), dtype=bool)
    for name in frame:
        finite &= np.isfinite(frame[name].to_numpy())
    dropped = int(len(frame) - np.count_nonzero(finite))
    kept = frame[finite].reset_index(drop=True) if dropped else frame
    kept.attrs["dropped"] = dropped
    return kept


def _whole_samples(path: Path, raw: Raw, *, most: bool) -> Raw:
    """Leave out the rows that lack a value, as samples that the logger lost; ``most``: up to all but one.

    Raises
    ------
    FormatError
        Where most rows lack one: a column is recorded at another rate, or not at all.
    """
    lacks: npt.NDArray[np.bool_] = raw.frame.isna().to_numpy()
    lost = np.asarray(lacks.any(axis=1))
    count, rows = int(np.count_nonzero(lost)), len(lost)
    if not count:
        return raw

    def place(row: int) -> str:
        return f"{raw.place(row)}, column {', '.join(str(name) for name in raw.frame.columns[lacks[row]])}"

    first = place(int(np.argmax(lost)))
    if count == rows or (2 * count > rows and not most):
        found = f"{first}: found nothing or NaN, and so in {count} of {rows} rows"
        expected = "expected a finite number; export all columns at the rate of the slowest"
        raise FormatError(path, f"{found}, {expected}")
    kept = np.flatnonzero(~lost)
    frame = raw.frame.iloc[kept].reset_index(drop=True)
    message = (
        f"{count} of {rows} rows lack a value (the first: {first}) and are left out; the logger lost data"
    )
    note = Note("missing values", float(count), 0.0, False, message)
    frame.attrs["notes"] = [*raw.frame.attrs.get("notes", ()), note]
    frame.attrs["torn"] = place(rows - 1) if lost[-1] else ""
    return Raw(frame, lambda row: raw.place(int(kept[row])))


def whole(path: Path, table: pd.DataFrame) -> pd.DataFrame:
    """Return a checked table that is the end of a file; its last row must be there in full.

    Raises
    ------
    FormatError
        Where the last row lacks a value: then the file may have been cut off.
    """
    if torn := table.attrs.get("torn"):
        message = f"{torn}: found nothing or NaN in the last row, expected a finite number"
        raise FormatError(path, f"{message}; copy the file again if it was cut off, else delete that row")
    return table


def _check_finite(path: Path, frame: pd.DataFrame, place: Callable[[int], str]) -> None:
    for name in frame:
        wrong = ~np.isfinite(frame[name].to_numpy())
        if "frequency_hz" in frame and name != "frequency_hz":
            wrong &= frame["frequency_hz"].to_numpy() != 0.0
        if wrong.any():
            row = int(np.argmax(wrong))
            value = frame[name].iloc[row]
            text = "nothing or NaN" if np.isnan(value) else f"{value}"
            others = int(np.count_nonzero(wrong)) - 1
            text += f", and {others} more" if others else ""
            raise FormatError(path, f"{place(row)}, column {name}: found {text}, expected a finite number")


def _check_rising(
    path: Path, frame: pd.DataFrame, name: str, place: Callable[[int], str], after: float
) -> None:
    values = np.concatenate([[after], frame[name].to_numpy()])
    falls = np.diff(values) <= 0.0
    if falls.any():
        row = int(np.argmax(falls))
        fault = f"found {values[row + 1]:.9g} after {values[row]:.9g}"
        raise FormatError(path, f"{place(row)}, column {name}: {fault}, expected a larger value in every row")


def _check_range(
    path: Path, frame: pd.DataFrame, name: str, limits: tuple[float, float], place: Callable[[int], str]
) -> None:
    values = frame[name].to_numpy()
    outside = (values < limits[0]) | (values > limits[1])
    if outside.any():
        row = int(np.argmax(outside))
        expected = (
            f"expected {limits[0]:g} to {limits[1]:g}"
            if np.isfinite(limits[1])
            else f"expected ≥ {limits[0]:g}"
        )
        raise FormatError(path, f"{place(row)}, column {name}: found {values[row]:g}, {expected}")


def _check_whole(path: Path, frame: pd.DataFrame, name: str, place: Callable[[int], str]) -> None:
    values = frame[name].to_numpy()
    broken = values != np.round(values)
    if broken.any():
        row = int(np.argmax(broken))
        raise FormatError(
            path, f"{place(row)}, column {name}: found {values[row]:g}, expected a whole number"
        )
