"""Cases: the models that effects change, at the speeds of the tests."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from metro.cutting.cutter import Cutter, evenly_pitched
from metro.dynamics.lobes import stability_boundary
from metro.dynamics.system import Cut, Structure
from metro.observables.stability.boundary import Cutting
from metro.observables.stability.cases import NOWHERE, boundaries, cases_of
from metro.observables.stability.errors import COMMON_SD, frequency_sd
from metro.observables.stability.positions import Tip
from metro.observables.stability.problem import LabelProblem

STRUCTURE = Structure(
    np.array([0, 1]), np.array([260.0, 390.0]), np.array([0.04, 0.03]), np.array([4e6, 6e6])
)
TIP = Tip("1", STRUCTURE, ("x1", "y1"), np.array([0.01, 0.01, 0.0, np.nan, 0.02, 0.02]))
CUTTING = Cutting(1e9, 4e8, np.array([0.03, 0.03]), Cutter(6e-3, 0.0, evenly_pitched(4)))
RUNS = pd.DataFrame(
    {
        "operation": "side",
        "direction": ["down", "up", "down", "down", "down"],
        "radial_depth_mm": 3.0,
        "feed_direction_deg": 0.0,
        "spindle_rpm": [900.0, 700.0, 700.0, 900.0, 800.0],
    },
    index=list("abcde"),
)
PLACES = dict.fromkeys("abcd", "1") | {"e": "elsewhere"}
CASES, POINT = cases_of(RUNS, PLACES, [TIP], CUTTING)
PROBLEM = LabelProblem(
    "lobes", tuple("abcde"), tuple("abcde"), ("identify",) * 5, np.ones(5, bool),
    RUNS["spindle_rpm"].to_numpy(), np.full(5, 1e-4), np.full(5, 0.5), (), CASES, POINT, np.full(5, np.nan),
)  # fmt: skip


def test_cuts_of_one_kind_share_a_case_and_speeds_a_point():
    assert [list(case.rpm) for case in CASES] == [[700.0, 900.0], [700.0]]
    assert list(POINT) == [1, 2, 0, 1, NOWHERE]
    assert list(PROBLEM.point_rpm) == [700.0, 900.0, 700.0]


def test_the_boundary_is_that_of_the_structure_and_the_cut():
    (depth,), (chatter,) = PROBLEM.boundaries([lambda model: model])
    swept = np.arccos(1 - 3.0 / 6.0)
    down = stability_boundary(STRUCTURE, Cut(4, np.pi - swept, np.pi, 1e9, 4e8), np.array([700.0, 900.0]))
    up = stability_boundary(STRUCTURE, Cut(4, 0.0, swept, 1e9, 4e8), np.array([700.0]))
    np.testing.assert_allclose(np.exp(depth), [*down.depth, *up.depth])
    np.testing.assert_allclose(chatter, [*down.chatter_hz, *up.chatter_hz])


def test_a_change_reaches_every_case():
    softer = replace(STRUCTURE, stiffness=STRUCTURE.stiffness / 2)
    (before, after), _ = PROBLEM.boundaries(
        [lambda model: model, lambda model: replace(model, structure=softer)]
    )
    np.testing.assert_allclose(after - before, np.log(0.5), rtol=1e-3)


def test_a_case_doubts_frequencies_by_more_than_their_scatter_and_nothing_else():
    mass = STRUCTURE.stiffness / STRUCTURE.omega**2
    np.testing.assert_array_equal(CASES[0].sd[:2], frequency_sd(TIP.sd[:2], mass))
    assert np.all(CASES[0].sd[:2] > TIP.sd[:2])
    np.testing.assert_array_equal(CASES[0].sd[2:], [*TIP.sd[2:], *CUTTING.sd])


def test_deviations_are_those_of_what_is_uncertain():
    spread = PROBLEM.deviations(400, 1)
    assert spread.shape == (400, 3)
    certain = replace(CASES[0], sd=np.zeros_like(CASES[0].sd)).deviations(400, 1)
    faster = CASES[0].at(CASES[0].rpm / (1 + COMMON_SD))  # all frequencies higher, as if the speed were lower
    moved = np.abs(
        boundaries([faster], [lambda model: model])[0] - boundaries([CASES[0]], [lambda model: model])[0]
    )
    np.testing.assert_allclose(certain.std(axis=0), moved[0], rtol=0.2)
    coefficients = np.array([0.0] * 6 + [0.03, 0.03])  # both scale the depth together: at least 3 % / sqrt 2
    alone = replace(CASES[0], sd=coefficients).deviations(400, 1).std(axis=0)
    assert np.all((alone > 0.02) & (alone < 0.04))
    assert np.all(spread[:, :2].std(axis=0) > alone)


def test_the_diagram_after_a_change_is_the_boundary_of_the_changed_model():
    rpm = np.array([700.0, 800.0])
    depth = np.exp(boundaries([CASES[0].at(rpm)], [lambda model: model])[0][0]) * 1e3
    diagram = pd.DataFrame(
        {"position": ["1", "1", "9"], "rpm": [*rpm, 700.0], "depth_mm": [*depth, 1.0], "chatter_hz": 50.0}
    )
    softer = replace(STRUCTURE, stiffness=STRUCTURE.stiffness / 2)
    after = PROBLEM.redrawn({"lobes": diagram}, lambda model: replace(model, structure=softer))["lobes"]
    np.testing.assert_allclose(after["depth_mm"], [*depth / 2, 1.0], rtol=1e-3)
    assert after["chatter_hz"].iloc[2] == pytest.approx(50.0)
