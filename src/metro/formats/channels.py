"""Channels with a name and perhaps a unit of their own, and the contract's columns that they are."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from metro.formats.errors import FormatError
from metro.formats.kinds import Kind, Raw, columns_to_read
from metro.formats.limits import check_unpacked

# Unit in a column's name → what a file may give instead, with the factor to it. Capitals matter: Nm is no nm.
UNITS: dict[str, dict[str, float]] = {
    "s": {"s": 1.0, "ms": 1e-3},
    "n": {"N": 1.0, "kN": 1e3},
    "deg": {"deg": 1.0, "°": 1.0, "rad": math.degrees(1.0)},
    "nm": {"Nm": 1.0, "N m": 1.0, "N*m": 1.0, "N·m": 1.0, "kNm": 1e3},
    "mm": {"mm": 1.0, "m": 1e3, "um": 1e-3, "µm": 1e-3, "μm": 1e-3},
    "hz": {"Hz": 1.0, "kHz": 1e3},
}
# What a response may be in, as impacts.csv has it; its column names no unit.
RESPONSES = {"m/s2": "m/s2", "m/s^2": "m/s2", "m/s²": "m/s2", "m/s": "m/s", "m": "m", "g": "g"}
_ALIASES = {"time": "t", "freq": "frequency", "freq_hz": "frequency_hz"}


class Clock(NamedTuple):
    """Times of values: the first and the step between them in s, and the recorder's mark of the start."""

    offset: float
    step: float
    start: bytes


@dataclass(frozen=True)
class Channel:
    """A channel of a file.

    Attributes
    ----------
    label : what messages call it.
    name, unit : as the file has them; the unit is "" where the file says none.
    shape : of its values; a vector may have further dimensions of 1.
    numeric : whether its values are real numbers.
    load : gives some of its values, an array of as many.
    clock : what the file says of the times of its values, where there may be no channel of time.
    """

    label: str
    name: str
    unit: str
    shape: tuple[int, ...]
    numeric: bool
    load: Callable[[slice], np.ndarray]
    clock: Clock | None = None


def channel_pieces(path: Path, kind: Kind, channels: Sequence[Channel], rows: int | None) -> Iterator[Raw]:
    """Read those channels that are columns of a kind, in the columns' units; the others are ignored.

    They come in pieces of so many rows, all at once where None; there is always one.

    A channel is named as the column (``fx_n``), or without its unit (``Fx``) and has a unit of its own;
    Where none is the time, it is that of the channels' clocks, which must be one. The unit of a response is
    left in ``attrs["response_unit"]``.

    Raises
    ------
    FormatError
        Naming the channel: a column missing or found twice, a unit missing, unknown or at odds with the name,
        values that are no vector of numbers, or not as many as in the first column.
    """
    found = [(column_of(kind, each.name), each) for each in channels]
    columns = [column for column, _ in found]
    if "t_s" in kind.required and "t_s" not in columns:
        timed = [each for column, each in found if column in kind.required]
        found += [("t_s", each) for each in _time(path, timed)]
    use = columns_to_read(path, kind, [column for column, _ in found])
    wanted = {column: next(each for name, each in found if name == column) for column in use}
    factors = {
        column: factor(path, column, each.label, each.name, each.unit) for column, each in wanted.items()
    }
    first = wanted[use[0]]
    for column, each in wanted.items():
        _check_values(path, column, each, first)
    count = math.prod(first.shape)
    step = count if rows is None else rows
    check_unpacked(path, 8 * len(wanted) * min(step, count), kind.title)
    unit = {"response_unit": response_unit(path, wanted["response"])} if "response" in wanted else {}
    for start in range(0, max(count, 1), max(step, 1)):
        some = slice(start, min(start + step, count))
        loaded = {name: each.load(some).astype(np.float64) * factors[name] for name, each in wanted.items()}
        frame = pd.DataFrame(loaded)
        frame.attrs.update(unit)
        yield Raw(frame, partial(_sample, start))


def _sample(start: int, row: int) -> str:
    return f"sample {start + row + 1}"


def column_of(kind: Kind, name: str) -> str:
    """Give the column that a channel's name stands for; the name in lower case where it is none."""
    key = name.strip().lower().replace(" ", "_")
    key = _ALIASES.get(key, key)
    columns = (*kind.required, *kind.optional)
    bare = {column.rpartition("_")[0]: column for column in columns if _unit_of(column)}
    return key if key in columns else bare.get(key, key)


def _unit_of(column: str) -> str:
    unit = column.rpartition("_")[2]
    return unit if "_" in column and unit in UNITS else ""


def factor(path: Path, column: str, label: str, name: str, unit: str) -> float:
    """Return the factor to a column's unit from what a channel of a name and a unit is in.

    Raises
    ------
    FormatError
        Where the unit is missing, unknown, or another than the channel's name says.
    """
    asked = _unit_of(column)
    if not asked:
        return 1.0
    named = name.strip().lower().endswith(f"_{asked}")
    known, unit = UNITS[asked], unit.strip(" []()")
    spelt = {size: each for each, size in reversed(known.items())}  # the first spelling of each
    expected = f"expected {' or '.join(reversed(spelt.values()))}"
    if unit in known and not (named and known[unit] != 1.0):
        return known[unit]
    if named and not unit:
        return 1.0
    if unit in known:
        expected = f"expected {next(iter(known))} as its name says: correct the one that is wrong"
    elif not unit:
        expected = f"{expected}: give the channel its unit, or name it {column}"
    else:
        expected = f"{expected}: export the channel in one of these"
    raise FormatError(path, f"{label}, column {column}: found the unit {unit!r}, {expected}")


def response_unit(path: Path, channel: Channel) -> str:
    """Return the unit of a hammer record's response as impacts.csv would name it; "" where none is said."""
    unit = channel.unit.strip(" []()")
    if unit and unit not in RESPONSES:
        expected = f"expected {' or '.join(dict.fromkeys(RESPONSES.values()))}"
        raise FormatError(path, f"{channel.label}, column response: found the unit {unit!r}, {expected}")
    return RESPONSES.get(unit, "")


def _time(path: Path, channels: Sequence[Channel]) -> list[Channel]:
    """Make the channel of time of channels that have one clock; none where they have no clock."""
    timed = [each for each in channels if each.clock is not None]
    if not timed or timed[0].clock is None:
        return []
    first, clock = timed[0], timed[0].clock
    for each in channels:
        if each.clock != clock:
            message = f"{each.label}: found another start or step of time than {first.label} has"
            raise FormatError(path, f"{message}, expected one for all: save them at one rate")

    def load(some: slice) -> np.ndarray:
        return clock.offset + clock.step * np.arange(*some.indices(math.prod(first.shape)))

    return [Channel(f"the time of {first.label}", "t_s", "s", first.shape, True, load)]


def _check_values(path: Path, column: str, channel: Channel, first: Channel) -> None:
    place = f"{channel.label}, column {column}"
    size, shape = math.prod(channel.shape), " × ".join(map(str, channel.shape))
    if not channel.numeric:
        raise FormatError(path, f"{place}: found no real numbers, expected a vector of them")
    if size != max(channel.shape, default=1):
        raise FormatError(path, f"{place}: found an array of {shape}, expected a vector: one per column")
    if size != math.prod(first.shape):
        expected = f"expected {math.prod(first.shape)}, as {first.label} has"
        raise FormatError(path, f"{place}: found {size} values, {expected}: save them at one rate")
