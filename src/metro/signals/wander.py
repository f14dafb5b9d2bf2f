"""The angle of a spindle whose speed wanders, followed in the record where no tacho measures it.

A force repeats with the spindle. The turn of each few revolutions against the mean of all is the error of
the angle there; vibrations between the orders of the spindle have no part in it.
"""

from __future__ import annotations

import math

import numpy as np

from metro.signals.asynchronous import over_angle
from metro.signals.orders import SPEED_SEARCH
from metro.units import Array, ComplexArray

WINDOW = 8  # revolutions that are looked at together, by a Hann taper, at every revolution
MOST = 0.03  # relative error of the speed within which it is followed
PASSINGS = 3  # orders that are looked at: up to this many tooth passings
EXPLAINED = 0.5  # of what is near the orders and does not repeat: followed, it must, or nothing is followed
_ROUNDS = 4
_TOGETHER = 5  # steps from revolution to revolution that are taken to be alike
_FINE = 400  # trials of an angle


def followed(time: Array, angle: Array, signal: Array, teeth: int) -> Array:
    """Angle (n,), rad, of the spindle, once the wander of its speed is followed in the signal.

    Parameters
    ----------
    time, angle : (n,) s; rad, with the mean speed of the record. signal : (n, channels).
    teeth : number of teeth, whose passing is the strongest order.

    Returns
    -------
    ``angle`` itself where following it does not gather much more energy at the orders of the spindle.
    """
    highest = PASSINGS * teeth
    best, gathered = angle, -math.inf
    spectra = _spectra(over_angle(time, angle, signal), highest)
    if spectra is None:
        return angle
    first = gathered = _gathered(spectra)
    trial = best
    for turn in range(_ROUNDS):
        error = _steps(spectra) if turn == 0 else _against_mean(spectra)
        trial = _corrected(trial, error)
        again = _spectra(over_angle(time, trial, signal), highest)
        if again is None or (energy := _gathered(again)) <= gathered:
            if turn > 0:
                break
            trial = best
            continue
        best, gathered, spectra = trial, energy, again
    # The mean speed is nearly known: chatter beside an order is no wander, though it gathers more. Wander may
    # have driven the estimate to one end of the search, while the truth is at the other.
    shift = (best[-1] - best[0]) / (angle[-1] - angle[0]) - 1.0
    wanders = 1.0 - gathered < (1.0 - EXPLAINED) * (1.0 - first) and abs(shift) < 2.0 * SPEED_SEARCH
    return best if wanders else angle


def _spectra(even: Array, highest: int) -> ComplexArray | None:
    """Amplitudes (w, orders, channels) at the orders 1…highest of windows that begin at every revolution."""
    turns, per_turn = even.shape[:2]
    if turns < 2 * WINDOW:
        return None
    highest = min(highest, per_turn // 2 - 1)
    phase = np.exp(-2j * math.pi * np.outer(np.arange(1, highest + 1), np.arange(per_turn)) / per_turn)
    # revolution by revolution, then tapered over some: a line half an order away is well down
    each = np.einsum("kp,tpc->tkc", phase, even - even.mean(axis=(0, 1)))
    taper = np.hanning(WINDOW + 2)[1:-1]
    windows = np.lib.stride_tricks.sliding_window_view(each, WINDOW, axis=0)
    return np.asarray(windows @ taper)


def _gathered(spectra: ComplexArray) -> float:
    """Share of the energy at the orders that is in their mean over the windows."""
    return float((np.abs(spectra.mean(axis=0)) ** 2).sum() / (np.abs(spectra) ** 2).mean(axis=0).sum())


def _best(cross: ComplexArray, largest: float) -> Array:
    """Angle (w,), rad, within ±``largest`` that turns products (w, orders) most nearly real and positive."""
    trial = np.linspace(-largest, largest, 2 * _FINE + 1)
    turned = np.exp(-1j * np.outer(np.arange(1, cross.shape[1] + 1), trial))
    return np.asarray(trial[np.argmax((cross @ turned).real, axis=1)])


def _steps(spectra: ComplexArray) -> Array:
    """Error of the angle (w,), rad, from how much it turns from revolution to revolution."""
    cross = (spectra[1:] * spectra[:-1].conj()).sum(axis=2)
    near = np.ones(_TOGETHER) / _TOGETHER
    padded = np.pad(cross, ((_TOGETHER // 2,) * 2, (0, 0)), mode="edge")
    smooth = np.lib.stride_tricks.sliding_window_view(padded, _TOGETHER, axis=0) @ near
    return np.concatenate([[0.0], np.cumsum(_best(smooth.astype(complex), 2.0 * math.pi * MOST))])


def _against_mean(spectra: ComplexArray) -> Array:
    """Error of the angle (w,), rad, against the mean of all windows."""
    cross = (spectra * spectra.mean(axis=0).conj()).sum(axis=2)
    return _best(cross, math.pi / 2.0)


def _corrected(angle: Array, error: Array) -> Array:
    """Angle (n,) once its error at the middle of each window is added, as a smooth curve."""
    from scipy.interpolate import make_smoothing_spline

    middle = angle[0] + 2.0 * math.pi * (np.arange(len(error)) + 0.5 * WINDOW)
    curve = make_smoothing_spline(middle, error, lam=1.0)
    inside = np.clip(angle, middle[0], middle[-1])
    beyond = (angle - inside) * np.where(
        angle < inside, curve.derivative()(middle[0]), curve.derivative()(middle[-1])
    )
    return np.asarray(angle + curve(inside) + beyond)
