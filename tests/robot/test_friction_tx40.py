"""Friction of a Stäubli TX40 from its published log: the published values, and what they leave."""

import os
from dataclasses import replace
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from metro.robot.friction import curvature, identify, rigid_columns
from metro.robot.motion import motion

DATA = Path(os.environ.get("METRO_REAL_DATA", Path(__file__).parents[2] / "../shared/real"))
FOLDER = DATA / "reference/friction-tx40"
pytestmark = pytest.mark.skipif(not FOLDER.is_dir(), reason="the real data (METRO_REAL_DATA) are not there")

DH = np.array(
    [
        [0, -np.pi / 2, 0.32, 0],
        [0, 0, 0.035, 0.225],
        [0, np.pi / 2, 0, 0],
        [0, -np.pi / 2, 0.225, 0],
        [0, np.pi / 2, 0, 0],
        [0, 0, 0.065, 0],
    ]
)
COULOMB = np.array([7.14, 8.26, 6.34, 2.48, 3.03, 0.282])
VISCOUS = np.array([8.05, 5.53, 1.97, 1.11, 1.86, 0.65])
PERIOD, CUTOFF = 2e-4, 50.0
GEARS = np.diag([32.0, 32, 45, -48, 45, 32])
GEARS[5, 4] = 32


@cache
def log():
    motors = pd.read_csv(FOLDER / "pos_read_data.csv").to_numpy()
    torque = pd.read_csv(FOLDER / "curr_data.csv").to_numpy()
    q = motors @ np.linalg.inv(GEARS).T + np.array([0, -np.pi / 2, np.pi / 2, 0, 0, 0])
    change = np.abs(np.diff(motors, axis=0))
    step = np.where(change > 1e-9, change, np.inf).min(axis=0) / np.abs(np.diag(GEARS))
    return motion(q, torque @ GEARS, PERIOD, CUTOFF, step)


@cache
def columns():
    """Rigid links, motors, and motor 6, which the gears of joint 5 turn too."""
    found = log()
    coupled = np.zeros((*found.rate.shape, 3))
    together = found.rate[:, 4] + found.rate[:, 5]
    for joint, other in ((4, 5), (5, 4)):
        coupled[:, joint, 0] = found.acceleration[:, other]
        coupled[:, joint, 1] = found.rate[:, other]
        coupled[:, joint, 2] = np.tanh(together / 0.05)
    return np.concatenate([rigid_columns(DH, found), coupled], axis=-1)


def test_coulomb_and_viscous_friction_are_the_published_ones():
    friction = identify(log(), columns())
    np.testing.assert_allclose(friction.value[:5, 0], COULOMB[:5], rtol=0.05)
    np.testing.assert_allclose(friction.value[:, 1], VISCOUS, rtol=0.05)
    low, high = np.moveaxis(friction.interval(), -1, 0)
    assert ((low[:, 0] < COULOMB) & (high[:, 0] > COULOMB)).all()
    assert ((low[:, 1] < VISCOUS) & (high[:, 1] > VISCOUS)).all()


def test_the_sign_of_speed_at_standstill_would_cut_coulomb_friction_by_half():
    found = log()
    naive = replace(found, moving=np.ones_like(found.moving), direction=np.sign(found.rate))
    share = identify(naive, columns()).value[:5, 0] / COULOMB[:5]
    assert (share < 0.65).all()
    assert (share > 0.45).all()


def test_friction_bends_with_speed_which_coulomb_and_viscous_lack():
    bend = curvature(log(), columns())
    assert (bend.p[:4] < 0.01).all()
    assert (bend.size[:2] > 0.8).all()
    assert (bend.size[:2] < 1.4).all()
    assert (bend.size[:2] > 5 * bend.sd[:2]).all()


def test_the_residual_of_the_straight_line_is_s_shaped_in_speed():
    """Friction rises steeply, levels off, and the straight line crosses it: below, above, below."""
    friction, found = identify(log(), columns()), log()
    left = friction.residual[:, :2] * np.sign(found.rate[:, :2])
    speed = np.abs(found.rate[:, :2])
    for j in range(2):
        moving = found.moving[:, j]
        edges = np.quantile(speed[moving, j], [0, 0.1, 0.55, 0.75, 1])
        means = [
            left[moving & (speed[:, j] >= low) & (speed[:, j] <= high), j].mean()
            for low, high in pairwise(edges)
        ]
        assert means[0] < 0
        assert means[2] > 0
        assert means[3] < 0
