"""Measurements that no fit can weigh refuse their observable, and name the run."""

from dataclasses import replace
from types import SimpleNamespace

import elastic_arm
import numpy as np
import pytest

from metro.observables.problem import Refusal
from metro.stages.problems import pose

BATCH = SimpleNamespace(manifest={})


def posed(**changes):
    """Pose a problem of walls, the fourth block of which has other values."""
    task = elastic_arm.problem({}, 0)
    blocks = (*task.blocks[:3], replace(task.blocks[3], **changes), *task.blocks[4:])
    observable = SimpleNamespace(problem=lambda *_: replace(task, blocks=blocks))
    return pose(observable, BATCH, {}, {}), blocks[3]


def test_finite_errors_are_no_fault():
    assert not isinstance(posed()[0], Refusal)


@pytest.mark.parametrize("value", [0.0, np.nan, np.inf, 1e306])
def test_an_error_of_which_there_is_no_weight_is_refused_by_its_run(value):
    sigma = np.full(elastic_arm.problem({}, 0).blocks[3].sigma.shape, 5e-6)
    sigma[[2, 7]] = value
    refused, block = posed(sigma=sigma)
    assert isinstance(refused, Refusal)
    assert refused.reason.startswith(f"run {block.run}: {block.axis[2]} is ")
    assert f"2 of {len(sigma)} values" in refused.reason


def test_a_measurement_that_is_no_number_is_refused_too():
    measured = elastic_arm.problem({}, 0).blocks[3].measured.copy()
    measured[0] = np.nan
    assert isinstance(posed(measured=measured)[0], Refusal)
