"""``python -m proof``: make batches that hide sealed effects, run the pipeline on them, open the truth.

``coverage`` needs no seal: its batches hide nothing, and what is counted is how often intervals hold. Nor
does ``faces``: what is compared is the faces that are predicted with those that are scanned. ``next`` asks
for runs where a verdict is undetermined, cuts them, and counts how often they decide; ``joint`` puts all
observables together against each alone; ``campaign`` follows a tool that wears and a machine that gets warm.
``discovery`` asks ``metro propose`` about a suite that was run and kept.

``judge`` makes, runs and opens batches for the commit that is checked out and writes down what came of it;
``score`` does the last of this for another program, ``baseline`` is three such programs (docs/protocol.md).
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

from proof.baselines import BASELINES
from proof.layout import Layout
from proof.suite import DEFAULT, FULL, SHARES
from virtual_cell.blind import RECIPES


def main(arguments: list[str] | None = None) -> None:
    """Run the command line."""
    options = _parser().parse_args(arguments)
    _COMMANDS[options.command](Layout(options.out) if "out" in options else None, options)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m proof", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    make = commands.add_parser("make", help="make batches with hidden effects, and seal what they are")
    coverage = commands.add_parser("coverage", help="how often the intervals of the coefficients hold")
    make.add_argument("--observable", choices=RECIPES, default=DEFAULT, help="what the batches are about")
    for command in (make, coverage):
        command.add_argument("--batches", type=int, default=200)
        command.add_argument("--seed", type=int, default=1)
        command.add_argument("--style", choices=SHARES, default="b", help="how it is measured; a: for tuning")
    run = commands.add_parser("run", help="run the pipeline on the batches; goes on where it was stopped")
    run.add_argument("--keep", action="store_true", help="keep the tables of raw signals")
    run.add_argument("--reports", action="store_true", help="write the PDF reports, too")
    opening = commands.add_parser("open", help="check the seal and compare the verdicts with the truth")
    opening.add_argument("--strict", action="store_true", help="fail where a demand is missed beyond chance")
    faces = commands.add_parser("faces", help="how predicted faces of eight cases resemble the scanned ones")
    faces.add_argument("--seed", type=int, default=1)
    faces.add_argument("--replicates", type=int, default=3)
    planned = commands.add_parser("next", help="how often runs that `metro next` plans decide")
    planned.add_argument("--batches", type=int, default=60)
    planned.add_argument("--seed", type=int, default=1)
    joint = commands.add_parser("joint", help="what all observables say together against each alone")
    joint.add_argument("--batches", type=int, default=32)
    joint.add_argument("--seed", type=int, default=1)
    discovery = commands.add_parser("discovery", help="what `metro propose` says of a suite that was run")
    campaign = commands.add_parser("campaign", help="whether wear and warm-up over batches are followed")
    campaign.add_argument("--seed", type=int, default=1)
    judge = commands.add_parser("judge", help="judge the commit that is checked out, and log it")
    judge.add_argument("--observable", choices=RECIPES, required=True, help="what the batches are about")
    judge.add_argument("--batches", type=int, default=FULL)
    judge.add_argument("--baselines", action="store_true", help="log what baselines reach, too")
    judge.add_argument(
        "--out", dest="root", type=Path, default=Path("build/judged"), help="of all judgements"
    )
    baseline = commands.add_parser("baseline", help="let a plain program answer about a suite")
    baseline.add_argument("name", choices=BASELINES)
    scoring = commands.add_parser("score", help="compare the answers of another program with the truth")
    commands.add_parser("board", help="make the page of all judgements anew")
    consistent = commands.add_parser("consistent", help="whether reports contradict themselves")
    for command in (
        make,
        run,
        consistent,
        opening,
        faces,
        planned,
        joint,
        campaign,
        baseline,
        scoring,
        discovery,
    ):
        command.add_argument("out", type=Path, help="folder of this proof")
    scoring.add_argument("answers", type=Path, help="folder with <batch>.json for each batch")
    scoring.add_argument("--name", required=True, help="of the program")
    scoring.add_argument("--log", action="store_true", help="put it on the board (of a judged suite)")
    for command in (make, coverage, run, opening, planned, joint, campaign, judge, baseline, scoring):
        command.add_argument("--jobs", type=int, default=2, help="worker processes")
    return parser


def _make(out: Layout, options: argparse.Namespace) -> None:
    from proof.suite import Suite, make

    suite = Suite(options.observable, options.batches, options.seed, options.style)
    digest = make(out, suite, options.jobs)
    print(f"{options.batches} batches in {out.raw}; what they hide is sealed as SHA-256 {digest}")


def _run(out: Layout, options: argparse.Namespace) -> None:
    from proof.run import run

    failed = run(out, options.jobs, keep=options.keep, pdf=options.reports)
    if failed:
        raise SystemExit(f"failed, see reports/<batch>/failed.txt: {', '.join(failed)}")


def _open(out: Layout, options: argparse.Namespace) -> None:
    from proof.figures import demanded
    from proof.opening import opened

    scores = opened(out, options.jobs)
    missed = [figure.label for figure in demanded(scores) if figure.missed_for_sure]
    if options.strict and missed:
        raise SystemExit("missed by more than chance: " + "; ".join(missed))


def _consistent(out: Layout, _: argparse.Namespace) -> None:
    from proof.consistency import checked

    found = checked(out.reports)
    broken = [f"{batch}: {words}" for batch, each in found.items() for words in each]
    print(f"{len(found)} batches, {len(broken)} contradictions")
    if broken:
        raise SystemExit("\n".join(broken))


def _faces(out: Layout, options: argparse.Namespace) -> None:
    from rich.console import Console

    from proof.faces import eight_cases, tables
    from proof.show import printed

    printed(tables(*eight_cases(out, options.seed, options.replicates)), Console())


def _next(out: Layout, options: argparse.Namespace) -> None:
    from rich.console import Console

    from proof.planned import asked_and_cut, tables
    from proof.show import printed

    printed(tables(*asked_and_cut(out, options.batches, options.seed, options.jobs)), Console())


def _joint(out: Layout, options: argparse.Namespace) -> None:
    from rich.console import Console

    from proof.joint import attributed, tables
    from proof.show import printed

    printed(tables(attributed(out, options.batches, options.seed, options.jobs)), Console())


def _discovery(out: Layout, _: argparse.Namespace) -> None:
    from proof.discovery import discoveries, printed, written

    found = discoveries(out)
    written(found, out)
    print(printed(found))


def _campaign(out: Layout, options: argparse.Namespace) -> None:
    from rich.console import Console

    from proof.campaign import followed, tables
    from proof.show import printed

    printed(tables(followed(out, options.seed, options.jobs)), Console())


def _judge(_: None, options: argparse.Namespace) -> None:
    from proof.protocol.judge import LOG, beside, judge
    from proof.run import forgotten

    out = judge(options.root, options.observable, options.batches, options.jobs)
    print(f"{out.root} is judged: see {LOG}")
    if options.baselines:
        beside(out, BASELINES, options.jobs)
    forgotten(out)


def _baseline(out: Layout, options: argparse.Namespace) -> None:
    from proof.baselines.run import answered

    answered(options.name, out, options.jobs)
    print(f"its answers are in {out.answers(options.name)}")


def _score(out: Layout, options: argparse.Namespace) -> None:
    from proof.opening import opened_for
    from proof.protocol.judge import listed

    scores = opened_for(options.name, options.answers, out, options.jobs)
    if options.log:
        listed(out, options.name, scores)


def _board(_: None, _options: argparse.Namespace) -> None:
    from proof.protocol.board import write
    from proof.protocol.judge import LOG, PAGE
    from proof.run import CHECKOUT

    write(CHECKOUT / LOG, CHECKOUT / PAGE)


def _coverage(_: None, options: argparse.Namespace) -> None:
    from rich.console import Console

    from proof.coverage import WAYS, coverage, table
    from proof.show import printed

    intervals = coverage(options.batches, options.seed, options.style, options.jobs)
    printed([table(intervals, way) for way in WAYS], Console())


_COMMANDS: dict[str, Callable[..., None]] = {
    "make": _make,
    "run": _run,
    "open": _open,
    "consistent": _consistent,
    "faces": _faces,
    "next": _next,
    "joint": _joint,
    "campaign": _campaign,
    "discovery": _discovery,
    "coverage": _coverage,
    "judge": _judge,
    "baseline": _baseline,
    "score": _score,
    "board": _board,
}


if __name__ == "__main__":
    main()
