"""Blocks of helical runs: their frame turns with the orbit, and their record begins anywhere on it."""

import math

import numpy as np
import pandas as pd
import pytest

from metro.cutting.cutter import Cutter, evenly_pitched
from metro.cutting.engagement import Engagement
from metro.cutting.force import Cut
from metro.cutting.helical import Helix
from metro.cutting.law import EdgeLaw
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import Fit, score
from metro.loop.fitting.noise import Noise
from metro.observables.force.blocks import _scale, zeros
from metro.observables.force.dynamometer import Recording
from metro.observables.force.model import ForceModel, ForceSetting
from metro.observables.force.observable import UNIDENTIFIED_KFAC, _at_other_feeds
from metro.observables.problem import Block

HIGHEST, BLOCKS = 8, 4
TOOL = Cutter(6e-3, math.radians(35), evenly_pitched(4))
MODEL = ForceModel(TOOL, EdgeLaw(), bottom_edges=("kfae",))
BETA = np.array([1500e6, 490e6, 270e6, 16e3, 16e3, 5e3, 4e3])
ORBIT, SPEED = 2 * math.pi * 0.95, 63.0


def block(direction, axial_feed=4e-6, role="validate", phase=0.7):
    """A run as the model predicts it, without noise, that begins with the feed in a ``direction``."""
    middles = tuple((np.arange(BLOCKS) + 0.5) / (BLOCKS * 0.95))
    setting = ForceSetting(
        cut=Cut(0.08e-3, 1e-3, Engagement(0.0, math.pi)),
        feed_direction=0.0,
        highest=HIGHEST,
        recording=Recording(middles, span=middles[0] * 2, speed=SPEED, orbit=ORBIT),
        cut_length=0.0,
        helix=Helix(3.6e-3, 1e-3, axial_feed),
    )
    axis = np.tile(np.repeat(["x", "y", "z"], 2 * HIGHEST + 1), BLOCKS)
    order = np.tile((np.arange(2 * HIGHEST + 1) + 1) // 2, 3 * BLOCKS)
    time = np.repeat(middles, 3 * (2 * HIGHEST + 1))
    table = pd.DataFrame({"block": np.searchsorted(middles, time), "axis": axis, "order": order})
    empty = Block(
        run="r1",
        condition="hole",
        role=role,
        order=1,
        measured=np.zeros(len(axis)),
        sigma=np.full(len(axis), 0.1),
        setting=setting,
        axis=axis,
        zeros=zeros(axis, order == 0, time, setting.recording),
        zero_sd=np.full(3, 1.0),
        coordinates={},
        repeats=BLOCKS,
    )
    matrix, offset = MODEL.design(empty, np.array([phase, direction]), None)
    measured = offset + matrix @ BETA
    scale = _scale(table.assign(force_n=measured), turning=True)
    shifts = np.column_stack([TOOL.tooth_angles, np.zeros(4)])
    return Block(**(vars(empty) | {"measured": measured, "scale": scale, "symmetries": shifts}))


def mean_force(block):
    """Mean force along x and y of the first time block."""
    return block.measured.reshape(BLOCKS, 3, -1)[0, :2, 0]


def along(axis):
    """A direction of feed that leaves next to no mean force along an axis (0: x, 1: y)."""
    angle = math.atan2(*mean_force(block(0.0))[::-1])
    return math.pi / 2 * (1 - axis) - angle + 0.03


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("half", [0.0, math.pi])
def test_the_direction_of_feed_is_found_where_the_force_is_along_one_axis(axis, half):
    run = block(along(axis) + half)
    force = np.abs(mean_force(run))
    assert force[axis] < 0.05 * force[1 - axis]
    noise = Noise(budget=0.007, scatter=np.full(7, 0.01), repeats={"hole": 1})
    candidate = Candidate(MODEL)
    none = np.zeros(0)
    known = Fit(candidate, none, BETA, {}, noise, np.eye(7), none, none, 0.0, 1.0, {}, {}, {}, (run,))
    rest = run.measured - score(known, [run]).predict(run)
    assert np.linalg.norm(rest) < 1e-3 * np.linalg.norm(run.measured)


def test_the_scale_of_a_frame_that_turns_does_not_depend_on_where_the_record_begins():
    scales = [block(direction).scale for direction in np.linspace(0.0, 2 * math.pi, 7)]
    for scale in scales[1:]:
        assert scale == pytest.approx(scales[0], rel=1e-9)


def test_at_an_axial_feed_that_no_run_tells_the_thrust_is_uncertain():
    told, same, other = (
        block(0.3, feed, role)
        for feed, role in ((4e-6, "identify"), (4.2e-6, "validate"), (7e-6, "validate"))
    )
    assert _at_other_feeds((told, same), TOOL)[0].unidentified is None
    assert _at_other_feeds((told, same), TOOL)[1].unidentified is None
    unidentified = _at_other_feeds((told, other), TOOL)[1].unidentified
    # N R K (s − s told) along z, in the mean alone; and edges that differ in height begin to cut in between
    of_feed = 4 * 6e-3 * UNIDENTIFIED_KFAC * 3e-6
    known = told.measured.reshape(BLOCKS, 3, -1)[:, 2, 0].mean()
    rng = np.random.default_rng(3)
    behind = rng.exponential(5e-6, (100_000, 3))
    begin = ((behind > 4e-6) & (behind < 7e-6)).sum(axis=1) / 4
    of_edges = abs(known) * np.sqrt(np.mean(begin**2))
    by_axis = unidentified.reshape(BLOCKS, 3, -1)
    assert by_axis[:, 2, 0] == pytest.approx(np.full(BLOCKS, np.hypot(of_feed, of_edges)), rel=0.01)
    assert of_edges > of_feed
    assert np.count_nonzero(unidentified) == BLOCKS
