"""Channels with a name and perhaps a unit of their own, and the contract's columns that they are."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from metro.formats import measures
from metro.formats.errors import FormatError
from metro.formats.kinds import Kind, Raw, columns_to_read
from metro.formats.limits import check_unpacked
from metro.formats.measures import OF_COLUMN

# Unit in a column's name → what a file may give instead, with the factor to it.
UNITS: dict[str, dict[str, float]] = {
    suffix: measures.UNITS[quantity] for suffix, quantity in OF_COLUMN.items()
}
# What a response may be in, as impacts.csv has it; its column names no unit.
RESPONSES = {"m/s2": "m/s2", "m/s^2": "m/s2", "m/s²": "m/s2", "m/s": "m/s", "m": "m", "g": "g"}
_ALIASES = {"time": "t", "freq": "frequency", "freq_hz": "frequency_hz"}
_ALIASES |= {f"force_{axis}": f"f{axis}" for axis in "xyz"}
_NAME_AND_UNIT = re.compile(r"(.*?)\s*[\[(](.*)[\])]")


def parted(label: str) -> tuple[str, str]:
    """Part a column's name from the unit that follows it: ``Fx [kN]``, ``force_x_kN``; "" if none does.

    Behind an underline nm is the contract's newton metre as well as a nanometre: it is left in the name.
    """
    match = _NAME_AND_UNIT.fullmatch(label.strip())
    if match and match[1]:
        return match[1], match[2]
    name, _, unit = label.strip().rpartition("_")
    if name and unit != "nm" and any(unit in spellings for spellings in measures.UNITS.values()):
        return name, unit
    return label.strip(), ""


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
    name, unit : as the file has them; the unit is "" where the file names none.
    shape : of its values; a vector may have further dimensions of 1.
    numeric : whether its values are real numbers.
    load : gives some of its values, an array of as many; those of a matrix column by column.
    pairs : whether its values are complex numbers.
    clock : the times of its values as the file describes them, where there may be no channel of time.
    """

    label: str
    name: str
    unit: str
    shape: tuple[int, ...]
    numeric: bool
    load: Callable[[slice], np.ndarray]
    clock: Clock | None = None
    pairs: bool = False


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
    named = [(column_of(kind, each.name, each.unit), each) for each in channels]
    columns = [column for column, _ in named]
    if "t_s" in kind.required and "t_s" not in columns:
        timed = [each for column, each in named if column in kind.required]
        named += [("t_s", each) for each in _time(path, timed)]
    use = columns_to_read(path, kind, [column for column, _ in named])
    wanted = {column: next(each for name, each in named if name == column) for column in use}
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


def column_of(kind: Kind, name: str, unit: str = "") -> str:
    """Give the column that a channel's name denotes; the name in lower case where it is none.

    Of columns that differ in their unit alone (``q1_deg``, ``q1_mm``) it is that of the channel's ``unit``,
    else the first.
    """
    key = name.strip().lower().replace(" ", "_")
    key = _ALIASES.get(key, key)
    columns = (*kind.required, *kind.optional)
    if key in columns:
        return key
    alike = [column for column in columns if unit_of(column) and column.rpartition("_")[0] == key]
    fitting = [column for column in alike if unit.strip(" []()") in UNITS[unit_of(column)]]
    return next(iter(fitting or alike), key)


def unit_of(column: str) -> str:
    """Return the unit in a column's name; "" where it has none."""
    unit = column.rpartition("_")[2]
    return unit if "_" in column and unit in UNITS else ""


def automatic(
    path: Path, kind: Kind, own: Iterable[tuple[str, str, str]], wanted: Collection[str]
) -> Iterator[tuple[int, str, float]]:
    """Yield those ``wanted`` columns of a kind that a file has by name: position, column, factor to its unit.

    Parameters
    ----------
    own : label, name and unit ("" where none is stated) of each column of the file.

    A name is the contract's own (``fx_n``), which goes before others, or states its unit (``Fx [kN]``,
    ``force_x_kN``).

    Raises
    ------
    FormatError
        Where a column that is required has a unit that is missing, unknown or not one of its quantity.
    """
    columns = list(own)
    exact = {name.strip().lower() for _, name, _ in columns}
    for at, (label, name, unit) in enumerate(columns):
        plain = name.strip().lower()
        if plain in wanted:
            yield at, plain, factor(path, plain, label, name, unit) if unit else 1.0
            continue
        bare, stated = parted(name)
        column = column_of(kind, bare, unit or stated)
        if column not in wanted or column in exact:
            continue
        if unit or stated or (column in kind.required and unit_of(column)):
            yield at, column, factor(path, column, label, bare, unit or stated)


def translated(
    path: Path, kind: Kind, labels: Sequence[str], names: Sequence[str]
) -> tuple[list[str], pd.Series]:
    """Give the columns of a table the contract's names, where they are those of a kind; others in lower case.

    Returns
    -------
    The names, and the factor to the unit of each column of the kind.
    """
    own = [(label, name, "") for label, name in zip(labels, names, strict=True)]
    found = {at: (column, size) for at, column, size in automatic(path, kind, own, kind.columns)}
    new = [found[at][0] if at in found else name.strip().lower() for at, name in enumerate(names)]
    return new, pd.Series(dict(found.values()), dtype=float)


def unit_in_name(name: str, unit: str) -> bool:
    """Return whether a name ends with a unit as the contract's names do: ``fx_n``."""
    return name.strip().lower().endswith(f"_{unit}")


def factor(path: Path, column: str, label: str, name: str, unit: str) -> float:
    """Return the factor to a column's unit from what a channel of a name and a unit is in.

    Raises
    ------
    FormatError
        Where the unit is missing, unknown, or contradicts the channel's name.
    """
    asked = unit_of(column)
    if not asked:
        return 1.0
    named = unit_in_name(name, asked)
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
