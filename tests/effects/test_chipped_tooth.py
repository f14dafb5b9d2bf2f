"""A chipped tooth: what it changes in the force, and that nothing of the library is taken for it."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from blind import clean, closed

from metro.cutting.chip import Cut
from metro.cutting.chipped import Chipped
from metro.cutting.cutter import Cutter, evenly_pitched
from metro.cutting.engagement import Engagement
from metro.cutting.force import force_basis
from metro.cutting.law import EdgeLaw
from metro.effects.chipped_tooth import EFFECT, apply
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.system import moved_models, sensitivities
from metro.observables.force.dynamometer import Recording
from metro.observables.force.model import ForceModel, ForceSetting

TOOL = Cutter(5e-3, math.radians(35), evenly_pitched(4))
CUT = Cut(0.08e-3, 3e-3, Engagement(0.0, math.pi))
COEFFICIENTS = np.array([8e8, 3e8, 2e8, 2e4, 2e4, 5e3])
SLICES, ANGLES = 400, 720


def slices(chipped):
    """Force by slices of a tool of which one tooth is shorter up to a height, on circular paths."""
    dz = CUT.axial_depth / SLICES
    z = (np.arange(SLICES) + 0.5) * dz
    off = np.zeros((SLICES, TOOL.teeth))
    off[z < chipped.height, chipped.tooth] = -chipped.length
    theta = 2 * np.pi * np.arange(ANGLES) / ANGLES
    phi = theta[:, None, None] + np.array(TOOL.tooth_angles) - (TOOL.lag_per_depth * z)[:, None]
    sine, cosine = np.sin(phi), np.cos(phi)
    chip = np.min(
        [m * CUT.feed_per_tooth * sine + off - np.roll(off, -m, axis=1) for m in range(1, TOOL.teeth + 1)],
        axis=0,
    )
    t, r, a = (
        np.where((sine > 0) & (chip > 0), k * chip + edge, 0.0) * dz
        for k, edge in zip(COEFFICIENTS[:3], COEFFICIENTS[3:], strict=True)
    )
    parts = (-t * cosine - r * sine, t * sine - r * cosine, a)
    return np.stack([part.sum(axis=(1, 2)) for part in parts], axis=1)


@pytest.mark.parametrize("height", [0.8e-3, 1.7e-3, 5e-3])
@pytest.mark.parametrize("length", [10e-6, 200e-6])
def test_force_of_a_chipped_tooth_is_that_of_slices(height, length):
    chipped = Chipped(1, length, height)
    broken, low = chipped.change(TOOL, CUT)
    sound, there, here = (
        force_basis(tool, EdgeLaw(), cut) @ COEFFICIENTS
        for tool, cut in ((TOOL, CUT), (broken, low), (TOOL, low))
    )
    reference = slices(chipped)
    change = np.abs(reference - sound).max()
    # How far a tooth reaches is a wave over the height: too little by up to 2.2 % at the ends of 3 mm.
    assert np.abs(sound + there - here - reference).max() < 0.03 * change + 0.002 * np.abs(reference).max()


def test_applying_breaks_one_tooth_of_the_force_model_and_touches_nothing_else():
    model = ForceModel(TOOL, EdgeLaw())
    changed = apply(model, {"length_um": 30.0, "tooth": 2.2, "height_mm": 1.5})
    assert changed.chipped == (Chipped(2, pytest.approx(30e-6), pytest.approx(1.5e-3)),)
    assert replace(changed, chipped=()) == model


@pytest.mark.slow
def test_a_chipped_tooth_is_taken_for_nothing_of_the_library(tmp_path):
    hidden = {"chipped_tooth": {"tooth": 1, "length_um": 40.0}}
    outcome, verdict, _ = closed(tmp_path, hidden, 2)
    assert verdict["status"] in {"unexplained", "partly_explained"}
    assert not any(entry["probability"] > 0.9 for entry in verdict["effects"])
    assert "like a chipped tooth" in verdict["unexplained"]["signature"]
    place = dict(outcome.likeness.candidate.parts(outcome.likeness.theta))
    values = {effect.name: effect.values(outcome.likeness.theta[at]) for effect, at in place.items()}
    assert values["chipped_tooth"]["length_um"] == pytest.approx(40.0, rel=0.05)


@pytest.mark.xdist_group("blind-clean")
def test_no_chipped_tooth_is_seen_in_a_batch_without_it():
    outcome, verdict, _ = clean(3)
    assert outcome.likeness is None
    assert verdict["status"] == "clean"


def test_a_parameter_that_changes_nothing_has_a_derivative_of_exactly_zero():
    """The number of the tooth: rounding as a derivative would be a direction, and the fit would follow it."""
    setting = ForceSetting(CUT, 0.3, 24, Recording((0.2, 0.6), 0.4, 80.0), 0.0)
    rows = 2 * 3 * 49
    block = SimpleNamespace(setting=setting, zeros=np.zeros((rows, 3)), measured=np.zeros(rows))
    candidate = Candidate(ForceModel(TOOL, EdgeLaw()), (EFFECT,))
    theta = np.array([40.0, 1.0, 1.2])
    model, moved = candidate.model(theta), moved_models(candidate, theta)
    effect, own = sensitivities(model, moved, block, np.array([0.7]), COEFFICIENTS)
    assert not effect[:, 1].any()
    assert effect[:, 0].any()
    assert effect[:, 2].any()
    assert own.any()
