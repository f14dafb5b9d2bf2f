"""What a file has, in its own names and units: the columns of a text, the variables, channels or arrays."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd

from metro.formats.channels import Channel, Clock, parted
from metro.formats.errors import FormatError
from metro.formats.kinds import Raw
from metro.formats.limits import check_unpacked
from metro.formats.text import Layout, number_pieces
from metro.formats.text_layout import TextOptions, TextTable, find_table


@dataclass(frozen=True)
class Own:
    """A column of a file as the file itself has it.

    Attributes
    ----------
    label : what messages call it; no other column of the file has the same.
    name : "" where the file gives it none.
    unit : "" where the file states none.
    size : number of its values where that is known before they are read.
    clock : the times of its values, where the file describes them.
    """

    label: str
    name: str
    unit: str = ""
    size: int | None = None
    clock: Clock | None = None


@dataclass(frozen=True)
class Contents:
    """What a file has.

    Attributes
    ----------
    container : the title of its format.
    columns : in the order of the file.
    pieces : ``(labels, rows)`` gives those columns in pieces of so many rows, at once where None.
    text : how a text file holds its numbers.
    """

    container: str
    columns: tuple[Own, ...]
    pieces: Callable[[Sequence[str], int | None], Iterator[Raw]]
    text: TextTable | None = None


def of_text(path: Path, options: TextOptions) -> Contents:
    """Find the columns of a text file; they are numbered where they have no names."""
    table = find_table(path, options)
    named = list(zip(table.names, table.units, strict=True))
    columns = tuple(
        Own(f"column {k} ({name})" if name else f"column {k}", name, unit)
        for k, (name, unit) in enumerate(named, 1)
    )
    layout = Layout(tuple(each.label for each in columns), table.parted_by, table.skip, table.decimal)
    return Contents("text", columns, partial(number_pieces, path, layout), table)


def of_frame(
    container: str, frame: pd.DataFrame, place: Callable[[int], str], units: Sequence[str] = ()
) -> Contents:
    """Take the columns of a table that is in memory, or that a reader has made."""
    given = units or [""] * frame.shape[1]
    columns = tuple(
        Own(f"column {name}", str(name), unit, len(frame))
        for name, unit in zip(frame.columns, given, strict=True)
    )
    table = frame.set_axis([each.label for each in columns], axis=1)

    def pieces(labels: Sequence[str], rows: int | None) -> Iterator[Raw]:
        step = len(table) if rows is None else rows
        for start in range(0, max(len(table), 1), max(step, 1)):
            some = table[list(labels)].iloc[start : start + step].reset_index(drop=True)
            yield Raw(some, partial(_later, place, start))

    return Contents(container, columns, pieces)


def of_channels(
    path: Path, container: str, opened: Callable[[], AbstractContextManager[Sequence[Channel]]]
) -> Contents:
    """Take the vectors of a file, and the columns of its matrices: ``name[1]``, ``name[2]`` and so on."""
    with opened() as channels:
        columns = tuple(own for own, _ in _vectors(channels))

    def pieces(labels: Sequence[str], rows: int | None) -> Iterator[Raw]:
        with opened() as again:
            loads = {own.label: (own, load) for own, load in _vectors(again)}
            size = max((loads[label][0].size or 0 for label in labels), default=0)
            step = size if rows is None else rows
            check_unpacked(path, 8 * len(labels) * min(step, size), "a recording")
            for start in range(0, max(size, 1), max(step, 1)):
                some = slice(start, min(start + step, size))
                values = {label: loads[label][1](some) for label in labels}
                lengths = {label: len(each) for label, each in values.items()}
                if len(set(lengths.values())) > 1:
                    least = min(lengths, key=lengths.__getitem__)
                    sizes = f"{least} has {loads[least][0].size} values, another has {size}"
                    raise FormatError(path, f"{sizes}, expected as many in all: save them at one rate")
                yield Raw(
                    pd.DataFrame({label: each.astype(np.float64) for label, each in values.items()}),
                    partial(_later, _sample, start),
                )

    return Contents(container, columns, pieces)


def _later(place: Callable[[int], str], start: int, row: int) -> str:
    return place(start + row)


def _sample(row: int) -> str:
    return f"sample {row + 1}"


Load = Callable[[slice], np.ndarray]


def _vectors(channels: Sequence[Channel]) -> Iterator[tuple[Own, Load]]:
    """Yield every vector of numbers with its values; a matrix is as many as its shorter side is long."""
    seen: dict[str, int] = {}
    for each in (part for one in channels for part in _real(one)):
        if not math.prod(each.shape):
            continue
        unit = each.unit or parted(each.name)[1]
        seen[each.label] = seen.get(each.label, 0) + 1
        label = each.label if seen[each.label] == 1 else f"{each.label} (number {seen[each.label]})"
        own = Own(label, each.name, unit, math.prod(each.shape), each.clock)
        long = max(each.shape, default=1)
        if own.size == long:
            yield own, each.load
        elif len(each.shape) == 2:
            for k in range(min(each.shape)):
                column = replace(own, label=f"{label}[{k + 1}]", name=f"{each.name}[{k + 1}]", size=long)
                yield column, partial(_of_matrix, each, k)


def _real(channel: Channel) -> Iterator[Channel]:
    """Yield a channel of real numbers, or ``name.real`` and ``name.imag`` of a complex one; else none."""
    if channel.numeric:
        yield channel
    elif channel.pairs:
        for part in ("real", "imag"):
            label, name = f"{channel.label}.{part}", f"{channel.name}.{part}"
            load = partial(_part_of, channel, part)
            yield replace(channel, label=label, name=name, numeric=True, load=load)


def _part_of(channel: Channel, part: str, some: slice) -> np.ndarray:
    values: np.ndarray = getattr(channel.load(some), part)
    return values


def _of_matrix(channel: Channel, column: int, some: slice) -> np.ndarray:
    return _matrix(channel)[some, column]


@functools.lru_cache(maxsize=1)
def _matrix(channel: Channel) -> np.ndarray:
    """Return a matrix, its longer side downwards; its values are stored column by column."""
    table = channel.load(slice(0, math.prod(channel.shape))).reshape(channel.shape, order="F")
    return table if channel.shape[0] >= channel.shape[1] else table.T
