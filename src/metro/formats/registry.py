"""The readers by content and suffix: what a file is, and which function reads it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from metro.formats import cutpro, gocator, matlab, rosbag, rsi, signalcalc, softgauge, sur, tdms
from metro.formats.closed import closed
from metro.formats.contents import Contents, of_channels, of_frame, of_text
from metro.formats.dynoware import dynoware_pieces
from metro.formats.e57 import SIGNATURE, e57_pieces
from metro.formats.errors import FormatError
from metro.formats.gocator import read_gocator
from metro.formats.kinds import KINDS, Kind, Raw, at_least, checked, whole
from metro.formats.mapping import Source, mapped_pieces
from metro.formats.pcd import pcd_pieces
from metro.formats.ply import ply_pieces
from metro.formats.pts import pts_pieces
from metro.formats.signalcalc import read_signalcalc
from metro.formats.signals import csv_pieces, npz_channels, parquet_contents, parquet_pieces, read_npz
from metro.formats.softgauge import read_softgauge
from metro.formats.stl import stl_pieces
from metro.formats.text import unpacked
from metro.formats.text_layout import TextOptions
from metro.formats.uff import COHERENCE, FRF, Function, read_functions, read_uff, without_frf
from metro.formats.x3p import read_x3p
from metro.formats.xyz import xyz_pieces

Pieces = Callable[[Path, Kind, int | None], Iterator[Raw]]

_HEAD = 512
_FIRST_ROWS = 32
_TABLES = tuple(KINDS)
_CHANNELS = tuple(kind for kind in _TABLES if kind != "cloud")
_TEXT = ("point list", "CSV")  # what a text may be, whatever its suffix
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
    contents : ``(path, options) -> Contents``, what a file has in its own names; None where it has none.
    holds : what the start of the content has somewhere, where formats start alike.
    """

    title: str
    suffixes: tuple[str, ...]
    starts: tuple[bytes, ...]
    kinds: tuple[str, ...]
    read: Callable[[Path, Kind, int | None], Raw]
    pieces: Pieces | None = None
    contents: Callable[[Path, TextOptions], Contents] | None = None
    holds: bytes = b""


def _pieces(
    title: str, suffixes: tuple[str, ...], starts: tuple[bytes, ...], kinds: tuple[str, ...], pieces: Pieces
) -> Format:
    """Describe a format that is read in pieces: the first is what :attr:`Format.read` gives."""
    return Format(title, suffixes, starts, kinds, lambda *asked: next(pieces(*asked)), pieces)


def _tdms(path: Path, _options: TextOptions) -> Contents:
    return of_channels(path, "TDMS", partial(tdms.tdms_channels, path))


def _mat(path: Path, _options: TextOptions) -> Contents:
    return of_channels(path, "MATLAB", partial(matlab.mat_channels, path, "a MATLAB file"))


def _npz(path: Path, _options: TextOptions) -> Contents:
    return of_channels(path, "NumPy archive", partial(npz_channels, path))


def _parquet(path: Path, _options: TextOptions) -> Contents:
    return parquet_contents(path)


def _cloud(title: str, suffixes: tuple[str, ...], starts: tuple[bytes, ...], pieces: Pieces) -> Format:
    return _pieces(title, suffixes, starts, ("cloud",), pieces)


# Content is asked first, in this order; plain text comes last because it has no mark of its own.
FORMATS = (
    replace(_pieces("Parquet", (".parquet", ".pq"), (b"PAR1",), _TABLES, parquet_pieces), contents=_parquet),
    Format("NumPy archive", (".npz",), (b"PK\x03\x04",), ("frf",), read_npz, contents=_npz),
    _cloud("PLY", (".ply",), (b"ply\n", b"ply\r"), ply_pieces),
    _cloud("PCD", (".pcd",), (b"# .PCD", b"#.PCD", b"VERSION"), pcd_pieces),
    _cloud("E57", (".e57",), (SIGNATURE,), e57_pieces),
    Format("universal", (".uff", ".unv", ".uf"), _UNIVERSAL, ("frf",), read_uff),
    Format("SignalCalc text", (), signalcalc.STARTS, ("frf",), read_signalcalc, holds=signalcalc.HOLDS),
    Format("CutPro FRF", cutpro.SUFFIXES, _ANY, ("frf",), cutpro.read_cutpro),
    Format("Gocator CSV", (), gocator.STARTS, ("cloud",), read_gocator),
    Format("software gauge", (), softgauge.STARTS, ("profile",), read_softgauge, holds=softgauge.HOLDS),
    Format("KUKA RSI recording", (".rsi", ".xml"), rsi.STARTS, ("robot", "joints"), rsi.read_rsi),
    Format("ROS 2 bag", (".mcap", ".db3"), rosbag.STARTS, ("robot", "joints"), rosbag.read_rosbag),
    replace(
        _pieces("DynoWare text export", (".txt", ".csv"), (b"DynoWare",), ("force",), dynoware_pieces),
        contents=of_text,
    ),
    replace(_pieces("TDMS", (".tdms",), (tdms.START,), _CHANNELS, tdms.tdms_pieces), contents=_tdms),
    replace(_pieces("MATLAB", (".mat",), matlab.STARTS, _CHANNELS, matlab.mat_pieces), contents=_mat),
    Format("SUR", (".sur", ".pro"), sur.STARTS, ("profile", "cloud"), sur.read_sur),
    Format("X3P", (".x3p",), (b"PK\x03\x04",), ("profile", "cloud"), read_x3p),
    replace(_cloud("PTS", (".pts",), _ANY, pts_pieces), contents=of_text),
    _cloud("STL", (".stl",), _ANY, stl_pieces),
    replace(_cloud("point list", (".xyz", ".txt", ".asc", ".csv"), _ANY, xyz_pieces), contents=of_text),
    replace(_pieces("CSV", (".csv", ".txt"), _ANY, _CHANNELS, csv_pieces), contents=of_text),
)


def read(source: Path | Source, kind: str) -> pd.DataFrame:
    """Read a data file.

    Parameters
    ----------
    source : the file, or a file with the mapping of ``batch.yaml`` by which it is read.
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
    path, raws = _opened(source, kind, None)
    return whole(path, checked(path, KINDS[kind], next(raws), KINDS[kind].least))


def read_pieces(source: Path | Source, kind: str, rows: int) -> Iterator[pd.DataFrame]:
    """Read a data file as :func:`read` in pieces of so many rows, for what is larger than memory.

    Formats that have no pieces (compressed PCD, STL, X3P, bags, …) are read whole.
    """
    asked, rows_read = KINDS[kind], 0
    path, raws = _opened(source, kind, rows)
    last, table = -np.inf, pd.DataFrame()
    for raw in raws:
        table = checked(path, asked, raw, 0, after=last)
        rows_read += len(table)
        last = table[asked.rising].iloc[-1] if asked.rising and len(table) else last
        yield table
    at_least(path, asked, rows_read, asked.least)
    whole(path, table)


def sniff(source: Path | Source, kind: str) -> None:
    """Check header and first rows of a data file, quickly; raises FormatError as :func:`read` would."""
    path, raws = _opened(source, kind, _FIRST_ROWS, first=True)
    checked(path, KINDS[kind], next(raws), 1, head=True)


def stated_kinds(path: Path) -> tuple[str, ...]:
    """Return the kinds of table that a file can hold by its format's mark; none of a text without one."""
    return tuple(dict.fromkeys(kind for each in _recognised(path, "a data file") for kind in each.kinds))


def open_contents(path: Path, kind: str | Kind, options: TextOptions) -> Contents:
    """Find what a file has in its own names and units, or, of a format without these, in those of a kind.

    Raises
    ------
    FormatError
        Where the file cannot be read, or its format holds nothing of the kind.
    """
    name = kind if isinstance(kind, str) else next(name for name, each in KINDS.items() if each is kind)
    candidates = _recognised(path, KINDS[name].title) or _by_suffix(path, KINDS[name].title)
    holding = [each for each in candidates if name in each.kinds]
    for each in holding or candidates:
        if each.contents:
            return each.contents(path, options)
    format_ = _format_of(path, name)
    raw = format_.read(path, KINDS[name], None)
    return of_frame(format_.title, raw.frame, raw.place)


def _opened(
    source: Path | Source, kind: str, rows: int | None, *, first: bool = False
) -> tuple[Path, Iterator[Raw]]:
    """Open a data file: its path and its pieces; the ``first`` one alone where no more is asked for."""
    one = source if isinstance(source, Source) else Source(source)
    asked = KINDS[kind]
    if one.mapping is not None:
        return one.path, mapped_pieces(one, asked, rows, open_contents)
    format_ = _format_of(one.path, kind)
    if format_.pieces and not first:
        return one.path, format_.pieces(one.path, asked, rows)
    return one.path, (format_.read(one.path, asked, rows if first else None) for _ in range(1))


class ReadFrf(NamedTuple):
    """An FRF of a file; ``reference``, ``response`` and ``unit`` are "" where the file has none."""

    reference: str
    response: str
    unit: str
    table: pd.DataFrame


def read_frfs(source: Path | Source) -> list[ReadFrf]:
    """Read every FRF of a data file; only universal files hold several, and state where each was taken.

    Raises
    ------
    FormatError
        As :func:`read`.
    """
    kind = KINDS["frf"]
    one = source if isinstance(source, Source) else Source(source)
    path = one.path
    if one.mapping is not None or _format_of(path, "frf").read is not read_uff:
        table = read(one, "frf")
        return [ReadFrf("", "", table.attrs.get("response_unit", ""), table)]
    functions = read_functions(path)
    coherence = {(each.reference, each.response): each for each in functions if each.kind == COHERENCE}
    frfs = []
    for each in functions:
        if each.kind == FRF:
            raw = _table(each, coherence.get((each.reference, each.response)))
            place = partial(_line, f"{each.reference} to {each.response}")
            table = checked(path, kind, Raw(raw, place), kind.least)
            frfs.append(ReadFrf(each.reference, each.response, each.unit, table))
    if not frfs:
        raise FormatError(path, f"{without_frf(path)}, expected {kind.title}")
    return frfs


def _line(pair: str, row: int) -> str:
    return f"{pair}, line {row + 1}"


def _table(frf: Function, coherence: Function | None) -> pd.DataFrame:
    table = pd.DataFrame({"frequency_hz": frf.frequency, "real": frf.values.real, "imag": frf.values.imag})
    if coherence is not None and np.array_equal(coherence.frequency, frf.frequency):
        table["coherence"] = coherence.values.real
    return table


def _format_of(path: Path, kind: str) -> Format:
    """Find the format by content, then by suffix; a file that holds something else is an error."""
    title = KINDS[kind].title
    candidates = _recognised(path, title) or _by_suffix(path, title)
    for each in candidates:
        if kind in each.kinds:
            return each
    suffix = path.suffix.lower()
    recognised = max(candidates, key=lambda each: suffix in each.suffixes)
    raise FormatError(path, f"found a {recognised.title} file, expected {title}")


def _recognised(path: Path, title: str) -> list[Format]:
    """Return the formats that the start of a file has the mark of."""
    head = _head(path)
    if not head.strip():
        raise FormatError(path, f"is empty, expected {title}")
    marked = [each for each in FORMATS if each.starts != _ANY and head.startswith(each.starts)]
    right = [each for each in marked if each.holds in head]
    return sorted(
        right, key=lambda each: path.suffix.lower() not in each.suffixes
    )  # archives all start alike


def _by_suffix(path: Path, title: str) -> list[Format]:
    """Return the formats without a mark that a file can be of: those of its suffix first, then, of text, all.

    Raises
    ------
    FormatError
        Where the suffix is that of a format with a mark, which the file has not, or of a program whose files
        cannot be read, or where the file is no text.
    """
    suffix = path.suffix.lower()
    if message := closed(suffix):
        raise FormatError(path, message)
    plain = [each for each in FORMATS if each.starts == _ANY]
    named = [each for each in plain if suffix in each.suffixes]
    marked = [each.title for each in FORMATS if suffix in each.suffixes]
    if marked and not named:
        message = f"is named {suffix} but does not start as a {marked[0]} file, expected {title}"
        raise FormatError(path, message)
    if named:
        return [*named, *(each for each in plain if each.title in _TEXT and each not in named)]
    if b"\0" in _head(path):
        titles = ", ".join(each.title for each in FORMATS)
        raise FormatError(path, f"is no text and has the mark of no format that can be read ({titles})")
    return [each for each in plain if each.title in _TEXT]


def _head(path: Path) -> bytes:
    """Return the start of a file, unpacked where it is a gzip file, without byte order mark and blanks."""
    try:
        with unpacked(path) as stream:
            return stream.read(_HEAD).removeprefix(b"\xef\xbb\xbf").lstrip()
    except OSError as error:
        raise FormatError(path, f"cannot be opened: {error.strerror}") from error
