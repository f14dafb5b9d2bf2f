"""Modal identification without a human: stable poles, maximum likelihood, number of modes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from metro.dynamics.by_file import Moved, explained, own_fits, with_files
from metro.dynamics.driving import Standing, power_given_out, standing, turning
from metro.dynamics.modes import Mode, modal_constants
from metro.dynamics.polefit import TERMS, PoleFit, Scatter, criterion
from metro.dynamics.refine import Data, losses, refine
from metro.dynamics.shapes import residues
from metro.dynamics.stabilisation import Diagram, stabilisation
from metro.units import Array, ComplexArray

Ways = Sequence[Sequence[np.ndarray]]  # to divide the columns into files

# Model error as a share of an FRF's rms: what a linear model of a machine leaves, and so where adding modes
# ends; greater where the FRF comes without its scatter, since then its systematic errors are not known
# either.
_MODEL_ERROR = 1e-3
_MODEL_ERROR_UNKNOWN_SCATTER = 0.025
_SEARCH_LINES = 500
_ORDERS = range(8, 49, 2)
_MOST_MODES = 24
_LARGEST_DAMPING = 0.35
_CHANCE, _TRACE = 1e-3, 0.25
_HALF = 0.5  # of the power: causal modes explain hardly any of conjugated FRFs
# Two resonances whose middles are further apart than this many times the sum of their half widths are two
# peaks in every response: no pole that moves looks so.
_CLOSE = 4.0
# A fit has converged where a few steps more gain less than a tenth of what one parameter gains by chance.
_FEW_STEPS, _ROUNDS, _SETTLED = 3, 20, 0.1


@dataclass(frozen=True)
class ModalModel:
    """Modes by rising frequency.

    Attributes
    ----------
    modes : those inside the band.
    fit : the fit they come from; its other modes represent the modes outside the band.
    error : (c,) its residual of each FRF, rms over rms.
    diagram : the stabilisation diagram that it started from.
    doubtful : a further mode that lowers chi² beyond chance, but by less than its unknowns are worth; None
        without such a trace.
    moved : how each of ``modes`` differs between the files; None where no two files see it.
    declared : column of each declared driving point → what its residues say of it.
    """

    modes: tuple[Mode, ...]
    fit: PoleFit
    error: Array
    diagram: Diagram
    doubtful: Mode | None
    moved: tuple[Moved | None, ...] = ()
    declared: Mapping[int, Standing] = field(default_factory=dict)


def identify_modes(
    frequency: Array,
    frf: ComplexArray,
    variance: Array | None = None,
    driving: int | None = None,
    *,
    others: Sequence[int] = (),
    inputs: int = 1,
    scatter: Scatter | None = None,
    decay: float = 0.0,
    files: Ways = (),
) -> ModalModel:
    """Identify the modes in the band that ``frequency`` spans.

    Parameters
    ----------
    frequency : (n,) Hz, above 0; independent lines (thin out what a gate made redundant).
    frf : (n, c) receptances that share their modes, m/N, the inputs of one output side by side.
    variance : (n, c) of the complex FRFs; None: estimated from the roughness between lines.
    driving : column of the declared driving point (reference = response), which gives the stiffness unless
        its residues contradict it.
    others : columns of further ones, which are taken in turn where the first is none.
    inputs : how many columns belong to one output.
    scatter : how the repeats differ, on the same lines and columns.
    decay : 1/s, of an exponential window on force and response, which is subtracted from the damping.
    files : ways to divide the columns into files, between which the poles may move: the columns of each. What
        they differ by is in the errors of the modes (:mod:`metro.dynamics.by_file`), of the way that shows
        most of it.

    Raises
    ------
    ValueError
        When there are fewer than 16 lines, or values that are not finite, or the FRFs are conjugated, or the
        window hides a mode, or the fit does not converge.
    """
    if len(frequency) < 16:
        raise ValueError(f"{len(frequency)} lines in the band: expected 16 or more")
    if not (np.all(np.isfinite(frf)) and frequency[0] > 0):
        raise ValueError("FRF: found values that are not finite, or a line at 0 Hz")
    point = None if driving is None else frf[:, driving]
    if point is not None and power_given_out(frequency, point) > 0.0 and turning(point) >= 0.0:
        raise ValueError(
            "driving-point receptance: its imaginary part is positive and its phase rises; expected e^{+iωt}"
            " and m/N"
        )
    noise = roughness(frf) if variance is None else variance
    rms = np.sqrt(np.mean(np.abs(frf) ** 2, axis=0))
    model_error = _MODEL_ERROR_UNKNOWN_SCATTER if variance is None else _MODEL_ERROR
    weight = np.sqrt(2.0 / (noise + (model_error * rms) ** 2))  # of the real and the imaginary part
    data = Data(2 * np.pi * frequency, frf, weight, inputs, scatter)
    start, diagram = _search(data.thinned(_SEARCH_LINES), files)
    fit = _converged(data, refine(data, start.omega, start.zeta, real=start.real))
    change = np.linalg.norm(fit.evaluate(data.omega) - frf, axis=0) / np.linalg.norm(frf, axis=0)
    if np.min(change) ** 2 > _HALF and sum(turning(column) for column in frf.T) > 0.0:
        raise ValueError(
            "the phase of the FRFs rises over the resonances, and no modes explain half of their power: they "
            "are conjugated (e^{-iωt}); export them with e^{+iωt}"
        )
    inside = _among(data.omega, fit.omega, fit.zeta) & (fit.zeta < _LARGEST_DAMPING)
    inside &= _is_there(data, fit)
    free = residues(data.omega, frf, np.sqrt(np.mean(data.weight**2, axis=1)), fit.poles)
    order = [int(r) for r in np.argsort(fit.omega) if inside[r]]
    points = [each for each in (driving, *others) if each is not None]
    powers = {column: power_given_out(frequency, frf[:, column]) for column in points}
    stands = {column: standing(fit, free, column, order, power) for column, power in powers.items()}
    driving = next((column for column in points if stands[column] is Standing.THERE), None)
    ways = [own_fits(data, fit, way) for way in files]
    modes, moved = [], []
    for r in order:
        mode = modal_constants(fit, r, driving, free[r], decay)
        found = [with_files(mode, r, way, driving=driving, decay=decay, fit=fit) for way in ways]
        widest, differs = max([(mode, None), *found], key=lambda each: _width(each[0]))
        modes.append(widest)
        moved.append(differs)
    # what poles that move leave over is no further mode
    alike = all(explained(data, fit, way).bic() >= fit.bic() for way in files)
    doubtful = _doubtful(data, fit, driving, decay) if alike else None
    return ModalModel(tuple(modes), fit, change, diagram, doubtful, tuple(moved), stands)


def _among(lines: Array, omega: Array, zeta: Array) -> np.ndarray:
    """Whether modes (k,) are among the lines (n,), rad/s: not outside of them, nor in a gap of theirs.

    A gap is where the hammer's spectrum has a hole. A mode that no line within half a bandwidth saw is an
    extrapolation from both sides of it.
    """
    nearest = np.abs(lines[:, None] - omega).min(axis=0)
    inside = (omega > lines[0]) & (omega < lines[-1])
    return np.asarray(inside & (nearest <= np.maximum(zeta * omega, np.median(np.diff(lines)))))


def _width(mode: Mode) -> float:
    """Error of a mode's pole, in half widths of its resonance."""
    return float(np.hypot(mode.frequency_sd / mode.frequency, mode.damping_sd) / mode.damping)


def roughness(frf: ComplexArray, lines: int = 15) -> Array:
    """(n, c) variance of the noise from second differences along the lines, pooled over ``lines``."""
    second = np.abs(frf[2:] - 2.0 * frf[1:-1] + frf[:-2]) ** 2 / 6.0
    second = np.concatenate([second[:1], second, second[-1:]])
    window = np.ones(min(lines, len(frf)))
    count = np.convolve(np.ones(len(frf)), window, mode="same")
    return np.stack([np.convolve(column, window, mode="same") / count for column in second.T], axis=1)


def _search(data: Data, files: Ways) -> tuple[PoleFit, Diagram]:
    """Start from the stable poles, then add and remove modes while the information criterion falls.

    Modes are real (normal) where that costs no more than it saves, and one that moves between files is one.
    """
    orders = range(_ORDERS.start, min(_ORDERS.stop, len(data.omega) // 2), _ORDERS.step)
    diagram = stabilisation(data, orders)
    starts = diagram.recurring()[:_MOST_MODES]
    starts = starts or [_strongest(data, np.zeros_like(data.frf))]
    general = _settled(data, _pruned(data, _fit(data, np.array(starts), real=False)))
    normal = _pruned(data, _fit(data, general.poles, real=True))
    return _merged(data, min(normal, general, key=lambda fit: fit.bic()), files), diagram


def _fit(data: Data, poles: ComplexArray, *, real: bool) -> PoleFit:
    omega = np.abs(poles)
    return refine(data, omega, np.clip(-poles.real / omega, 1e-3, _LARGEST_DAMPING), real=real)


def _converged(data: Data, fit: PoleFit) -> PoleFit:
    """Refine a fit until a few steps more gain nothing that counts.

    Raises
    ------
    ValueError
        When they still do after many rounds.
    """
    gain = np.inf
    for _ in range(_ROUNDS):
        further = refine(data, fit.omega, fit.zeta, real=fit.real, iterations=_FEW_STEPS)
        gain, fit = (fit.chi2 - further.chi2) / max(further.chi2_per_datum, 1.0), further
        if gain < _SETTLED:
            return fit
    raise ValueError(
        f"modes: the fit does not converge, its last {_FEW_STEPS} steps still lower chi² by {gain:.2g}: "
        "modes too close for these lines? Record longer, or choose a narrower band"
    )


def _is_there(data: Data, fit: PoleFit) -> bool:
    """Return whether a fit of one mode is better than the residual terms alone, by the criterion.

    A search starts from one mode at least and removes modes down to one: where there is none in the band,
    that one has next to no residue, and rounding decides where it stands. A fit of several was pruned.
    """
    if len(fit.omega) > 1:
        return True
    without = fit.chi2 + float(losses(data, fit)[0])
    return fit.bic() < criterion(without, (fit.count[0], TERMS * data.frf.shape[1]))


def _pruned(data: Data, fit: PoleFit) -> PoleFit:
    """Remove the mode that is missed least while the criterion falls."""
    while len(fit.omega) > 1:
        least = int(np.argmin(losses(data, fit)))
        again = _fit(data, np.delete(fit.poles, least), real=fit.real)
        if again.bic() >= fit.bic():
            break
        fit = again
    return fit


def _settled(data: Data, fit: PoleFit) -> PoleFit:
    """Add and remove modes in turn while the criterion falls: what was added first may be idle by now."""
    while True:
        again = _pruned(data, _added(data, fit))
        if again.bic() >= fit.bic():
            return fit
        fit = again


def _added(data: Data, fit: PoleFit) -> PoleFit:
    """Add a mode at the residual's highest peak while the criterion falls."""
    while len(fit.omega) < _MOST_MODES:
        start = _strongest(data, fit.evaluate(data.omega))
        longer = _fit(data, np.append(fit.poles, start), real=fit.real)
        if longer.bic() >= fit.bic():
            break
        fit = longer
    return fit


def _merged(data: Data, fit: PoleFit, files: Ways) -> PoleFit:
    """Remove one of two close modes where poles that move from file to file explain what both do.

    To poles common to all files, a mode that moves looks like two or three that nearly coincide. With poles
    of each file's own, the files must need both modes by themselves.
    """
    for way in files:
        kept = fit
        while (shorter := _shorter(data, kept, fit, way)) is not None:
            kept = shorter
        fit = kept if kept.real else min(kept, _normal(data, kept), key=lambda one: _left(data, one, way))
    return fit


def _normal(data: Data, fit: PoleFit) -> PoleFit:
    """Return the fit with real modes: a pole that moves makes the residue at a common one complex."""
    return _fit(data, fit.poles, real=True)


def _left(data: Data, fit: PoleFit, way: Sequence[np.ndarray]) -> float:
    return min(fit.bic(), explained(data, fit, way).bic())


def _shorter(data: Data, fit: PoleFit, common: PoleFit, way: Sequence[np.ndarray]) -> PoleFit | None:
    """Return ``fit`` without one of two close modes, if the files do as well as ``common``, the first fit."""
    width = fit.omega * fit.zeta
    apart = np.abs(fit.omega[:, None] - fit.omega) / (width[:, None] + width)
    first, second = np.triu_indices(len(fit.omega), 1)
    close = [i for i in np.argsort(apart[first, second]) if apart[first[i], second[i]] < _CLOSE]
    if not close:
        return None
    missed, both = losses(data, fit), explained(data, fit, way).bic()
    for pair in close:
        weaker = min(first[pair], second[pair], key=lambda r: float(missed[r]))
        again = _fit(data, np.delete(fit.poles, weaker), real=fit.real)
        one = explained(data, again, way)
        if one.bic() < both and one.as_well_as(common):
            return again
    return None


def _doubtful(data: Data, fit: PoleFit, driving: int | None, decay: float) -> Mode | None:
    """Return the mode at the residual's highest peak where it is no chance, though it was not kept.

    Chi² must show it, and the damping's own error, which includes the errors that the hits share.
    """
    from scipy import stats

    start = _strongest(data, fit.evaluate(data.omega))
    longer = _fit(data, np.append(fit.poles, start), real=fit.real)
    gain = (fit.chi2 - longer.chi2) / max(longer.chi2_per_datum, 1.0)
    last = len(longer.omega) - 1
    inside = data.omega[0] < longer.omega[last] < data.omega[-1] and longer.zeta[last] < _LARGEST_DAMPING
    if not inside or stats.chi2.sf(gain, longer.count[1] - fit.count[1]) > _CHANCE:
        return None
    mode = modal_constants(longer, last, driving, longer.residues[last], decay)
    return mode if mode.damping_sd < _TRACE * mode.damping else None


def _strongest(data: Data, fitted: ComplexArray) -> complex:
    """Pole at the line at which the weighted residual, smoothed over 2 % of the band, is largest."""
    size = np.sum(np.abs((data.frf - fitted) * data.weight) ** 2, axis=1)
    window = np.ones(max(len(size) // 50, 3))
    omega = float(data.omega[np.convolve(size, window, mode="same").argmax()])
    return omega * complex(-0.03, 1.0)
