"""Over all batches: the settings that make a face flat, and the verdicts with the largest residuals."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from metro.observables.catalogue import title
from metro.report.content import Paragraph, Section, Table
from metro.report.numbers import number, percent, probability, quantity
from metro.units import JSON, printed

BEST, WORST = 3, 10


def rankings(identified: Mapping[str, JSON]) -> list[Section]:
    """Tabulate the flattest and the least flat configuration of each batch that has a ranking of them."""
    rows = []
    for batch, content in sorted(identified.items()):
        ranked = (content.get("study") or {}).get("ranking") or []
        shown = list(enumerate(ranked, start=1))
        shown = shown if len(shown) <= BEST + 1 else [*shown[:BEST], shown[-1]]
        rows += [
            [
                batch,
                f"{place} of {len(ranked)}",
                str(row["configuration"]),
                quantity(row["xm"]),
                probability(row.get("probability_best")),
            ]
            for place, row in shown
        ]
    if not rows:
        return []
    header = ["batch", "rank", "configuration", "X_m", "best with probability"]
    caption = (
        f"The {BEST} flattest configurations and the least flat one of each batch: X_m with its 95 % "
        "interval, and how probably each is the flattest of its batch."
    )
    return [Section("Configurations", [Table(header, rows, caption, [1.5, 0.7, 3, 1.4, 1.2], numeric=[4])])]


def largest_residuals(entries: Iterable[tuple[str, str, JSON]]) -> list[Section]:
    """Tabulate the verdicts with the largest residual after the loop, relative to the noise.

    Parameters
    ----------
    entries : batch, observable and verdict of each.
    """
    ratios = [
        (float(entry["after"]["rms"]) / float(entry["noise_floor"]), batch, name, entry)
        for batch, name, entry in entries
        if (entry.get("after") or {}).get("rms") is not None and entry.get("noise_floor")
    ]
    ranked = sorted(ratios, key=lambda row: (-row[0], row[1], row[2]))
    if not ranked:
        return []
    above = sum(ratio > 1 for ratio, *_ in ranked)
    said = f"{above} of {len(ranked)} residuals exceed the noise floor; see their verdicts."
    header = ["batch", "observable", "residual", "of the signal", "times the noise"]
    caption = "Residuals on held-out runs after the loop, the largest in units of the noise floor first."
    if len(ranked) > WORST:
        caption += f" The first {WORST}."
    table = Table(header, _rows(ranked[:WORST]), caption, [1.6, 1.8, 1.2, 1, 1], numeric=[2, 3, 4])
    return [Section("Largest residuals", [Paragraph(said), table])]


def _rows(ranked: Sequence[tuple[float, str, str, JSON]]) -> list[list[str]]:
    return [
        [
            batch,
            title(name),
            f"{number(entry['after']['rms'])} {printed(entry.get('unit'))}".strip(),
            "–" if entry.get("unit") == "1" else percent(entry["after"].get("nrmse")),
            number(ratio, 2),
        ]
        for ratio, batch, name, entry in ranked
    ]
