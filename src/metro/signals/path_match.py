"""Whether two logs belong together: the same path, wholly, at the same speed, by clocks that agree.

An idle run says nothing about conditions that it does not share with the cut. Every difference is stated
with its figure, and logs of different places are refused.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from metro.signals.align import LEAST_SHARE, bin_means, projected
from metro.units import MM, MS, Array

NEAR = 0.5 * MM  # two runs of one programme lie closer than this
FARTHEST = 10 * MM  # as far as an idle run is lifted off the work; beyond, the arm has another posture
SAME_SPEED = 0.01  # clocks that are wrong by more than this do not exist
DRIFT = 1e-4
WHOLE = 0.98
_BINS = 200


@dataclass(frozen=True)
class Match:
    """How two logs, of the cut and of the idle run, compare; lengths in m, times in s.

    Attributes
    ----------
    length : of the cut's path. covered : share of it that the idle run passed.
    apart, farthest : rms and largest distance of the idle run's samples from the cut's path.
    speed : median speed of the cut by its time stamps.
    pace, pace_sd : time that passes in the cut per time in the idle run at the same places (idle speed over
        cut speed), and its standard error. NaN where they share too little.
    offset : the cut's time stamp where the idle run's is zero.
    jitter : rms of the cut's time stamps about offset + pace · idle time.
    """

    length: float
    covered: float
    apart: float
    farthest: float
    speed: float
    pace: float
    pace_sd: float
    offset: float
    jitter: float

    @property
    def refusal(self) -> str | None:
        """Why the idle run cannot be compared with the cut; None where it can."""
        if self.covered < LEAST_SHARE:
            return (
                f"the idle run covers {self.covered * self.length / MM:.1f} mm of the "
                f"{self.length / MM:.1f} mm "
                "of the cut's path"
            )
        if self.apart > FARTHEST:
            return (
                f"the idle run is {self.apart / MM:.1f} mm (rms) from the cut's path, expected at most "
                f"{FARTHEST / MM:g} mm: gravity and friction of another place"
            )
        return None

    def remarks(self, rate: Array, viscous: Array | None = None) -> list[str]:
        """Describe what the two runs do not share, with the error that it implies.

        Parameters
        ----------
        rate : (m, n) speeds of the joints in the cut, rad/s. viscous : (n,) friction, N m s/rad, if known.
        """
        said = []
        if self.covered < WHOLE:
            said.append(
                f"the idle run covers {100 * self.covered:.0f} % of the cut's path: no force elsewhere"
            )
        if self.apart > NEAR:
            said.append(
                f"the idle run is {self.apart / MM:.2f} mm (rms; at most {self.farthest / MM:.2f} mm) "
                f"from the "
                "cut's path"
            )
        if abs(self.pace - 1) > SAME_SPEED:
            said.append(self._of_speed(rate, viscous))
        elif abs(self.pace - 1) > max(DRIFT, 3 * self.pace_sd):
            said.append(
                f"the clocks drift: {self.pace - 1:+.2e} ± {1.96 * self.pace_sd:.1e} of the idle run's time "
                f"({(self.pace - 1) * self.length / self.speed / MS:+.2f} ms over the path)"
            )
        return said

    def _of_speed(self, rate: Array, viscous: Array | None) -> str:
        """Viscous friction is proportional to speed: what it differs by, or what each unit of it would."""
        change = np.abs(rate).max(axis=0) * abs(self.pace - 1)
        text = f"the idle run was {100 * (self.pace - 1):+.1f} % faster than the cut"
        if viscous is None:
            most = int(np.argmax(change))
            return (
                f"{text}: friction differs by up to {change[most]:.2g} N m per N m s/rad of viscous friction "
                f"(joint {most + 1}; it is not known here)"
            )
        error = change * viscous
        most = int(np.argmax(error))
        return f"{text}: viscous friction differs by up to {error[most]:.2g} N m (joint {most + 1})"


def match(cut: Array, cut_time: Array, idle: Array, idle_time: Array) -> Match:
    """Compare two logs.

    Parameters
    ----------
    cut, idle : (n, 3), (n', 3) commanded tip where it moves, m. cut_time, idle_time : (n,), (n',) stamps, s.
    """
    s_cut, _ = projected(cut, cut)
    s_idle, away = projected(idle, cut)
    inside = np.isfinite(s_idle)
    length = float(s_cut[-1])
    if not inside.any():
        away, inside = (
            np.array([np.linalg.norm(idle - cut[:1], axis=1).min(initial=math.inf)]),
            np.array([True]),
        )
        covered = 0.0
    else:
        covered = float(np.ptp(s_idle[inside]) / length)
    speed = float(np.median(np.diff(s_cut) / np.diff(cut_time)))
    apart, farthest = float(np.sqrt(np.mean(away[inside] ** 2))), float(away[inside].max())
    pace, pace_sd, offset, jitter = _pace(s_cut, cut_time, s_idle, idle_time)
    return Match(length, covered, apart, farthest, speed, pace, pace_sd, offset, jitter)


def _pace(
    s_cut: Array, cut_time: Array, s_idle: Array, idle_time: Array
) -> tuple[float, float, float, float]:
    """Straight line through the times of both logs at the same places; standard errors from the residuals."""
    known = s_idle[np.isfinite(s_idle)]
    if len(known) < 10:
        return math.nan, math.nan, math.nan, math.nan
    place = np.linspace(known.min(), known.max(), min(_BINS, len(known) // 3) + 1)
    times = [
        bin_means(s, np.column_stack([time, s]), place)
        for s, time in ((s_cut, cut_time), (s_idle, idle_time))
    ]
    full = np.isfinite(times[0]).all(axis=1) & np.isfinite(times[1]).all(axis=1)
    (first, s_first), (second, s_second) = times[0][full].T, times[1][full].T
    if len(first) < 4:
        return math.nan, math.nan, math.nan, math.nan
    # the samples of a bin lie at slightly different places: the cut's own speed takes them together
    first = first + np.gradient(first, s_first) * (s_second - s_first)
    design = np.column_stack([np.ones(len(second)), second])
    (offset, pace), *_ = np.linalg.lstsq(design, first, rcond=None)
    residual = first - design @ (offset, pace)
    jitter = float(np.sqrt(residual @ residual / (len(first) - 2)))
    sd = jitter / float(np.sqrt(((second - second.mean()) ** 2).sum()))
    return float(pace), sd, float(offset), jitter
