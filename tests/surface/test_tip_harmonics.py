"""Teeth that move the tip: against the propagated response, and how little they do it where they are fast."""

import math

import numpy as np
import pytest

from metro.cutting.cutter import Cutter, evenly_pitched
from metro.cutting.engagement import engagement
from metro.cutting.force import Cut, force_basis
from metro.cutting.law import EdgeLaw
from metro.surface.tip_harmonics import SLOW, at_rim, tooth_heights
from metro.surface.tip_response import respond, tip_modes
from metro.units import DEG, MM, N_MM, N_MM2, UM

MASS = np.array([[654.58, 0.0, 382.51], [0.0, 903.38, 0.0], [382.51, 0.0, 269.57]])
STIFFNESS = np.diag([3.32e5, 7.15e5, 8.77e5])
TEETH = np.array(evenly_pitched(4))


def force() -> np.ndarray:
    """Force of [F]'s face cut over a revolution, (720, 3) N: 16 mm, four teeth, 10 by 2 mm, 0.05 mm."""
    tool = Cutter(8 * MM, 30 * DEG, evenly_pitched(4))
    si = np.array([905, 402, 468, 16.4, 19.9, 21.7]) * np.array([N_MM2] * 3 + [N_MM] * 3)
    return (
        force_basis(tool, EdgeLaw(), Cut(0.05 * MM, 2 * MM, engagement("face", "down", 10 * MM, 8 * MM))) @ si
    )


def test_at_12000_rpm_the_teeth_move_the_tip_by_less_than_a_micrometre() -> None:
    modes, rate = tip_modes(MASS, STIFFNESS[None]), 2 * np.pi * 200
    heights = tooth_heights(modes, 0.05, force(), rate)
    static = abs((np.linalg.inv(STIFFNESS) @ force().mean(axis=0))[2])
    assert rate * 4 > SLOW * modes.frequency.max()
    assert np.ptp(heights) < 1 * UM  # the scanner's noise in a footprint is some 3 µm
    assert np.ptp(heights) < 0.02 * static


def test_near_the_highest_mode_they_move_it_by_more_than_the_mean_force() -> None:
    modes = tip_modes(MASS, STIFFNESS[None])
    heights = tooth_heights(modes, 0.02, force(), modes.frequency[0, 2] / 4)
    assert np.ptp(heights) > abs((np.linalg.inv(STIFFNESS) @ force().mean(axis=0))[2])
    assert abs(heights.mean()) < 1e-9 * np.ptp(heights)  # the mean force is the static deflection's


def test_the_motion_is_that_which_the_propagated_response_settles_to() -> None:
    turns, rate = 20, 2 * np.pi * 3.0
    pushed = force()[::2]
    pushed = pushed - pushed.mean(axis=0)
    modes = tip_modes(MASS, STIFFNESS[None])
    long = np.vstack([np.tile(pushed, (turns, 1)), pushed[:1]])
    settled = respond(modes, 0.08, long[None], 2 * np.pi / rate / 360)[0, -360:]
    # the one takes the force as linear between samples, the other as a trigonometric sum
    found = tooth_heights(modes, 0.08, pushed, rate)[0]
    assert np.abs(found - settled).max() < 0.01 * np.ptp(settled)


@pytest.mark.parametrize("tooth", range(4))
def test_a_place_on_the_rim_is_cut_when_a_tooth_comes_to_it(tooth: int) -> None:
    angle = 2 * math.pi * np.arange(720) / 720
    low = 2.0
    heights = -np.exp(-(((angle - low) / 0.02) ** 2))[None]  # low when tooth 0 is at 2 rad
    rim = np.linspace(-math.pi, math.pi, 721)
    left = at_rim(heights, np.zeros(721, dtype=int), rim, TEETH[[tooth]])
    assert rim[left.argmin()] == pytest.approx(math.remainder(low + TEETH[tooth], 2 * math.pi), abs=0.01)
    assert (at_rim(heights, np.zeros(721, dtype=int), rim, TEETH) <= left).all()
