"""The opening: the seal is checked, the oracle runs, and the verdicts are compared with the truth."""

from __future__ import annotations

import json
import os
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import yaml
from rich.console import Console

from metro.batch.config import load_config
from metro.batch.processed import write_json
from metro.effects.library import library
from metro.observables.problem import Problem
from metro.observables.stability.problem import LabelProblem
from metro.stages.problem_file import read_problems
from metro.units import JSON
from proof import seal
from proof.figures import demanded
from proof.label_oracle import label_oracle
from proof.layout import Layout
from proof.oracle import oracle
from proof.progress import tracked
from proof.run import CHECKOUT
from proof.score import Score, score
from proof.show import draw, markdown, printed
from proof.statistics import Figure
from proof.suite import DEFAULT
from proof.tables import tables


def opened(out: Layout, jobs: int) -> list[Figure]:
    """Open the truth, print every table, write ``table.md`` and ``figure.svg``; return what is demanded.

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
    about = truth.get("observable", DEFAULT)
    oracles = _oracles(out, truth["batches"], jobs, about)
    scores = [_score(out, name, entry, oracles.get(name), about) for name, entry in truth["batches"].items()]
    results = tables(scores, about)
    printed(results, Console())
    draw(scores, out.root / "figure.svg")
    (out.root / "table.md").write_text(markdown(_heading(out, truth), results))
    return demanded(scores)


def _finished(out: Layout, name: str) -> bool:
    return any((out.reports / name / file).is_file() for file in ("run.json", "failed.txt"))


def _oracles(out: Layout, truths: JSON, jobs: int, about: str) -> dict[str, JSON]:
    """Return the oracle's figures of every batch that hides something; those that are there are kept."""
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    asked = [
        name for name, truth in truths.items() if truth["effects"] and _read(out.reports / name / "run.json")
    ]
    with ProcessPoolExecutor(jobs, get_context("spawn"), max_tasks_per_child=1) as pool:
        futures = [pool.submit(_oracle, out, name, truths[name]["effects"], about) for name in asked]
        return dict(future.result() for future in tracked(futures, "asking the oracle"))


def _oracle(out: Layout, name: str, hidden: JSON, about: str) -> tuple[str, JSON]:
    file, mark = out.oracle / f"{name}.json", out.reports / name / "run.json"
    if not file.is_file() or file.stat().st_mtime < mark.stat().st_mtime:
        gates = load_config(CHECKOUT / "config/config.yaml")["loop"]
        task = _problem(out.processed / name, about)
        if isinstance(task, LabelProblem):
            result = label_oracle(task, hidden, library(about), gates["held_out_gain"])
        else:
            result = oracle(task, hidden, library(about), gates["model_form_budget"])
        write_json(file, result)
    return name, _read(file) or {}


def _problem(processed: Path, about: str) -> Problem | LabelProblem:
    task = read_problems(processed)[about].task
    if not isinstance(task, Problem | LabelProblem):
        raise ValueError(f"{processed}: {about} has no problem")
    return task


def _score(out: Layout, name: str, truth: JSON, oracle_figures: JSON | None, about: str) -> Score:
    run = _read(out.reports / name / "run.json")
    return score(
        truth,
        oracle_figures,
        _read(out.reports / name / "verdict.json") if run else None,
        _read(out.processed / name / "loop.json") if run else None,
        teeth=int(yaml.safe_load((out.raw / name / "batch.yaml").read_text())["tool"]["teeth"]),
        seconds=sum(run["seconds"].values()) if run else None,
        observable=about,
    )


def _read(path: Path) -> JSON | None:
    return json.loads(path.read_text()) if path.is_file() else None


def _heading(out: Layout, truth: JSON) -> str:
    marks = [_read(out.reports / name / "run.json") for name in truth["batches"]]
    codes = {json.dumps(mark["code"], sort_keys=True) for mark in marks if mark}
    words = f"# Proof: {truth.get('observable', DEFAULT)}\n\n"
    words += f"{len(truth['batches'])} batches of style {truth['style']}, seed {truth['seed']}; "
    words += f"sealed as SHA-256 `{out.seal.read_text().strip()}`."
    return (
        words if len(codes) < 2 else f"{words} **The batches were run by {len(codes)} versions of the code.**"
    )
