"""The verdict on an arm by measured poses, from what was found: statuses, probabilities, rivals, words."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest
from worded import in_words

from metro.loop.measured_poses import judged, probability

QUIET = {"parts": {"joint 3": 0.1, "alone": 0.9}, "share": -0.01, "ci95": [-0.05, 0.03], "noise_share": None}
LOUD = {"parts": {"joint 3": 0.4, "alone": 0.6}, "share": 0.3, "ci95": [0.2, 0.4], "noise_share": 0.5}
GRAVITY = "elasticity under gravity, joint 2"
TILT = "tilt of the base under the arm's weight"


def effect(code, title, joint, p_value=2e-5, **parameters):
    size = {"value": 0.1, "ci95": [0.09, 0.11], "unit": "mm"}
    named = {
        name: {"value": v, "ci95": [v - 0.01, v + 0.01], "unit": "mrad"} for name, v in parameters.items()
    }
    where = {"joint": joint} if joint else {}
    head = {"effect": code, "title": title, "moves": size, "gain": 0.2, "p_value": p_value}
    return {**head, **where, "parameters": named}


def tried(code, title, joint, kept):
    where = {"joint": joint} if joint else {}
    return {"effect": title, "code": code, "gain": 0.2, "error": 0.01, "p_value": 0.3, "kept": kept, **where}


def series(effects=(), *, rows=0.5, left=QUIET, noise=None, rivals=(), scatter=0.03):
    """Return a block; ``rows``: p-value of the corrections of joint 2."""
    median = {stage: {"median": {"value": 0.1}} for stage in ("nominal", "geometry", "effects")}
    return {
        "poses": 400,
        "scatter": {"value": scatter, "unit": "mm"},
        "noise": noise,
        "corrections": {"joint 2 length": {"value": 0.8, "ci95": [0.7, 0.9], "unit": "mm"}},
        "geometry": [{"joint": 2, "p_value": rows}],
        "effects": list(effects),
        "tried": [
            tried("elasticity", GRAVITY, 2, kept=True),
            tried("base_tilt", TILT, 0, kept=False),
        ],
        "rivals": [list(pair) for pair in rivals],
        "errors": dict.fromkeys(("random", "region", "time"), median),
        "ceiling": left,
    }


def verdict(**blocks):
    rng = np.random.default_rng(0)
    parts = []
    for run in blocks:
        part = {"run": run, "kind": "region", "pose": np.arange(200), "region": np.arange(200) % 8}
        part |= {f"{axis}_mm": rng.normal(0, 500, 200) for axis in "xyz"}
        part |= {
            f"{stage}_{axis}_mm": rng.normal(0, sd, 200)
            for stage, sd in (("nominal", 0.5), ("geometry", 0.2), ("effects", 0.03))
            for axis in "xyz"
        }
        parts.append(pd.DataFrame({**part, "sigma_mm": np.nan}))
    return judged(blocks, pd.concat(parts), 0)[0]


@pytest.mark.parametrize(
    ("block", "status"),
    [
        (series(), "clean"),
        (series(left=LOUD), "unexplained"),
        (series(rows=1e-9), "explained"),
        (series(rows=1e-9, left=LOUD), "partly_explained"),
        (series([effect("elasticity", GRAVITY, 2)], rivals=[(GRAVITY, TILT)]), "undetermined"),
        (series([effect("elasticity", GRAVITY, 2)], rows=1e-9, rivals=[(GRAVITY, TILT)]), "explained"),
        (series(noise={"value": 0.03, "unit": "mm", "source": "instrument"}), "unexplained"),
        (series(noise={"value": 0.3, "unit": "mm", "source": "instrument"}), "clean"),
        (series(noise={"value": 0.03, "unit": "mm", "source": "repeats", "freedom": 500}), "clean"),
        (series(noise={"value": 0.02, "unit": "mm", "source": "repeats", "freedom": 500}), "unexplained"),
    ],
)
def test_the_status_is_that_of_the_contract(block, status):
    assert verdict(r01=block)["status"] == status


def test_the_worst_series_decides_and_effects_say_of_which_they_are():
    found = verdict(r01=series(rows=1e-9), r02=series(rows=1e-9, left=LOUD))
    assert found["status"] == "partly_explained"
    assert [one["run"] for one in found["effects"]] == ["r01", "r02"]
    assert list(found["unexplained"]["ceiling"]["series"]) == ["r02"]


def test_a_rival_makes_a_lead_of_a_finding_and_both_are_named():
    found = verdict(r01=series([effect("elasticity", GRAVITY, 2)], rows=1e-9, rivals=[(GRAVITY, TILT)]))
    chances = {one["effect"]: one["probability"] for one in found["effects"]}
    assert chances["gravity_elasticity"] == 0.5
    assert chances["kinematic_error"] > 0.999
    assert found["indistinguishable"] == [["gravity_elasticity (joint 2)", "base_tilt"]]
    assert "cannot distinguish gravity elasticity (joint 2) from base tilt" in in_words(found["words"])
    assert "a point on the base" in in_words(found["next_experiment"])


@pytest.mark.parametrize(
    ("half", "name", "gap"), [(-0.05, "joint_backlash", 5.73), (0.05, "joint_hysteresis", -5.73)]
)
def test_a_joint_that_lags_has_backlash_and_one_that_leads_has_none(half, name, gap):
    title = "direction of approach, joint 3"
    block = series([effect("approach", title, 3, **{"half play": half})])
    (found,) = verdict(r01=block)["effects"]
    assert found["effect"] == name
    angle = found["parameters"]["angle_mdeg"]
    assert angle["value"] == pytest.approx(gap, abs=0.01)
    assert angle["ci95"][0] < angle["value"] < angle["ci95"][1]


def test_a_p_value_leaves_the_probability_that_sellke_bayarri_and_berger_tabulate():
    """Table 1 of their paper: error probabilities of 0.289, 0.111 and 0.0184 at p = 0.05, 0.01 and 0.001."""
    assert [1 - probability(p) for p in (0.05, 0.01, 0.001)] == pytest.approx(
        [0.289, 0.111, 0.0184], abs=6e-4
    )
    assert probability(0.9) == pytest.approx(0.5)
    assert probability(0.0) > 1 - 1e-12


def test_the_words_of_what_is_left_name_its_kind_and_the_share_of_the_instrument():
    left = verdict(r01=series(left=LOUD))["unexplained"]
    said = in_words(left["ceiling"]["words"])
    assert "40 % depends on the angle of joint 3 alone and 60 % does not repeat" in said
    assert "other poses predict 30 % (20 to 40 %)" in said
    assert "The stated noise of the instrument makes 50 % of it" in said
    assert said.endswith("This points to the gear or the encoder of joint 3, finer than its curve.")
    noise = {"value": 0.03, "unit": "mm", "source": "instrument"}
    quiet = verdict(r01=series(noise=noise))["unexplained"]
    assert "no cause of these kinds can explain it" in in_words(quiet["ceiling"]["words"])
    assert (
        in_words(quiet["signature"])
        == "0.03 mm in a coordinate, beside 0.03 mm that the instrument is stated to have"
    )


def test_no_series_no_verdict():
    assert judged({"not_identified": {"r01": "few"}}, pd.DataFrame(), 0) is None
    assert math.isclose(sum(LOUD["parts"].values()), 1.0)
