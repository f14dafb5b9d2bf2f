"""The files of a batch folder: read one at a time, with what is wrong with them and how good they are."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import pandas as pd

from metro.batch.findings import Finding as Problem
from metro.batch.sources import Files, source
from metro.formats import FormatError
from metro.formats.mapping import filled
from metro.formats.registry import ReadFrf, read, read_frfs, read_pieces, sniff
from metro.signals import quality
from metro.slips.copies import digest
from metro.units import Array

# Checks that a recording must pass to be used; one that does not is left out, and the report says so.
MUST_PASS = frozenset({"dead channel", "clipping", "channels alike", "motion", "FRF convention"})
LEFT_OUT = "; the recording is left out"


@dataclass
class Recordings:
    """Reads the files of a batch folder, and gathers what is wrong with them and how good they are.

    Attributes
    ----------
    advance : called when a file has been read.
    files : the mappings of ``batch.yaml`` by which files are read.
    problems : files that could not be read; they give no part.
    findings : rows of the quality table.
    zeros : run → the dynamometer's first time stamp, s: the zero of all clocks of that run.
    paths : run → extents (2,) of its programmed path in x and y, mm.
    left_out : run and column of runs.csv of each recording that is not fit for use.
    usable : files of impacts.csv with at least one hit or FRF that is fit for use.
    channels : hash of the values of each channel of a hammer record → column, name of its file, blow.
    """

    folder: Path
    advance: Callable[[], None]
    files: Files = field(default_factory=dict)
    problems: list[Problem] = field(default_factory=list)
    findings: list[dict[str, object]] = field(default_factory=list)
    zeros: dict[str, float] = field(default_factory=dict)
    paths: dict[str, Array] = field(default_factory=dict)
    left_out: list[tuple[str, str]] = field(default_factory=list)
    usable: set[str] = field(default_factory=set)
    channels: dict[str, tuple[str, str, Hashable]] = field(default_factory=dict)

    def table(self, file: str, kind: str) -> pd.DataFrame | None:
        """Read a file; None, and a problem gathered, where that is impossible."""
        try:
            return read(source(self.folder, file, self.files), kind)
        except FormatError as error:
            self.problems.append(Problem("error", file, error.message))
            return None
        finally:
            self.advance()

    def holds(self, file: str, kind: str) -> bool:
        """Return whether a file can be read as a kind of table, by its head."""
        try:
            sniff(source(self.folder, file, self.files), kind)
        except FormatError:
            return False
        return True

    def pieces(self, file: str, kind: str, rows: int, *, again: bool = False) -> Iterator[pd.DataFrame]:
        """Read a file in pieces of so many rows; what cannot be read ends it, a problem gathered.

        ``again``: it was read before, and is no step of the progress; it may have been changed since.
        """
        try:
            yield from read_pieces(source(self.folder, file, self.files), kind, rows)
        except FormatError as error:
            self.problems.append(Problem("error", file, error.message))
        finally:
            if not again:
                self.advance()

    def frfs(self, file: str) -> list[ReadFrf]:
        """Read every FRF of a file; none, and a problem gathered, where that is impossible."""
        try:
            return read_frfs(source(self.folder, file, self.files))
        except FormatError as error:
            self.problems.append(Problem("error", file, error.message))
            return []
        finally:
            self.advance()

    def note(self, file: str, run: str, findings: list[quality.Finding]) -> None:
        """Add findings on a file to the quality table."""
        self.findings += [{"file": file, "run": run, **finding._asdict()} for finding in findings]

    def note_read(self, file: str, run: str, table: pd.DataFrame) -> None:
        """Add to the quality table what the reader of a file noted (:class:`metro.formats.packets.Note`)."""
        self.note(file, run, [quality.Finding(*note) for note in table.attrs.get("notes", ())])

    def doubt(self, file: str, message: str) -> bool:
        """Gather a problem of a file, where there is one (""); return whether there is."""
        self.problems += [Problem("error", file, message)] if message else []
        return bool(message)

    def copied(self, file: str, column: str, values: Array, blow: Hashable) -> bool:
        """Gather a problem where a channel has the bits of one of another file; return whether it has.

        Several responses of one ``blow`` share its force.
        """
        key = digest(values)
        its, other, hit = self.channels.setdefault(key, (column, file, blow)) if key else (column, file, blow)
        shared = its == column == "force_n" and hit == blow
        if other == file or shared:
            return False
        here, there = self._recorded(file, column), self._recorded(other, its)
        return self.doubt(
            file,
            f"{column}: {here} has the same values as {there}, bit for bit, expected a recording of its own; "
            "one was copied over the other: export that one again, or leave its row out of impacts.csv",
        )

    def _recorded(self, file: str, column: str) -> str:
        """Return the name of the file that a column is read from."""
        one = source(self.folder, file, self.files)
        given = one.mapping.columns.get(column) if one.mapping else None
        return filled(given.file, one.record) if given and given.file else file

    def fit(self, file: str, run: str, column: str, findings: list[quality.Finding]) -> bool:
        """Note findings on a run's recording; return whether it can be used, and leave it out otherwise."""
        failed = [each.check in MUST_PASS and not each.ok for each in findings]
        noted = [
            each._replace(message=f"{each.message}{LEFT_OUT}") if bad else each
            for each, bad in zip(findings, failed, strict=True)
        ]
        self.note(file, run, noted)
        self.left_out += [(run, column)] if any(failed) else []
        return not any(failed)
