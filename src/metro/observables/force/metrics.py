"""How well a force was predicted: NRMSE, peak, mean, phase and the peak of each tooth, with intervals.

The source is the rows of comparison.parquet, which hold a revolution-synchronous force per time block of a
run. A block is a repeat of the same revolution, and the scatter over the blocks gives the interval of a
figure. If a run has one block, the rows' sigma bounds the interval.
"""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from metro.units import Array

MODELS = ("before", "after")
NORMAL = 1.96
OVERSAMPLING = 8
# amplitudes below this share of an axis's largest are the rounding of a record that holds no such order
LEAST_AMPLITUDE = 1e-9

METRICS = (
    *("run", "axis", "model", "metric", "tooth", "unit"),
    *("measured", "predicted", "value", "lo", "hi", "percent"),
)


def metrics(rows: pd.DataFrame, teeth: int) -> pd.DataFrame:
    """Return the figures of every run and axis, before and after.

    Parameters
    ----------
    rows : force rows of ``comparison.parquet``: ``run, axis, t_s, angle_deg, measured, before, after, sigma,
        unit``, evenly spaced over the revolution. teeth : number of teeth of the cutter.

    Returns
    -------
    One row per run, axis, model (before, after), metric and, for the peaks, tooth: ``measured`` and
    ``predicted`` in the unit of the rows; ``value`` with its 95 % interval ``lo … hi`` and ``unit``;
    ``percent`` = value over the magnitude of ``measured``. The metrics, errors being predicted less measured:

    - ``nrmse``: rms of the difference over rms of the measured, %.
    - ``peak``: error of the largest magnitude over the revolution. ``mean``: error of the mean.
    - ``phase``: delay of the measured force, degrees of spindle angle, modulo the pitch.
    - ``tooth_peak``: error of the largest magnitude within each pitch, teeth numbered as they pass.

    Raises
    ------
    ValueError
        If the time blocks of a run and axis do not have the same angles.
    """
    results: list[dict[str, object]] = []
    for (run, axis), part in rows.groupby(["run", "axis"], sort=False):
        blocks = {name: _blocks(part, name) for name in ("measured", *MODELS)}
        if any(np.isnan(values).any() for values in blocks.values()):
            raise ValueError(f"run {run}, axis {axis}: the time blocks do not have the same angles")
        sigma = float(np.sqrt(np.mean(part["sigma"].to_numpy(float) ** 2)))
        for model in MODELS:
            key = {"run": run, "axis": axis, "model": model}
            force = str(part["unit"].iloc[0])
            results += [key | row for row in _figures(blocks["measured"], blocks[model], teeth, sigma, force)]
    return pd.DataFrame(results, columns=list(METRICS))


def order_spectrum(rows: pd.DataFrame) -> pd.DataFrame:
    """Return amplitudes of measured force and of both residuals, by axis and order of the spindle.

    Parameters
    ----------
    rows : see :func:`metrics`.

    Returns
    -------
    ``axis, order, measured, before, after``: rms over runs and time blocks of the amplitude of each order
    (of the mean at order 0), in the unit of the rows; up to the highest order that the records hold.
    """
    parts = []
    for axis, part in rows.groupby("axis", sort=True):
        power: dict[str, list[Array]] = {name: [] for name in ("measured", *MODELS)}
        for _, run in part.groupby("run", sort=False):
            measured = _blocks(run, "measured")
            power["measured"].append(_amplitudes(measured) ** 2)
            for model in MODELS:
                power[model].append(_amplitudes(measured - _blocks(run, model)) ** 2)
        table = pd.DataFrame({name: np.sqrt(np.concatenate(p).mean(axis=0)) for name, p in power.items()})
        held = np.flatnonzero(table["measured"] > LEAST_AMPLITUDE * table["measured"].max())
        table = table.iloc[: int(held.max(initial=0)) + 1]
        parts.append(table.assign(axis=axis, order=np.arange(len(table))))
    return pd.concat(parts, ignore_index=True)[["axis", "order", "measured", *MODELS]]


def _blocks(part: pd.DataFrame, column: str) -> Array:
    """Values of one run and axis as (time blocks, angles)."""
    values: Array = part.pivot(index="t_s", columns="angle_deg", values=column).to_numpy(float)
    return values


def _amplitudes(waveforms: Array) -> Array:
    """Amplitude of each order below half the number of angles, (blocks, orders)."""
    count = waveforms.shape[1]
    amplitude = 2.0 * np.abs(np.fft.rfft(waveforms, axis=1))[:, : (count + 1) // 2] / count
    amplitude[:, 0] /= 2.0
    return np.asarray(amplitude)


def _figures(
    measured: Array, predicted: Array, teeth: int, sigma: float, force: str
) -> list[dict[str, object]]:
    """All figures of one run, axis and model; waveforms as (time blocks, angles)."""
    size = _rms(measured)
    # rms rate of the force per degree; for a constant force the phase is not identifiable
    rate = _rms((np.roll(predicted, -1, axis=1) - np.roll(predicted, 1, axis=1)) * predicted.shape[1] / 720.0)
    nrmse = [
        100.0 * _rms(m - p) / _rms(m) if _rms(m) > 0 else math.nan
        for m, p in zip(measured, predicted, strict=True)
    ]
    overall = 100.0 * _rms(measured - predicted) / size if size > 0 else math.nan
    low, high = _interval(np.array(nrmse), overall, 100.0 * sigma / size if size > 0 else math.nan)
    figures: list[dict[str, object]] = [
        {"metric": "nrmse", "unit": "%", "value": overall, "lo": max(low, 0.0), "hi": high}
    ]
    shifts = np.array([phase_shift(m, p, teeth) for m, p in zip(measured, predicted, strict=True)])
    low, high = _interval(shifts, float(shifts.mean()), sigma / rate if rate > 0 else math.nan)
    figures.append({"metric": "phase", "unit": "deg", "value": float(shifts.mean()), "lo": low, "hi": high})
    figures.append(_error("peak", np.abs(measured).max(axis=1), np.abs(predicted).max(axis=1), sigma))
    figures.append(_error("mean", measured.mean(axis=1), predicted.mean(axis=1), sigma))
    sectors = tooth_sectors(measured, teeth)
    for tooth in range(teeth):
        real, modelled = (np.abs(w[:, sectors == tooth]).max(axis=1) for w in (measured, predicted))
        figures.append({**_error("tooth_peak", real, modelled, sigma), "tooth": tooth + 1})
    return [{"tooth": 0, "unit": force, **figure} for figure in figures]


def _error(metric: str, measured: Array, predicted: Array, sigma: float) -> dict[str, object]:
    """Error of one number per time block: its mean over the blocks, its interval, and its share."""
    value, size = float((predicted - measured).mean()), float(measured.mean())
    low, high = _interval(predicted - measured, value, sigma)
    return {
        "metric": metric,
        "measured": size,
        "predicted": float(predicted.mean()),
        "value": value,
        "lo": low,
        "hi": high,
        "percent": 100.0 * value / abs(size) if size != 0.0 else math.nan,
    }


def _interval(by_block: Array, value: float, deviation: float) -> tuple[float, float]:
    """95 % interval of a figure: Student's t over the time blocks, or ``deviation`` for a single block.

    ``deviation`` is the largest effect of an error of the rows' sigma that all angles share.
    """
    from scipy.stats import t

    count = len(by_block)
    if count > 1:
        half = float(t.ppf(0.975, count - 1) * by_block.std(ddof=1) / math.sqrt(count))
    else:
        half = NORMAL * deviation
    return value - half, value + half


def phase_shift(measured: Array, predicted: Array, teeth: int) -> float:
    """Shift that best aligns a predicted with a measured waveform: the peak of their circular correlation.

    Parameters
    ----------
    measured, predicted : (angles,) over one revolution. teeth : equal teeth repeat every pitch, so that a
        shift is sought within half a pitch either way.

    Returns
    -------
    Degrees by which the measured waveform comes later; NaN where one of them is constant. The correlation is
    interpolated band-limited; a parabola through its highest point and the two beside it refines the peak.
    """
    count = len(measured)
    cross = np.fft.rfft(measured) * np.conj(np.fft.rfft(predicted))
    cross[0] = 0.0
    if np.abs(cross).max() <= 1e-20 * count**2 * _rms(measured) * _rms(predicted):
        return math.nan
    fine = OVERSAMPLING * count
    correlation = np.fft.irfft(cross, fine)
    reach = fine // (2 * teeth)
    shifts = np.arange(-reach, reach + 1)
    best = int(shifts[np.argmax(correlation[shifts])])
    left, middle, right = correlation[[best - 1, best, (best + 1) % fine]]
    curvature = left - 2.0 * middle + right
    step = 0.5 * (left - right) / curvature if curvature < 0.0 else 0.0
    return (best + float(np.clip(step, -0.5, 0.5))) * 360.0 / fine


def tooth_sectors(measured: Array, teeth: int) -> Array:
    """Return the pitch, 0 … teeth − 1 in the order of passing, that each angle belongs to.

    Parameters
    ----------
    measured : (time blocks, angles) over one revolution. The border between pitches is at the angle at which
        the magnitude over all teeth is smallest, so that no tooth's peak falls on a border.
    """
    count = measured.shape[1]
    phase = np.arange(count) * teeth / count
    bins = max(1, count // teeth)
    place = np.minimum(((phase % 1.0) * bins + 1e-9).astype(int), bins - 1)
    magnitude = np.bincount(place, np.abs(measured).mean(axis=0), bins) / np.bincount(place, minlength=bins)
    start = int(np.argmin(magnitude)) / bins
    return np.asarray(np.floor(phase - start + 1e-9).astype(int) % teeth)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
