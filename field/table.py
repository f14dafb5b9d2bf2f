"""The comparison as a page of the documentation, and in short for the terminal."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from field.run import Result
from field.taking import Known
from metro.report.numbers import with_interval
from metro.units import JSON

HEAD = """# Files of others

Files that other people recorded, brought in by `metro import` alone and run like any batch, beside what is
known of them. The files are not part of the repository; `python -m field --write docs/field.md` makes this
page from them. *Agreement*: whether our 95 % interval and the known value with its rounding overlap.

| set | questions | time, s | ends in | quantity | known | ours (95 %) | agreement |
| --- | --- | --- | --- | --- | --- | --- | --- |
"""


def page(results: Sequence[Result]) -> str:
    """Return the comparison in Markdown."""
    rows = [f"| {' | '.join(row)} |" for result in results for row in _rows(result)]
    remarks = [f"- `{r.set.name}`: {r.set.remark}." for r in results if r.set.remark]
    refusals = [f"- `{r.set.name}` is refused: {r.refusal}" for r in results if r.refusal]
    return HEAD + "\n".join(rows) + "\n\n" + "\n".join([*remarks, *refusals]) + "\n"


def summary(results: Sequence[Result]) -> str:
    """Return the comparison line by line."""
    return "".join("  ".join(row) + "\n" for result in results for row in _rows(result))


def _rows(result: Result) -> Iterator[list[str]]:
    ends = "refusal" if result.refusal else "report"
    head = [f"`{result.set.name}`", str(result.questions), f"{result.seconds:.0f}", ends]
    if result.wrong:
        head[-1] += " (should not)"
    rows = [_compared(known, result.found) for known in result.set.known] if result.found else []
    for place, row in enumerate(rows or [["–", "–", "–", "–"]]):
        yield [*(head if not place else [""] * len(head)), *row]


def _compared(known: Known, found: dict[str, JSON] | None) -> list[str]:
    ours = known.ours(found) if found else None
    given = "–" if known.value is None else f"{known.value:g} {known.unit}"
    if ours is None:
        return [known.what, given, "none", "cannot say"]
    text = f"{with_interval(ours['value'], ours.get('ci95'))} {known.unit}"
    return [known.what, given, text, _agreement(known, ours)]


def _agreement(known: Known, ours: JSON) -> str:
    low, high = (ours.get("ci95") or [None, None])[:2]
    if known.value is None:
        return "–"
    if low is None or high is None:
        equal = abs(known.value - ours["value"]) <= known.half
        return "equal as far as it is known, no interval" if equal else "no interval"
    if low - known.half <= known.value <= high + known.half:
        return "within"
    half = 0.5 * (high - low) + known.half
    return f"off by {abs(known.value - ours['value']) / half:.1f} half widths"
