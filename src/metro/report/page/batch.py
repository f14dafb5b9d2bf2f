"""A batch in the page: its verdicts in a line; words, tables, files and plots when it is unfolded."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from urllib.parse import quote

from metro.observables.catalogue import title
from metro.report.content import Item, Section, Table
from metro.report.numbers import number, percent, probability, words
from metro.report.page.boundary import boundary_curves
from metro.report.page.curves import run_curves
from metro.report.page.faces import face_maps, point_maps
from metro.report.page.markup import Html, badge, embedded, items_of, joined, tag
from metro.report.page.path_errors import path_errors
from metro.report.page.responses import response_curves
from metro.report.page.trial import trial_cut
from metro.report.parameters import parameter_words
from metro.report.results import Results
from metro.report.sections.causes import with_causes
from metro.report.sections.summary import first_words
from metro.report.sections.verdict import STATUS, error_text
from metro.units import JSON, printed

FILES = ("verdict.json", "identified.json", "provenance.json")  # written by the stages next to the report


def anchor(batch: str) -> str:
    """Return the id of a batch's section."""
    return f"batch-{batch}"


def batch_section(results: Results, link: str, budget: int) -> Html:
    """Write a batch, folded.

    Parameters
    ----------
    link : path to its report, relative to the page. budget : bytes that the data of its plots may take.
    """
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
    items = [*first_words(results), *_errors(verdicts), *_effects(verdicts)]
    body = items_of(with_causes(Section("", items), results).items, {}, level=4)
    data = tag("script", embedded(_plots(results, budget)), type="application/json", class_="data")
    plots = tag("div", class_="plots")
    back = tag("p", tag("a", "Back to top", href="#top"), class_="back")
    return tag("details", line, _files(name, link), body, plots, data, back, id=anchor(name), class_="batch")


def _files(name: str, link: str) -> Html:
    """Link the report of a batch, as PDF and as a page, and the files next to it."""
    folder = link[: link.rfind("/") + 1]
    page = tag("a", "the same as a page", href=folder + "report.html")
    beside = [joined([" · ", tag("a", file, href=folder + quote(file))]) for file in FILES]
    return tag("p", tag("a", f"Report of {name} (PDF)", href=link), " · ", page, *beside, class_="files")


def _status(entry: JSON) -> str:
    return STATUS.get(str(entry.get("status")), "–")


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
            "; ".join(parameter_words(effect)) or "–",
            probability(effect.get("probability")),
        ]
        for name, entry in verdicts.items()
        for effect in entry.get("effects") or []
    ]
    header = ["effect", "seen in", "size", "probability"]
    return [Table(header, rows, "Effects found, with 95 % intervals.")] if rows else []


def _plots(results: Results, budget: int) -> list[JSON]:
    """Return the plots of a batch in ``budget`` bytes; later plots share the bytes that one did not need."""
    makers: list[Callable[[int], JSON | None]] = [
        lambda share: boundary_curves(results, share),
        lambda share: response_curves(results, share),
        lambda share: point_maps(results, share),
        lambda share: face_maps(results, share),
        *(lambda share, name=name: run_curves(results, name, share) for name in results.verdicts()),
        lambda share: path_errors(results, share),
        lambda _: trial_cut(results),
    ]
    plots: list[JSON] = []
    for waiting, make in zip(range(len(makers), 0, -1), makers, strict=True):
        if plot := make(budget // waiting):
            plots.append(plot)
            budget = max(0, budget - len(embedded(plot)))
    return plots
