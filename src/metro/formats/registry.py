"""The readers by content and suffix: what a file is, and which function reads it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from metro.formats import matlab, rosbag, rsi, tdms
from metro.formats.dynoware import dynoware_pieces
from metro.formats.e57 import SIGNATURE, e57_pieces
from metro.formats.errors import FormatError
from metro.formats.kinds import KINDS, Kind, Raw, at_least, checked
from metro.formats.pcd import pcd_pieces
from metro.formats.ply import ply_pieces
from metro.formats.pts import pts_pieces
from metro.formats.signals import csv_pieces, parquet_pieces, read_npz
from metro.formats.stl import stl_pieces
from metro.formats.uff import COHERENCE, FRF, Function, read_functions, read_uff
from metro.formats.x3p import read_x3p
from metro.formats.xyz import xyz_pieces

Pieces = Callable[[Path, Kind, int | None], Iterator[Raw]]

_HEAD = 512
_FIRST_ROWS = 32
_TABLES = tuple(KINDS)
_CHANNELS = tuple(kind for kind in _TABLES if kind != "cloud")
_ANY: tuple[bytes, ...] = (b"",)
_UNIVERSAL = (b"-1\n", b"-1\r", b"-1".ljust(76))  # a mark on a line of its own


@dataclass(frozen=True)
class Format:
    """A file format.

    Attributes
    ----------
    title : its name in messages.
    suffixes : the suffixes of its files.
    starts : what the content starts with; plain text starts with anything.
    kinds : the kinds of table it can hold.
    read : ``(path, kind, rows) -> Raw``; reads all rows where ``rows`` is None.
    pieces : ``(path, kind, rows) -> iterator of Raw``, all rows by so many; None where a file is read whole.
    """

    title: str
    suffixes: tuple[str, ...]
    starts: tuple[bytes, ...]
    kinds: tuple[str, ...]
    read: Callable[[Path, Kind, int | None], Raw]
    pieces: Pieces | None = None


def _pieces(
    title: str, suffixes: tuple[str, ...], starts: tuple[bytes, ...], kinds: tuple[str, ...], pieces: Pieces
) -> Format:
    """Describe a format that is read in pieces: the first is what :attr:`Format.read` gives."""
    return Format(title, suffixes, starts, kinds, lambda *asked: next(pieces(*asked)), pieces)


def _cloud(title: str, suffixes: tuple[str, ...], starts: tuple[bytes, ...], pieces: Pieces) -> Format:
    return _pieces(title, suffixes, starts, ("cloud",), pieces)


# Content is asked first, in this order; plain text comes last because it has no mark of its own.
FORMATS = (
    _pieces("Parquet", (".parquet", ".pq"), (b"PAR1",), _TABLES, parquet_pieces),
    Format("NumPy archive", (".npz",), (b"PK\x03\x04",), ("frf",), read_npz),
    _cloud("PLY", (".ply",), (b"ply\n", b"ply\r"), ply_pieces),
    _cloud("PCD", (".pcd",), (b"# .PCD", b"#.PCD", b"VERSION"), pcd_pieces),
    _cloud("E57", (".e57",), (SIGNATURE,), e57_pieces),
    Format("universal", (".uff", ".unv", ".uf"), _UNIVERSAL, ("frf",), read_uff),
    Format("KUKA RSI recording", (".rsi", ".xml"), rsi.STARTS, ("robot",), rsi.read_rsi),
    Format("ROS 2 bag", (".mcap", ".db3"), rosbag.STARTS, ("robot",), rosbag.read_rosbag),
    _pieces("DynoWare text export", (".txt", ".csv"), (b"DynoWare",), ("force",), dynoware_pieces),
    _pieces("TDMS", (".tdms",), (tdms.START,), _CHANNELS, tdms.tdms_pieces),
    _pieces("MATLAB", (".mat",), matlab.STARTS, _CHANNELS, matlab.mat_pieces),
    Format("X3P", (".x3p",), (b"PK\x03\x04",), ("profile",), read_x3p),
    _cloud("PTS", (".pts",), _ANY, pts_pieces),
    _cloud("STL", (".stl",), _ANY, stl_pieces),
    _cloud("point list", (".xyz", ".txt", ".asc", ".csv"), _ANY, xyz_pieces),
    _pieces("CSV", (".csv", ".txt"), _ANY, _CHANNELS, csv_pieces),
)


def read(path: Path, kind: str) -> pd.DataFrame:
    """Read a data file.

    Parameters
    ----------
    kind : ``force``, ``robot``, ``path``, ``profile``, ``cloud``, ``record`` or ``frf``.

    Returns
    -------
    pandas.DataFrame
        The columns of :data:`metro.formats.kinds.KINDS`, float64 (whole numbers int64), checked.

    Raises
    ------
    FormatError
        Naming file, place, column, what was found and what was expected.
    """
    return checked(path, KINDS[kind], _format_of(path, kind).read(path, KINDS[kind], None), KINDS[kind].least)


def read_pieces(path: Path, kind: str, rows: int) -> Iterator[pd.DataFrame]:
    """Read a data file as :func:`read` in pieces of so many rows, for what is larger than memory.

    Formats that have no pieces (compressed PCD, STL, X3P, bags, …) are read whole.
    """
    asked, found = KINDS[kind], 0
    format_ = _format_of(path, kind)
    whole = (format_.read(path, asked, None) for _ in range(1))
    last = -np.inf
    for raw in format_.pieces(path, asked, rows) if format_.pieces else whole:
        table = checked(path, asked, raw, 0, after=last)
        found += len(table)
        last = table[asked.rising].iloc[-1] if asked.rising and len(table) else last
        yield table
    at_least(path, asked, found, asked.least)


def sniff(path: Path, kind: str) -> None:
    """Check header and first rows of a data file, quickly; raises FormatError as :func:`read` would."""
    checked(path, KINDS[kind], _format_of(path, kind).read(path, KINDS[kind], _FIRST_ROWS), 1)


class ReadFrf(NamedTuple):
    """An FRF of a file; ``reference``, ``response`` and ``unit`` are "" where the file does not tell."""

    reference: str
    response: str
    unit: str
    table: pd.DataFrame


def read_frfs(path: Path) -> list[ReadFrf]:
    """Read every FRF of a data file; only universal files hold more than one, and say where each was taken.

    Raises
    ------
    FormatError
        As :func:`read`.
    """
    kind = KINDS["frf"]
    if _format_of(path, "frf").read is not read_uff:
        return [ReadFrf("", "", "", read(path, "frf"))]
    functions = read_functions(path)
    coherence = {(each.reference, each.response): each for each in functions if each.kind == COHERENCE}
    found = []
    for each in functions:
        if each.kind == FRF:
            raw = _table(each, coherence.get((each.reference, each.response)))
            place = partial(_line, f"{each.reference} to {each.response}")
            table = checked(path, kind, Raw(raw, place), kind.least)
            found.append(ReadFrf(each.reference, each.response, each.unit, table))
    if not found:
        raise FormatError(path, f"found no function of type {FRF}, expected {kind.title}")
    return found


def _line(pair: str, row: int) -> str:
    return f"{pair}, line {row + 1}"


def _table(frf: Function, coherence: Function | None) -> pd.DataFrame:
    table = pd.DataFrame({"frequency_hz": frf.frequency, "real": frf.values.real, "imag": frf.values.imag})
    if coherence is not None and np.array_equal(coherence.frequency, frf.frequency):
        table["coherence"] = coherence.values.real
    return table


def _format_of(path: Path, kind: str) -> Format:
    """Find the format by content, then by suffix; a file named as one and holding another is an error."""
    suffix = path.suffix.lower()
    try:
        with path.open("rb") as stream:
            head = stream.read(_HEAD).removeprefix(b"\xef\xbb\xbf").lstrip()
    except OSError as error:
        raise FormatError(path, f"cannot be opened: {error.strerror}") from error
    title = KINDS[kind].title
    if not head:
        raise FormatError(path, f"is empty, expected {title}")
    known = [each for each in FORMATS if each.starts != _ANY and head.startswith(each.starts)]
    named = [each for each in FORMATS if suffix in each.suffixes and each.starts == _ANY]
    for each in known or named:
        if kind in each.kinds:
            return each
    if known or named:
        found = max(known or named, key=lambda each: suffix in each.suffixes)  # archives all start alike
        raise FormatError(path, f"found a {found.title} file, expected {title}")
    marked = [each.title for each in FORMATS if suffix in each.suffixes]
    if marked:
        raise FormatError(
            path, f"is named {suffix} but does not start as a {marked[0]} file, expected {title}"
        )
    suffixes = sorted({s for each in FORMATS if kind in each.kinds for s in each.suffixes})
    raise FormatError(path, f"found the suffix {suffix!r}, expected one of {', '.join(suffixes)} for {title}")
