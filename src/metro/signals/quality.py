"""Is a record fit for use? Findings in the words of a process engineer, as rows of the quality table."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from metro.signals.clipping import FLAT_TOP_SAMPLES, flat_top, longest_run
from metro.units import MS, Array

RATE_TOLERANCE = 0.01
JITTER_LIMIT = 0.1
GAP = 1.5
AIR_BLOCKS = 50
TEETH = 0.2  # scatter over mean, above which it may be the force of teeth: a wrong zero does not scatter
SMOOTH = 0.5  # scatter of the steps over that of the values, below which it is no white noise
AIR_ACTIVITY = 0.1
OFFSET_LIMIT = 0.02


class Finding(NamedTuple):
    """A check's value against its limit (NaN where it has none); not ``ok``: somebody should look."""

    check: str
    value: float
    limit: float
    ok: bool
    message: str


@dataclass(frozen=True)
class Steps:
    """Steps between time stamps, s.

    ``typical`` is their median; ``count``, ``mean`` and ``variance`` are of those that are no gap; ``gaps``
    counts those that are, ``lost`` is what they are together beyond the typical, ``longest`` of all.
    """

    typical: float
    count: int
    mean: float
    variance: float
    gaps: int
    lost: float
    longest: float

    def joined(self, other: Steps) -> Steps:
        """Return the steps of this part and the next of a record, whose gaps are judged by this typical."""
        count = self.count + other.count
        share = other.count / max(count, 1)
        apart = other.mean - self.mean
        within = (1.0 - share) * self.variance + share * other.variance
        return Steps(
            self.typical,
            count,
            self.mean + share * apart,
            within + share * (1.0 - share) * apart**2,
            self.gaps + other.gaps,
            self.lost + other.lost,
            max(self.longest, other.longest),
        )


def steps(time_s: Array, typical: float | None = None) -> Steps:
    """Return the steps of the time stamps (n,), s, strictly rising, n ≥ 2; ``typical``: where it is known."""
    every = np.diff(time_s)
    typical = float(np.median(every)) if typical is None else typical
    gaps = every > GAP * typical
    regular = every[~gaps]
    mean, variance = (float(np.mean(regular)), float(np.var(regular))) if len(regular) else (0.0, 0.0)
    lost = float(np.sum(every[gaps] - typical))
    return Steps(typical, len(regular), mean, variance, int(gaps.sum()), lost, float(np.max(every)))


def sampling(time_s: Array, declared_hz: float | None = None) -> list[Finding]:
    """Check rate, jitter and gaps of the time stamps (n,), s, strictly rising, n ≥ 2."""
    return sampled(steps(time_s), declared_hz)


def sampled(record: Steps, declared_hz: float | None = None) -> list[Finding]:
    """Check rate, jitter and gaps by the steps of a record.

    The rate is one over the mean step, gaps left out; a median would inherit the rounding of time stamps.
    """
    rate = 1.0 / record.mean
    return [_rate(rate, declared_hz), _jitter(float(np.sqrt(record.variance)) * rate), _gaps(record)]


def _rate(rate: float, declared_hz: float | None) -> Finding:
    if declared_hz is None:
        message = f"sampled at {rate:.6g} Hz; batch.yaml declares no rate"
        return Finding("sampling rate", rate, np.nan, True, message)
    ok = abs(rate / declared_hz - 1.0) <= RATE_TOLERANCE
    message = f"sampled at {rate:.6g} Hz, declared {declared_hz:.6g} Hz"
    hint = "" if ok else ": the time stamps are used; correct the rate in batch.yaml or the time column"
    return Finding("sampling rate", rate, declared_hz, ok, message + hint)


def _jitter(jitter: float) -> Finding:
    ok = jitter <= JITTER_LIMIT
    message = f"time steps scatter by {100.0 * jitter:.2g} % of the step"
    hint = "" if ok else ": time stamps are rounded or samples came late; log with more digits"
    return Finding("jitter", jitter, JITTER_LIMIT, ok, message + hint)


def _gaps(record: Steps) -> Finding:
    if record.gaps == 0:
        return Finding("gaps", 0.0, 0.0, True, "no samples are missing")
    missing = f"{record.lost / record.typical:.0f} samples missing in all"
    gaps = f"{record.gaps} gap{'s' if record.gaps > 1 else ''}"
    message = f"{gaps}, the longest {record.longest / MS:.3g} ms, {missing}"
    return Finding("gaps", float(record.gaps), 0.0, False, f"{message}: the logger lost data")


def flat_tops(
    name: str, values: Array, full_scale: float | None = None, ends: tuple[bool, bool] = (True, True)
) -> Finding:
    """Check a channel (n,) for clipping: five or more samples in a row at full scale, or cut off at an end.

    ``ends``: as of :func:`metro.signals.clipping.flat_top`.
    """
    extremes = float(np.min(values)), float(np.max(values))
    flat = [(flat_top(values, level, ends), level) for level in extremes]
    if full_scale is not None:
        flat.append((longest_run(np.abs(values) >= full_scale), full_scale))
    longest, level = max(flat)
    ok = longest < FLAT_TOP_SAMPLES
    message = f"{name} is not clipped"
    if not ok:
        fault = f"{name} stays at {level:.5g} for {longest} samples in a row"
        message = f"{fault}: the amplifier's range was exceeded; measure again with a larger range"
    return Finding("clipping", float(longest), float(FLAT_TOP_SAMPLES), ok, message)


def dead(name: str, values: Array) -> Finding:
    """Check that a channel moves at all."""
    return moving(name, float(np.ptp(values)), float(values[0]))


def moving(name: str, span: float, first: float) -> Finding:
    """Check that a channel moves at all, by the span of its values and the first of them."""
    ok = span > 0.0
    fault = f"{name} stays at {first:.5g} throughout: is the channel connected?"
    message = f"{name} moves" if ok else fault
    return Finding("dead channel", span, 0.0, ok, message)


def alike(names: tuple[str, ...], values: Array) -> Finding:
    """Check that no two channels (n, k) that move are the same, but for the sign."""
    return apart(names, same_pairs(values), np.ptp(values, axis=0))


def same_pairs(values: Array) -> set[tuple[int, int, bool]]:
    """Find pairs i > j of channels (n, k) that are the same (True), or the same but for the sign (False)."""
    signed = {True: values, False: -values}
    return {
        (i, j, kept)
        for i in range(values.shape[1])
        for j in range(i)
        for kept, other in signed.items()
        if np.array_equal(values[:, i], other[:, j])
    }


def apart(names: tuple[str, ...], pairs: set[tuple[int, int, bool]], span: Array) -> Finding:
    """Check that no channels that move, by their span (k,), are among the pairs that are the same."""
    same = [f"{names[j]} and {names[i]}" for i, j, _ in sorted(pairs) if span[i] > 0.0]
    message = f"{same[0]} are one signal: is one cable in two inputs?" if same else "channels differ"
    return Finding("channels alike", float(len(same)), 0.0, not same, message)


def motion(set_deg: Array) -> Finding:
    """Check that an arm (n, 6) is commanded to move."""
    travel = float(np.ptp(set_deg, axis=0).max())
    message = (
        f"the joints move by up to {travel:.3g}°" if travel else "no joint moves: is it the log of a cut?"
    )
    return Finding("motion", travel, 0.0, travel > 0.0, message)


def blocks_of(values: Array) -> tuple[Array, Array, Array]:
    """Return scatter (b,), means (b, k) and scatter of the steps (b,) of the blocks that channels part into.

    The scatter is that of all channels together; that of white noise equals that of its steps, by which a
    force of teeth moves less from sample to sample.
    """
    blocks = values[: len(values) // AIR_BLOCKS * AIR_BLOCKS].reshape(AIR_BLOCKS, -1, values.shape[1])
    if blocks.shape[1] < 2:
        return np.zeros(0), np.zeros((0, values.shape[1])), np.zeros(0)
    scatter = np.sqrt(np.sum(np.var(blocks, axis=1), axis=1))
    steps = np.sqrt(0.5 * np.sum(np.mean(np.diff(blocks, axis=1) ** 2, axis=1), axis=1))
    return scatter, blocks.mean(axis=1), steps


def zero_in_air(names: tuple[str, ...], blocks: tuple[Array, Array, Array], largest: float) -> list[Finding]:
    """Check the zero of force channels where the tool cuts air at the record's start or end.

    Air is the run of blocks at either end whose scatter is below a tenth of the cut's. A cut that is calm
    before it chatters is no air: the force of its teeth scatters, and does so smoothly. A record that has no
    air does not show its zero, and gives no finding.

    Parameters
    ----------
    blocks : of the channels, as of :func:`blocks_of`. largest : of the values, without their sign.
    """
    activity, mean, steps = blocks
    if not len(activity):
        return []
    quiet = activity < AIR_ACTIVITY * float(np.quantile(activity, 0.9))
    air = np.logical_and.accumulate(quiet) | np.logical_and.accumulate(quiet[::-1])[::-1]
    if not air.any() or air.all():
        return []
    zero = mean[air].mean(axis=0)
    scatter, limit = float(np.median(activity[air])), OFFSET_LIMIT * largest
    smooth = float(np.median(steps[air])) < SMOOTH * scatter
    if np.abs(zero).max() > limit and smooth and scatter > TEETH * np.linalg.norm(zero):
        return []
    return [_offset(name, float(value), limit) for name, value in zip(names, zero, strict=True)]


def _offset(name: str, value: float, limit: float) -> Finding:
    ok = abs(value) <= limit
    message = f"{name} reads {value:.3g} while the tool cuts air"
    hint = "" if ok else f", more than {limit:.3g}: reset the charge amplifier before the cut"
    return Finding("zero in air", value, limit, ok, message + hint)


EXTENT = "size of the scan"  # a check that every cloud passes, and that is shown to whoever brings it in


def missing_points(dropped: int, kept: int) -> Finding:
    """Report the points of a cloud that had no coordinates and were dropped."""
    share = dropped / max(dropped + kept, 1)
    message = f"{kept} points, {dropped} without coordinates were dropped"
    hint = "" if share <= 0.5 else ": most of the face gave no reading; check the scanner's exposure"
    return Finding("missing points", share, 0.5, share <= 0.5, message + hint)


def conjugated(sign: float, turning: float = 0.0) -> Finding:
    """Report a driving-point FRF whose imaginary part has the sign of a structure that gives out power.

    Where its phase falls over the resonances (``turning`` below zero) it is not conjugated but reversed.
    """
    ok = sign <= 0.0
    if not ok and turning < 0.0:
        fault = "the driving point's imaginary part is positive, and its phase falls over the resonances"
        message = f"{fault}: sensor or hammer points the other way, or they are at different places"
        return Finding("FRF sign", sign, 0.0, ok, f"{message}; used without its stiffness")
    message = "the driving point takes in power, as it must"
    if not ok:
        fault = "the driving point's imaginary part is positive: the FRF is conjugated (e^{-iωt})"
        message = f"{fault} or one sensor points the other way; export it with e^{{+iωt}}"
    return Finding("FRF convention", sign, 0.0, ok, message)


def light(mass_kg: float, limit_kg: float, *, soft: bool) -> Finding:
    """Report an FRF of a structure that is soft and of little mass, by both of which its unit is in doubt."""
    ok = not soft or mass_kg >= limit_kg
    message = f"the FRF is that of a mass of {1e3 * mass_kg:.3g} g"
    hint = "" if ok else " that is softer than any robot: is response_unit of impacts.csv right? It is used"
    return Finding("FRF size", mass_kg, limit_kg, ok, f"{message}{hint}")
