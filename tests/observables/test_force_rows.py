"""Rows of the run table for force runs that could be made next: what the model predicts is what is cut."""

import math
from dataclasses import replace

import numpy as np
import pytest

from metro.cutting.cutter import Cutter
from metro.cutting.engagement import Engagement
from metro.cutting.force import Cut
from metro.observables.force.dynamometer import Recording
from metro.observables.force.model import ForceSetting
from metro.observables.force.proposals import feasible
from metro.observables.problem import Block

RPM, DEPTH = 5000.0, 1.5e-3
CUTTER = Cutter(radius=6e-3, helix=math.radians(30.0), tooth_angles=(0.0, math.pi))


def slot(run, feed):
    """A slot of the batch at a feed per tooth, m."""
    recording = Recording((0.2,), span=0.1, speed=RPM / 60.0, orbit=0.0, zero_at=0.0, contact=0.05)
    cut = Cut(feed_per_tooth=feed, axial_depth=DEPTH, engagement=Engagement(0.0, math.pi))
    axis = np.array(["x", "y", "z"])
    return Block(
        run=run,
        condition=run,
        role="identify",
        order=1,
        measured=np.ones(3),
        sigma=np.ones(3),
        setting=ForceSetting(cut, 0.0, 0, recording, 0.1),
        axis=axis,
        zeros=np.eye(3),
        zero_sd=np.full(3, 0.001),
        coordinates={"axis": axis},
        labels=np.full(3, "mean"),
    )


RUNS = (slot("r1", 0.05e-3), slot("r2", 0.1e-3))
NOMINAL = {"r1": 0.05, "r2": 0.1}  # mm


def settings(proposal):
    (block,), (made,) = proposal.blocks, proposal.made
    return block.setting, made


def test_every_row_says_what_the_model_predicts():
    rows = [settings(one) for one in feasible(RUNS, CUTTER) if one.made]
    assert len(rows) > 6
    for setting, made in rows:
        feed = NOMINAL[made.like] * made.times.get("feed_per_tooth_mm", 1.0)
        assert setting.cut.feed_per_tooth == pytest.approx(1e-3 * feed)
        assert setting.cut.axial_depth == pytest.approx(DEPTH * made.times.get("axial_depth_mm", 1.0))
        assert 60.0 * setting.recording.speed == pytest.approx(made.given.get("spindle_rpm", RPM), abs=6.0)
        turned = math.degrees(setting.feed_direction)
        assert turned == pytest.approx(made.given.get("feed_direction_deg", 0.0))
        if made.given.get("operation") == "side":
            arc = setting.cut.engagement.exit - setting.cut.engagement.entry
            radial = 6.0 * (1.0 - math.cos(arc))
            assert made.given["radial_depth_mm"] == pytest.approx(radial)


def test_a_record_in_the_air_is_no_row_of_the_run_table():
    unmade = [one.words for one in feasible(RUNS, CUTTER) if not one.made]
    assert len(unmade) == 1
    assert "in the air" in unmade[0]


def depths(limits):
    return {round(1e3 * one.blocks[0].setting.cut.axial_depth, 3) for one in feasible(RUNS, CUTTER, limits)}


def test_a_depth_beyond_what_was_cut_is_proposed_where_the_user_allows_it():
    assert 3.0 not in depths(None)
    assert 4.0 not in depths(None)
    assert {3.0, 4.0} <= depths({"axial_depth_mm": (0.5, 4.0)})
    assert {3.0, 3.3} & depths({"axial_depth_mm": (0.5, 3.3)}) == {3.0}  # no new depth, nearly


def test_feeds_go_as_far_as_the_user_allows():
    feeds = [
        max(one.blocks[0].setting.cut.feed_per_tooth for one in feasible(RUNS, CUTTER, limits))
        for limits in ({"feed_per_tooth_mm": (0.0, 0.2)}, {"feed_per_tooth_mm": (0.0, 0.3)})
    ]
    assert feeds == pytest.approx([0.2e-3, 0.3e-3])


def test_a_cut_of_another_kind_has_no_wall_that_gives_way_as_that_of_the_run_that_it_is_like():
    giving = [replace(run, setting=replace(run.setting, give=1e-4)) for run in RUNS]
    found = {one.words: one.blocks[0].setting.give for one in feasible(giving, CUTTER) if one.made}
    sides = [give for words, give in found.items() if "side cut" in words]
    assert sides
    assert not any(sides)
