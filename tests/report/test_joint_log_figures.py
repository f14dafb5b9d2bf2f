"""Friction of joints as page one and the section of joint logs have it: only where a motion determines it."""

import numpy as np
import pandas as pd
import pytest

from metro.batch.batch import Batch
from metro.report.content import Facts
from metro.report.figures import joint_logs as figures
from metro.report.results import Results
from metro.report.sections.joint_logs import NOT_IDENTIFIABLE, _friction
from metro.report.sections.joint_words import joint_facts

SPEED = np.array([-20.0, -10.0, 10.0, 20.0])
WEIGHT = 250.0  # N m, of which nobody knows whether it is weight or friction


def tables(coulomb):
    table = pd.DataFrame(
        {
            "run": "idle",
            "joint": [1, 2],
            "unit": "N m",
            "offset": [np.nan, WEIGHT],
            "coulomb": [np.nan, coulomb],
            "viscous": [np.nan, 3.0],
        }
    )
    friction = coulomb * np.sign(SPEED) + 3.0 * np.radians(SPEED)
    curve = pd.concat(
        pd.DataFrame(
            {"run": "idle", "joint": joint, "speed_deg_s": SPEED, "friction": friction + WEIGHT, "sd": 0.1}
        )
        for joint in (1, 2)
    )
    return table, curve


def test_a_joint_whose_friction_is_open_has_no_points_and_the_others_lie_on_their_line():
    table, curve = tables(8.0)
    figure = figures.friction(curve, table)
    unknown, known = figure.axes[:2]
    assert not unknown.get_lines()
    assert [text.get_text() for text in unknown.texts] == ["not determined"]
    points, *lines = (line.get_ydata() for line in known.get_lines())
    assert np.concatenate(lines[-2:]) == pytest.approx(points)
    assert figure.legends  # of the first joint that has points


@pytest.mark.parametrize(("low", "determined"), [(7.0, True), (-0.2, False)])
def test_a_friction_whose_interval_reaches_zero_is_no_result_of_page_one(low, determined):
    table, curve = tables(8.0)
    level = {"value": 8.0, "ci95": [low, 16.0 - low], "unit": "N m"}
    unknown = {"value": None, "ci95": [None, None], "unit": "N m"}
    identified = {"joints": {"runs": {"idle": {"joints": [1, 2], "coulomb": [unknown, level]}}}}
    shown = {"joint_log": table, "joint_log_curve": curve}
    items = joint_facts(Results(Batch("b", {}, {}, pd.DataFrame(), {}), shown, identified, {}, {}))
    assert any(isinstance(item, Facts) for item in items) is determined


@pytest.mark.parametrize(
    ("name", "value", "sd", "cell"),
    [
        ("gravity", 1200.0, 2750.0, NOT_IDENTIFIABLE),  # beside 20 N m, all that the joint exerts
        ("gravity", 0.1, 0.2, "≤ 0.51"),  # an axis that is vertical carries no weight, and that is known
        ("gravity", np.nan, np.nan, NOT_IDENTIFIABLE),
        ("coulomb", 8.0, 1.0, "8.0 ± 2.0"),
        ("coulomb", -0.03, 0.08, "≤ 0.13"),
        ("viscous", 20.0, 57.0, "≤ 137"),  # 2 N m at the top speed
        ("viscous", 20.0, 5700.0, NOT_IDENTIFIABLE),
        ("inertia", 5.0, 42.0, NOT_IDENTIFIABLE),
        ("inertia", 50.0, 4.0, "50.0 ± 8.2"),
    ],
)
def test_what_a_motion_does_not_determine_is_said_to_be_so(name, value, sd, cell):
    """A weight had been printed as 1200 ± 5600 N m."""
    known = dict.fromkeys(("coulomb", "viscous", "gravity", "inertia"), 10.0)
    row = {
        "run": "idle",
        "joint": 1,
        "unit": "N m",
        "condition": 9.0,
        "torque_rms": 20.0,
        "fastest_deg_s": 1.0,
    }
    row |= known | {f"{quantity}_sd": 0.1 for quantity in known} | {name: value, f"{name}_sd": sd}
    made = _friction(pd.DataFrame([row]), {})
    assert made.rows[0][2 + list(known).index(name)] == cell
    assert ("Not identifiable:" in made.caption) is (cell == NOT_IDENTIFIABLE)
    assert ("distinguished from zero" in made.caption) is cell.startswith("≤")
