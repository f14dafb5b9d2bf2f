"""``metro explain``: what the first page of a report tells, in a terminal."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from metro.batch.findings import ContractError, Finding
from metro.commands.completion import with_results
from metro.commands.output import print_json
from metro.report.content import Paragraph
from metro.report.numbers import number, percent, probability, words
from metro.report.phrases import plain
from metro.report.results import Results, title
from metro.report.sections.measured import measured_words
from metro.report.sections.verdict import (
    STATUS,
    advice,
    change,
    error_text,
    left_words,
    print_check,
    sentence,
)
from metro.units import JSON, printed

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.table import Table

FEW = 5  # candidates shown where all observables are
WIDTH = 40
COLOURS = {"clean": "green", "explained": "green", "insufficient": "yellow", "undetermined": "yellow"}


def explain(batch: str, observable: str, processed: Path, reports: Path, as_json: bool) -> None:
    """Print what was measured, the verdicts, the errors before and after, the candidates, what comes next.

    Parameters
    ----------
    batch : its name. observable : one of its observables; "" for all of them.

    Raises
    ------
    ContractError
        The batch has no results, or no verdict on the observable.
    """
    results = read(batch, processed, reports)
    verdicts = results.verdicts()
    if observable and observable not in verdicts:
        there = f"found verdicts on {', '.join(verdicts)}" if verdicts else "found no verdict at all"
        raise ContractError([Finding("error", batch, f"{there}, expected one on {observable}")])
    chosen = {observable: verdicts[observable]} if observable else verdicts
    if as_json:
        print_json(_content(results, chosen))
        return
    from rich.console import Console, Group

    Console(highlight=False, markup=False).print(Group(*_parts(results, chosen, None if observable else FEW)))


def read(batch: str, processed: Path, reports: Path) -> Results:
    """Read the results of a batch that the words need: no table but the printed errors.

    Raises
    ------
    ContractError
        One of the files is not there.
    """
    import pandas as pd

    from metro.batch.processed import read_batch

    known = with_results(reports)
    if batch not in known and not (processed / batch).is_dir():
        there = (
            f"batches with results: {', '.join(known)}" if known else "no batch has any yet: call snakemake"
        )
        raise ContractError([Finding("error", batch, f"there are no results of such a batch; {there}")])
    files = [processed / batch / name for name in ("batch.json", "runs.parquet", "loop.json")]
    files += [reports / batch / name for name in ("identified.json", "verdict.json")]
    missing = [
        Finding("error", str(file), "is not there: call snakemake") for file in files if not file.is_file()
    ]
    if missing:
        raise ContractError(missing)
    loop, identified, verdict = (json.loads(file.read_text(encoding="utf-8")) for file in files[2:])
    printed = processed / batch / "published_errors.parquet"
    table = pd.read_parquet(printed) if printed.is_file() else pd.DataFrame()
    tables = {"published_errors": table} if len(table) else {}
    return Results(read_batch(processed / batch), tables, identified, verdict, loop)


def _content(results: Results, chosen: dict[str, JSON]) -> JSON:
    return {
        "batch": results.batch.name,
        "title": results.title,
        "measured": measured_words(results),
        "notes": _notes(results),
        "observables": {
            name: {"words": sentence(name, entry, left_words(results, name)), **entry}
            for name, entry in chosen.items()
        },
    }


def _notes(results: Results) -> list[str]:
    """Return the other sentences of the first page: advice, and the check of printed errors."""
    items = [*advice(results.identified), *print_check(results)]
    return [item.text for item in items if isinstance(item, Paragraph)]


def _parts(results: Results, chosen: dict[str, JSON], most: int | None) -> Iterator[RenderableType]:
    from rich.text import Text

    yield Text(results.title, style="bold")
    yield Text(measured_words(results))
    if not chosen:
        yield Text("\nNo held-out measurement could be compared with a prediction in this batch: no verdict.")
    for text in _notes(results):
        yield Text(f"\n{text}")
    for name, entry in chosen.items():
        status = str(entry.get("status"))
        told = sentence(name, entry, left_words(results, name))
        yield Text(f"\n{title(name)}: {STATUS.get(status, status)}", f"bold {COLOURS.get(status, 'red')}")
        yield Text(told)
        yield from _bars(entry)
        yield from _candidates(results, name, entry, most)
        if entry.get("next_experiment"):
            yield Text(f"Measure next: {plain(entry['next_experiment']).rstrip('.')}.", style="bold")


def _bars(entry: JSON) -> Iterator[RenderableType]:
    """Draw the errors on held-out runs as bars over one scale, the floor that noise sets as a mark."""
    from rich.table import Table
    from rich.text import Text

    floor = entry.get("noise_floor")
    errors = [entry.get("before") or {}, entry.get("after") or {}]
    sizes = [float(error["rms"]) for error in errors if error.get("rms") is not None]
    top = max((size for size in [*sizes, floor or 0.0] if math.isfinite(size)), default=0.0)
    if top <= 0 or len(sizes) < len(errors):
        return
    told = change("", entry)
    shares = [told.before, told.after] if told else [None, None]
    table = Table.grid(padding=(0, 1))
    for label, error, size, share, colour in zip(
        ("base model", "with effects"), errors, sizes, shares, ("yellow", "cyan"), strict=True
    ):
        text = error_text(error, entry.get("unit"))
        more = f"({percent(share / 100)} of the signal)" if share is not None else ""
        table.add_row(Text(label), Text(bar(size, top, WIDTH, floor), style=colour), Text(f"{text} {more}"))
    if floor is not None:
        table.add_row(
            "", Text("│ noise floor", style="dim"), Text(f"{number(floor)} {printed(entry.get('unit'))}")
        )
    yield table


def bar(size: float, top: float, width: int, mark: float | None = None) -> str:
    """Return a bar of ``size`` in ``width`` characters that stand for ``top``, to an eighth of a character.

    ``mark`` is a value at which a line stands, over the bar or behind its end.
    """
    eighths = round(8 * width * min(max(size / top, 0.0), 1.0))
    text = ("█" * (eighths // 8) + " ▏▎▍▌▋▊▉"[eighths % 8]).ljust(width)[:width]
    if mark is None:
        return text
    at = min(int(width * min(max(mark / top, 0.0), 1.0)), width - 1)
    return f"{text[:at]}│{text[at + 1 :]}"


def _candidates(results: Results, name: str, entry: JSON, most: int | None) -> Iterator[Table]:
    """Yield the table of the effects that were tried, those that were added first."""
    from rich.table import Table

    tried = results.told(name).get("candidates") or entry.get("candidates") or []
    if not tried:
        return
    added = {str(effect["effect"]): effect for effect in entry.get("effects") or []}
    ranked = sorted(tried, key=_rank)
    table = Table(show_edge=False, pad_edge=False, header_style="bold")
    for header in ("effect tried", "probability", "held-out gain", "p", "outcome"):
        table.add_column(header, overflow="fold")
    for effect in added.values():
        table.add_row(words(str(effect["effect"])), probability(effect.get("probability")), "", "", "added")
    rest = [one for one in ranked if str(one["effect"]) not in added]
    for one in rest[:most]:
        shown = (probability(one.get("probability")), _gain(one), probability(one.get("p_value")))
        table.add_row(words(str(one["effect"])), *shown, str(one.get("why_not") or one.get("verdict") or "–"))
    if most is not None and len(rest) > most:
        table.add_row(
            f"… and {len(rest) - most} more", "", "", "", f"metro explain {results.batch.name} {name}"
        )
    yield table


def _rank(candidate: JSON) -> tuple[float, float]:
    """Order candidates: the most probable first, then the best evidence."""
    return -_known(candidate.get("probability"), 0.0), _known(candidate.get("p_value"), 1.0)


def _gain(candidate: JSON) -> str:
    gain = candidate.get("held_out_gain")
    return "–" if gain is None else number(gain, 2)


def _known(value: Any, otherwise: float) -> float:
    return otherwise if value is None else float(value)
