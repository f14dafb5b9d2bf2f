"""A tool that bends: it is no effect of the library, and no softer joint either."""

from dataclasses import replace

import elastic_arm
import numpy as np
import pytest
from worded import in_words

from metro.effects import joint_backlash, stiffness_scale, tip_give
from metro.loop.search.search import search
from metro.loop.search.trial import Gates
from metro.loop.verdict.residual import remaining
from metro.observables.deformation.setting import CutWall

GATES = Gates(model_form_budget=0.007, materiality=0.004, false_additions=0.05, held_out_gain=3.0, seed=1)
EFFECTS = (*joint_backlash.EFFECT, *stiffness_scale.EFFECT[2:], tip_give.EFFECT)
GIVE = 80e-9  # m/N: a tool of 12.5 N/µm


def bent(give, truth=None, **plan):
    """The batch with a tool that bends under what pushes it along the wall's normal."""
    task = elastic_arm.problem(truth or {}, 1, **plan)
    moved = [
        replace(block, measured=block.measured + give * float(block.setting.force[0] @ block.setting.normal))
        if isinstance(block.setting, CutWall)
        else block
        for block in task.blocks
    ]
    return replace(task, blocks=tuple(moved))


def test_a_wall_stands_proud_by_the_force_along_its_normal():
    task = elastic_arm.problem({}, 1)
    model = tip_give.EFFECT.apply(task.base, {"um_per_kn": 80.0})
    beta = 1.0 / elastic_arm.STIFFNESS
    for block in task.blocks:
        (before, rest), (after, more) = (one.design(block, np.zeros(0), beta) for one in (task.base, model))
        np.testing.assert_array_equal(after, before)
        pushed = 0.0
        if isinstance(block.setting, CutWall):
            pushed = GIVE * block.setting.force[0] @ block.setting.normal
        np.testing.assert_allclose(more - rest, pushed, atol=1e-15)


def test_a_bent_tool_is_taken_for_no_joint_and_the_rest_is_said_to_be_like_one():
    outcome = search(bent(GIVE), EFFECTS, GATES)
    assert outcome.names == ()
    assert outcome.likeness is not None
    assert [effect.name for effect in outcome.likeness.candidate.effects] == ["tip_give"]
    np.testing.assert_allclose(outcome.likeness.theta, [80.0], rtol=0.2)


@pytest.mark.parametrize("factor", [0.8, pytest.param(1.2, marks=pytest.mark.slow)])
def test_a_softer_arm_is_no_bent_tool(factor):
    outcome = search(bent(0.0, {"factor": dict.fromkeys(range(1, 7), factor)}), EFFECTS, GATES)
    assert outcome.names == ("stiffness_scale",)
    assert outcome.likeness is None


def test_where_the_poses_do_not_tell_a_bent_tool_is_said_to_be_possible():
    task = bent(GIVE, ways=elastic_arm.ONE_WAY, repeats=3)
    outcome = search(task, EFFECTS, GATES)
    assert outcome.names == ("stiffness_scale",)
    assert "alternative explanation to stiffness scale: a tip give" in "; ".join(in_words(remaining(outcome)))
