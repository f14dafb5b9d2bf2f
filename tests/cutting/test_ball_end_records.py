"""Slots that a real ball-end tool cut at five depths: each depth from the coefficients of the others."""

import math
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat

from metro.cutting.chip import Cut
from metro.cutting.cutter import Cutter, evenly_pitched
from metro.cutting.engagement import Engagement
from metro.cutting.force import force_basis
from metro.cutting.law import EdgeLaw
from metro.signals.orders import order_averages, spindle_speed, to_orders

DATA = Path(os.environ.get("METRO_REAL_DATA", Path(__file__).parents[2] / "../shared/real"))
RECORDS = DATA.parent / "field/force-ball-d16/ball_d16.mat"
pytestmark = pytest.mark.skipif(not RECORDS.is_file(), reason="the records (METRO_REAL_DATA) are not there")
RATE, FEED, RADIUS, HIGHEST = 10_000, 0.1e-3, 8e-3, 24
FLAT = Cutter(RADIUS, math.radians(25), evenly_pitched(2))
# Feed along the sensor's y, and a sensor under the work: the force on the tool is the opposite.
TO_TOOL = -np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
DEPTHS = range(1, 6)


def amplitudes(rows):
    return np.concatenate([rows[:1].astype(complex), rows[1::2] - 1j * rows[2::2]])


@pytest.fixture(scope="module")
def measured():
    content, found = loadmat(RECORDS), {}
    for depth in DEPTHS:
        force = np.stack([content[f"F{axis}_Ball_{depth}"].ravel() for axis in "xyz"], axis=1) @ TO_TOOL.T
        time = np.arange(len(force)) / RATE
        speed, _ = spindle_speed(time, force, 800 / 60, HIGHEST)
        average = order_averages(time, 2 * math.pi * speed * time, force, HIGHEST, 1)[0]
        found[depth] = amplitudes(average.value.T)
    return found


def left_out(tool, measured):
    """Error of each depth, of its rms, by the coefficients of the four others, each at its best phase."""
    order = np.arange(HIGHEST + 1)
    designs = {}
    for depth in DEPTHS:
        cut = Cut(FEED, depth * 1e-3, Engagement(0.0, math.pi))
        designs[depth] = amplitudes(to_orders(force_basis(tool, EdgeLaw(), cut, True), HIGHEST))
    turns = np.exp(1j * np.outer(math.pi * np.arange(180) / 180, order))[:, :, None, None]

    def solve(design, target):
        matrix = np.concatenate([design.real, design.imag]).reshape(-1, 6)
        return np.linalg.lstsq(matrix, np.concatenate([target.real, target.imag]).ravel(), rcond=None)[0]

    def error(design, target, beta):
        return np.sqrt((np.abs(target - design @ beta) ** 2).sum() / (np.abs(target) ** 2).sum())

    def best(design, target, beta):
        return min((turn * design for turn in turns), key=lambda turned: error(turned, target, beta))

    errors = []
    for out in DEPTHS:
        others = [depth for depth in DEPTHS if depth != out]
        first = others[-1]
        alone = [solve(turn * designs[first], measured[first]) for turn in turns]
        spans = [
            error(turn * designs[first], measured[first], b) for turn, b in zip(turns, alone, strict=True)
        ]
        beta = alone[int(np.argmin(spans))]
        for _ in range(6):
            turned = {depth: best(designs[depth], measured[depth], beta) for depth in others}
            beta = solve(
                np.concatenate([turned[depth] for depth in others]),
                np.concatenate([measured[depth] for depth in others]),
            )
        errors.append(error(best(designs[out], measured[out], beta), measured[out], beta))
    return np.array(errors)


def test_a_ball_end_predicts_the_depth_that_was_left_out_better_than_a_flat_end(measured):
    flat, ball = left_out(FLAT, measured), left_out(replace(FLAT, corner=RADIUS), measured)
    print("flat", flat.round(3), "ball", ball.round(3))
    assert np.sqrt(np.mean(ball**2)) < 0.8 * np.sqrt(np.mean(flat**2))
    assert ball[0] < 0.8 * flat[0]
    assert ball[-1] < 0.8 * flat[-1]
