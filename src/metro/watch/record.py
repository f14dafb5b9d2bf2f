"""A new file read by the readers of ingest, and a force record as the block of evidence that it is."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.batch.canonical import Part, write_parts
from metro.batch.findings import Finding, errors
from metro.batch.processed import Processed
from metro.batch.runs import filled, run_findings
from metro.batch.sources import SECTION
from metro.batch.tables import read_table
from metro.observables.cut.conditions import feed
from metro.observables.force.observable import observe, problem
from metro.observables.problem import Block, Problem, Refusal
from metro.stages import joint_logs, recordings, robot_logs, scans
from metro.stages.reading import Recordings
from metro.stages.whole import RUN_FILES
from metro.units import MM
from metro.watch.model import Finished

Reader = Callable[[Batch, Recordings], Iterator[Part]]
READERS: dict[str, Reader] = {
    "dynamometer": recordings.force,
    "robot_log": robot_logs.robot,
    "idle_log": robot_logs.robot,
    "joint_log": joint_logs.joint,
    "path": recordings.path,
    "scan": scans.scan,
    "profile": recordings.profile,
    "slopes": recordings.slopes,
    "poses": recordings.poses,
    "targets": recordings.targets,
}
TABLE = {column: table for table, columns in RUN_FILES.items() for column in columns}
# Share of the steady cut of the batch's shortest record that a new one holds at least: where there is less,
# the export or the copy ended early.
WHOLE = 0.8
ALIKE = 0.5  # (largest less least) over the mean, of what records have in common


class NotReadError(Exception):
    """A file that cannot be judged as it is: what is wrong with it, and what to do."""


@dataclass(frozen=True)
class Named:
    """A file that a table of the batch names.

    ``run``: row of runs.csv, or test of impacts.csv. ``column``: of the table, such as ``dynamometer``.
    ``row``: what the row states, as text: another statement makes another prediction.
    """

    file: str
    run: str
    column: str
    row: str


@dataclass(frozen=True, eq=False)
class Tables:
    """The run table of a batch folder as it is now, planned rows included, and its hammer tests."""

    runs: pd.DataFrame
    impacts: pd.DataFrame
    faults: tuple[Finding, ...]

    def named(self) -> list[Named]:
        """Return every file that a row names, in the order of cutting."""
        found = []
        for row in self.runs.to_dict("records"):
            files = {column: str(row[column]) for column in READERS if row[column]}
            settings = repr({str(k): v for k, v in row.items() if k not in {*READERS, "role"}})
            found += [Named(file, str(row["run"]), column, settings) for column, file in files.items()]
        for row in self.impacts.to_dict("records"):
            if row["file"]:
                found.append(Named(str(row["file"]), str(row["test"]), "impacts", repr(row)))
        return found

    def fault(self, run: str) -> str:
        """Return what is wrong with the row of a run, or with the tables as a whole; "" where nothing is."""
        return "; ".join(str(each) for each in self.faults if each.run in ("", run))


def tables_of(folder: Path, batch: Batch) -> Tables:
    """Read runs.csv and impacts.csv of a batch folder; files that they name need not be there."""
    runs, faults = read_table(folder, "runs")
    faults = [*faults, *run_findings(runs, batch.manifest)]
    impacts, more = read_table(folder, "impacts")
    frame = impacts.frame.assign(response_unit=impacts.frame["response_unit"].replace("", "m"))
    table = filled(runs.frame, batch.manifest) if len(runs.frame) else runs.frame
    return Tables(table, frame, errors([*faults, *more]))


def with_run(batch: Batch, tables: Tables, run: str) -> tuple[Batch, Batch]:
    """Return a batch with a run of its folder as a held-out one, and the same with this run alone."""
    row = tables.runs[tables.runs["run"] == run].set_index("run").assign(role="validate")
    others = batch.runs.drop(index=run, errors="ignore")
    row = row.reindex(columns=others.columns).astype(others.dtypes.to_dict())
    return replace(batch, runs=pd.concat([others, row])), replace(batch, runs=row)


@dataclass(frozen=True, eq=False)
class Read:
    """A file that was read: the canonical table that it became, and what its checks have to say."""

    place: Path
    table: str
    warnings: tuple[str, ...]


def read_file(done: Finished, folder: Path, tables: Tables, named: Named, place: Path) -> Read:
    """Read a new file by the reader of ingest, into a canonical table in the folder ``place``.

    Raises
    ------
    NotReadError
        The row of the table or the file is not as it should be.
    """
    if fault := tables.fault(named.run):
        raise NotReadError(f"{fault}; correct the table, the file is then judged")
    taken = Recordings(folder, lambda: None, done.batch.manifest.get(SECTION) or {})
    if named.column == "impacts":
        rows = tables.impacts[tables.impacts["file"] == named.file]
        table = "hit" if (rows["kind"] == "record").all() else "frf"
        parts = recordings.hit(done.batch, rows, taken) if table == "hit" else recordings.frf(rows, taken)
    else:
        _, alone = with_run(done.batch, tables, named.run)
        blank = [column for column in READERS if column != named.column]
        alone = replace(alone, runs=alone.runs.assign(**dict.fromkeys(blank, "")))
        table, parts = TABLE[named.column], READERS[named.column](alone, taken)
    write_parts(place / f"{table}.parquet", table, parts, {})
    unfit = [str(row["message"]) for row in taken.findings if not row["ok"]]
    if taken.problems:
        raise NotReadError("; ".join(each.message for each in taken.problems))
    if taken.left_out or (named.column == "impacts" and not taken.usable):
        raise NotReadError("; ".join(unfit) or "the recording is not fit for use: record it again")
    return Read(place, table, tuple(unfit))


@dataclass(frozen=True)
class _Overlaid:
    """Canonical tables: that of the new run, and all others of the batch."""

    new: Processed
    own: str
    old: Processed

    def __call__(self, name: str, run: str | None = None) -> pd.DataFrame:
        return (self.new if name == self.own else self.old)(name, run)

    def pieces(self, name: str, run: str) -> Iterator[pd.DataFrame]:
        return (self.new if name == self.own else self.old).pieces(name, run)


def force_block(done: Finished, tables: Tables, run: str, read: Read) -> Block:
    """Return the block of evidence of a new force record, as ``identify`` would make it of a held-out run.

    Raises
    ------
    NotReadError
        The record holds no steady cut, or it ends before the cut does.
    """
    batch, alone = with_run(done.batch, tables, run)
    overlaid = _Overlaid(Processed(read.place), read.table, done.read)
    observed = observe(alone, overlaid, done.identified)
    if isinstance(observed, Refusal):
        raise NotReadError(f"{observed.reason}; check the row of runs.csv, or record the run again")
    _require_whole(done, batch, run, observed["spindle"])
    joined = {
        name: pd.concat([_others(table, run), observed[name]], ignore_index=True)
        for name, table in done.observed.items()
        if name in observed
    }
    # What the block of a run depends on: its own orders, what holes the fits had, and the zeros of all runs.
    holes = batch.runs.index[batch.runs["operation"] == "helical"]
    needed = {run, *holes} if run in holes else {run}
    joined["orders"] = joined["orders"][joined["orders"]["run"].isin(needed)]
    posed = problem(batch, joined, done.identified)
    blocks = posed.blocks if isinstance(posed, Problem) else ()
    found = [block for block in blocks if block.run == run]
    if not found:
        raise NotReadError(f"{posed.reason}" if isinstance(posed, Refusal) else "holds no steady cut")
    return found[0]


def _others(table: pd.DataFrame, run: str) -> pd.DataFrame:
    return table[table["run"] != run] if "run" in table else table


def _require_whole(done: Finished, batch: Batch, run: str, spindle: pd.DataFrame) -> None:
    """Refuse a record whose cut ends long before it should, by the records that the batch has.

    Some record each cut for the same time, others the same part of its length: the measure is the one that is
    more alike in the records of the same operation. Where neither is, nothing is known of a new one.
    """
    others = _others(done.observed["spindle"], run)
    operation = batch.runs["operation"]
    others = others[operation.reindex(others["run"]).to_numpy() == operation[run]]
    if others.empty:
        return
    known, new = _covered(batch, others), _covered(batch, spindle)
    spread = {name: float(np.ptp(values) / np.mean(values)) for name, values in known.items()}
    name = min(spread, key=lambda each: spread[each] if np.isfinite(spread[each]) else np.inf)
    least = WHOLE * float(np.min(known[name]))
    if not spread[name] < ALIKE or not new[name][0] < least:
        return
    row: Any = batch.runs.loc[run]
    size, unit = (1.0, "s") if name == "time" else (float(row["cut_length_mm"]), "mm")
    raise NotReadError(
        f"holds {size * new[name][0]:.3g} {unit} of steady cut, expected at least {size * least:.3g} {unit} "
        f"as in the runs of the batch (operation {operation[run]}): the end of the record is missing; "
        "export or copy it again"
    )


def _covered(batch: Batch, spindle: pd.DataFrame) -> dict[str, np.ndarray]:
    """Return the time, s, of the steady cut in each record, and its share of the length of the cut."""
    runs = [str(run) for run in spindle["run"]]
    seconds = (spindle["steady_to_s"] - spindle["steady_from_s"]).to_numpy()
    length = batch.runs.loc[runs, "cut_length_mm"].to_numpy(dtype=float) * MM
    share = seconds * np.array([feed(batch, run) for run in runs]) / length
    return {"time": seconds, "length": np.asarray(share)}


def temporary() -> tempfile.TemporaryDirectory[str]:
    """Return a folder for the tables of one file, which goes when it has been judged."""
    return tempfile.TemporaryDirectory(prefix="metro-watch-")
