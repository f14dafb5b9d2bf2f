"""The judgement of a commit: batches whose seed is its hash, the pipeline's verdicts, the truth, a row."""

from __future__ import annotations

import time
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

from metro.units import JSON
from proof import seal
from proof.baselines import BASELINES
from proof.baselines.run import answered
from proof.layout import Layout
from proof.opening import about, opened, opened_for
from proof.protocol import board, log
from proof.protocol.board import OURS
from proof.protocol.commit import seed_of, unchanged, under_test
from proof.protocol.row import row
from proof.run import CHECKOUT, run
from proof.score import Score
from proof.suite import Suite, make

STYLE = "d"  # of the batches that judge; style c is for tuning
LIMIT = 180.0  # s of processor time, for the pipeline and for the oracle of one batch each
LOG, PAGE = Path("docs/protocol-log.jsonl"), Path("docs/protocol-board.md")


class NotJudgedError(RuntimeError):
    """A program can stand on the board beside this pipeline only, for a suite that judged it."""


def judge(
    root: Path,
    observable: str,
    batches: int,
    jobs: int,
    *,
    checkout: Path = CHECKOUT,
    limit: float = LIMIT,
    style: str = STYLE,
) -> Layout:
    """Judge the commit that is checked out: make, run, open, write down; go on where it was stopped.

    Parameters
    ----------
    root : folder of all judgements; this one gets a folder of its own in it, which is returned.

    Raises
    ------
    UncommittedError
        What would be judged is no commit, or was changed meanwhile.
    """
    commit = under_test(checkout)
    suite = Suite(observable, batches, seed_of(commit, observable), style, commit)
    out = Layout(root / f"{commit[:12]}-{observable}-{batches}")
    if not out.seal.is_file():
        make(out, suite, jobs)
    if _judged(checkout, out, OURS):
        return out
    start = time.perf_counter()
    run(out, jobs, keep=False, pdf=False, through=observable, limit=limit)
    scores = opened(out, jobs, limit)
    unchanged(checkout, commit)
    took = {"limit_s": limit, "minutes": round((time.perf_counter() - start) / 60.0, 1), "jobs": jobs}
    _written(checkout, out, OURS, scores, took)
    return out


def beside(out: Layout, names: Sequence[str], jobs: int, *, checkout: Path = CHECKOUT) -> None:
    """Let baselines answer about a suite that was judged, and write down what that is worth."""
    for name in names:
        if not _judged(checkout, out, name):
            answered(name, out, jobs, LIMIT)
            _written(checkout, out, name, opened_for(name, out.answers(name), out, jobs, LIMIT), {})


def listed(out: Layout, program: str, scores: Sequence[Score], *, checkout: Path = CHECKOUT) -> None:
    """Write down what another program's answers about a judged suite are worth.

    Raises
    ------
    NotJudgedError
        This pipeline was not judged by that suite, or the program bears the name of one that is ours.
    """
    if program in {OURS, *BASELINES}:
        raise NotJudgedError(f"{program} is the name of a program of this repository: give another one")
    if not _judged(checkout, out, OURS):
        raise NotJudgedError(f"no commit was judged by {out.root}: it has no row in {LOG}")
    _written(checkout, out, program, scores, {})


def _judged(checkout: Path, out: Layout, program: str) -> bool:
    """Whether a program has a row for this very suite."""
    sealed = out.seal.read_text().strip()
    return any((one["seal"], one["program"]) == (sealed, program) for one in log.rows(checkout / LOG))


def _written(checkout: Path, out: Layout, program: str, scores: Sequence[Score], took: JSON) -> None:
    truth = seal.unseal(out.truth, out.seal)
    head = {
        "commit": truth["commit"],
        "date": datetime.now(UTC).date().isoformat(),
        "observable": about(truth),
        "style": truth["style"],
        "batches": len(truth["batches"]),
        "seed": truth["seed"],
        "seal": out.seal.read_text().strip(),
        **took,
    }
    log.append(checkout / LOG, row(program, scores, head))
    board.write(checkout / LOG, checkout / PAGE)
