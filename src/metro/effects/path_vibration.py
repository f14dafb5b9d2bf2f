"""Path vibration: the tip vibrates at a frequency of its own along the path."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np

from metro.effects.effect import Effect, EffectParameter, Values
from metro.effects.periodogram import TimeShares, middle_start, own_peaks
from metro.observables.flatness.model import FlatnessModel
from metro.observables.problem import Block, Problem, Refusal
from metro.observables.waviness.model import Vibration, WavinessModel
from metro.units import MM, UM, Array

LEAST_CYCLES, LEAST_POINTS = (
    2.0,
    4.0,
)  # that the shortest run must show; that a cycle of the fastest must hold
LEAST_WAVES = 1.0  # that the longest pass must show
SHORTEST = 5 * MM  # wave of which the discs of path points keep more than half
OF_THE_STRONGEST = 0.4  # least power of a line that is followed, too
STEPS = 3.0  # per width of a line: the longest run's reciprocal
MOST = 4  # lines that are followed
APART = 1.2  # ratio of speeds: ten waves on a path are two more or fewer then, and a run resolves one

Model = TypeVar("Model", WavinessModel, FlatnessModel)


def apply(model: Model, values: Values) -> Model:
    """Let the tip swing along a wall's normal, or along z, too; each run has a phase of its own."""
    swing = Vibration(values["frequency_hz"], values["amplitude_um"] * UM)
    return replace(model, vibration=(*model.vibration, swing))


def adapt(effect: Effect, problem: Problem) -> Effect | Refusal:
    """Start from the strongest lines in time of the base model's residual, each run with its own phase."""
    walls = [block.setting for block in problem.role("identify")]
    if not walls:
        return Refusal("no run is there to find its frequency in")
    frequencies = _resolved([wall.t for wall in walls])
    if not len(frequencies):
        return Refusal("the cuts are too short to hold two cycles of anything")
    frequency, amplitude = effect.parameters
    step = float(frequencies[1] - frequencies[0]) if len(frequencies) > 1 else frequency.scale
    grid = frequencies if len(frequencies) > 1 else frequencies[0] + step * np.arange(2)
    lines, size = own_peaks(problem, list(map(_along_wall, walls)), grid, MOST, least=OF_THE_STRONGEST)
    start = max(float(np.median(size)) / UM, amplitude.scale)
    return replace(
        effect,
        parameters=(
            replace(
                frequency,
                lower=float(frequencies[0]) / 2,
                upper=2 * float(frequencies[-1]),
                scale=step,
                starts=tuple(lines.tolist()),
            ),
            replace(amplitude, starts=(start,)),
        ),
        sought=max(1.0, len(frequencies) / STEPS),
        own=1,
        timed=_apart([len(wall.t) / float(np.ptp(wall.t)) for wall in walls]),
    )


def _apart(speeds: Sequence[float]) -> bool:
    """Whether a wave that is tied to the path has other frequencies in time in some of the runs."""
    return max(speeds) > APART * min(speeds)


def _along_wall(setting: Any) -> TimeShares:
    """Every place of a wall is cut once, and filtered as the profile is."""
    time = setting.t[:, None]
    return TimeShares(time, np.ones_like(time), lambda heights: setting.filtered @ heights)


def _resolved(times: list[Array]) -> Array:
    """Frequencies that the runs resolve, Hz."""
    spans = np.array([t[-1] - t[0] for t in times])
    low = LEAST_CYCLES / spans.min()
    high = max(len(t) / LEAST_POINTS / span for t, span in zip(times, spans, strict=True))
    return np.asarray(np.arange(low, high, 1.0 / (STEPS * spans.max())))


def adapt_to_faces(effect: Effect, problem: Problem) -> Effect | Refusal:
    """Start from the strongest lines in time of the base model's residual, each face with its own phase."""
    blocks = problem.role("identify")
    frequencies = _seen_on_faces([block.setting for block in blocks])
    if len(frequencies) < 2:
        return Refusal("its passes are too short, or its points too far apart, to show a wave")
    ways = [_time_shares(problem.base, block) for block in blocks]
    lines, size = own_peaks(problem, ways, frequencies, MOST, least=OF_THE_STRONGEST)
    frequency, amplitude = effect.parameters
    step = float(frequencies[1] - frequencies[0])
    return replace(
        effect,
        parameters=(
            replace(
                frequency,
                lower=float(frequencies[0]),
                upper=float(frequencies[-1]),
                scale=step,
                starts=tuple(lines.tolist()),
            ),
            replace(amplitude, starts=(max(float(np.median(size)) / UM, amplitude.scale),)),
        ),
        sought=max(1.0, len(frequencies) / STEPS),
        own=1,
        timed=_apart([block.setting.pace.speed for block in blocks]),
    )


def _seen_on_faces(settings: list[Any]) -> Array:
    """Frequencies, Hz, whose waves along a pass are no longer than it, and longer than a disc and a bin.

    From pass to pass a wave is seen once per period, so that its frequency is known modulo the rate of the
    passes. The waves along the passes identify which of these it is, and so do faces whose passes have
    another length.
    """
    low, high, spans = [], [], []
    for setting in settings:
        pace, passages = setting.pace, setting.passages
        times = pace.time(passages)[passages.valid]
        spans.append(float(np.ptp(times)))
        low.append(LEAST_WAVES * pace.speed / float(np.ptp(passages.along[passages.valid])))
        apart = np.hypot(np.diff(setting.mean(setting.x)), np.diff(setting.mean(setting.y)))
        high.append(pace.speed / max(SHORTEST, float(np.median(apart))))
    return np.asarray(np.arange(min(low), min(high), 1.0 / (STEPS * max(spans))))


def _time_shares(base: Any, block: Block) -> TimeShares:
    """When the rim may have finished the points of a face, and how these make its elements.

    A vibration decides which passage is the lowest, of those that are nearly so by the base model. The
    surface is lower than their mean, and goes up and down with it. They share each point evenly.
    """
    setting = block.setting
    height = base.heights(setting, middle_start(base, block))
    free = block.measured - block.zeros @ np.linalg.lstsq(block.zeros, block.measured, rcond=None)[0]
    near = height <= height.min(axis=1)[:, None] + float(np.std(free))
    share = near / near.sum(axis=1)[:, None]
    return TimeShares(setting.pace.time(setting.passages), share, setting.mean)


ON_WALLS = Effect(
    name="path_vibration",
    observables=("waviness",),
    parameters=(
        EffectParameter("frequency_hz", "Hz", 0.1, 500.0, 0.05, starts=(5.0,)),
        EffectParameter("amplitude_um", "um", 0.0, 500.0, 0.5, starts=(2.0,), local=True),
    ),
    apply=apply,
    part="vibration",
    adapt=adapt,
    signature=(
        "Waves on the wall of one frequency in time, so that their length goes with the feed; the encoders "
        "do not show them, or only in part. Waves of one length at every feed are of a gear, or of the work."
    ),
    literature="Schneider et al., Prod. Eng. 8 (2014) 59: structural modes of industrial robots in milling",
    experiment="the same cut at two feeds that differ by a third, with an accelerometer on the spindle",
    remedy=(
        "find what vibrates at this frequency with an accelerometer on spindle and "
        "arm, and change feed or speed"
    ),
)
ON_FACES = replace(
    ON_WALLS,
    observables=("flatness",),
    parameters=(
        EffectParameter("frequency_hz", "Hz", 0.01, 500.0, 0.003, starts=(2.0,)),
        EffectParameter("amplitude_um", "um", 0.0, 500.0, 0.5, starts=(2.0,), local=True),
    ),
    adapt=adapt_to_faces,
    signature=(
        "Waves along every pass of one frequency in time, that go on from pass to pass and from where they "
        "were in no other face. Waves shorter than 5 mm are lost in the means over discs: at 40 mm/s "
        "up to 8 Hz are seen. The ringing of the arm's modes dies out behind the entry."
    ),
    form="faces",
)
EFFECT = (ON_WALLS, ON_FACES)
