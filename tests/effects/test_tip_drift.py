"""A tip that drifts along the session: it is no effect of the library, and nothing of the library either."""

from dataclasses import replace

import elastic_arm
import numpy as np
import pytest

from metro.effects import joint_backlash, stiffness_scale, tip_drift
from metro.loop.search.search import search
from metro.loop.search.trial import Gates
from metro.observables.deformation.setting import CutWall

GATES = Gates(model_form_budget=0.007, materiality=0.004, false_additions=0.05, held_out_gain=3.0, seed=1)
EFFECTS = (*joint_backlash.EFFECT, stiffness_scale.EFFECT[0], tip_drift.EFFECT)
WAYS = tuple((pose, degrees, "down" if pose else "up") for pose in (0, 2) for degrees in (0, 90))
DRIFT = np.array([-4e-6, 2.5e-6, 0.0])  # m from run to run


def drifting(by, truth=None):
    """The batch with every wall moved by its place in the session, repeats one after another."""
    task = elastic_arm.problem(truth or {}, 1, ways=WAYS, repeats=2)
    moved = [
        replace(block, measured=block.measured + block.order * float(block.setting.normal @ by))
        if isinstance(block.setting, CutWall)
        else block
        for block in task.blocks
    ]
    return replace(task, blocks=tuple(moved))


def test_a_wall_moves_by_its_place_in_the_session_along_its_normal():
    task = elastic_arm.problem({}, 1, ways=WAYS)
    model = tip_drift.EFFECT.apply(task.base, {"x_um_per_run": -4.0, "y_um_per_run": 2.5})
    beta = 1.0 / elastic_arm.STIFFNESS
    for block in task.role("identify"):
        (before, rest), (after, more) = (one.design(block, np.zeros(0), beta) for one in (task.base, model))
        np.testing.assert_array_equal(after, before)
        np.testing.assert_allclose(more - rest, block.order * (block.setting.normal @ DRIFT), atol=1e-15)


def test_a_drift_is_taken_for_no_joint_and_the_rest_is_said_to_be_like_one():
    outcome = search(drifting(DRIFT), EFFECTS, GATES)
    assert outcome.names == ()
    assert outcome.likeness is not None
    assert [effect.name for effect in outcome.likeness.candidate.effects] == ["tip_drift"]
    np.testing.assert_allclose(outcome.likeness.theta, [-4.0, 2.5], atol=0.8)


@pytest.mark.parametrize(("truth", "names"), [({}, ()), ({"gap": {5: 20.0}}, ("joint_backlash",))])
def test_no_drift_is_seen_where_there_is_none(truth, names):
    outcome = search(drifting(0.0 * DRIFT, truth), EFFECTS, GATES)
    assert outcome.names == names
    assert outcome.likeness is None
