"""Looks at a batch folder, one after another: which files are new and complete, and what is said of them."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from dataclasses import replace
from datetime import datetime
from functools import partial
from pathlib import Path

from metro.batch.findings import ContractError
from metro.batch.provenance import sha256 as _sha256
from metro.batch.sources import SECTION, files_of, parted
from metro.watch.arrivals import HEAD_START_S, PATIENCE_S, Arrivals, Stamp, stamp_of
from metro.watch.figures import compared
from metro.watch.journal import FILE, Journal
from metro.watch.judgement import Judgement, faulty, not_compared, of_force
from metro.watch.model import NEEDED, finished
from metro.watch.record import (
    Named,
    NotReadError,
    Tables,
    force_block,
    read_file,
    tables_of,
    temporary,
)
from metro.watch.resemblance import likenesses

KINDS = {
    "robot_log": "a robot log",
    "idle_log": "the log of an idle run",
    "joint_log": "a joint log",
    "path": "a programmed path",
    "scan": "a scan",
    "profile": "a profile",
    "slopes": "a table of slopes",
    "poses": "a table of poses",
    "targets": "a table of targets",
    "impacts": "a hammer test",
}
RUNS, IMPACTS = ("runs.csv", "runs.parquet"), ("impacts.csv", "impacts.parquet")
UNFINISHED = (".part", ".partial", ".tmp", ".temp", ".crdownload", ".filepart", ".swp", "~")
AGAIN = "Export or copy the file again; metro check says the same of it."
NO_ROW = (
    "Append a row with its settings to runs.csv, the file named under the column of its kind; "
    "it is then judged."
)


class Watcher:
    """A batch folder that is watched, with the model of its batch in memory.

    Attributes
    ----------
    done : the batch as the pipeline left it; loaded anew when its results are. journal : what was judged.
    waiting : whether a file was there, at the last look, of which nothing was said yet.
    """

    def __init__(
        self, folder: Path, processed: Path, reports: Path, arrivals: Arrivals | None = None
    ) -> None:
        self.folder, self._processed, self._reports = folder, processed, reports
        self._name = folder.resolve().name
        self._arrivals = arrivals or Arrivals()
        self._of_results = self._results()
        self.done = finished(self._name, processed, reports)
        self._warm()
        self.journal = Journal(reports / FILE, self._name)
        self.waiting = False
        self._tables: tuple[tuple[Stamp | None, ...], Tables] | None = None
        self._keys: dict[tuple[str, str], tuple[Stamp, str]] = {}
        self._on_trial: dict[tuple[str, str], tuple[str, Judgement]] = {}

    def look(self) -> Iterator[Judgement]:
        """Look once; yield what is to be said of files that are complete by now, each kept before."""
        self.waiting = False
        self._reload()
        tables = self._settled_tables()
        if tables is None:
            self.waiting = True
            return
        general = [str(each) for each in tables.faults if not each.run]
        if general:
            file = next((name for name in RUNS if (self.folder / name).is_file()), RUNS[0])
            advice = "Correct the table; its files are then judged."
            yield from self._said(file, "", partial(faulty, file, "", "; ".join(general), advice))
            return
        named = [each for each in tables.named() if each.file not in self.done.sources]
        for each in named:
            yield from self._said(each.file, each.row, partial(self._judged, tables, each))
        for file in self._nameless(tables):
            message = "no row of runs.csv or impacts.csv names it"
            yield from self._said(file, "", partial(faulty, file, "", message, NO_ROW))

    def _said(self, file: str, row: str, judge: Callable[[], Judgement]) -> Iterator[Judgement]:
        """Say what is to be said of a file that is there, once it is complete; what is wrong with it, later.

        It is judged while it rests. The judgement holds if the file is the same when it has rested enough.
        """
        path = self.folder / parted(self.folder, file)[0]
        quiet = self._arrivals.quiet(path)
        stamp = stamp_of(path)
        if quiet < 0.0 or stamp is None:
            return
        if quiet < HEAD_START_S:
            self.waiting = True
            return
        try:
            key = self._key(file, stamp, row, path)
            if self.journal.has(key):
                return
            known, judgement = self._on_trial.get((file, row), ("", None))
            if judgement is None or known != key:
                judgement = judge()
                self._on_trial[file, row] = key, judgement
        except OSError:  # it is gone, or not readable yet
            self.waiting = True
            return
        complete = self._arrivals.complete(path) and stamp_of(path) == stamp
        quiet = self._arrivals.quiet(path)
        if not complete or (judgement.status == "error" and quiet < PATIENCE_S):
            self.waiting = True
            return
        now = datetime.now().astimezone().isoformat(timespec="seconds")
        judgement = replace(judgement, at=now, seconds=round(quiet, 2), key=key)
        self.journal.add(judgement)
        del self._on_trial[file, row]
        yield judgement

    def _key(self, file: str, stamp: Stamp, row: str, path: Path) -> str:
        """Return what identifies a file, its content and its row; what has not changed is not read again."""
        known, key = self._keys.get((file, row), (None, ""))
        if known != stamp:
            text = "\n".join((file, _sha256(path), row))
            key = hashlib.sha256(text.encode()).hexdigest()[:24]
            self._keys[file, row] = stamp, key
        return key

    def _copied(self, path: Path) -> str:
        """Return the file of the batch that has the same content; "" where none has."""
        content = _sha256(path)
        return next((file for file, known in self.done.sources.items() if known == content), "")

    def _judged(self, tables: Tables, named: Named) -> Judgement:
        """Read a file, and compare it with the model where there is one for it."""
        path = self.folder / parted(self.folder, named.file)[0]
        if not path.resolve().is_relative_to(self.folder.resolve()):
            message = "it is outside the batch's folder"
            return faulty(named.file, named.run, message, "Copy it into the folder, and name it there.")
        if copied := self._copied(path):
            message = f"it has the same content as {copied}, expected a recording of its own"
            return faulty(named.file, named.run, message, "Copy the file of this run.")
        try:
            return self._compared(tables, named)
        except (NotReadError, ContractError) as error:
            return faulty(named.file, named.run, str(error).replace("\n", "; "), AGAIN)

    def _compared(self, tables: Tables, named: Named) -> Judgement:
        with temporary() as place:
            read = read_file(self.done, self.folder, tables, named, Path(place))
            if named.column != "dynamometer":
                why = f"{KINDS[named.column]} is not compared here; metro run compares it with the batch"
                return not_compared(named, why, read.warnings)
            if self.done.force is None:
                return not_compared(named, self.done.lacking, read.warnings)
            block = force_block(self.done, tables, named.run, read)
        result = compared(self.done.force, block)
        causes = () if result.as_predicted else likenesses(result)
        judgement = of_force(named, result, causes)
        return replace(judgement, reasons=(*judgement.reasons, *read.warnings))

    def _settled_tables(self) -> Tables | None:
        """Return the tables of the folder, read again where they changed; None while they are written."""
        paths = [self.folder / name for name in (*RUNS, *IMPACTS)]
        if any(stamp_of(path) and not self._arrivals.complete(path) for path in paths):
            return None
        stamps = tuple(stamp_of(path) for path in paths)
        if self._tables is None or self._tables[0] != stamps:
            self._tables = stamps, tables_of(self.folder, self.done.batch)
        return self._tables[1]

    def _nameless(self, tables: Tables) -> Iterator[str]:
        """Yield files that lie where recordings of the batch do, have their suffix, and are in no row."""
        mappings = self.done.batch.manifest.get(SECTION) or {}
        known = set(self.done.sources)
        for each in tables.named():
            known.update(files_of(self.folder, each.file, mappings))
        kinds = {(str(Path(file).parent), Path(file).suffix) for file in known if "/" in file}
        for parent in sorted({parent for parent, _ in kinds}):
            place = self.folder / parent
            for path in sorted(place.iterdir()) if place.is_dir() else []:
                file = f"{parent}/{path.name}"
                hidden = path.name.startswith(".") or path.name.endswith(UNFINISHED)
                if not hidden and path.is_file() and (parent, path.suffix) in kinds and file not in known:
                    yield file

    def _results(self) -> tuple[Stamp | None, ...]:
        return tuple(stamp_of(self._reports / name) for name in NEEDED)

    def _reload(self) -> None:
        """Load the batch anew where the pipeline went through it again."""
        results = self._results()
        if results != self._of_results and None not in results:
            self.done = finished(self._name, self._processed, self._reports)
            self._of_results, self._tables = results, None
            self._warm()

    def _warm(self) -> None:
        """Compare a run of the batch, which loads and compiles what the first new file would wait for."""
        if self.done.force and self.done.observed:
            compared(self.done.force, self.done.force.problem.blocks[-1])
