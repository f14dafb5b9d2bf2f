"""``metro explain``: the first page of a report, in a terminal."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from metro.batch.findings import ContractError, Finding
from metro.commands.bars import error_bars
from metro.commands.calls import require_verdict
from metro.commands.output import print_json
from metro.commands.which import batch_name
from metro.observables.catalogue import title
from metro.report.content import Item, Paragraph, Section, Table
from metro.report.numbers import number, probability, words
from metro.report.results import Results
from metro.report.sections.causes import with_causes
from metro.report.sections.decisions import best_cut, decided
from metro.report.sections.key_results import key_results
from metro.report.sections.measured import measured_words
from metro.report.sections.quality import with_flags
from metro.report.sections.summary import advice, no_verdict, print_check
from metro.report.sections.trust import trust, trust_in
from metro.report.sections.verdict import STATUS, left_words, next_words, remedies, verdict_words
from metro.units import JSON

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.table import Table as Grid

FEW = 5  # candidates shown where all observables are
# What is on the first page besides verdicts; a table without rows is left out, as in a report.
TABLES = ("published_errors", "qc", "chatter_runs", "lobes_final", "lobe_runs", "load_points")
COLOURS = {"clean": "green", "explained": "green", "insufficient": "yellow", "undetermined": "yellow"}


def explain(batch: str, observable: str, processed: Path, reports: Path, as_json: bool) -> None:
    """Print what was measured, the verdicts, the errors before and after, the candidates, what comes next.

    Parameters
    ----------
    batch : its name, or a folder of it. observable : one of its observables; "" for all of them.

    Raises
    ------
    CallError
        There is no such batch, or no such observable.
    ContractError
        The batch has no results, or no verdict on the observable.
    """
    results = read(batch_name(batch, processed, reports), processed, reports)
    verdicts = results.verdicts()
    require_verdict(results.batch.name, observable, verdicts)
    chosen = {observable: verdicts[observable]} if observable else verdicts
    if as_json:
        print_json(_content(results, chosen))
        return
    from rich.console import Console, Group

    console = Console(highlight=False, markup=False)
    console.print(Group(*_parts(results, chosen, None if observable else FEW, console.width)))


def read(batch: str, processed: Path, reports: Path) -> Results:
    """Read the results of a batch that the words of the first page need.

    Raises
    ------
    ContractError
        One of the files is not there.
    """
    import pandas as pd

    from metro.batch.processed import read_batch

    files = [processed / batch / name for name in ("batch.json", "runs.parquet", "loop.json")]
    files += [reports / batch / name for name in ("identified.json", "verdict.json")]
    missing = [
        Finding("error", str(file), "is not there: call metro run") for file in files if not file.is_file()
    ]
    if missing:
        raise ContractError(missing)
    loop, identified, verdict = (json.loads(file.read_text(encoding="utf-8")) for file in files[2:])
    there = {name: path for name in TABLES if (path := processed / batch / f"{name}.parquet").is_file()}
    read = {name: pd.read_parquet(path) for name, path in there.items()}
    tables = {name: table for name, table in read.items() if len(table)}
    return Results(read_batch(processed / batch), tables, identified, verdict, loop)


def _content(results: Results, chosen: dict[str, JSON]) -> JSON:
    return {
        "batch": results.batch.name,
        "title": results.title,
        "measured": measured_words(results),
        "notes": _notes(results),
        "flags": [item.text for item in _flags(results) if isinstance(item, Paragraph)],
        "causes": results.loop.get("causes") or [],
        "trust": trust(results),
        "observables": {
            name: {"words": verdict_words(name, entry, left_words(results, name)), **entry}
            for name, entry in chosen.items()
        },
    }


def _notes(results: Results) -> list[str]:
    """Return the other sentences of the first page: decisions, advice, and the check of printed errors."""
    items = [*advice(results.identified), *print_check(results)]
    said = [item.text for item in items if isinstance(item, Paragraph)]
    return [*decided(results.verdict), *best_cut(results.verdict), *said]


def _flags(results: Results) -> list[Item]:
    """Return what the first page says is wrong in the raw data."""
    return list(with_flags(Section("", []), results).items)


def _causes(results: Results, observable: str) -> list[Item]:
    """Return what the first page says of the causes behind several verdicts; those of one observable."""
    causes = results.loop.get("causes") or []
    mine = [cause for cause in causes if not observable or observable in cause["seen_in"]]
    return list(with_causes(Section("", []), replace(results, loop={**results.loop, "causes": mine})).items)


def _parts(
    results: Results, chosen: dict[str, JSON], most: int | None, width: int
) -> Iterator[RenderableType]:
    from rich.text import Text

    yield Text(results.title, style="bold")
    yield Text(measured_words(results))
    yield from _shown(key_results(results))
    if not chosen:
        yield Text(f"\n{no_verdict(results)}\n{' '.join(trust(results))}")
    yield from _shown(_flags(results))
    for text in _notes(results):
        yield Text(f"\n{text}")
    for name, entry in chosen.items():
        status = str(entry.get("status"))
        sentence = verdict_words(name, entry, left_words(results, name))
        yield Text(f"\n{title(name)}: {STATUS.get(status, status)}", f"bold {COLOURS.get(status, 'red')}")
        yield Text(sentence)
        yield from error_bars(entry, width)
        yield from _candidates(results, name, entry, most)
        yield Text(f"To trust: {trust_in(results, name).partition(': ')[2]}")
        for remedy in remedies(entry):
            yield Text(f"What to do about it: {remedy}.", style="bold")
        if measurement := next_words(entry):
            yield Text(f"What to do next: {measurement}.", style="bold")
    yield from _shown(_causes(results, "" if most else next(iter(chosen))))


def _shown(items: list[Item]) -> Iterator[RenderableType]:
    """Show what a report says in a table, and in paragraphs that stand out."""
    from rich.text import Text

    for item in items:
        if isinstance(item, Paragraph):
            yield Text(f"\n{item.text}", style="yellow")
        elif isinstance(item, Table):
            yield Text(f"\n{item.caption}", style="bold")
            yield _grid(item.header, item.rows)


def _grid(header: Sequence[str], rows: Sequence[Sequence[str]]) -> Grid:
    from rich.table import Table as Grid

    grid = Grid(show_edge=False, pad_edge=False, header_style="bold")
    for name in header:
        grid.add_column(name, overflow="fold")
    for row in rows:
        grid.add_row(*row)
    return grid


def _candidates(results: Results, name: str, entry: JSON, most: int | None) -> Iterator[RenderableType]:
    """Yield the table of the effects that were tried, those that were added first."""
    tried = results.loop_record(name).get("candidates") or entry.get("candidates") or []
    if not tried:
        return
    added = {str(effect["effect"]): effect for effect in entry.get("effects") or []}
    others = [one for one in sorted(tried, key=_rank) if str(one["effect"]) not in added]
    rows = [
        [words(one), probability(effect.get("probability")), "", "", "added"] for one, effect in added.items()
    ]
    for one in others[:most]:
        shown = (probability(one.get("probability")), _gain(one), probability(one.get("p_value")))
        rows.append([words(str(one["effect"])), *shown, str(one.get("why_not") or one.get("verdict") or "–")])
    if most is not None and len(others) > most:
        more = f"metro explain {results.batch.name} {name}"
        rows.append([f"… and {len(others) - most} more", "", "", "", more])
    yield _grid(["effect tried", "probability", "held-out gain", "p", "outcome"], rows)


def _rank(candidate: JSON) -> tuple[float, float]:
    """Order candidates: the most probable first, then the best evidence."""
    return -_known(candidate.get("probability"), 0.0), _known(candidate.get("p_value"), 1.0)


def _gain(candidate: JSON) -> str:
    gain = candidate.get("held_out_gain")
    return "–" if gain is None else number(gain, 2)


def _known(value: Any, otherwise: float) -> float:
    return otherwise if value is None else float(value)
