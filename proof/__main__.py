"""``python -m proof``: make batches that hide sealed effects, run the pipeline on them, open the truth.

``coverage`` needs no seal: its batches hide nothing, and what is counted is how often intervals hold. Nor
does ``faces``: what is compared is the faces that are predicted with those that are scanned. ``next`` asks
for runs where a verdict is undetermined, cuts them, and counts how often they decide; ``joint`` puts all
observables together against each alone; ``campaign`` follows a tool that wears and a machine that gets warm.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from proof.layout import Layout
from proof.suite import DEFAULT
from virtual_cell.blind import HARDER_STYLES, RECIPES
from virtual_cell.recipes.force import STYLES


def main(arguments: list[str] | None = None) -> None:
    """Run the command line."""
    options = _parser().parse_args(arguments)
    if options.command == "coverage":
        _coverage(options)
    else:
        _COMMANDS[options.command](Layout(options.out), options)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m proof", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    make = commands.add_parser("make", help="make batches with hidden effects, and seal what they are")
    coverage = commands.add_parser("coverage", help="how often the intervals of the coefficients hold")
    make.add_argument("--observable", choices=RECIPES, default=DEFAULT, help="what the batches are about")
    for command in (make, coverage):
        command.add_argument("--batches", type=int, default=200)
        command.add_argument("--seed", type=int, default=1)
        command.add_argument(
            "--style",
            choices=(*STYLES, *HARDER_STYLES),
            default="b",
            help="how it is measured; a: for tuning",
        )
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
    campaign = commands.add_parser("campaign", help="whether wear and warm-up over batches are followed")
    campaign.add_argument("--seed", type=int, default=1)
    for command in (make, run, opening, faces, planned, joint, campaign):
        command.add_argument("out", type=Path, help="folder of this proof")
    for command in (make, coverage, run, opening, planned, joint, campaign):
        command.add_argument("--jobs", type=int, default=2, help="worker processes")
    return parser


def _make(out: Layout, options: argparse.Namespace) -> None:
    from proof.suite import make

    about = options.observable
    digest = make(out, options.batches, options.seed, options.style, options.jobs, observable=about)
    print(f"{options.batches} batches in {out.raw}; what they hide is sealed as SHA-256 {digest}")


def _run(out: Layout, options: argparse.Namespace) -> None:
    from proof.run import run

    failed = run(out, options.jobs, keep=options.keep, pdf=options.reports)
    if failed:
        raise SystemExit(f"failed, see reports/<batch>/failed.txt: {', '.join(failed)}")


def _open(out: Layout, options: argparse.Namespace) -> None:
    from proof.opening import opened

    missed = [figure.label for figure in opened(out, options.jobs) if figure.missed_for_sure]
    if options.strict and missed:
        raise SystemExit("missed by more than chance: " + "; ".join(missed))


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


def _campaign(out: Layout, options: argparse.Namespace) -> None:
    from rich.console import Console

    from proof.campaign import followed, tables
    from proof.show import printed

    printed(tables(followed(out, options.seed, options.jobs)), Console())


def _coverage(options: argparse.Namespace) -> None:
    from rich.console import Console

    from proof.coverage import WAYS, coverage, table
    from proof.show import printed

    intervals = coverage(options.batches, options.seed, options.style, options.jobs)
    printed([table(intervals, way) for way in WAYS], Console())


_COMMANDS = {
    "make": _make,
    "run": _run,
    "open": _open,
    "faces": _faces,
    "next": _next,
    "joint": _joint,
    "campaign": _campaign,
}


if __name__ == "__main__":
    main()
