"""The judgement on a new file: what it is, in words that a machinist can act on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Literal

from metro.units import JSON
from metro.watch.figures import Compared, Figure
from metro.watch.record import Named
from metro.watch.resemblance import Likeness

Status = Literal["as predicted", "differs", "checked", "error"]


@dataclass(frozen=True)
class Judgement:
    """What is said of a file.

    Attributes
    ----------
    file : as the table names it. run : of runs.csv, or test of impacts.csv; "" where no row names the file.
    status : "checked" of a file that was read and is compared with nothing.
    headline : one sentence. reasons : further sentences. advice : what to do.
    figures : by axis, N; "all" of the three together. causes : codes of what it looks like.
    at : when, ISO 8601. seconds : from the last change of the file to the judgement.
    key : of file, content and row: a judgement holds as long as these are the same.
    """

    file: str
    run: str
    status: Status
    headline: str
    reasons: tuple[str, ...] = ()
    advice: str = ""
    figures: Mapping[str, JSON] = field(default_factory=dict)
    causes: tuple[str, ...] = ()
    at: str = ""
    seconds: float = 0.0
    key: str = ""

    @property
    def content(self) -> JSON:
        """As JSON."""
        return asdict(self)


GO_ON = "Go on."
# By cause: what it may be, and what to check.
MEANING = {
    "proportion": (
        "another axial depth than runs.csv states, harder or softer work, or a worn tool",
        "the axial depth, the work and the edges",
    ),
    "feed": (
        "another feed per tooth than runs.csv states, or harder or softer work",
        "the feed rate, the spindle speed and the work",
    ),
    "edge": ("edges that are more worn, or sharper, than those of the batch", "the edges of the tool"),
    "thrust": (
        "edges that are rounder or more worn than those of the batch, or other work",
        "the edges of the tool and the work",
    ),
    "runout": (
        "another runout of the tool than the batch had, or unequal teeth",
        "the clamping of the tool, and its teeth",
    ),
    "turned": (
        "a dynamometer that is turned about z against the batch",
        "the mounting of the dynamometer and feed_direction_deg",
    ),
    "zero": ("a zero of the dynamometer that is wrong", "the reset of the charge amplifier before the cut"),
    "drift": (
        "a force that drifts along the run",
        "the drift of the charge amplifier, the temperature and the edges",
    ),
    "radial": ("another radial depth than runs.csv states", "the radial depth, and the stock before the cut"),
}
INSTRUMENT = {"turned", "zero", "drift"}
UNDECIDED = "One run does not show what it is: no cause that was tried has its shape."


def of_force(named: Named, compared: Compared, causes: Sequence[Likeness]) -> Judgement:
    """Return the judgement on a force record that was compared with its prediction."""
    whole = compared.whole
    figures = {each.axis or "all": _content(each) for each in (whole, *compared.axes)}
    error = (
        f"measured less predicted is {number(whole.rms_n)} N rms, {whole.ratio:.1f} times the expected error "
        f"of {number(whole.expected_n)} N"
    )
    by_axis = ", ".join(
        f"{each.axis} {number(each.rms_n)} N ({each.ratio:.1f} times)" for each in compared.axes
    )
    if compared.as_predicted:
        headline = f"as predicted: {error}"
        return Judgement(
            named.file, named.run, "as predicted", headline, (f"By axis: {by_axis}.",), GO_ON, figures
        )
    worst = compared.worst
    headline = f"differs by {number(whole.rms_n)} N rms ({whole.ratio:.1f} times the expected error)"
    if worst.ratio > 1.5 * whole.ratio:
        headline += f", most in {worst.axis} ({worst.ratio:.1f} times)"
    reasons = [f"By axis: {by_axis}.", *likeness_words(causes)]
    codes = tuple(each.code for each in causes)
    return Judgement(
        named.file, named.run, "differs", headline, tuple(reasons), _advice(codes), figures, codes
    )


def likeness_words(causes: Sequence[Likeness]) -> list[str]:
    """Say what a residual looks like, and what else it may be."""
    if not causes:
        return [UNDECIDED]
    best, *others = causes
    sentences = [
        f"It looks like {_sized(best)}: {MEANING[best.code][0]} "
        f"(this shape holds {100 * best.explained:.0f} % of the difference)."
    ]
    if others:
        alike = "; or ".join(f"{_sized(each)}: {MEANING[each.code][0]}" for each in others)
        sentences.append(f"This run cannot distinguish it from {alike}.")
    return sentences


def _sized(cause: Likeness) -> str:
    """Name a cause with its size."""
    size = cause.size
    length = sum(each**2 for each in size) ** 0.5
    more = "larger" if size[0] > 0.0 else "smaller"
    share = f"{100.0 * abs(size[0]):.0f} %"
    by_axis = ", ".join(f"{value:+.2g}" for value in size)
    return {
        "proportion": f"a force that is {share} {more} in proportion",
        "feed": f"a part of the force that grows with the feed, {share} {more}",
        "edge": f"edge forces that are {share} {more}",
        "thrust": f"a radial force on the teeth that is {share} {more}",
        "runout": f"a force once per revolution, as of {length:.2g} µm of runout",
        "turned": f"a turn of {size[0]:.2g}°",
        "zero": f"an offset of {by_axis} N in x, y, z",
        "drift": f"a drift of {by_axis} N/s in x, y, z",
        "radial": f"a radial depth that is {abs(size[0]):.2g} mm {more}",
    }[cause.code]


def _advice(codes: Sequence[str]) -> str:
    if not codes:
        return "Cut again; if the repeat differs as well, stop and plan runs with metro next."
    checks = "; ".join(dict.fromkeys(MEANING[code][1] for code in codes))
    if set(codes) <= INSTRUMENT:
        return f"Check {checks}, then cut again."
    return f"Stop and check {checks}, before the next cut."


def not_compared(named: Named, why: str, warnings: Sequence[str]) -> Judgement:
    """Return the judgement on a file that was read and is compared with nothing."""
    headline = f"checked, not compared: {why}"
    return Judgement(named.file, named.run, "checked", headline, tuple(_sentence(w) for w in warnings), GO_ON)


def faulty(file: str, run: str, message: str, advice: str) -> Judgement:
    """Return the judgement on a file that cannot be used as it is."""
    return Judgement(file, run, "error", f"cannot be used: {message}", (), advice)


def number(value: float) -> str:
    """Write a force with two significant digits, whole newtons from 100 on."""
    return f"{value:.0f}" if abs(value) >= 100.0 else f"{value:.2g}"


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:].rstrip('.')}."


def _content(figure: Figure) -> JSON:
    return {"rms_n": figure.rms_n, "expected_n": figure.expected_n, "times": figure.ratio}
