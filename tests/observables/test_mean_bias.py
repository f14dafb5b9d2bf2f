"""What runout makes of the coefficients from mean forces, by closed forms of a slot of two teeth."""

import math
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from metro.cutting.chip import Cut
from metro.cutting.cutter import Cutter, evenly_pitched
from metro.cutting.engagement import Engagement
from metro.cutting.law import EdgeLaw
from metro.observables.force.coefficients import mean_coefficients
from metro.observables.force.dynamometer import Recording
from metro.observables.force.mean_bias import mean_bias
from metro.observables.force.model import ForceModel, ForceSetting
from metro.observables.problem import BaseFit, Block, Problem

BETA = np.array([800e6, 320e6, 170e6, 14e3, 18e3, 4e3])
DEPTH, RUNOUT = 2e-3, 5e-6
BASE = ForceModel(Cutter(6e-3, 0.0, evenly_pitched(2)), EdgeLaw())
FEEDS = (0.02e-3, 0.03e-3, 0.05e-3, 0.08e-3)


def slot(i, feed):
    axis = np.repeat(["x", "y", "z"], 9)
    mean = np.tile(np.arange(9) == 0, 3)
    setting = ForceSetting(
        Cut(feed, DEPTH, Engagement(0.0, math.pi)), 0.0, 4, Recording((0.5,), 1.0, 100.0), 0.0
    )
    zeros = np.stack([(axis == name) & mean for name in "xyz"], axis=1).astype(float)
    blank = np.zeros(27)
    return Block(f"r{i}", f"{feed}", "identify", i, blank, blank + 1.0, setting, axis, zeros, np.ones(3), {})


def measured(feed, runout):
    """Mean force of a slot: shear as ever, edges where the chip is thicker than none.

    The teeth stand 2 × runout apart in radius, so the shorter one cuts where feed × sine is more than that.
    """
    lift = math.asin(min(1.0, 2.0 * runout / feed))
    both, across = 1.0 - lift / math.pi, 0.5 * (1.0 + math.cos(lift))
    ktc, krc, kac, kte, kre, kae = BETA
    x = -DEPTH * (feed * krc / 2.0 + 2.0 / math.pi * kre * across)
    y = DEPTH * (feed * ktc / 2.0 + 2.0 / math.pi * kte * across)
    return (x, y, DEPTH * (2.0 / math.pi * kac * feed + kae * both)), both


def spindle(blocks, runout):
    means = [measured(block.setting.cut.feed_per_tooth, runout)[0] for block in blocks]
    return pd.DataFrame(means, columns=["mean_x_n", "mean_y_n", "mean_z_n"]).assign(
        run=[block.run for block in blocks]
    )


def stated(runout):
    """What is stated of means with a runout that the model with effects knows."""
    blocks = tuple(slot(i, feed) for i, feed in enumerate(FEEDS))
    table = spindle(blocks, runout)
    reported = {"mean": mean_coefficients(BASE, blocks, table)}
    model = replace(BASE, cutter=replace(BASE.cutter, runout_radius=runout))
    task = Problem("force", "N", 1.0, model, blocks, np.full(6, 0.01))
    return reported, mean_bias(BASE, task, table, reported, BaseFit(BETA, np.eye(6), 3.0, {}))


def test_the_bias_of_a_runout_is_found_and_what_remains_are_the_coefficients():
    reported, block = stated(RUNOUT)
    for parameter, truth in zip(BASE.parameters, BETA, strict=True):
        name, true = parameter.name, truth / parameter.si
        assert block["mean_corrected"][name]["value"] == pytest.approx(true, rel=2e-3)
        bias = block["mean_bias"]["mean"][name]["value"]
        assert bias == pytest.approx(reported["mean"][name]["value"] - true, abs=2e-3 * true)
    assert block["mean_bias"]["mean"]["kac"]["value"] > 0.05 * BETA[2] / 1e6 > 0.0
    assert block["mean_bias"]["mean"]["kae"]["value"] < 0.0


def test_the_share_of_the_cut_is_that_of_the_shorter_tooth_that_lifts_out():
    _, block = stated(RUNOUT)
    for feed, share in block["mean_bias"]["edge_in_cut"].items():
        on_circles = measured(float(feed) * 1e-3, RUNOUT)[1]
        # on its true path a tooth is up to feed / radius, 1.3 %, elsewhere where it lifts out
        assert 1.0 - share == pytest.approx(1.0 - on_circles, rel=0.06)


def test_without_effects_on_the_means_nothing_is_stated():
    assert stated(0.0)[1] == {}
