"""The opening: the seal is checked, the oracle runs, and what a program says is compared with the truth."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import yaml
from rich.console import Console

from metro.units import JSON
from proof import seal
from proof.answers import answer, p_value
from proof.layout import Layout
from proof.oracles import oracles
from proof.run import FAILURE, pose
from proof.score import FAILED, Score, score
from proof.show import draw, markdown, printed
from proof.suite import DEFAULT
from proof.tables import tables


def about(truth: JSON) -> str:
    """Return the observable of a suite."""
    return str(truth.get("observable", DEFAULT))


def about_suite(out: Layout) -> str:
    """Return the observable of a sealed suite."""
    return about(seal.unseal(out.truth, out.seal))


def opened(out: Layout, jobs: int, limit: float | None = None) -> list[Score]:
    """Score what this pipeline says of a suite; print every table, write ``table.md`` and ``figure.svg``.

    ``limit``: of the oracle's processor time for a batch, s.

    Raises
    ------
    BrokenSealError
        The truth is not the one that was sealed.
    FileNotFoundError
        A batch has neither a verdict nor the reason why it failed.
    """
    truth = seal.unseal(out.truth, out.seal)
    waiting = [name for name in truth["batches"] if not _finished(out, name)]
    if waiting:
        raise FileNotFoundError(
            f"{len(waiting)} batches were not run, the first is {waiting[0]}: run them first"
        )
    scores = _scores(out, truth, jobs, limit, lambda name: _ours(out, name, about(truth)))
    scores = [_with_reason(one, out.reports / one.batch / FAILURE) for one in scores]
    _shown(out, truth, scores, "", _versions(out, truth))
    return scores


def opened_for(
    program: str, answers: Path, out: Layout, jobs: int, limit: float | None = None
) -> list[Score]:
    """Do the same with what another program says: one file for each batch; one without a file has failed.

    Where the pipeline has not run on the suite, its problems are posed, to know how large the effects are.
    """
    truth = seal.unseal(out.truth, out.seal)
    pose(out, jobs, limit)
    scores = _scores(out, truth, jobs, limit, lambda name: answer(answers, name, about(truth)))
    scores = [_with_reason(one, answers / f"{one.batch}.{FAILURE}") for one in scores]
    _shown(out, truth, scores, f"-{program}", f" What {program} says of them.")
    return scores


def _shown(out: Layout, truth: JSON, scores: list[Score], suffix: str, words: str) -> None:
    results = tables(scores, about(truth))
    printed(results, Console())
    draw(scores, out.root / f"figure{suffix}.svg")
    (out.root / f"table{suffix}.md").write_text(markdown(_heading(out, truth) + words, results))


def _scores(
    out: Layout, truth: JSON, jobs: int, limit: float | None, said: Callable[[str], JSON | None]
) -> list[Score]:
    asked = oracles(out, truth["batches"], jobs, about(truth), limit)
    return [
        score(
            entry,
            asked.get(name),
            said(name),
            teeth=int(yaml.safe_load((out.raw / name / "batch.yaml").read_text())["tool"]["teeth"]),
            observable=about(truth),
        )
        for name, entry in truth["batches"].items()
    ]


def _with_reason(one: Score, file: Path) -> Score:
    """Return a score that says why its batch failed, where it did and somebody wrote it down."""
    if one.status != FAILED or not file.is_file():
        return one
    return replace(one, failure=file.read_text().strip().splitlines()[-1])


def _finished(out: Layout, name: str) -> bool:
    return any((out.reports / name / file).is_file() for file in ("run.json", FAILURE))


def _ours(out: Layout, name: str, about: str) -> JSON | None:
    """Return what the pipeline says of a batch, in its verdict and beside it; None: it failed."""
    run, said = _read(out.reports / name / "run.json"), answer(out.reports / name, "verdict", about)
    if run is None or said is None:
        return None
    story = (_read(out.processed / name / "loop.json") or {"observables": {}})["observables"].get(about, {})
    return {
        **said,
        "cannot_be_seen": [one["effect"] for one in story.get("cannot_be_seen", [])],
        "p_value": p_value(_read(out.processed / name / "findings.json"), about),
        "seconds": sum(run["seconds"].values()),
    }


def _read(path: Path) -> JSON | None:
    return json.loads(path.read_text()) if path.is_file() else None


def _heading(out: Layout, truth: JSON) -> str:
    words = f"# Proof: {about(truth)}\n\n"
    words += f"{len(truth['batches'])} batches of style {truth['style']}, seed {truth['seed']}; "
    return words + f"sealed as SHA-256 `{out.seal.read_text().strip()}`."


def _versions(out: Layout, truth: JSON) -> str:
    """Own up to it where not all batches were run by the same code."""
    marks = [_read(out.reports / name / "run.json") for name in truth["batches"]]
    codes = {json.dumps(mark["code"], sort_keys=True) for mark in marks if mark}
    return "" if len(codes) < 2 else f" **The batches were run by {len(codes)} versions of the code.**"
