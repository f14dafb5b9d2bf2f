"""Walls of an arm with known truth, wave by wave: for the tests of the effects that waviness shows."""

from dataclasses import replace

import numpy as np

from metro.loop.search.trial import Gates
from metro.observables.problem import Block, Problem
from metro.observables.waviness.model import PHASES, WavinessModel, WavyCut
from metro.surface.profile import part
from metro.surface.waves import wave_basis

GATES = Gates(model_form_budget=0.007, materiality=0.004, false_additions=0.05, held_out_gain=3.0, seed=1)
LENGTH, SPACING, CUTOFF = 0.06, 0.2e-3, 8e-3
X = np.arange(0.0, LENGTH, SPACING)
KEPT = slice(40, len(X) - 40)
FEEDS = (0.010, 0.014, 0.020)
SIGMA = 0.6e-6
TRACKING = 3e-6
# joint angles along the three paths: joint 4 turns round in the middle of two, joint 6 in none
TRAVEL = np.array(
    [[-0.4, 1.1, -1.3, 0.0, 0.6, -0.9], [0.9, -0.5, 0.7, 0.0, -1.0, 0.8], [0.3, 0.8, 0.9, 1.2, 0.5, 1.4]]
)
TURN = np.array([[0, 0, 0, 30.0, 0, 0], [0, 0, 0, -24.0, 0, 0], [0, 0, 0, 0, 0, 0]])
MOVES = np.array(
    [[0.9, 0.5, -0.7, 0.25, 0.3, -0.33], [-0.6, 0.8, 0.5, -0.3, 0.2, 0.3], [0.7, -0.4, 0.6, 0.2, -0.35, 0.28]]
)
COMPLIANCE = 1.0 / np.array([1.8e6, 2.1e6, 1.3e6, 3.1e5, 3.9e5, 2.3e5])
LOAD = np.array(
    [[120, 200, -90, 20, -35, 15.0], [-90, 150, 60, -25, 30, 12.0], [140, -60, 80, 15, 22, -18.0]]
)


def cut(path, feed):
    """What a run follows from, but its tracking error; the torque of joint 5 changes sign on two paths."""
    waves, length = wave_basis(len(X[KEPT]), SPACING, 0.6e-3, CUTOFF)
    filtered = waves @ part(np.eye(len(X)), SPACING, CUTOFF).waviness[KEPT]
    q = np.outer(X, TRAVEL[path]) + np.outer((X - 0.5 * LENGTH) ** 2, TURN[path]) + 0.3
    load = np.tile(LOAD[path], (len(X), 1))
    if path < 2:
        load[:, 4] *= (0.4 * LENGTH - X) / (0.4 * LENGTH)
    blank = np.zeros((len(waves), 6))
    t = 0.1 + X / feed
    return (
        WavyCut(
            by_joint=blank, idle=None, share=np.ones(blank.shape), q=q, rate=np.gradient(q, t, axis=0), t=t,
            pace=np.gradient(q, t, axis=0),
            moves=np.tile(MOVES[path], (len(X), 1)), load=load, compliance=COMPLIANCE, filtered=filtered,
            longer=np.zeros((2, len(X[KEPT]))),
        ),
        length,
    )  # fmt: skip


def problem(truth=None, *, seed=0, transfer=1.0):
    """Three paths at two feeds each, twice, and a run of each at the third feed held out."""
    rng = np.random.default_rng(seed)
    shape = rng.normal(size=(3, 6, len(X)))
    blocks, truth = [], truth or WavinessModel(tuple(range(6)))
    plan = [(p, f, "identify") for p in range(3) for _ in range(2) for f in (0, 2)]
    plan += [(p, 1, "validate") for p in range(3)]
    for order, (path, feed, role) in enumerate(plan, start=1):
        setting, length = cut(path, FEEDS[feed])
        strayed = TRACKING * part(shape[path].T, SPACING, CUTOFF, 3e-3).waviness * 3.0
        setting = replace(setting, by_joint=setting.filtered @ strayed)
        count = len(length)
        blank = Block(
            run=f"r{order}", condition=f"{path}-{feed}", role=role, order=order, measured=np.zeros(count),
            sigma=np.full(count, SIGMA), setting=setting, axis=np.full(count, "z"),
            zeros=np.zeros((count, 0)), zero_sd=np.zeros(0),
            coordinates={"axis": np.full(len(X[KEPT]), "z"), "x_mm": X[KEPT] * 1e3},
            synthesis=np.linalg.pinv(wave_basis(len(X[KEPT]), SPACING, 0.6e-3, CUTOFF)[0]),
            symmetries=np.array(PHASES)[:, None],
            labels=np.where(length > 2e-3, "waves above 2 mm", "waves below 2 mm"),
        )  # fmt: skip
        phases = np.random.default_rng([seed, order]).uniform(0.0, 2.0 * np.pi, len(truth.vibration))
        matrix, offset = truth.design(blank, phases)
        made = matrix[:, 0] * transfer * (1 + 0.01 * rng.normal()) + offset + SIGMA * rng.normal(size=count)
        blocks.append(replace(blank, measured=made))
    return Problem("waviness", "um", 1e-6, WavinessModel(tuple(range(6))), tuple(blocks), np.array([0.02]))
