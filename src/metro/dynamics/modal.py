"""Modal identification without a human: stable poles, maximum likelihood, number of modes."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from metro.dynamics.plscf import stable_poles
from metro.dynamics.refine import Data, PoleFit, chi2_without, refine
from metro.units import Array, ComplexArray

# Model error as a share of an FRF's rms: what a linear model of a machine leaves, and so where adding modes
# ends; greater where the FRF comes without its scatter, since then its systematic errors are not known
# either.
_MODEL_ERROR = 1e-3
_MODEL_ERROR_UNKNOWN_SCATTER = 0.02
_SEARCH_LINES = 500
_ORDERS = range(8, 49, 2)
_MOST_MODES = 24


@dataclass(frozen=True)
class Mode:
    """A mode of vibration with its standard deviations.

    Attributes
    ----------
    frequency, frequency_sd : undamped natural frequency, Hz. (Printed "natural frequencies" are often the
        damped one.)
    damping, damping_sd : damping ratio.
    stiffness, stiffness_sd : at the driving point, N/m; NaN where there is no driving point, or where the
        residue there has the wrong sign for a mode of a passive structure.
    mass : stiffness / omega², kg.
    shape : (c,) complex residues over the responses, scaled to 1 at the driving point (else at the largest).
    """

    frequency: float
    frequency_sd: float
    damping: float
    damping_sd: float
    stiffness: float
    stiffness_sd: float
    mass: float
    shape: ComplexArray


@dataclass(frozen=True)
class ModalModel:
    """Modes by rising frequency, the fit they come from, and its error per FRF (rms over rms)."""

    modes: tuple[Mode, ...]
    fit: PoleFit
    error: Array


def identify_modes(
    frequency: Array, frf: ComplexArray, variance: Array | None = None, driving: int | None = None
) -> ModalModel:
    """Identify the modes in the band that ``frequency`` spans.

    Parameters
    ----------
    frequency : (n,) Hz, above 0; independent lines (thin out what a gate made redundant).
    frf : (n, c) receptances that share their modes, m/N.
    variance : (n, c) of the complex FRFs; None: estimated from the roughness between lines.
    driving : column of the driving point (reference = response), which gives the stiffness.

    Raises
    ------
    ValueError
        When there are fewer than 16 lines, or values that are not finite, or none of the FRFs has a driving
        point's sign although one is declared (conjugated or negated data).
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
    unit = rms.max()  # residues and residual terms of order one
    model_error = _MODEL_ERROR_UNKNOWN_SCATTER if variance is None else _MODEL_ERROR
    weight = unit / np.sqrt(noise + (model_error * rms) ** 2)
    data = Data(2 * np.pi * frequency, frf / unit, weight)
    found = _search(data.thinned(_SEARCH_LINES))
    fit = _rescaled(refine(data, found.omega, found.zeta, real=found.real), unit)
    change = np.linalg.norm(fit.evaluate(data.omega) - frf, axis=0) / np.linalg.norm(frf, axis=0)
    inside = (fit.omega > data.omega[0]) & (fit.omega < data.omega[-1]) & (fit.zeta < 0.35)
    order = [
        int(r) for r in np.argsort(fit.omega) if inside[r]
    ]  # the others stand for what is outside the band
    return ModalModel(tuple(_mode(fit, r, driving) for r in order), fit, change)


def roughness(frf: ComplexArray, lines: int = 15) -> Array:
    """(n, c) variance of the noise from second differences along the lines, pooled over ``lines``."""
    second = np.abs(frf[2:] - 2.0 * frf[1:-1] + frf[:-2]) ** 2 / 6.0
    second = np.concatenate([second[:1], second, second[-1:]])
    window = np.ones(min(lines, len(frf)))
    count = np.convolve(np.ones(len(frf)), window, mode="same")
    return np.stack([np.convolve(column, window, mode="same") / count for column in second.T], axis=1)


def _search(data: Data) -> PoleFit:
    """Start from the stable poles, then add and remove modes while the information criterion falls.

    Modes are real (normal) where that costs no more than it saves.
    """
    frequency = data.omega / (2 * np.pi)
    orders = range(_ORDERS.start, min(_ORDERS.stop, len(frequency) // 2), _ORDERS.step)
    clusters = stable_poles(frequency, data.frf[:, :, None], data.weight, orders)
    starts = [pole for pole, count in clusters if count >= len(orders) / 4][:_MOST_MODES]
    starts = starts or [_strongest(data, np.zeros_like(data.frf))]
    general = _added(data, _pruned(data, _fit(data, np.array(starts), real=False)))
    normal = _pruned(data, _fit(data, general.poles, real=True))
    return min(normal, general, key=lambda fit: fit.bic())


def _fit(data: Data, poles: ComplexArray, *, real: bool) -> PoleFit:
    omega = np.abs(poles)
    return refine(data, omega, np.clip(-poles.real / omega, 1e-3, 0.35), real=real)


def _pruned(data: Data, fit: PoleFit) -> PoleFit:
    """Remove the mode that is missed least while the criterion falls."""
    while len(fit.omega) > 1:
        least = int(np.argmin([chi2_without(data, fit, r) for r in range(len(fit.omega))]))
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


def _strongest(data: Data, fitted: ComplexArray) -> complex:
    """Pole at the line at which the weighted residual, smoothed over 2 % of the band, is largest."""
    size = np.sum(np.abs((data.frf - fitted) * data.weight) ** 2, axis=1)
    window = np.ones(max(len(size) // 50, 3))
    omega = float(data.omega[np.convolve(size, window, mode="same").argmax()])
    return omega * complex(-0.03, 1.0)


def _rescaled(fit: PoleFit, unit: float) -> PoleFit:
    return replace(
        fit,
        residues=fit.residues * unit,
        residue_sd=fit.residue_sd * unit,
        residual_terms=fit.residual_terms * unit,
    )


def _mode(fit: PoleFit, r: int, driving: int | None) -> Mode:
    m = len(fit.omega)
    omega, zeta = float(fit.omega[r]), float(fit.zeta[r])
    sd = np.sqrt(np.diag(fit.covariance))
    residues = fit.residues[r]
    stiffness = stiffness_sd = float("nan")
    if driving is not None and residues[driving].imag < 0.0:
        # 1/m = 2 i omega_d A for a real mode, A = -i/(2 m omega_d)
        stiffness = omega**2 / (-2.0 * omega * np.sqrt(1.0 - zeta**2) * float(residues[driving].imag))
        stiffness_sd = stiffness * float(fit.residue_sd[r, driving] / -residues[driving].imag)
    place = int(np.abs(residues).argmax()) if driving is None else driving
    return Mode(
        frequency=omega / (2 * np.pi),
        frequency_sd=omega / (2 * np.pi) * float(sd[r]),
        damping=zeta,
        damping_sd=zeta * float(sd[m + r]),
        stiffness=stiffness,
        stiffness_sd=stiffness_sd,
        mass=stiffness / omega**2,
        shape=residues / residues[place],
    )
