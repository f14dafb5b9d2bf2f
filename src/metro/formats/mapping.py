"""How a file that is not in the contract's own form is read: what of it is which column of the contract."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from metro.formats.channels import Clock, automatic, unit_in_name
from metro.formats.contents import Contents, Own
from metro.formats.errors import FormatError
from metro.formats.kinds import Kind, Raw
from metro.formats.measures import (
    OF_COLUMN,
    RESPONSES,
    Measure,
    MeasureError,
    by_sensitivity,
    first_spellings,
    measure,
    per_force,
)
from metro.formats.text_layout import TextOptions
from metro.spelling import suggestion

RECORD = "{record}"
# Key of a mapping → the column that it makes of the row's number, counted from 0, and how.
STEPS: dict[str, tuple[str, Callable[[np.ndarray, float], np.ndarray]]] = {
    "rate_hz": ("t_s", lambda row, rate: row / rate),
    "spacing_mm": ("x_mm", lambda row, spacing: row * spacing),
    "resolution_hz": ("frequency_hz", lambda row, resolution: row * resolution),
}
Open = Callable[[Path, Kind, TextOptions], Contents]


@dataclass(frozen=True)
class From:
    """Where a column of the contract comes from.

    Attributes
    ----------
    column : the file's own name or number (from 1); None for the name that the contract has.
    file : another file, relative to the folder of the one that the table names; "" for this one.
    unit : what the file's numbers are in, after ``scale``; "" where the file states it or the name says it.
    scale : the file's numbers are multiplied by it; -1 turns a sign.
    sensitivity : of the sensor, as ``10.2 mV/g`` or ``200 N/V``.
    """

    column: str | int | None = None
    file: str = ""
    unit: str = ""
    scale: float = 1.0
    sensitivity: str = ""


@dataclass(frozen=True)
class FileMapping:
    """A mapping of ``batch.yaml``: how the files of a pattern are read.

    Attributes
    ----------
    key : what messages call it.
    columns : column of the contract → where it comes from; a column that is not named is read as ever.
    text : what is stated of a text file.
    steps : key of :data:`STEPS` → its number.
    """

    key: str
    columns: Mapping[str, From] = field(default_factory=dict)
    text: TextOptions = field(default_factory=TextOptions)
    steps: Mapping[str, float] = field(default_factory=dict)

    def beside(self, record: str) -> list[str]:
        """Return the other files that a record is read from, relative to the folder of the named one."""
        return list(dict.fromkeys(filled(one.file, record) for one in self.columns.values() if one.file))


@dataclass(frozen=True)
class Source:
    """What a table of a batch names: a file, the record of it, and how it is read where not as ever."""

    path: Path
    record: str = ""
    mapping: FileMapping | None = None


def mapping_of(key: str, given: Mapping[str, Any]) -> FileMapping:
    """Make a mapping of what ``batch.yaml`` holds, which its schema has checked."""
    columns = {}
    for name, entry in (given.get("columns") or {}).items():
        one = dict(entry) if isinstance(entry, Mapping) else {"from": entry}
        columns[name] = From(
            one.get("from"),
            one.get("file", ""),
            one.get("unit", ""),
            float(one.get("scale", 1)),
            one.get("sensitivity", ""),
        )
    text = TextOptions(given.get("start_row"), given.get("delimiter"), given.get("decimal"))
    return FileMapping(key, columns, text, {name: float(given[name]) for name in STEPS if name in given})


def factor_to(column: str, given: From) -> tuple[float, str]:
    """Return the factor from a file's numbers to a column of the contract, and the unit of a response or "".

    Raises
    ------
    MeasureError
        Where a unit or a sensitivity is unknown, or is not of what the column is.
    """
    if column in ("real", "imag"):
        read = per_force(given.unit) if given.unit else Measure("", 1.0, "")
    else:
        read = measure(given.unit, _asked(column))
    if given.sensitivity:
        read = by_sensitivity(read, given.sensitivity)
    if column in ("response", "real", "imag"):
        if not read.quantity:
            return given.scale, ""
        if read.unit == "g" and read.factor:  # impacts.csv has it, too
            grams = measure("g").factor
            return given.scale * (read.factor / grams), "g"
        if read.quantity not in RESPONSES:
            raise MeasureError(_of_another(column, read, tuple(RESPONSES)))
        unit, to_unit = RESPONSES[read.quantity]
        return given.scale * (read.factor * to_unit), unit
    asked = _asked(column)
    if read.quantity and read.quantity != asked:
        raise MeasureError(_of_another(column, read, (asked,) if asked else ()))
    return given.scale * read.factor, ""


def _asked(column: str) -> str:
    """Return the quantity that the unit in a column's name is of; "" where it has none."""
    return OF_COLUMN.get(column.rpartition("_")[2], "") if "_" in column else ""


def _of_another(column: str, read: Measure, asked: Sequence[str]) -> str:
    """Say that a unit is not one of what a column is."""
    if not asked:
        return f"found the unit {read.unit}, expected none: {column} has no unit"
    hint = ""
    if read.quantity in ("voltage", "current", "charge"):
        hint = f": state the sensitivity too, as 200 {first_spellings(asked)[0]}/{read.unit}"
    return f"found the unit {read.unit}, expected one of {', '.join(first_spellings(asked))}{hint}"


def mapped_pieces(source: Source, kind: Kind, rows: int | None, opened: Open) -> Iterator[Raw]:
    """Read a mapped file in pieces of so many rows, at once where None: the contract's columns and units.

    Raises
    ------
    FormatError
        Naming the key of ``batch.yaml``, what the file has, and what was probably meant.
    """
    mapping = source.mapping
    assert mapping is not None
    _check_record(source, mapping)
    asked = {name: given for name, given in mapping.columns.items() if name in kind.columns}
    made = {
        column: (key, make)
        for key, (column, make) in STEPS.items()
        if key in mapping.steps and column in kind.required
    }
    files = {"": source.path} | {
        one.file: source.path.parent / filled(one.file, source.record) for one in asked.values() if one.file
    }
    contents = {}
    for file, path in files.items():
        if not path.is_file():
            message = (
                f"batch.yaml, {mapping.key}: {path.name} is not there, expected it beside {source.path.name}"
            )
            raise FormatError(source.path, message)
        contents[file] = opened(path, kind, mapping.text)
    taken: dict[str, tuple[str, Own, float]] = {}
    unit = ""
    for name, given in asked.items():
        own = _find(source, mapping, contents[given.file], name, given)
        stated = given if given.unit or given.column is None else _with_unit(given, own)
        factor, response = _factor(source, mapping, name, stated)
        taken[name] = (given.file, own, factor)
        unit = unit or response
    here = contents[""]
    others = set(kind.columns) - taken.keys() - made.keys()
    named = [(each.label, each.name, each.unit) for each in here.columns]
    for at, name, factor in automatic(source.path, kind, named, others):
        taken[name] = ("", here.columns[at], factor)
    clock = _clock(taken) if "t_s" in kind.required and not {"t_s"} & (taken.keys() | made.keys()) else None
    _check_complete(source, mapping, kind, here, {*taken, *made, *(["t_s"] if clock else [])})
    start = 0
    for raws in _together(source, contents, taken, rows):
        frame = pd.DataFrame(
            {
                name: raws[file].frame[own.label].to_numpy(np.float64) * factor
                for name, (file, own, factor) in taken.items()
            }
        )
        index = np.arange(start, start + len(frame), dtype=np.float64)
        for column, (key, make) in made.items():
            frame[column] = make(index, mapping.steps[key])
        if clock:
            frame["t_s"] = clock.offset + clock.step * index
        start += len(frame)
        ordered = frame[[name for name in kind.columns if name in frame]]
        ordered.attrs.update({"response_unit": unit} if unit else {})
        yield Raw(ordered, next(iter(raws.values())).place)


def _check_record(source: Source, mapping: FileMapping) -> None:
    wanted = any(RECORD in f"{one.column}{one.file}" for one in mapping.columns.values())
    if wanted and not source.record:
        message = f"batch.yaml, {mapping.key}: asks for one record by {RECORD}, which the table does not name"
        raise FormatError(source.path, f'{message}: write "{source.path.name}#1" for the record 1')
    if source.record and not wanted:
        message = (
            f"batch.yaml, {mapping.key}: has no {RECORD}, but the table names the record {source.record}"
        )
        raise FormatError(source.path, f"{message}: write {RECORD} where the names of the columns have it")


def filled(text: str, record: str) -> str:
    """Return a name of a mapping with the record's own in it."""
    return text.replace(RECORD, record)


def _find(source: Source, mapping: FileMapping, contents: Contents, name: str, given: From) -> Own:
    """Find the column of a file that is asked for."""
    place = f"{mapping.key}.columns.{name}"
    asked = name if given.column is None else given.column
    file = filled(given.file, source.record) or source.path.name
    if isinstance(asked, int):
        if 1 <= asked <= len(contents.columns):
            return contents.columns[asked - 1]
        count = len(contents.columns)
        raise FormatError(
            source.path,
            f"batch.yaml, {place}: asks for column {asked}, {file} has {count}{_listed(contents)}",
        )
    wanted = filled(asked, source.record)
    for same in (str.__eq__, lambda a, b: a.strip().lower() == b.strip().lower()):
        # the label of a column that shares its name with another is a name, too
        found = [each for each in contents.columns if same(each.name, wanted) or same(each.label, wanted)]
        if len(found) == 1:
            return found[0]
        if found:
            labels = ", ".join(each.label for each in found)
            raise FormatError(
                source.path, f'{place}: "{wanted}" is the name of {labels}: give the number of one'
            )
    hint = suggestion(wanted, [each.name for each in contents.columns if each.name]) + _records(
        asked, contents
    )
    raise FormatError(
        source.path, f'batch.yaml, {place}: found no "{wanted}" in {file}{hint}{_listed(contents)}'
    )


def _records(asked: str, contents: Contents) -> str:
    """Say which records a file has."""
    if RECORD not in asked:
        return ""
    pattern = re.escape(asked).replace(re.escape(RECORD), "(.+)")
    found = [match[1] for each in contents.columns if (match := re.fullmatch(pattern, each.name))]
    return f"; it has the records {', '.join(found)}" if found else ""


def _listed(contents: Contents) -> str:
    names = [each.name or each.label for each in contents.columns]
    more = f" and {len(names) - 40} more" if len(names) > 40 else ""
    return f": it has the columns {', '.join(names[:40])}{more}"


def _with_unit(given: From, own: Own) -> From:
    """Take the unit that the file states, where the mapping states none."""
    return From(given.column, given.file, own.unit, given.scale, given.sensitivity)


def _factor(source: Source, mapping: FileMapping, name: str, given: From) -> tuple[float, str]:
    asked = name.rpartition("_")[2] if "_" in name else ""
    if not given.unit and not given.sensitivity and asked in OF_COLUMN and given.column is not None:
        own = str(given.column)
        if not unit_in_name(own, asked):
            units = ", ".join(first_spellings((OF_COLUMN[asked],)))
            place = f"batch.yaml, {mapping.key}.columns.{name}"
            raise FormatError(source.path, f"{place}: states no unit, expected unit: one of {units}")
    try:
        return factor_to(name, given)
    except MeasureError as error:
        raise FormatError(source.path, f"batch.yaml, {mapping.key}.columns.{name}: {error}") from error


def _clock(taken: Mapping[str, tuple[str, Own, float]]) -> Clock | None:
    """Return the clock of the columns of a file, where they have one and the same."""
    clocks = {own.clock for _, own, _ in taken.values()}
    return clocks.pop() if len(clocks) == 1 else None


def _check_complete(
    source: Source, mapping: FileMapping, kind: Kind, here: Contents, there: set[str]
) -> None:
    missing = kind.lacking(there)
    if not missing and (fault := kind.fault(sorted(there))):
        message = f"batch.yaml, {mapping.key}: says nothing of {fault}"
        raise FormatError(source.path, f"{message}, expected under columns for {kind.title}{_listed(here)}")
    if not missing:
        return
    step = next((key for key, (column, _) in STEPS.items() if column in missing), "")
    hint = f", or state {step}" if step else ""
    message = f"batch.yaml, {mapping.key}: says nothing of {', '.join(missing)} of {kind.title}"
    raise FormatError(source.path, f"{message}, expected them under columns{hint}{_listed(here)}")


def _together(
    source: Source,
    contents: Mapping[str, Contents],
    taken: Mapping[str, tuple[str, Own, float]],
    rows: int | None,
) -> Iterator[dict[str, Raw]]:
    """Yield the pieces of all files beside each other; they have as many rows."""
    used = {
        file: list(dict.fromkeys(own.label for at, own, _ in taken.values() if at == file))
        for file in contents
    }
    streams = {file: contents[file].pieces(labels, rows) for file, labels in used.items() if labels}
    total = dict.fromkeys(streams, 0)
    for pieces in zip_longest(*streams.values()):
        lengths = [0 if piece is None else len(piece.frame) for piece in pieces]
        total = {file: total[file] + length for file, length in zip(streams, lengths, strict=True)}
        if len(set(lengths)) > 1:
            more = "" if rows is None else " or more"
            each = " and ".join(f"{n}{more} in {file or source.path.name}" for file, n in total.items())
            raise FormatError(
                source.path,
                f"found different numbers of rows, {each}, expected as many in all: are these files of one "
                "record? Name those that are, or cut the longer one off where the shorter one ends",
            )
        yield dict(zip(streams, pieces, strict=True))
