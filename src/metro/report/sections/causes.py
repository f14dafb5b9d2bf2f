"""The batch as one story: its causes, the observables that show them, errors propagated from the force."""

from __future__ import annotations

from dataclasses import replace

from metro.observables.catalogue import title
from metro.report.content import Item, Paragraph, Section, Table
from metro.report.numbers import listing, number, percent, probability, words
from metro.report.parameters import of_joint, parameter_words
from metro.report.phrases import sentence
from metro.report.results import Results, with_own
from metro.units import JSON, printed

STATUS = {
    "together": "significant only together",
    "contradiction": "contradiction",
    "confirmed": "confirmed",
    "denied": "another would show it, and does not",
    "alone": "others not sensitive enough",
    "one_observable": "no other could show it",
}
ALONE = ["pose"]  # what measured poses alone show has a section of its own
SAID = ("together", "contradiction")  # statements that the verdicts of single observables do not contain


def with_causes(summary: Section, results: Results) -> Section:
    """Return the first page with the causes of the batch behind the verdicts, where there are several."""
    facts = results.loop.get("effects") or {}
    causes = [
        with_own(cause, "cause", facts)
        for cause in results.loop.get("causes") or []
        if cause["seen_in"] != ALONE
    ]
    if not causes or len(results.verdicts()) < 2:
        return summary
    items = list(summary.items)
    behind = [i for i, item in enumerate(items) if isinstance(item, Paragraph) and item.look == "verdict"]
    place = max(behind, default=len(items) - 1) + 1
    return replace(summary, items=[*items[:place], *_story(causes), *items[place:]])


def _story(causes: list[JSON]) -> list[Item]:
    rows = [
        [
            cause_name(cause),
            listing([title(name) for name in cause["seen_in"]]),
            _values(cause),
            probability(cause["probability"]),
            STATUS.get(cause["status"], words(cause["status"])),
        ]
        for cause in causes
    ]
    header = ["cause", "seen in", "combined estimate", "probability", "other observables"]
    caption = "Causes in this batch, with parameters from all observables and 95 % intervals."
    table = Table(header, rows, caption, [1.5, 1.9, 2.0, 0.9, 1.4], numeric=[3])
    notes = [str(cause["words"]) for cause in causes if cause["status"] in SAID]
    return [table, *(Paragraph(sentence(note), "warning") for note in notes)]


PARTS = ("total", "upstream", "own", "doubt")  # of an error that a force propagates to
NORMAL = {"doubt": 1.96}  # from a standard deviation to half of a 95 % interval


def cause_name(cause: JSON) -> str:
    """Name of a cause, and of its joint."""
    return of_joint(str(cause["cause"]), (cause.get("where") or {}).get("joint"))


def _values(cause: JSON) -> str:
    if cause["status"] == "contradiction":
        return "no common value"
    return ", ".join(parameter_words(cause)) or "–"


def upstream(results: Results) -> Section | None:
    """Write the share of each observable's error from the predicted force, if that was measured, too."""
    chain = results.loop.get("chain") or {}
    rows = [
        [
            title(name),
            when,
            *(
                f"{number(NORMAL.get(part, 1.0) * entry[when][part])} {printed(entry['unit'])}"
                for part in PARTS
            ),
            percent(entry[when]["share"]),
        ]
        for name, entry in chain.items()
        for when in ("before", "after")
    ]
    if not rows:
        return None
    text = (
        "In held-out runs with a dynamometer the force is both predicted and measured. The table separates "
        "the error from the predicted force and the error that remains with the measured force. Where the "
        "verdict starts from the measured force, its error is the latter. A calibration error of the "
        "dynamometer shifts error between the two by at most the value given under uncertainty."
    )
    header = ["observable", "loop", "with predicted force", "from the force", "with measured force"]
    header += ["uncertainty", "share"]
    caption = (
        "Rms error by origin. Share: part of the mean square error that vanishes when the measured force is "
        "used; negative where the two errors compensate. Uncertainty: half of a 95 % interval."
    )
    table = Table(header, rows, caption, [1.5, 0.7, 1.2, 1.1, 1.2, 0.9, 0.7], numeric=[2, 3, 4, 5, 6])
    return Section("From force to shape", [Paragraph(text), table])
