"""Modal identification without a human: stable poles, maximum likelihood, number of modes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.dynamics.modes import Mode, modal_constants
from metro.dynamics.polefit import PoleFit, Scatter, criterion
from metro.dynamics.refine import Data, losses, refine
from metro.dynamics.shapes import residues
from metro.dynamics.stabilisation import Diagram, stabilisation
from metro.units import Array, ComplexArray

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
    """

    modes: tuple[Mode, ...]
    fit: PoleFit
    error: Array
    diagram: Diagram
    doubtful: Mode | None


def identify_modes(
    frequency: Array,
    frf: ComplexArray,
    variance: Array | None = None,
    driving: int | None = None,
    *,
    inputs: int = 1,
    scatter: Scatter | None = None,
    decay: float = 0.0,
) -> ModalModel:
    """Identify the modes in the band that ``frequency`` spans.

    Parameters
    ----------
    frequency : (n,) Hz, above 0; independent lines (thin out what a gate made redundant).
    frf : (n, c) receptances that share their modes, m/N, the inputs of one output side by side.
    variance : (n, c) of the complex FRFs; None: estimated from the roughness between lines.
    driving : column of the driving point (reference = response), which gives the stiffness.
    inputs : how many columns belong to one output.
    scatter : how the repeats differ, on the same lines and columns.
    decay : 1/s, of an exponential window on force and response, which is subtracted from the damping.

    Raises
    ------
    ValueError
        When there are fewer than 16 lines, or values that are not finite, or none of the FRFs has a driving
        point's sign although one is declared (conjugated or negated data), or the window hides a mode, or the
        fit does not converge.
    """
    if len(frequency) < 16:
        raise ValueError(f"{len(frequency)} lines in the band: expected 16 or more")
    if not (np.all(np.isfinite(frf)) and frequency[0] > 0):
        raise ValueError("FRF: found values that are not finite, or a line at 0 Hz")
    if driving is not None and np.sum(frf[:, driving].imag * frequency) > 0:
        raise ValueError(
            "driving-point receptance: its imaginary part is positive; expected e^{+iωt} and m/N"
        )
    noise = roughness(frf) if variance is None else variance
    rms = np.sqrt(np.mean(np.abs(frf) ** 2, axis=0))
    model_error = _MODEL_ERROR_UNKNOWN_SCATTER if variance is None else _MODEL_ERROR
    weight = np.sqrt(2.0 / (noise + (model_error * rms) ** 2))  # of the real and the imaginary part
    data = Data(2 * np.pi * frequency, frf, weight, inputs, scatter)
    start, diagram = _search(data.thinned(_SEARCH_LINES))
    fit = _converged(data, refine(data, start.omega, start.zeta, real=start.real))
    change = np.linalg.norm(fit.evaluate(data.omega) - frf, axis=0) / np.linalg.norm(frf, axis=0)
    inside = (fit.omega > data.omega[0]) & (fit.omega < data.omega[-1]) & (fit.zeta < _LARGEST_DAMPING)
    inside &= _is_there(data, fit)
    free = residues(data.omega, frf, np.sqrt(np.mean(data.weight**2, axis=1)), fit.poles)
    order = [int(r) for r in np.argsort(fit.omega) if inside[r]]
    modes = tuple(modal_constants(fit, r, driving, free[r], decay) for r in order)
    return ModalModel(modes, fit, change, diagram, _doubtful(data, fit, driving, decay))


def roughness(frf: ComplexArray, lines: int = 15) -> Array:
    """(n, c) variance of the noise from second differences along the lines, pooled over ``lines``."""
    second = np.abs(frf[2:] - 2.0 * frf[1:-1] + frf[:-2]) ** 2 / 6.0
    second = np.concatenate([second[:1], second, second[-1:]])
    window = np.ones(min(lines, len(frf)))
    count = np.convolve(np.ones(len(frf)), window, mode="same")
    return np.stack([np.convolve(column, window, mode="same") / count for column in second.T], axis=1)


def _search(data: Data) -> tuple[PoleFit, Diagram]:
    """Start from the stable poles, then add and remove modes while the information criterion falls.

    Modes are real (normal) where that costs no more than it saves.
    """
    orders = range(_ORDERS.start, min(_ORDERS.stop, len(data.omega) // 2), _ORDERS.step)
    diagram = stabilisation(data, orders)
    starts = diagram.recurring()[:_MOST_MODES]
    starts = starts or [_strongest(data, np.zeros_like(data.frf))]
    general = _added(data, _pruned(data, _fit(data, np.array(starts), real=False)))
    normal = _pruned(data, _fit(data, general.poles, real=True))
    return min(normal, general, key=lambda fit: fit.bic()), diagram


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
    return fit.bic() < criterion(without, (fit.count[0], 2 * data.frf.shape[1]))


def _pruned(data: Data, fit: PoleFit) -> PoleFit:
    """Remove the mode that is missed least while the criterion falls."""
    while len(fit.omega) > 1:
        least = int(np.argmin(losses(data, fit)))
        again = _fit(data, np.delete(fit.poles, least), real=fit.real)
        if again.bic() >= fit.bic():
            break
        fit = again
    return fit


def _added(data: Data, fit: PoleFit) -> PoleFit:
    """Add a mode at the residual's highest peak while the criterion falls."""
    while len(fit.omega) < _MOST_MODES:
        start = _strongest(data, fit.evaluate(data.omega))
        longer = _fit(data, np.append(fit.poles, start), real=fit.real)
        if longer.bic() >= fit.bic():
            break
        fit = longer
    return fit


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
