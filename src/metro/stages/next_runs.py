"""``metro next``: the few runs that would decide what a batch leaves open, as rows of a run table.

The search is repeated with the settings of the loop stage: the fits that the choice of runs needs are not
kept on disk.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from metro.batch.findings import ContractError, Finding
from metro.batch.planned import Limits, Row, in_random_order, limits_of, rounded, row_like, within
from metro.batch.processed import read_json
from metro.batch.provenance import made_by
from metro.batch.writing import write_atomically
from metro.loop.planning.planner import Aim, aims
from metro.loop.search.trial import Gates
from metro.loop.statement import to_json
from metro.observables.problem import Made, Problem
from metro.stages.loop import Closing, closed
from metro.units import JSON
from metro.wording.statements import worded

NOTHING = "nothing is open: no run is needed to decide anything, and none would make predictions much surer"
TESTS = 3  # of stability that are proposed at once, at different speeds


@dataclass(frozen=True)
class Asked:
    """An open question, and the rows that would answer it, each to be made so many times."""

    observable: str
    aim: Aim
    rows: tuple[tuple[Row, int], ...]

    @property
    def words(self) -> str:
        """The question, and the runs that would answer it, in words."""
        return str(worded(to_json(self.aim.states)))


def next_runs(
    batch: str,
    observable: str,
    *,
    most: int,
    limits: Sequence[str],
    out: Path | None,
    seed: int,
    processed: Path,
    reports: Path,
    as_json: bool,
) -> None:
    """Print what is open in a batch and which runs would close it; write these where ``out`` says.

    Parameters
    ----------
    observable : only this one; "" for all. most : runs per observable. limits : ``COLUMN=LOW:HIGH``. seed :
        of the order of cutting.

    Raises
    ------
    ContractError
        The loop has not run on the batch, a limit is not one, or ``out`` is there already.
    """
    if out and out.exists():
        raise ContractError([Finding("error", str(out), "is there already: give another file")])
    gates = _gates(processed / batch, reports / batch)
    allowed = _known_limits(processed / batch) | limits_of(limits)
    there = list(read_json(reports / batch / "verdict.json")["observables"])
    if observable and observable not in there:
        message = f"found verdicts on {', '.join(there) or 'nothing'}, expected one on {observable}"
        raise ContractError([Finding("error", batch, message)])
    names = [observable] if observable else there
    # The observables before it may have identified effects that its model has to include.
    only = there[: there.index(names[-1]) + 1] if names else []
    ends: JSON = {column: list(each) for column, each in allowed.items()}
    state = closed(processed / batch, gates, only, ends)
    asked = [one for name in names for one in _asked(state, name, allowed, most)]
    wanted: dict[str, tuple[Row, int]] = {}
    for row, repeats in (pair for one in asked for pair in one.rows):
        key = repr(sorted((name, str(value)) for name, value in row.items()))
        wanted[key] = row, max(repeats, wanted.get(key, (row, 0))[1])  # asked for twice, made once
    table = in_random_order(state.batch.runs, list(wanted.values()), seed)
    if out and len(table):
        text = table.to_csv(index=False, lineterminator="\n")
        write_atomically(out, lambda stream: stream.write(text.encode()))
    if as_json:
        sys.stdout.write(json.dumps(_content(batch, asked, table), indent=1, ensure_ascii=False) + "\n")
    else:
        sys.stdout.write("\n".join(_in_words(batch, names, asked, table, out)) + "\n")


def _known_limits(processed: Path) -> dict[str, tuple[float, float]]:
    """Return the limits of settings that the manifest states."""
    known = read_json(processed / "batch.json")["manifest"].get("limits") or {}
    return limits_of([f"{column}={low}:{high}" for column, (low, high) in known.items()])


def _gates(processed: Path, reports: Path) -> Gates:
    """Return the settings that the loop stage ran with."""
    for file in (processed / "comparison.parquet", reports / "verdict.json"):
        if not file.is_file():
            raise ContractError([Finding("error", str(file), "is not there: call metro run")])
    return Gates(**made_by(processed, "loop")["settings"])


def _asked(state: Closing, name: str, limits: Limits, most: int) -> list[Asked]:
    """Return the open questions of an observable."""
    if name not in state.closed:
        return _tests(state, name, limits, most)
    problem, outcome = state.closed[name].problem, state.closed[name].outcome
    planned = aims(_allowed(problem, state.batch.runs, limits), outcome, state.gates, most)
    return [Asked(name, aim, tuple(_rows(state.batch.runs, aim))) for aim in planned]


def _allowed(problem: Problem, runs: pd.DataFrame, limits: Limits) -> Problem:
    """Leave out runs beyond what the user can set."""
    feasible = (one for one in problem.feasible if all(within(_row(runs, made), limits) for made in one.made))
    return replace(problem, feasible=tuple(feasible))


def _row(runs: pd.DataFrame, made: Made) -> Row:
    return row_like(runs, made.like, made.times, made.given)


def _rows(runs: pd.DataFrame, aim: Aim) -> list[tuple[Row, int]]:
    return [(_row(runs, made), kind.repeats) for kind in aim.kinds for made in kind.proposal.made]


def _tests(state: Closing, name: str, limits: Limits, most: int) -> list[Asked]:
    """Return the most informative tests of stability for an undecided cause, at different speeds."""
    promised = state.stories[name].get("experiments") or []
    states = state.verdicts[name].get("next_experiment")
    if not states:
        return []
    runs = state.batch.runs
    labelled = runs[(runs["role"] != "") & (runs["spindle_rpm"] > 0)]
    rows: dict[float, Row] = {}
    for test in promised:
        speed, depth = rounded(test.get("spindle_rpm", np.nan)), rounded(test.get("axial_depth_mm", np.nan))
        if np.isfinite(speed) and speed not in rows and len(rows) < min(TESTS, most) and len(labelled):
            like = str((labelled["spindle_rpm"] - speed).abs().idxmin())
            row = row_like(runs, like, {}, {"spindle_rpm": speed, "axial_depth_mm": depth})
            rows |= {speed: row} if within(row, limits) else {}
    chance = float(promised[0]["probability"]) if rows else None
    return [Asked(name, Aim("decide", states, (), chance), tuple((row, 1) for row in rows.values()))]


def _content(batch: str, asked: Sequence[Asked], table: pd.DataFrame) -> JSON:
    questions = [
        {
            "observable": one.observable,
            "question": one.aim.question,
            "words": one.words,
            "chance": one.aim.chance,
            "runs": sum(repeats for _, repeats in one.rows),
        }
        for one in asked
    ]
    return {"batch": batch, "questions": questions, "runs": json.loads(table.to_json(orient="records"))}


def _in_words(
    batch: str, names: Sequence[str], asked: Sequence[Asked], table: pd.DataFrame, out: Path | None
) -> list[str]:
    """Say what is open, observable by observable, and what is to be cut."""
    lines = []
    for name in names:
        mine = [one.words for one in asked if one.observable == name]
        lines += [f"{name}: {words}." for words in mine] or [f"{name}: {NOTHING}."]
    if not names:
        lines.append(f"{batch}: no observable has a verdict; metro check says what the batch lacks.")
    if len(table):
        filled = table.loc[:, [bool((table[name].notna() & (table[name] != "")).any()) for name in table]]
        lines += ["", f"{len(table)} runs, in this order:", filled.to_string(index=False, na_rep="")]
        if "force" in names:
            lines.append("Begin each record in the air: there the zero of the dynamometer is read.")
        lines += [f"Written to {out}."] if out else ["Write them with --out FILE.csv."]
    elif asked:
        lines.append("No row for the run table follows from that.")
    return lines
