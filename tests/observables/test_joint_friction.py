"""Friction of the idle runs of a batch: found where the runs tell it, and where not, why."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from metro.batch.batch import Batch
from metro.observables.joint_force.friction import observe, report
from metro.observables.joint_force.observable import LEAST_VISCOUS, _instruments
from metro.observables.problem import Refusal
from metro.robot.kinematics import arm_of_cell

DH = [[0, 90, 500, 250], [90, 0, 0, 610], [-180, -90, 0, 70], [0, 90, 710, 0], [0, -90, 0, 0], [0, 0, 215, 0]]
HOME = np.array([0.1, -0.4, 0.2, 0.3, 0.8, 0.2])
COULOMB = np.array([160.0, 190.0, 130.0, 45.0, 38.0, 26.0])
VISCOUS = np.array([900.0, 1100.0, 700.0, 160.0, 140.0, 90.0])
LINK = 200.0  # kg, in the flange, weighs on the joints


def heights(q):
    """Height of the flange's origin (m,), m, by the matrices of the table, written out here."""
    frame = np.broadcast_to(np.eye(4), (len(q), 4, 4))
    for (theta, alpha, d, a), angle in zip(DH, q.T, strict=True):
        c, s = np.cos(np.radians(theta) + angle), np.sin(np.radians(theta) + angle)
        ca, sa, o = np.cos(np.radians(alpha)), np.sin(np.radians(alpha)), 0 * c
        rows = [[c, -s * ca, s * sa, a * c * 1e-3], [s, c * ca, -c * sa, a * s * 1e-3]]
        rows += [[o, sa + o, ca + o, d * 1e-3 + o], [o, o, o, 1 + o]]
        frame = frame @ np.moveaxis(np.array(rows), 2, 0)
    return frame[:, 2, 3]


def run(rng, name, path, log="idle"):
    """Log of a run: friction, the weight of a link, noise, encoders of 1e-5 degrees."""
    t = 0.012 * np.arange(len(path))
    rate = np.gradient(path, t, axis=0)
    weight = [LINK * 9.81 * (heights(path + 1e-5 * e) - heights(path - 1e-5 * e)) / 2e-5 for e in np.eye(6)]
    torque = np.stack(weight, axis=1) + COULOMB * np.tanh(rate / 1e-5) + VISCOUS * rate
    torque += rng.normal(0.0, 2.0, torque.shape)
    q = np.round(np.degrees(path), 5)
    columns = {"run": name, "log": log, "t_s": t}
    columns |= {f"q{i + 1}_set_deg": q[:, i] for i in range(6)} | {f"q{i + 1}_deg": q[:, i] for i in range(6)}
    return pd.DataFrame(columns | {f"tau{i + 1}_nm": torque[:, i] for i in range(6)})


def swing(count, size):
    """Path on which joints 1 to 4 turn round; the fifth goes one way, the sixth not at all."""
    u = np.linspace(0.0, 2 * np.pi, count)
    moves = np.stack([np.sin((j + 1) * u + j) for j in range(6)], axis=1)
    moves[:, 4], moves[:, 5] = u / np.pi + 0.1 * np.sin(u), 0.0
    return HOME + size * moves


def observed(*runs, cell=None):
    table = pd.concat(runs, ignore_index=True)
    batch = Batch("b", {}, {"cell": "arm", "arm": {"dh": DH}} if cell is None else cell, pd.DataFrame(), {})
    return observe(batch, lambda _name: table)


@pytest.fixture(scope="module")
def found():
    rng = np.random.default_rng(4)
    return observed(*(run(rng, f"r{i}", swing(700 + 90 * i, 0.1)) for i in range(4)))


def test_friction_is_found_of_joints_that_turn_round(found):
    table = found["joint_friction"].set_index("joint").loc[1:4]
    for name, true in (("coulomb", COULOMB), ("viscous", VISCOUS)):
        assert table[name].to_numpy() == pytest.approx(true[:4], rel=0.03 if name == "coulomb" else 0.1)
        # 99.9 % intervals, from those of 95 %
        half = (table[f"{name}_high"] - table[f"{name}_low"]) / 2
        assert (np.abs(table[name] - true[:4]) < 1.8 * half).all()
    assert (table["remark"] == "").all()


def test_friction_that_falls_with_the_speed_is_not_called_viscous():
    """Just above rest it falls (Stribeck): what a straight line through it shows is no viscous friction."""
    rng = np.random.default_rng(6)
    runs = [run(rng, f"r{i}", swing(700 + 90 * i, 0.1)) for i in range(4)]
    for one in runs:
        rate = np.radians(np.gradient(one["q1_deg"], one["t_s"]))
        one["tau1_nm"] -= 4.0 * VISCOUS[0] * rate
    row = observed(*runs)["joint_friction"].set_index("joint").loc[1]
    assert np.isfinite(row["coulomb"])
    assert np.isnan(row["viscous"])
    assert "falls with the speed" in row["remark"]


def test_of_the_others_it_is_said_why_not(found):
    table = found["joint_friction"].set_index("joint")
    assert np.isnan(table.loc[5, "coulomb"])
    assert "one way only" in table.loc[5, "remark"]
    assert table.loc[6, ["coulomb", "viscous"]].isna().all()
    assert "too slow" in table.loc[6, "remark"]


def test_what_is_not_known_is_null_with_its_reason(found):
    block = report(found)["arm"]["friction"]
    assert block["coulomb"][5] == {"value": None, "ci95": [None, None], "unit": "N m"}
    assert block["coulomb"][0]["ci95"][0] < block["coulomb"][0]["value"] < block["coulomb"][0]["ci95"][1]
    assert block["viscous"][0]["unit"] == "N m s/rad"
    assert set(block["not_identified"]) == {"joint 5", "joint 6"}


def test_the_curve_shows_the_level_on_both_sides(found):
    curve = found["joint_friction_curve"]
    part = curve[curve["joint"] == 1]
    line = COULOMB[0] * np.sign(part["speed_deg_s"]) + VISCOUS[0] * np.radians(part["speed_deg_s"])
    assert part["friction_nm"].to_numpy() == pytest.approx(line.to_numpy(), abs=3.0)
    assert (part["speed_deg_s"] > 0).any()
    assert (part["speed_deg_s"] < 0).any()
    assert not (curve["joint"] == 6).any()


def test_the_cut_is_no_idle_run():
    rng = np.random.default_rng(4)
    refusal = observed(run(rng, "r1", swing(700, 0.1), log="cut"))
    assert isinstance(refusal, Refusal)
    assert refusal.reason == "no run has an idle_log"
    assert report(refusal) == {"arm": {"not_identified": {"friction": refusal.reason}}}


def test_an_arm_at_rest_is_refused_and_of_a_machine_that_is_no_arm_nothing_is_said():
    rng = np.random.default_rng(4)
    still = run(rng, "r1", np.tile(HOME, (700, 1)))
    assert report(observed(still, cell={"cell": "mill"})) == {}
    assert "no joint moves" in observed(still).reason


def test_a_joint_that_is_at_rest_in_all_runs_leaves_finite_errors_of_its_friction():
    """Friction by speed would have made 1e306 N m s/rad of its level over no speed, and ended the fit."""
    batch = Batch("b", {}, {"cell": "arm", "arm": {"dh": DH}}, pd.DataFrame(), {})
    arm = arm_of_cell(batch.cell, batch.manifest)
    table = pd.DataFrame({"joint": range(1, 7), "fastest_deg_s": [2.0] * 5 + [0.0], "coulomb": 20.0})
    table = table.assign(viscous=np.nan, viscous_low=np.nan, viscous_high=np.nan)
    sigma = _instruments(batch, arm, (), table).sigma
    viscous = sigma[-2 - 6 : -2]
    assert viscous[5] == LEAST_VISCOUS < viscous[0] < 1e4
