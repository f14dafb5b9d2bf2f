"""The tables of a proof, as text: the same for the terminal and for the page."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from proof.estimates import ANGLES
from proof.figures import demanded, further, kind, undecided
from proof.score import STATUSES, Score
from proof.statistics import Demand, Figure, binned, share
from virtual_cell.arm_effects import SHOWN

NOTHING, UNEXPLAINED = "(clean)", "(unexplained)"
KINDS = {
    "none": "nothing",
    "one": "one effect",
    "two": "two effects",
    "outside": "outside the library",
}


@dataclass(frozen=True)
class Table:
    """A title, a header and rows of text; ``note`` explains how to read it."""

    title: str
    header: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]
    note: str = ""


def tables(scores: Sequence[Score], observable: str = "force") -> list[Table]:
    """Return every table of a proof."""
    labels = [tabulated("What the tests cannot decide", undecided(scores), _UNDECIDED)]
    return [
        tabulated("What is demanded", demanded(scores), NOTES[observable]),
        tabulated("What lies behind", further(scores), ""),
        *(labels if observable == "lobes" else []),
        _statuses(scores),
        _effects(scores),
        confusion(scores),
        _pairs(scores),
        _outside(scores),
        _estimates(scores),
        _calibration(scores),
        _wrong(scores),
    ]


_FORCE = (
    "Effects count from a size of 1 × the noise: the rms change of the prediction on held-out runs when the "
    "effect is left out and all else is refitted, over the rms noise of what is compared there. Of effects "
    "outside the library, the size is the base model's error beyond the declared noise. Intervals: Wilson "
    "for shares, order statistics for medians."
)
_LOBES = (
    "Effects count from a size of 1: of labels drawn from the truth with the errors that the loop allows "
    "for, 95 of 100 sets speak for the effect, at its true parameters, with the log-likelihood ratio that "
    "the loop asks for (3). Of effects outside the library, the size is by how much less likely the labels "
    "are than those that the base model would draw, over that of one in a hundred of these. Where there "
    "are too few tests for a verdict, "
    "nothing counts as seen. Errors are of the probability of a held-out label."
)
_ARM = _FORCE.replace("Intervals:", "An effect named in a wrong joint is a wrong effect. Intervals:")
_UNDECIDED = "Undecided: undetermined or insufficient."
NOTES = {"force": _FORCE, "flatness": _FORCE, "lobes": _LOBES, **dict.fromkeys(SHOWN, _ARM)}


def tabulated(title: str, figures: Iterable[Figure], note: str) -> Table:
    """Return figures as a table, each with its interval and what is demanded of it."""
    rows = [
        (f.label, number(f.value, f.unit), _interval(f), str(f.count), _demand(f.demand, f.unit), _met(f))
        for f in figures
    ]
    return Table(title, ("figure", "value", "95 % interval", "cases", "demanded", "met"), rows, note)


def number(value: float, unit: str) -> str:
    """Return a figure as it is printed: a share in per cent, anything else with its unit."""
    if not np.isfinite(value):
        return "–"
    return f"{100 * value:.1f} %" if unit == "%" else f"{value:.3g} {unit}".strip()


def _interval(figure: Figure) -> str:
    if not figure.count or not np.isfinite(figure.low) or figure.low == figure.high:
        return "–"
    return f"{number(figure.low, figure.unit)} to {number(figure.high, figure.unit)}"


def _demand(demand: Demand | None, unit: str) -> str:
    if demand is None:
        return ""
    bounds = [("≥", demand.least), ("≤", demand.most)]
    return ", ".join(f"{sign} {number(bound, unit)}" for sign, bound in bounds if bound is not None)


def _met(figure: Figure) -> str:
    if figure.demand is None:
        return ""
    if figure.met is None:
        return "no case"
    return "yes" if figure.met else "NO" if figure.missed_for_sure else "no, within chance"


def _statuses(scores: Sequence[Score]) -> Table:
    rows = []
    for name, words in KINDS.items():
        for seen in (True, False) if name != "none" else (False,):
            group = [s for s in kind(scores, name) if s.seen is seen]
            counts = Counter(s.status for s in group)
            size = "" if name == "none" else (", seen" if seen else ", below the noise")
            rows.append((words + size, str(len(group)), *(str(counts[status] or "·") for status in STATUSES)))
    return Table("Statuses", ("hidden", "batches", *STATUSES), rows)


def _effects(scores: Sequence[Score]) -> Table:
    rows = []
    for name in _names(kind(scores, "one")):
        group = [s for s in kind(scores, "one") if s.hidden == (name,)]
        seen = [s for s in group if s.seen]
        sizes = [s.sizes[name] for s in group if s.sizes]
        instead = Counter(other for s in seen for other in s.named if other != name)
        rows.append(
            (
                *(name, str(len(group)), f"{np.median(sizes):.2g}" if sizes else "–", str(len(seen))),
                *(_of([s.exact for s in seen]), _of([s.right for s in group if not s.seen])),
                ", ".join(f"{other} {count}" for other, count in instead.most_common()) or "–",
            )
        )
    header = ("hidden", "batches", "median size", "seen", "right, seen", "right, below", "also or instead")
    return Table("One effect", header, rows, "Size: over the noise.")


def _of(cases: Sequence[bool]) -> str:
    return f"{sum(cases)} of {len(cases)}" if cases else "–"


def _names(scores: Iterable[Score]) -> list[str]:
    return sorted({name for s in scores for name in s.hidden})


def confusion(scores: Sequence[Score]) -> Table:
    """Count what was named by what was hidden, alone; effects below the noise in rows of their own."""
    hidden = [s for name in ("none", "one", "outside") for s in kind(scores, name)]
    rows: dict[str, list[str]] = {}
    for s in hidden:
        label = (s.hidden[0] + ("" if s.seen else ", below the noise")) if s.hidden else "nothing"
        rows.setdefault(label, []).extend(s.named or ([NOTHING] if s.status == "clean" else [UNEXPLAINED]))
    effects = sorted(
        {name for names in rows.values() for name in names if name not in {NOTHING, UNEXPLAINED}}
    )
    columns = (*effects, NOTHING, UNEXPLAINED)
    counted = {label: Counter(names) for label, names in sorted(rows.items())}
    lines = [(label, *(str(count[name] or "·") for name in columns)) for label, count in counted.items()]
    return Table(
        "Confusion",
        ("hidden", *columns),
        lines,
        f"{UNEXPLAINED}: nothing is named, something is left or undecided.",
    )


def _pairs(scores: Sequence[Score]) -> Table:
    rows = []
    for s in sorted(kind(scores, "two"), key=lambda s: s.hidden):
        named = ["yes" if name in s.named else "no" for name in s.hidden]
        sizes = [f"{s.sizes[name]:.2g}" if name in s.sizes else "–" for name in s.hidden]
        rows.append((s.batch, *s.hidden, *sizes, *named, ", ".join(sorted(s.extra)) or "–", s.status))
    header = ("batch", "first", "second", "size", "size", "named", "named", "named too", "status")
    return Table("Two effects", header, rows)


def _outside(scores: Sequence[Score]) -> Table:
    rows = []
    for name in _names(kind(scores, "outside")):
        group = [s for s in kind(scores, "outside") if s.hidden == (name,)]
        seen = [s for s in group if s.seen]
        named = Counter(other for s in group for other in s.named)
        rows.append(
            (
                *(name, str(len(group)), str(len(seen)), _of([s.admitted for s in seen])),
                *(_of([s.misattributed for s in seen]), _of([s.misattributed for s in group if not s.seen])),
                ", ".join(f"{other} {count}" for other, count in named.most_common()) or "–",
            )
        )
    header = ("hidden", "batches", "seen", "rest admitted, seen", "wrong, seen", "wrong, below", "named")
    return Table("Outside the library", header, rows)


def _estimates(scores: Sequence[Score]) -> Table:
    estimates = [one for name in ("one", "two") for s in kind(scores, name) if s.seen for one in s.estimates]
    rows = []
    for key in sorted({(one.effect, one.parameter) for one in estimates}):
        group = [one for one in estimates if (one.effect, one.parameter) == key]
        covered = share("", [one.covered for one in group if one.covered is not None])
        error = float(np.median([abs(one.error) for one in group]))
        words = f"{error:.2g}°" if key in ANGLES else f"{100 * error:.2g} %"
        rows.append((*key, str(len(group)), words, number(covered.value, "%"), _interval(covered)))
    header = (
        "effect",
        "parameter",
        "values",
        "median error",
        "95 % interval covers",
        "95 % interval of that",
    )
    return Table("Parameters", header, rows, "Relative errors; of angles with a period in degrees.")


def _calibration(scores: Sequence[Score]) -> Table:
    stated = [pair for s in scores for pair in (*s.stated, *s.rejected)]
    rows = [
        (
            *(f"{b.low:g} to {b.high:g}", str(b.count), f"{b.stated:.3f}", f"{b.came_true.value:.3f}"),
            f"{b.came_true.low:.3f} to {b.came_true.high:.3f}",
        )
        for b in binned(stated)
    ]
    header = ("stated probability", "effects", "mean stated", "frequency right", "95 % interval")
    return Table("Calibration", header, rows, "Every effect tried in every batch, named or not.")


def _wrong(scores: Sequence[Score]) -> Table:
    """Return the batches that a person should look at."""
    asked = [s for s in scores if s.seen and s.kind in {"one", "two"} and not s.exact]
    asked += [s for s in kind(scores, "none") if s.added]
    asked += [s for s in kind(scores, "outside") if s.misattributed or (s.seen and not s.admitted)]
    asked += [s for s in scores if s.extra and s.kind in {"one", "two"} and s not in asked]
    rows = [
        (
            *(
                s.batch,
                s.kind,
                " + ".join(f"{name} ({s.sizes.get(name, np.nan):.2g})" for name in s.hidden) or "–",
            ),
            *(s.status, ", ".join(f"{name} ({p:.2f})" for name, p in s.named.items()) or "–"),
        )
        for s in sorted(asked, key=lambda s: s.batch)
    ]
    return Table("Batches that went wrong", ("batch", "kind", "hidden (size)", "status", "named (p)"), rows)
