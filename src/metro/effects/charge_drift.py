"""Charge drift: the zero of a piezoelectric sensor drifts during the measurement."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from metro.effects.effect import Effect, EffectParameter, Values
from metro.observables.force.model import ForceModel
from metro.observables.problem import Problem
from metro.units import Array

CHANNELS = 3
CERTAIN = 0.999  # that a drift is within the bounds that the records themselves set
LEAST_WIDTH = 0.1  # N/s of these bounds


def apply(model: ForceModel, values: Values) -> ForceModel:
    """Let the zero of each channel drift by ``slope_n_s``, counted from where it was read."""
    slope = tuple(was + more for was, more in zip(model.sensor.slope, values["slope_n_s"], strict=True))
    return replace(model, sensor=replace(model.sensor, slope=slope))


def adapt(effect: Effect, problem: Problem) -> Effect:
    """Let no channel drift faster than the means of revolutions do along the records.

    Nothing that has another slope within the records can be a drift of so many newtons per second. Where they
    do show a slope, a drift that is as large as they allow is a result like any other: what more the means
    deviate by has another cause.
    """
    settings: list[tuple[str, Any]] = [(block.condition, block.setting) for block in problem.role("identify")]
    seen = [(name, setting.recording) for name, setting in settings if setting.recording.slope is not None]
    if not seen:
        return effect
    base: Any = problem.base
    to_channels, declared = np.array(base.sensor.axes), np.array(base.sensor.slope)
    slopes = np.array([each.slope for _, each in seen]) @ to_channels.T - declared
    deviations = np.sqrt(np.array([each.slope_sd for _, each in seen]) ** 2 @ (to_channels**2).T)
    alike = np.unique([name for name, _ in seen], return_inverse=True)[1]
    parameters = []
    for parameter, rate, sd in zip(effect.parameters, slopes.T, deviations.T, strict=True):
        low, high = within(rate, sd, alike)
        falls, rises = high < 0.0, low > 0.0
        low, high = min(low, -LEAST_WIDTH), max(high, LEAST_WIDTH)
        low, high = (float(np.clip(end, parameter.lower, parameter.upper)) for end in (low, high))
        starts = (0.75 * low + 0.25 * high, 0.25 * low + 0.75 * high)
        scale = min(parameter.scale, 0.25 * (high - low))
        bounds = replace(parameter, lower=low, upper=high, nothing_below=falls, nothing_above=rises)
        parameters.append(replace(bounds, scale=scale, starts=starts))
    return replace(effect, parameters=tuple(parameters))


def within(rate: Array, sd: Array, alike: np.ndarray) -> tuple[float, float]:
    """Bounds, N/s, of the drift that records with slopes ``rate`` ± ``sd`` (n,) share.

    Around the weighted mean; its deviation is that of the readings, or by the scatter where this is larger:
    other causes change the force along a record as well. They are the same in the repeats of a condition, so
    the conditions scatter, not their records. ``alike`` (n,): number of each record's condition, 0, 1, ….
    """
    from scipy.stats import norm, t

    weight = 1.0 / np.maximum(sd, LEAST_WIDTH) ** 2
    if alike.max() > 0:
        rate = np.bincount(alike, weight * rate) / np.bincount(alike, weight)
        weight = np.bincount(alike, weight).astype(float)
    mean = float(weight @ rate / weight.sum())
    half = float(norm.ppf(0.5 + 0.5 * CERTAIN)) / math.sqrt(weight.sum())
    if len(rate) > 1:
        scatter = math.sqrt(float(weight @ (rate - mean) ** 2) / (len(rate) - 1) / float(weight.sum()))
        half = max(half, scatter * float(t.ppf(0.5 + 0.5 * CERTAIN, len(rate) - 1)))
    return mean - half, mean + half


EFFECT = Effect(
    name="charge_drift",
    observables=("force",),
    parameters=tuple(
        EffectParameter("slope_n_s", "N/s", -200.0, 200.0, 1.0, starts=(-3.0, 3.0), group=number)
        for number in range(CHANNELS)
    ),
    apply=apply,
    adapt=adapt,
    belongs_to=("instrument",),
    per="axis",
    signature=(
        "The mean force changes at the same rate in every record, in the air as in the cut. "
        "Wear within a run has a similar signature but appears only in the cut."
    ),
    literature="Kistler, Piezoelectric Measurement: drift of charge amplifiers",
    experiment="an air cut before and after the same run, as long as the run itself",
    remedy="let the charge amplifier warm up, dry its connectors, and zero it before every run",
    form="slope",
)
