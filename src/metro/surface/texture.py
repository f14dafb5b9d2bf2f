"""Surface texture of a trace by ISO 21920: P, W and R profiles, their parameters, and the interval of each.

The P profile is the trace as it was recorded, about its least-squares line. A Gaussian filter (ISO 16610-21)
with the nesting index λc parts it into W, which is longer, and R, which is shorter; waves below λs are taken
out of R where the points are close enough together to show them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from metro.surface.profile import even, gaussian_filter
from metro.surface.profile_parameters import (
    LEAST_WIDTH,
    moments,
    profile_parameters,
    section_length,
    slope,
    upward_crossings,
)
from metro.units import MM, UM, Array

SHORT: tuple[tuple[float, float], ...] = (
    (0.8 * MM, 2.5 * UM),
    (2.5 * MM, 8 * UM),
    (math.inf, 25 * UM),
)  # λs by λc: ISO 21920-3, table 1
SECTIONS = 5  # of an evaluation length, by default of ISO 21920-3
CLOSE = 5.0  # points per λs, and per λc: fewer do not show what the filter parts
LEAST_SECTIONS = 3  # from which their scatter gives an interval
FEW = 10  # crossings of the mean line, with fewer of which a profile is form and no texture
DRAWS = 24  # of the noise of the points
NORMAL = 1.96
MEANS = ("p", "v", "z")  # means over the sections
HEIGHTS = (*MEANS, "t")
MEAN_SQUARES = ("a", "q", "dq")  # or near to one
UNITLESS = ("sk", "ku", "dq")


@dataclass(frozen=True, eq=False)
class Profile:
    """A profile of a trace, evenly spaced, without the parts that the ends of the filter disturb.

    Attributes
    ----------
    letter : P, W or R. x, z : (n,) m. section : length of a section, m; the whole length for P and W.
    narrowest : m, width below which a hill or a dale does not count.
    """

    letter: str
    x: Array
    z: Array
    section: float
    narrowest: float

    @property
    def spacing(self) -> float:
        """Distance of the points, m."""
        return float(self.x[1] - self.x[0])

    @property
    def sections(self) -> list[Array]:
        """The heights of each whole section, (k,) m."""
        size = min(max(round(self.section / self.spacing), 1), len(self.z))
        return [self.z[i * size : (i + 1) * size] for i in range(len(self.z) // size)]


@dataclass(frozen=True)
class Parameter:
    """A parameter with its 95 % interval, SI; the ends are NaN where nothing determines them."""

    value: float
    low: float = math.nan
    high: float = math.nan
    source: str = ""


@dataclass(frozen=True)
class Texture:
    """The profiles of a trace, and what was settled or could not be said, in sentences."""

    profiles: tuple[Profile, ...]
    notes: tuple[str, ...]


def texture(x: Array, z: Array, cutoff: float) -> Texture:
    """Part a trace ``x``, ``z`` (n,), m, into its profiles; ``cutoff``: λc, m.

    Raises
    ------
    ValueError
        Where the trace has a gap, fewer than 8 points, or is level throughout.
    """
    x, z = even(x, z)
    spacing, length = float(x[1] - x[0]), float(x[-1] - x[0])
    if not np.ptp(z):
        raise ValueError("all heights of the profile are the same")
    primary, said = levelled(x, z)
    notes = [said]
    profiles = [Profile("P", x, primary, length, LEAST_WIDTH * section_length(primary, spacing))]
    if spacing > cutoff / CLOSE:
        notes.append(
            f"W and R are not stated: the points are {spacing / UM:.3g} µm apart, and λc = {cutoff / MM:g} "
            f"mm takes {cutoff / CLOSE / UM:.3g} µm or less."
        )
    elif length < 2.0 * cutoff - spacing:
        notes.append(
            f"W and R are not stated: the trace is {length / MM:.3g} mm long, and λc = {cutoff / MM:g} mm "
            f"takes {2.0 * cutoff / MM:.3g} mm for one section with half a λc at either end."
        )
    else:
        parts, remarks = _parted(x, primary, cutoff)
        profiles += parts
        notes += remarks
    return Texture(tuple(profiles), tuple(notes))


def levelled(x: Array, z: Array) -> tuple[Array, str]:
    """Return heights (n,) about their line, and which it is: the mean, or the least-squares line.

    A line through a texture of few elements follows from where these begin and end. Heights that change sides
    n times are like n independent ones: the rise of the line through these has a standard deviation of
    q √(12/n). A line that rises no more than 1.96 times that is no tilt of the trace, and is left in.
    """
    mean = z - z.mean()
    along = x - x.mean()
    rise = float(along @ mean) / float(along @ along)
    flat = mean - rise * along
    crossings = int(np.count_nonzero(np.diff(np.sign(flat))))
    chance = NORMAL * float(flat.std()) * math.sqrt(12.0 / max(crossings, 1))
    if crossings >= FEW and abs(rise) * float(np.ptp(x)) <= chance:
        return mean, "P is the trace as recorded, about its mean height: it has no tilt that can be shown."
    return flat, "P is the trace as recorded, about its least-squares line."


def _parted(x: Array, primary: Array, cutoff: float) -> tuple[list[Profile], list[str]]:
    spacing = float(x[1] - x[0])
    short = next(length for most, length in SHORT if cutoff <= most)
    fine = spacing <= short / CLOSE * (1.0 + 1e-9)  # 0.5 µm by its rounded places
    smooth = gaussian_filter(primary, spacing, cutoff)
    rough = (gaussian_filter(primary, spacing, short) if fine else primary) - smooth
    margin = round(0.5 * cutoff / spacing)
    inner = slice(margin, len(x) - margin)
    count = int((len(x) - 2 * margin + 1) * spacing / cutoff + 1e-9)
    notes = [
        f"λc = {cutoff / MM:g} mm; "
        + (
            f"λs = {short / UM:g} µm is applied to R. "
            if fine
            else f"λs = {short / UM:g} µm is not applied: the points are {spacing / UM:.3g} µm apart. "
        )
        + "Half a λc is left out at either end."
    ]
    if count < SECTIONS:
        notes.append(f"R is of {count} section{'s' if count > 1 else ''}; ISO 21920-3 asks for {SECTIONS}.")
    long, middle = smooth[inner], x[inner]
    wavy = Profile("W", middle, long - long.mean(), float(np.ptp(middle)), LEAST_WIDTH * cutoff)
    rough = rough[inner]
    return [wavy, Profile("R", middle, rough - rough.mean(), cutoff, LEAST_WIDTH * cutoff)], notes


def parameters(profile: Profile) -> dict[str, float]:
    """Return the parameters by their endings (a, q, sk, ku, p, v, z, t, dq, Sm), SI; Sm may be NaN."""
    whole = profile_parameters(profile.z, profile.spacing, profile.narrowest)
    pieces = np.array([[each.max(), -each.min(), np.ptp(each)] for each in profile.sections])
    return {
        "a": whole.a,
        "q": whole.q,
        "sk": whole.skewness,
        "ku": whole.kurtosis,
        **dict(zip(MEANS, map(float, pieces.mean(axis=0)), strict=True)),
        "t": whole.t,
        "dq": whole.slope,
        "Sm": whole.width,
    }


def stated(profile: Profile, noise: float) -> dict[str, Parameter]:
    """Return the parameters with intervals: by the scatter over the sections, else by the points' noise.

    ``noise``: standard deviation of a point, m; NaN where it is not known.
    """
    values = parameters(profile)
    count = len(profile.sections)
    if count >= LEAST_SECTIONS:
        scattered = _over_sections(profile, values)
        of = f"scatter over {count} sections"
        return {
            name: Parameter(
                value, *scattered.get(name, (math.nan, math.nan)), of if name in scattered else ""
            )
            for name, value in values.items()
        }
    if not noise > 0.0:
        return {name: Parameter(value) for name, value in values.items()}
    noises = list(_noises(profile, noise))
    disturbed = [parameters(replace(profile, z=profile.z + each)) for each in noises]
    alone = [parameters(replace(profile, z=each)) for each in noises]
    found = {
        name: _under_noise(name, value, *(np.array([draw[name] for draw in of]) for of in (disturbed, alone)))
        for name, value in values.items()
    }
    # Of a profile that noise has rounded already, more of it makes the mean deviation grow less.
    # A normal distribution is what noise makes of any other: where a/q is above that of a normal, it falls.
    least = min(found["a"].low, found["a"].value * found["q"].low / found["q"].value)
    return found | {"a": replace(found["a"], low=least)}


def _least(name: str, low: float) -> float:
    """Return the lower end of an interval: only the skewness is below zero."""
    return low if name == "sk" else max(low, 0.0)


def _over_sections(profile: Profile, values: dict[str, float]) -> dict[str, tuple[float, float]]:
    """Return intervals by the jackknife over sections; of the total height, an extreme, there is none."""
    from scipy.special import stdtrit

    pieces = _pieces(profile)
    count = len(pieces.sections)
    left_out = [_without(pieces, i) for i in range(count)]
    reach = float(stdtrit(count - 1, 0.975)) * math.sqrt((count - 1) ** 2 / count)
    ends = {}
    for name, value in values.items():
        each = np.array([one.get(name, math.nan) for one in left_out])
        if name != "t" and np.isfinite(each).all():
            half = reach * float(each.std(ddof=1))
            if name == "Sm":
                half = math.hypot(half, _of_ends(profile, value))
            ends[name] = (_least(name, value - half), value + half)
    return ends


def _of_ends(profile: Profile, width: float) -> float:
    """Return how far a mean width may be off since elements begin between points: the first and the last."""
    elements = max(round(float(np.ptp(profile.x)) / width), 1)
    return NORMAL * profile.spacing * math.sqrt(2.0 / 12.0) / elements


@dataclass(frozen=True, eq=False)
class _Pieces:
    """What the sections of a profile have each: ``heights`` (k, 3) of ``MEANS`` and ``slopes`` (k,), the rms.

    ``begins`` (n,) the section in which each element of the whole profile begins, ``widths`` (n,) its width.
    """

    sections: list[Array]
    heights: Array
    slopes: Array
    begins: Array
    widths: Array


def _pieces(profile: Profile) -> _Pieces:
    sections = profile.sections
    crossings = upward_crossings(profile.z - profile.z.mean(), profile.narrowest / profile.spacing)
    return _Pieces(
        sections,
        np.array([[each.max(), -each.min(), np.ptp(each)] for each in sections]),
        np.array([slope(each, profile.spacing) for each in sections]),
        crossings[:-1] // len(sections[0]),
        np.diff(crossings) * profile.spacing,
    )


def _without(pieces: _Pieces, gone: int) -> dict[str, float]:
    """Return the parameters of all sections but one; element widths are those that begin in the others."""
    kept = np.arange(len(pieces.sections)) != gone
    rest = moments(np.concatenate([each for each, stays in zip(pieces.sections, kept, strict=True) if stays]))
    widths = pieces.widths[pieces.begins != gone]
    return {
        "a": rest.a,
        "q": rest.q,
        "sk": rest.skewness,
        "ku": rest.kurtosis,
        **dict(zip(MEANS, map(float, pieces.heights[kept].mean(axis=0)), strict=True)),
        "dq": math.sqrt(float(np.mean(pieces.slopes[kept] ** 2))),
        "Sm": float(widths.mean()) if len(widths) else math.nan,
    }


def _noises(profile: Profile, noise: float) -> Iterator[Array]:
    """Yield noise as the points of the profile have it, in mirrored pairs; of W what passes its filter."""
    cutoff = profile.narrowest / LEAST_WIDTH
    random = np.random.default_rng(0)
    for _ in range(DRAWS // 2):
        off = noise * random.standard_normal(len(profile.z))
        off = gaussian_filter(off, profile.spacing, cutoff) if profile.letter == "W" else off
        yield from (off, -off)


def _under_noise(name: str, value: float, disturbed: Array, alone: Array) -> Parameter:
    """Return a parameter with the interval that the noise of the points leaves of it.

    Parameters
    ----------
    disturbed : (k,) the parameter of the profile with noise added. alone : (k,) that of the noise.

    Notes
    -----
    The trace has its noise already. A mean square grows by that of the noise, whatever the profile; a height
    by no more than the height of the noise alone, since max(a + b) ≤ max a + max b.
    """
    if not (np.isfinite(disturbed).all() and math.isfinite(value)):
        return Parameter(value)
    spread = NORMAL * float(disturbed.std(ddof=1))
    growth = float(disturbed.mean()) - value
    if name in MEAN_SQUARES:
        squares = disturbed**2 - value**2
        reach = float(squares.mean()) + NORMAL * float(squares.std(ddof=1))
        low = math.sqrt(max(value**2 - reach, 0.0))
    elif name in HEIGHTS:
        low = value - float(alone.mean()) - spread
    else:
        low = value - max(growth, 0.0) - spread
    high = value - min(growth, 0.0) + spread
    return Parameter(value, _least(name, low), high, "noise of the points")


def by_repeats(values: list[dict[str, float]]) -> Callable[[str, float], Parameter]:
    """Return a function that gives a parameter its interval by the scatter of repeated traces of one place.

    ``values``: of each of two or more traces. The interval is that of one trace.
    """
    from scipy.special import stdtrit

    reach = float(stdtrit(len(values) - 1, 0.975))

    def of(name: str, value: float) -> Parameter:
        sd = float(np.std([each[name] for each in values], ddof=1))
        if not math.isfinite(sd):
            return Parameter(value)
        low, high = _least(name, value - reach * sd), value + reach * sd
        return Parameter(value, low, high, f"scatter of {len(values)} traces")

    return of
