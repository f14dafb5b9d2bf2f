"""The campaign: all batches in one table and one PDF."""

from __future__ import annotations

import re
from collections.abc import Mapping

import pandas as pd

from metro import __version__
from metro.batch.capabilities import plural
from metro.observables.catalogue import names, title
from metro.report.content import Bullets, Item, Paragraph, Picture, Section, Table
from metro.report.document import Cover, compile_pdf
from metro.report.figures import verdicts as figures
from metro.report.numbers import listing, number, words
from metro.report.parameters import effect_words
from metro.report.phrases import plain
from metro.report.sections import findings
from metro.report.sections.decisions import best_cut, decided
from metro.report.sections.memory import memory_section
from metro.report.sections.standings import largest_residuals, rankings
from metro.report.sections.trust import HOLDS
from metro.report.sections.verdict import STATUS, change, error_text, known_interval, next_words
from metro.units import JSON, printed

TITLE = "Campaign summary"
PER_FIGURE = 24
MOST_LINES = 6
TEXT = (
    "batch",
    "observable",
    "status",
    "unit",
    "effects",
    "parameters",
    "rivals",
    "unexplained",
    "next_experiment",
    "error",
)
NUMBERS = (
    *("noise_floor", "before_rms", "before_lo", "before_hi", "before_nrmse"),
    *("after_rms", "after_lo", "after_hi", "after_nrmse"),
)


def campaign_table(verdicts: Mapping[str, JSON], failed: Mapping[str, str] | None = None) -> pd.DataFrame:
    """Return one row per batch and observable: status, errors before and after with intervals, effects.

    Parameters
    ----------
    verdicts : content of ``verdict.json`` by batch.
    failed : batches without a result, and why: each has a row of status ``failed`` with the reason as error.
    """
    rows = [_row(batch, name, entry) for batch, name, entry in _entries(verdicts)]
    blank = dict.fromkeys(TEXT, "")
    rows += [
        {**blank, "batch": batch, "status": "failed", "error": why} for batch, why in (failed or {}).items()
    ]
    table = pd.DataFrame(rows, columns=[*TEXT[:4], *NUMBERS, *TEXT[4:]])
    return table.astype({**dict.fromkeys(TEXT, str), **dict.fromkeys(NUMBERS, float)})


def campaign_report(
    verdicts: Mapping[str, JSON],
    identified: Mapping[str, JSON],
    memory: JSON | None = None,
    failed: Mapping[str, str] | None = None,
    links: Mapping[str, str] | None = None,
) -> bytes:
    """Return the campaign's summary as a PDF; the same bytes for the same results.

    ``memory``: content of ``memory.json``; ``failed``: batches without a result, and why; ``links``: path to
    the report of each batch, relative to the summary.
    """
    cover = Cover(TITLE, plural(len(verdicts), "batch"), f"metro {__version__}")
    return compile_pdf(cover, campaign_sections(verdicts, identified, memory, failed), links or {})


def campaign_sections(
    verdicts: Mapping[str, JSON],
    identified: Mapping[str, JSON],
    memory: JSON | None = None,
    failed: Mapping[str, str] | None = None,
) -> list[Section]:
    """Return the sections of the summary, for the PDF and for the page."""
    entries = _entries(verdicts)
    nexts = _nexts(entries)
    judged = [f"{batch}: {line}" for batch, each in sorted(verdicts.items()) for line in decided(each)]
    cuts = [f"{batch}: {line}" for batch, each in sorted(verdicts.items()) for line in best_cut(each)]
    return [
        *_failed(failed or {}),
        Section(
            "Verdicts", [Paragraph(_overview(verdicts), "verdict"), *_verdicts(entries), *_pictures(entries)]
        ),
        *([Section("Conformity with tolerances", [Bullets(judged)])] if judged else []),
        *([Section("Recommended cuts", [Bullets(cuts)])] if cuts else []),
        *([Section("What to measure next", [Bullets(nexts)])] if nexts else []),
        *largest_residuals(entries),
        *rankings(identified),
        *memory_section(memory or {}),
        Section("What could not be determined", _undetermined(entries, identified)),
    ]


def _nexts(entries: list[tuple[str, str, JSON]]) -> list[str]:
    """Say what to measure next: what verdicts need comes first, and what several ask for is said once."""
    alike: dict[tuple[bool, str, str], list[str]] = {}
    for batch, name, entry in entries:
        if text := next_words(entry):
            alike.setdefault((entry.get("status") in HOLDS, title(name), text), []).append(batch)
    ranked = sorted(alike.items(), key=lambda item: item[0][0])
    return [f"{listing(batches)}, {name}: {text}" for (_, name, text), batches in ranked]


def _failed(failed: Mapping[str, str]) -> list[Section]:
    """List the batches without a result, with the reason of each; the other sections omit them."""
    if not failed:
        return []
    lines = {batch: why.splitlines() for batch, why in failed.items()}
    rows = [
        [
            batch,
            "; ".join(reasons[:MOST_LINES])
            + (f"; and {len(reasons) - MOST_LINES} more" * (len(reasons) > MOST_LINES)),
        ]
        for batch, reasons in sorted(lines.items())
    ]
    text = f"{plural(len(failed), 'batch')} failed; the summary is of the others."
    table = Table(["batch", "what stopped it"], rows, "Batches without a result.", [1, 4])
    return [Section("Batches that failed", [Paragraph(text, "warning"), table])]


def _entries(verdicts: Mapping[str, JSON]) -> list[tuple[str, str, JSON]]:
    order = {name: i for i, name in enumerate(names())}
    return [
        (batch, name, entry)
        for batch, verdict in sorted(verdicts.items())
        for name, entry in sorted(
            (verdict.get("observables") or {}).items(), key=lambda item: order.get(item[0], len(order))
        )
    ]


def _row(batch: str, observable: str, entry: JSON) -> JSON:
    effects = entry.get("effects") or []
    rivals = [" or ".join(words(str(n)) for n in group) for group in entry.get("indistinguishable") or []]
    row = {
        "batch": batch,
        "observable": observable,
        "status": entry.get("status", ""),
        "unit": entry.get("unit") or "",
        "noise_floor": entry.get("noise_floor"),
        "effects": ", ".join(str(e["effect"]) for e in effects),
        "parameters": "; ".join(effect_words(e) for e in effects),
        "rivals": "; ".join(rivals),
        "unexplained": str((entry.get("unexplained") or {}).get("signature") or ""),
        "next_experiment": entry.get("next_experiment") or "",
        "error": "",
    }
    for when in ("before", "after"):
        error = entry.get(when) or {}
        low, high = known_interval(error) or (None, None)
        values = {"rms": error.get("rms"), "lo": low, "hi": high, "nrmse": error.get("nrmse")}
        row |= {f"{when}_{key}": value for key, value in values.items()}
    return row


def _overview(verdicts: Mapping[str, JSON]) -> str:
    counts: dict[str, int] = {}
    for _, _, entry in _entries(verdicts):
        name = STATUS.get(str(entry.get("status")), "other")
        counts[name] = counts.get(name, 0) + 1
    silent = [batch for batch, verdict in sorted(verdicts.items()) if not verdict.get("observables")]
    total = sum(counts.values())
    text = f"{plural(len(verdicts), 'batch')}, {plural(total, 'verdict')}"
    text += f": {listing([f'{n} {name}' for name, n in counts.items()])}." if counts else "."
    return text + (f" Nothing could be compared in {listing(silent)}." if silent else "")


def _verdicts(entries: list[tuple[str, str, JSON]]) -> list[Item]:
    rows = [
        [
            batch,
            title(name),
            STATUS.get(str(entry.get("status")), "–"),
            error_text(entry.get("before"), None),
            error_text(entry.get("after"), None),
            printed(entry.get("unit")) or "1",
            number(entry.get("noise_floor")),
            "; ".join(effect_words(e) for e in entry.get("effects") or []) or "none",
        ]
        for batch, name, entry in entries
    ]
    header = ["batch", "observable", "verdict", "before", "after", "unit", "noise", "effects added"]
    caption = (
        "Errors on held-out runs (rms, with 95 % intervals; none where one condition was held out) before "
        "and after the effects that were found."
    )
    return [Table(header, rows, caption, [1.5, 1.3, 1, 1.25, 1.25, 0.5, 0.75, 2.1])] if rows else []


def _pictures(entries: list[tuple[str, str, JSON]]) -> list[Item]:
    rows = [c for b, n, e in entries if (c := change(f"{b}: {title(n)}", e)) is not None]
    items: list[Item] = []
    for start in range(0, len(rows), PER_FIGURE):
        part = rows[start : start + PER_FIGURE]
        alt = "; ".join(f"{c.label}: {c.before:.2g} % before, {c.after:.2g} % after" for c in part)
        figure = figures.changes(part, "error on held-out runs (% of the signal)")
        items.append(
            Picture(figure, f"{findings.changed(part)} Errors with 95 % intervals, and the noise floor.", alt)
        )
    return items


def _undetermined(entries: list[tuple[str, str, JSON]], identified: Mapping[str, JSON]) -> list[Item]:
    sentences = []
    for batch, name, entry in entries:
        row = _row(batch, name, entry)
        if row["rivals"]:
            sentences.append(f"{batch}, {title(name)}: {row['rivals']} cannot be distinguished.")
        if row["unexplained"]:
            sentences.append(f"{batch}, {title(name)}: unexplained residual, {plain(row['unexplained'])}.")
        if row["status"] == "insufficient":
            sentences.append(f"{batch}, {title(name)}: there are too few identification runs to decide.")
    missing = _missing(identified)
    items: list[Item] = [Bullets(sentences)] if sentences else [Paragraph("Every residual was explained.")]
    if missing:
        caption = "What was not identified, and why."
        items.append(Table(["reason", "not identified", "batches"], missing, caption, [2, 1.8, 2.6]))
    return items


def _missing(identified: Mapping[str, JSON]) -> list[list[str]]:
    """Return a row for each reason, with the quantities and the batches that it concerns."""
    batches: dict[tuple[str, str], list[str]] = {}
    for batch, content in sorted(identified.items()):
        for name, reason in (content.get("not_identified") or {}).items():
            text = re.sub(r"^cell \S+: ", "", str(reason)).rstrip(".")
            batches.setdefault((text, title(str(name))), []).append(batch)
    alike: dict[tuple[str, str], list[str]] = {}
    for (reason, name), quantities in batches.items():
        alike.setdefault((reason, ", ".join(quantities)), []).append(name)
    ranked = sorted(alike.items(), key=lambda item: -len(item[0][1].split(", ")))
    return [[reason, listing(names), quantities] for (reason, quantities), names in ranked]
