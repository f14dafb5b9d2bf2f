"""Poles of each file by itself, and what all files say of a mode together.

A test takes hours: the hammer's place, the mass of a sensor that moves on, or the temperature shift the poles
from file to file. A fit of common poles to all files takes every line for a repetition, and its errors fall
with the number of lines, however much the files contradict each other. So every file is fitted once more with
poles of its own: how much these differ belongs to the error of the mode.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from metro.dynamics.common_value import Common, common_value
from metro.dynamics.modes import RESOLVED, Mode, modal_constants
from metro.dynamics.polefit import PoleFit, criterion
from metro.dynamics.refine import Data, refine
from metro.units import Array, ComplexArray

_HALF = 0.5  # half width, at 95 %, of the logarithm of a damping that single files cannot identify
_FEW = 8  # iterations of a fit that is only compared with another one


@dataclass(frozen=True)
class Own:
    """Fit of the responses ``columns`` of one file.

    Attributes
    ----------
    seen : (m,) the modes whose poles are its own.
    strayed : (m,) those whose poles went to another mode's place, and are the common ones instead.
    """

    columns: np.ndarray
    fit: PoleFit
    seen: np.ndarray
    strayed: np.ndarray


@dataclass(frozen=True)
class Moved:
    """How a mode differs between files: what they have in common, on a logarithmic scale."""

    frequency: Common
    damping: Common


def own_fits(data: Data, fit: PoleFit, files: Sequence[np.ndarray]) -> list[Own]:
    """Fit each file from the common poles on; ``files`` are the columns of each.

    A mode keeps its common pole in a file that does not resolve its damping (near a node of its shape), and
    in one whose fit moves it to another mode's place: it makes up for something else there.
    """
    return [_own(data.of(columns), fit, columns) for columns in files]


def _own(part: Data, fit: PoleFit, columns: np.ndarray) -> Own:
    common = refine(part, fit.omega, fit.zeta, real=fit.real, iterations=0)
    seen = np.array([_sees(common, r) for r in range(len(fit.omega))])
    strayed = np.zeros_like(seen)
    own = common
    while seen.any():
        own = refine(part, fit.omega, fit.zeta, real=fit.real, free=seen)
        away = seen & _strays(fit.poles, own.poles)
        if not away.any():
            break
        seen, strayed, own = seen & ~away, strayed | away, common
    return Own(columns, own, seen, strayed)


def _strays(common: ComplexArray, own: ComplexArray) -> np.ndarray:
    """Return which modes (m,) have a pole of their own that is nearer to the common pole of another."""
    distance = np.abs(own[:, None] - common)
    return np.asarray(distance.argmin(axis=1) != np.arange(len(common)))


def _sees(fit: PoleFit, r: int) -> bool:
    gradient = np.zeros(3 * len(fit.omega))
    gradient[len(fit.omega) + r] = 1.0
    return 0.0 < fit.sd(gradient, 0) < RESOLVED


@dataclass(frozen=True)
class Explained:
    """What poles of each file's own leave of the data: ``chi2``, with (real data, parameters) ``count``."""

    chi2: float
    count: tuple[int, int]

    def bic(self) -> float:
        """Bayesian information criterion."""
        return criterion(self.chi2, self.count)

    def as_well_as(self, common: PoleFit) -> bool:
        """Return whether it leaves no more per degree of freedom than ``common`` does, but for chance.

        The difference of two sums of squares of normal noise has twice as many times its variance as they
        differ in parameters; two standard deviations of it count as chance.
        """
        spare = abs(self.count[1] - common.count[1])
        allowed = self.count[0] - self.count[1] + 2.0 * math.sqrt(2.0 * spare)
        return self.chi2 <= common.chi2_per_datum * allowed


def explained(data: Data, fit: PoleFit, files: Sequence[np.ndarray]) -> Explained:
    """Fit each file by itself from the common poles on, and add up what that leaves."""
    own = [refine(data.of(columns), fit.omega, fit.zeta, real=fit.real, iterations=_FEW) for columns in files]
    count = np.sum([each.count for each in own], axis=0)
    return Explained(sum(each.chi2 for each in own), (int(count[0]), int(count[1])))


def moved(fits: Sequence[Own], r: int, decay: float) -> Moved | None:
    """Return what the files that see mode ``r`` have in common; None if it is one or none."""
    there = [own.fit for own in fits if own.seen[r]]
    slower = [fit for fit in there if float(fit.poles[r].real) + decay < 0.0]  # than the window
    modes = [modal_constants(fit, r, None, fit.residues[r], decay) for fit in slower]
    if len(modes) < 2:
        return None
    frequency, damping = np.array([(mode.frequency, mode.damping) for mode in modes]).T
    errors = np.array([(mode.frequency_sd, mode.damping_sd) for mode in modes]).T
    return Moved(
        common_value(np.log(frequency), errors[0] / frequency),
        common_value(np.log(damping), errors[1] / damping),
    )


def _untold(mode: Mode, r: int, fits: Sequence[Own]) -> Moved | None:
    """Return what is known of a mode that single files cannot separate from others; None if none tried.

    Its pole strayed in files that resolve it as long as it stays: together with the neighbours it makes up
    the response, and files that agree on the sum need not agree on it. It is said to lie within the half
    width of its resonance, and its damping to be known to half.
    """
    strayed = sum(bool(own.strayed[r]) for own in fits)
    if not strayed:
        return None
    values, sds = (math.log(mode.frequency), math.log(mode.damping)), (mode.damping / 1.96, _HALF / 1.96)
    frequency, damping = (Common(x, sd, sd, strayed, 1.0) for x, sd in zip(values, sds, strict=True))
    return Moved(frequency, damping)


def with_files(
    mode: Mode, r: int, fits: Sequence[Own], *, driving: int | None, decay: float, fit: PoleFit
) -> tuple[Mode, Moved | None]:
    """Return a mode of the common fit with what its files show of it; None where no two of them see it.

    Frequency and damping are those of the files where these differ by more than their errors, and else those
    of the common fit. The stiffness is then that of the file of the driving point by its own pole.

    Parameters
    ----------
    driving : column of the driving point.
    fit : of the common poles.
    """
    seen = moved(fits, r, decay) or _untold(mode, r, fits)
    if seen is None or seen.frequency.scatter == seen.damping.scatter == 0.0:
        return mode, seen
    if seen.frequency.scatter > 0.0:
        value = math.exp(seen.frequency.value)
        mode = replace(mode, frequency=value, frequency_sd=max(value * seen.frequency.sd, mode.frequency_sd))
    if seen.damping.scatter > 0.0:
        value = math.exp(seen.damping.value)
        mode = replace(mode, damping=value, damping_sd=max(value * seen.damping.sd, mode.damping_sd))
    relative = mode.damping_sd / mode.damping
    if driving is None or not math.isfinite(mode.stiffness):
        return replace(mode, resolved=mode.resolved and relative < RESOLVED), seen
    stiffness, sd = _stiffness(mode, r, fits, driving=driving, decay=decay, fit=fit, seen=seen)
    omega, omega_sd = 2.0 * math.pi * mode.frequency, mode.frequency_sd / mode.frequency
    mass, viscous = stiffness / omega**2, 2.0 * mode.damping * stiffness / omega
    changed = replace(
        mode,
        stiffness=stiffness,
        stiffness_sd=stiffness * sd,
        mass=mass,
        mass_sd=mass * math.hypot(sd, 2.0 * omega_sd),
        viscous=viscous,
        viscous_sd=viscous * math.hypot(sd, relative, omega_sd),
        resolved=relative < RESOLVED and sd < RESOLVED,
    )
    return changed, seen


def _stiffness(
    mode: Mode, r: int, fits: Sequence[Own], *, driving: int, decay: float, fit: PoleFit, seen: Moved
) -> tuple[float, float]:
    """Stiffness, N/m, and its relative standard deviation."""
    scatter = np.array([seen.frequency.scatter, seen.damping.scatter])
    own = next((each for each in fits if driving in each.columns), None)
    if own is not None and own.seen[r] and float(own.fit.poles[r].real) + decay < 0.0:
        at = int(np.flatnonzero(own.columns == driving)[0])
        by_own = modal_constants(own.fit, r, at, own.fit.residues[r], decay)
        if math.isfinite(by_own.stiffness):
            # its frequency is that of one file: what the others differ by moves the stiffness with its square
            relative = max(by_own.stiffness_sd / by_own.stiffness, mode.stiffness_sd / mode.stiffness)
            return by_own.stiffness, math.hypot(relative, 2.0 * scatter[0])
    # the pole of this file is not known by itself: what the poles of files differ by moves its residue
    slope = _follows(fit, r, driving)
    return mode.stiffness, math.hypot(mode.stiffness_sd / mode.stiffness, *(slope * scatter))


def _follows(fit: PoleFit, r: int, driving: int) -> Array:
    """(2,) change of the logarithm of the stiffness with (log omega, log zeta) that the fit is given."""
    m = len(fit.omega)
    pole, residue = [r, m + r], 2 * m + r
    joint = fit.joint[driving]
    moved_residue = np.linalg.solve(joint[np.ix_(pole, pole)], joint[pole, residue])
    slope: Array = np.array([1.0, 0.0]) - moved_residue / float(fit.residues[r, driving].imag)
    return slope
