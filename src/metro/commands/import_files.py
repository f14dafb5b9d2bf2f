"""``metro import``: files that nobody has described become a batch; what decides a number is asked."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import typer

from metro.batch.check import CheckReport
from metro.batch.show import render
from metro.commands.calls import wrong_call
from metro.importing.look import copies, described, look
from metro.importing.propose import Proposal, propose
from metro.importing.questions import NONE, Question, questions, sensitivities
from metro.importing.write import AnswerError, write_batch
from metro.spelling import suggestion

FREE = (
    "cell",
    "cut_length_mm",
    "feed_direction_deg",
    "tool.overhang_mm",
    "cell_file",
    "drives.torque_per_ampere_nm_a",
    "drives.gear_ratio",
    "drives.uncertainty",
    "drives.uncertainty_by_joint",
    "tool.end",
    "tool.corner_radius_mm",
    "tool.taper_deg",
    "tool.cutting_edge_angle_deg",
)  # that may be given without a question


def import_files(
    paths: Sequence[Path], out: Path | None, given: Sequence[str], check: Callable[[Path], CheckReport]
) -> int:
    """Look at files, ask what they do not say, write a batch of them, and check it.

    ``check`` does one batch: :func:`metro.stages.whole.check_whole`.

    Returns
    -------
    code : 0; 1 where nothing was written, or the batch has an error.
    """
    missing = [path for path in paths if not path.is_file()]
    if missing:
        raise wrong_call(str(missing[0]), "is no file")
    files = [look(path) for path in paths]
    typer.echo("\n".join(described(files)))
    same = copies(files)
    for one, column, other, its in same:
        both = f"{one.path.name}, {column.label} and {other.path.name}, {its.label}"
        typer.echo(
            f"error: {both} hold the same numbers, bit for bit: which was copied? Nothing is written.",
            err=True,
        )
    proposals, unknown = propose(files)
    for line in unknown:
        typer.echo(f"not used: {line}", err=True)
    if same or not proposals:
        return 1
    answers = _answers(proposals, [*given, *([f"batch={out.resolve().name}"] if out else [])])
    name = answers.pop("batch")
    folder = out or Path("data/raw") / name
    if folder.exists():
        raise wrong_call(
            str(folder), "is there already, nothing was written: remove it, or give another --out"
        )
    used = {row.partition("#")[0] for each in proposals for row, _ in each.rows} | {
        n for p in proposals for n in p.more
    }
    try:
        write_batch(folder, [seen for seen in files if seen.path.name in used], proposals, answers)
    except AnswerError as error:
        raise wrong_call("--set", str(error)) from error
    typer.echo((folder / "batch.yaml").read_text(encoding="utf-8"))
    report = check(folder)
    from rich.console import Console

    Console(highlight=False).print(render(report))
    if not report.ok:
        typer.echo(f"{folder} was written, and snakemake will refuse it: mend it, or remove it", err=True)
    return 0 if report.ok else 1


def _answers(proposals: Sequence[Proposal], given: Sequence[str]) -> dict[str, str]:
    """Take the answers of the command line, and ask for the others where somebody can answer."""
    answers: dict[str, str] = {}
    for one in given:
        key, equals, value = one.partition("=")
        if not equals:
            raise wrong_call("--set", f'found "{one}", expected KEY=VALUE')
        answers[key] = value.strip()
    asked = list(questions(proposals))
    known = [question.key for question in [*asked, *sensitivities(answers)]]
    for key in answers:
        if key not in known and key not in FREE:
            raise wrong_call("--set", f'"{key}" is not asked for{suggestion(key, known)}')
    ask = _prompt if sys.stdin.isatty() else None
    open_questions = _fill(asked, answers, ask)
    open_questions += _fill(list(sensitivities(answers)), answers, ask)
    if open_questions:
        listed = "\n".join(f"  --set {question.key}=…   {question.words}" for question in open_questions)
        count = f"{len(open_questions)} question{'s are' if len(open_questions) > 1 else ' is'} open"
        raise wrong_call("metro import", f"{count}:\n{listed}")
    return {key: value for key, value in answers.items() if value not in ("", NONE)}


def _fill(
    asked: Sequence[Question], answers: dict[str, str], ask: Callable[[Question], str] | None
) -> list[Question]:
    """Ask what is not answered yet; return the questions that nobody is there to answer."""
    still_open = []
    for question in asked:
        value = answers.get(question.key, "")
        expected = question.expected(value) if value else ""
        if expected:
            raise wrong_call(question.key, f'found "{value}", expected {expected}')
        if not value and ask is not None:
            answers[question.key] = ask(question)
        elif not value and not question.optional:
            still_open.append(question)
    return still_open


def _prompt(question: Question) -> str:
    """Ask until the answer is one that the question accepts."""
    while True:
        answer = str(typer.prompt(question.words, default="", show_default=False)).strip()
        if not answer and not question.optional:
            none = "; none, where it is not known" if question.leaves_out else ""
            typer.echo(f"an answer is needed: no file states this value, and results depend on it{none}")
            continue
        expected = question.expected(answer) if answer else ""
        if not expected:
            return answer
        typer.echo(f'found "{answer}", expected {expected}')
