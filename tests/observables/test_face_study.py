"""The study of a batch's faces: known effects come back, printed tables say what they can and no more."""

import math

import numpy as np
import pandas as pd
import pytest

from metro.batch.batch import Batch
from metro.observables.flatness.study import study
from metro.observables.published.study import printed_study

# [F] table 7: X_m simulated | measured, mm, cases 1 … 8
SIMULATED = [0.391, 0.426, 0.471, 0.501, 0.398, 0.472, 0.402, 0.465]
MEASURED = [0.412, 0.486, 0.458, 0.611, 0.446, 0.517, 0.498, 0.697]


def cases(repeats=1):
    rows = [
        {"run": f"{w}{p}{o}{k}", "wrist": w, "location": p, "orientation": o, "pose": f"{w}{p}"}
        for k in range(repeats)
        for w in "AB"
        for p in "12"
        for o in "LT"
    ]
    return pd.DataFrame(rows).assign(axial_depth_mm=2.0, spindle_rpm=12000.0).set_index("run")


def batch(runs):
    return Batch("plates", {}, {}, runs, {})


def indices(runs, xm):
    frames = [
        pd.DataFrame({"run": runs.index, "index_name": name, "corrected_um": share * np.asarray(xm)})
        for name, share in (("xm", 1.0), ("xa", 0.25), ("fltt", 0.9))
    ]
    return pd.concat(frames, ignore_index=True)


def truth(runs, scatter, seed=1):
    """100 µm; wrist B 1.3 times wrist A, location 2 and T together 1.5 times more."""
    rng = np.random.default_rng(seed)
    both = (runs["location"] == "2") & (runs["orientation"] == "T")
    xm = 100.0 * np.where(runs["wrist"] == "B", 1.3, 1.0) * np.where(both, 1.5, 1.0)
    return xm * np.exp(rng.normal(0, scatter, len(runs)))


def test_effects_that_were_put_in_come_back_as_factors_and_in_um():
    runs = cases(3)
    found = study(batch(runs), indices(runs, truth(runs, 0.03)), {})
    terms = {term["term"]: term for term in found["terms"]}
    wrist = terms["wrist"]["levels"][0]
    assert (wrist["level"], wrist["over"]) == (["B"], "A")
    assert wrist["factor"]["ci95"][0] < 1.3 < wrist["factor"]["ci95"][1]
    size = found["mean"]["value"]
    assert wrist["difference"]["value"] == pytest.approx(
        size * (math.sqrt(1.3) - 1 / math.sqrt(1.3)), rel=0.1
    )
    assert terms["location × orientation"]["p_value"] < 1e-3
    assert terms["location × orientation"]["p_holm"]["fltt"] < 1e-2
    assert terms["wrist × orientation"]["p_value"] > 0.05
    assert found["scatter"] == pytest.approx(0.03, rel=0.5)


def test_a_pose_that_stands_for_wrist_and_location_is_said_to_be_no_factor_of_its_own():
    runs = cases(2)
    found = study(batch(runs), indices(runs, truth(runs, 0.03)), {})
    told = {alias["term"]: alias["from"] for alias in found["not_separable"]}
    assert told["pose"] == ["wrist", "location", "wrist × location"]


def test_the_ranking_names_the_best_and_the_prediction_is_held_against_it():
    runs = cases(3)
    xm = truth(runs, 0.03)
    exact = dict(zip(runs.index, truth(runs, 0.0), strict=True))
    found = study(batch(runs), indices(runs, xm), {run: 0.7 * value for run, value in exact.items()})
    values = [row["xm"]["value"] for row in found["ranking"]]
    assert values == sorted(values)
    assert {row["levels"]["wrist"] for row in found["ranking"][:3]} == {"A"}
    assert sum(row["probability_best"] for row in found["ranking"]) == pytest.approx(1.0)
    assert found["agreement"]["sure_alike"] == pytest.approx(1.0, abs=0.1)
    turned = study(batch(runs), indices(runs, xm), {run: 1 / value for run, value in exact.items()})
    assert turned["agreement"]["spearman"]["value"] < -0.8


def test_faces_without_an_index_above_its_noise_are_left_out():
    runs = cases(3)
    xm = truth(runs, 0.03)
    xm[0] = 0.0
    assert study(batch(runs), indices(runs, xm), {})["runs"] == 23


def test_plates_of_a_column_are_a_random_effect():
    runs = cases(3).assign(plate=np.repeat(["p1", "p2", "p3"], 8))
    shift = np.repeat([0.8, 1.0, 1.3], 8)
    found = study(batch(runs), indices(runs, shift * truth(runs, 0.03)), {})
    assert found["scatter"] < 0.06
    assert found["scatter_between_plates"] > 0.1


def test_repeats_of_one_configuration_have_no_factor():
    runs = cases(3).iloc[::8]
    assert "no factor" in study(batch(runs), indices(runs, [90, 100, 110]), {})["not_identified"]["factorial"]


@pytest.fixture(scope="module")
def printed():
    rows = [
        {"row": f"case {i}", "quantity": name, "measured": share * m, "predicted": share * s}
        for i, (s, m) in enumerate(zip(SIMULATED, MEASURED, strict=True), start=1)
        for name, share in (("X_m", 1.0), ("X_a", 0.3), ("X_g", 2.5 if i == 3 else 0.25))
    ]
    runs = cases().assign(run=[f"case{i}" for i in range(1, 9)]).set_index("run").drop(columns="pose")
    return printed_study(batch(runs), {"published_errors": pd.DataFrame(rows).assign(unit="mm")})["study"]


def test_the_published_cases_by_hand(printed):
    """Main effects of table 7 are differences of means of logarithms; what is left has four degrees."""
    signs = np.array([[w, p, o] for w in (-1, 1) for p in (-1, 1) for o in (-1, 1)])
    logs = np.log(MEASURED)
    effects = signs.T @ logs / 4
    rest = logs - logs.mean() - signs @ effects / 2
    variance = rest @ rest / 4
    for term, effect in zip(printed["terms"], effects, strict=True):
        assert term["dof"] == [1, 4]
        assert term["levels"][0]["factor"]["value"] == pytest.approx(math.exp(effect), rel=1e-9)
        assert term["f"] == pytest.approx(effect**2 / (variance / 2), rel=1e-9)
    significant = [term["term"] for term in printed["terms"] if term["p_value"] < 0.05]
    assert significant == ["location", "orientation"]


def test_the_published_simulation_is_too_flat_by_a_sixth_and_no_factor_is_to_blame(printed):
    mean = printed["bias"]["mean"]
    assert mean["value"] == pytest.approx(math.exp(np.mean(np.log(np.array(MEASURED) / SIMULATED))), rel=1e-9)
    assert mean["ci95"][0] > 1.0
    assert all(term["p_value"] > 0.05 for term in printed["bias"]["terms"])
    assert printed["cannot_tell"]


def test_the_published_ranking(printed):
    from scipy.stats import kendalltau, spearmanr

    assert printed["agreement"]["spearman"]["value"] == pytest.approx(
        spearmanr(SIMULATED, MEASURED).statistic
    )
    alike = (1 + kendalltau(SIMULATED, MEASURED).statistic) / 2
    assert printed["agreement"]["alike"] == pytest.approx(alike)
    assert printed["ranking"][0]["runs"] == ["case1"]


def test_a_misprinted_mean_that_exceeds_the_range_is_no_data(printed):
    assert "X_g" not in printed["terms"][0]["p_holm"]
    assert "X_a" in printed["terms"][0]["p_holm"]
