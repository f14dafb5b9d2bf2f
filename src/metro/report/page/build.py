"""The page: what the campaign's PDF says, then each batch in a section that unfolds, with its plots."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib.resources import files
from urllib.parse import quote

from metro import __version__
from metro.report.campaign import TITLE
from metro.report.content import Bullets, Item, Paragraph, Section, Table
from metro.report.numbers import number, percent, probability, words
from metro.report.page.curves import boundary_curves, run_curves
from metro.report.page.faces import face_maps, point_maps
from metro.report.page.markup import Html, badge, embedded, items_of, joined, tag
from metro.report.parameters import parameter_words
from metro.report.phrases import plain
from metro.report.results import Results, title
from metro.report.sections.causes import with_causes
from metro.report.sections.measured import measured_words
from metro.report.sections.verdict import (
    STATUS,
    advice,
    error_text,
    left_words,
    sentence,
)
from metro.units import JSON, printed

SCRIPTS = ("kit.js", "chart.js", "face.js", "page.js")
WHOLE, PER_BATCH = 4_000_000, 400_000  # bytes that the data of all plots, and those of one batch, may take


def campaign_page(sections: Sequence[Section], batches: Iterable[Results], links: Mapping[str, str]) -> str:
    """Return the campaign as one HTML file that needs no other; the same text for the same results.

    Parameters
    ----------
    sections : of the summary, see :func:`metro.report.campaign.campaign_sections`.
    batches : with the tables of :data:`metro.batch.layout.PAGE`; read one by one, none is kept once written.
    links : name of every batch → where its report is, as seen from the page.
    """
    budget = min(PER_BATCH, WHOLE // max(1, len(links)))
    anchors = {name: f"#{quote(_anchor(name))}" for name in links}
    told = [
        tag("section", tag("h2", s.title), items_of(s.items, anchors), aria_label=s.title) for s in sections
    ]
    unfolding = [_batch(results, links[results.batch.name], budget) for results in batches]
    buttons = [
        tag("button", "Unfold all", type="button", data_fold="open"),
        tag("button", "Fold all", type="button", data_fold="close"),
    ]
    without = tag("noscript", tag("p", "The plots need JavaScript; all else is here without it."))
    head = tag("p", *buttons, class_="tools")
    batch_part = tag("section", tag("h2", "Batches"), head, without, *unfolding, aria_label="Batches")
    return _document(TITLE, f"{len(links)} batches · metro {__version__}", [*told, batch_part])


def _document(heading: str, below: str, parts: Sequence[Html]) -> str:
    """Put the parts into a page that may load nothing and run nothing but its own script and style."""
    assets = files("metro.report.page") / "assets"
    script = "".join((assets / name).read_text(encoding="utf-8") for name in SCRIPTS)
    style = (assets / "page.css").read_text(encoding="utf-8")
    policy = f"default-src 'none'; img-src data:; script-src {_hashed(script)}; style-src {_hashed(style)}"
    head = tag(
        "head",
        tag("meta", charset="utf-8"),
        tag("meta", http_equiv="Content-Security-Policy", content=policy),
        tag("meta", name="viewport", content="width=device-width, initial-scale=1"),
        tag("title", heading),
        tag("style", Html(style)),
    )
    body = tag(
        "body",
        tag("a", "To the verdicts", href="#main", class_="skip"),
        tag("header", tag("h1", heading), tag("p", below)),
        tag("main", *parts, id="main", tabindex="-1"),
        tag("script", Html(script)),
    )
    return f"<!DOCTYPE html>\n{tag('html', head, body, lang='en')}\n"


def _hashed(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


def _anchor(batch: str) -> str:
    return f"batch-{batch}"


def _batch(results: Results, link: str, budget: int) -> Html:
    """Write a batch: verdicts in its summary line; words, errors, effects and plots when unfolded."""
    verdicts, name = results.verdicts(), results.batch.name
    badges = [
        joined([tag("span", title(n), " ", badge(_status(e)), class_="told"), " "])
        for n, e in verdicts.items()
    ]
    line = tag(
        "summary",
        tag("h3", results.title, *([tag("small", f" {name}")] if results.title != name else [])),
        joined(badges) or tag("span", "no verdict", class_="told"),
    )
    body = items_of(with_causes(Section("", _words(results)), results).items, {}, level=4)
    report = tag("p", tag("a", f"Report of {name} (PDF)", href=link))
    data = tag("script", embedded(_plots(results, budget)), type="application/json", class_="data")
    plots = tag("div", class_="plots")
    return tag("details", line, body, report, plots, data, id=_anchor(name), class_="batch")


def _status(entry: JSON) -> str:
    return STATUS.get(str(entry.get("status")), "–")


def _words(results: Results) -> list[Item]:
    """Say what the first page of the batch's report says."""
    verdicts = results.verdicts()
    nothing = "No held-out measurement could be compared with a prediction in this batch: no verdict."
    told = [Paragraph(sentence(n, e, left_words(results, n)), "verdict") for n, e in verdicts.items()]
    nexts = [
        f"Measure next, {title(n)}: {plain(e['next_experiment'])}"
        for n, e in verdicts.items()
        if e.get("next_experiment")
    ]
    return [
        Paragraph(measured_words(results)),
        *(told or [Paragraph(nothing, "verdict")]),
        *([Bullets(nexts)] if nexts else []),
        *advice(results.identified),
        *_errors(verdicts),
        *_effects(verdicts),
    ]


def _errors(verdicts: Mapping[str, JSON]) -> list[Item]:
    rows = [
        [
            title(name),
            _status(entry),
            *(text for when in ("before", "after") for text in _error(entry, when)),
            f"{number(entry.get('noise_floor'))} {printed(entry.get('unit'))}".strip(),
            str(len(entry.get("held_out_runs") or [])),
        ]
        for name, entry in verdicts.items()
    ]
    shares = ("rms before", "of the signal", "rms after", "of the signal")
    header = ["observable", "verdict", *shares, "noise floor", "held-out runs"]
    return [Table(header, rows, "Errors on held-out runs, with 95 % intervals.")] if rows else []


def _error(entry: JSON, when: str) -> tuple[str, str]:
    error = entry.get(when) or {}
    share = "–" if entry.get("unit") == "1" else percent(error.get("nrmse"))
    return error_text(error, entry.get("unit")), share


def _effects(verdicts: Mapping[str, JSON]) -> list[Item]:
    rows = [
        [
            words(str(effect["effect"])),
            title(name),
            "; ".join(parameter_words(str(effect["effect"]), effect.get("parameters") or {})) or "–",
            probability(effect.get("probability")),
        ]
        for name, entry in verdicts.items()
        for effect in entry.get("effects") or []
    ]
    header = ["effect", "seen in", "size", "probability"]
    return [Table(header, rows, "Effects found, with 95 % intervals.")] if rows else []


def _plots(results: Results, budget: int) -> list[JSON]:
    """Return what is drawn of a batch in ``budget`` bytes; what a plot leaves is shared by those after."""
    makers: list[Callable[[int], JSON | None]] = [
        lambda share: boundary_curves(results, share),
        lambda share: point_maps(results, share),
        lambda share: face_maps(results, share),
        *(lambda share, name=name: run_curves(results, name, share) for name in results.verdicts()),
    ]
    plots: list[JSON] = []
    for waiting, make in zip(range(len(makers), 0, -1), makers, strict=True):
        if plot := make(budget // waiting):
            plots.append(plot)
            budget = max(0, budget - len(embedded(plot)))
    return plots
