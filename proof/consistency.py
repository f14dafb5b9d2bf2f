"""Whether reports keep their word: properties that hold between a verdict's sentences and its figures.

Each rule is a property of what was written (``verdict.json``, and the text of ``report.pdf`` where there is
one) and needs no truth: no "clean" beside an effect, no error that is larger than expected without a word
on whether chance explains it, the same status, sentences and names in the report as in the file.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path

from metro.batch.processed import read_json
from metro.units import JSON

Rule = Callable[[JSON], Iterator[str]]
AS_EXPECTED, CHANCE = 1.0, 0.01  # ratio to what is expected; p-value below which the error is beyond chance
SPEAKING = {"explained", "partly_explained", "undetermined"}  # statuses that name effects
TO_EXPLAIN = {"partly_explained", "unexplained"}  # statuses that say that a residual remains


def contradictions(verdict: JSON, page: str = "") -> list[str]:
    """Return what contradicts itself in a verdict, and on the page of results that shows it.

    Parameters
    ----------
    verdict : of ``verdict.json``. page : text of the report; empty: there is none.
    """
    found = []
    for name, entry in verdict["observables"].items():
        found += [f"{name}: {words}" for rule in RULES for words in rule(entry)]
        found += [f"{name}: {words}" for words in _on_page(entry, page)] if page else []
    return found


def checked(reports: Path) -> dict[str, list[str]]:
    """Return the contradictions of every batch below a folder of reports, by batch."""
    return {
        path.parent.name: contradictions(read_json(path), _text(path.with_name("report.pdf")))
        for path in sorted(reports.glob("*/verdict.json"))
    }


def _text(pdf: Path) -> str:
    """Text of a report in one line; empty where there is none."""
    if not pdf.is_file():
        return ""
    document = import_module("pypdfium2").PdfDocument(pdf)
    pages = [page.get_textpage().get_text_bounded() for page in document]
    return " ".join(" ".join(pages).split())


def _statuses(entry: JSON) -> Iterator[str]:
    status, names = entry["status"], [one["effect"] for one in entry["effects"]]
    if status in SPEAKING and not names and not entry["indistinguishable"]:
        yield f"{status}, but no effect is named"
    if status in {"clean", "unexplained", "insufficient"} and names:
        yield f"{status}, but {', '.join(names)} is named"
    if status in {"clean", "explained"} and entry["unexplained"]:
        yield f"{status}, but a residual is described as unexplained"
    if status in TO_EXPLAIN and not entry["unexplained"]:
        yield f"{status}, but no residual is described"


def _errors(entry: JSON) -> Iterator[str]:
    before, after = entry["before"], entry["after"]
    if not before or not after:
        return
    # The effects of the force change the prediction of the labels of chatter, too.
    alike = math.isclose(before["rms"], after["rms"], rel_tol=1e-6)
    if not entry["effects"] and not alike and entry["unit"] != "1":
        yield "no effect is named, but the error before differs from that after"
    for when, one in (("before", before), ("after", after)):
        low, high = one.get("ci95") or (None, None)
        if low is not None and high is not None and not low <= one["rms"] <= high:
            yield f"the interval of the error {when} does not hold its value"
    words = (entry.get("verification") or {}).get("words", "")
    if after["rms"] > before["rms"] and "error increases" not in words:
        yield "the held-out error grew with the effects, which is not said"


def _verification(entry: JSON) -> Iterator[str]:
    said = entry.get("verification")
    if not said or said.get("ratio") is None:
        return
    words = said["words"]
    if said["holds"] != (said["p_value"] >= CHANCE):
        yield f"the verification {'holds' if said['holds'] else 'fails'} at p = {said['p_value']:.2g}"
    if ("contradicts" in words) == bool(said["holds"]):
        yield "the sentence on the verification and its result disagree"
    if said["ratio"] > AS_EXPECTED and said["holds"] and "can explain" not in words:
        yield "an error above what is expected is not said to be one that chance explains"
    for one in said["worse_runs"]:
        if one["run"] not in words:
            yield f"run {one['run']} became worse, which the sentence does not say"


def _probabilities(entry: JSON) -> Iterator[str]:
    named = {one["effect"] for one in entry["effects"]}
    known = named.union(*entry["indistinguishable"])
    for one in (*entry["effects"], *entry["candidates"]):
        value = one.get("probability")
        if value is not None and not 0.0 <= value <= 1.0:
            yield f"{one['effect']} has the probability {value:g}"
    for one in entry["candidates"]:
        if named and one["effect"] not in known and not one.get("why_not"):
            yield f"{one['effect']} is neither named nor is it said why not"
    for one in entry["effects"]:
        for name, value in one["parameters"].items():
            each = value if isinstance(value, list) else [value]
            yield from (f"the interval of {name} of {one['effect']} does not hold its value" for part in each
                        if not _holds(part))  # fmt: skip


def _holds(value: JSON) -> bool:
    """Whether an interval, where there is one, holds its value."""
    if not isinstance(value, dict) or not value.get("ci95"):
        return True
    low, high = value["ci95"]
    at = value.get("value")
    return None in (low, high, at) or low <= at <= high


RULES: tuple[Rule, ...] = (_statuses, _errors, _verification, _probabilities)


def _on_page(entry: JSON, page: str) -> Iterator[str]:
    """Compare the text of the report with the file."""
    status = entry["status"].replace("_", " ")
    if status not in page:
        yield f"the report does not say {status!r}"
    said = (entry.get("verification") or {}).get("words")
    if said and _bare(said) not in _bare(page):
        yield "the report does not have the sentence on the verification"
    for one in entry["effects"]:
        if one["effect"].replace("_", " ") not in page.lower():
            yield f"the report does not name {one['effect']}"
    likeliest = max((one["probability"] for one in entry["effects"]), default=1.0)
    if likeliest < 0.95 and re.search(r"\bproven\b", page, re.IGNORECASE):
        yield f"the report says 'proven', but the likeliest effect has the probability {likeliest:.2f}"


def _bare(text: str) -> str:
    """Letters and figures of a text alone: line breaks and the signs of fonts differ."""
    return re.sub(r"[^a-z0-9]", "", text.lower())
