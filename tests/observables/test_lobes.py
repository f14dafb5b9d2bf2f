"""From hammer records and labels to lobes and probabilities, on a batch made in the test."""

import math
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from metro.batch.batch import Batch
from metro.cutting.cutter import Cutter, evenly_pitched
from metro.dynamics.lobes import stability_boundary
from metro.dynamics.system import Cut, Edge, Structure
from metro.observables.problem import Refusal
from metro.observables.stability import boundary as stability
from metro.observables.stability import observable as lobes

HZ, ZETA, K = np.array([40.0, 70.0]), np.array([0.05, 0.04]), np.array([4e6, 6e6])
BATCH = {
    "tool": {"diameter_mm": 12, "teeth": 4, "helix_deg": 0},
    "coefficients": {
        "ktc_n_mm2": 2000, "krc_n_mm2": 800, "kac_n_mm2": 300, "kte_n_mm": 20, "kre_n_mm": 20, "kae_n_mm": 2,
    },
}  # fmt: skip
RUNS = ["stable", "chatter", "beside", "unlabelled"]
COLUMNS = ["test", "position", "reference", "response", "replicate"]


def receptance(frequency):
    ratio = frequency[:, None] / HZ
    return (1 / (K * (1 - ratio**2 + 2j * ZETA * ratio))).sum(axis=1)


def tables(directions=("x", "y")):
    """FRF files of a driving point in each direction, with 0.5 % noise."""
    rng = np.random.default_rng(0)
    frequency = np.arange(0.0, 150.0, 0.5)
    parts = []
    for d in directions:
        frf = receptance(frequency)
        scale = 0.005 * np.abs(frf).mean() / np.sqrt(2)
        frf = frf + scale * (rng.normal(size=len(frf)) + 1j * rng.normal(size=len(frf)))
        part = pd.DataFrame({"frequency_hz": frequency, "real_m_n": frf.real, "imag_m_n": frf.imag})
        parts.append(part.assign(test="tip", position="1", reference=f"1{d}", response=f"1{d}", replicate=1))
    hit = pd.DataFrame(columns=[*COLUMNS, "response_unit", "t_s", "force_n", "response_si"])
    stations = pd.DataFrame(columns=["position", "x_mm", "y_mm", "z_mm"])
    pickups = pd.DataFrame(columns=["position", "reference", "response", "distance_mm"])
    frf = pd.concat(parts, ignore_index=True)
    return {"hit": hit, "frf": frf, "stations": stations, "pickups": pickups}


def batch(**changes):
    runs = pd.DataFrame(
        {
            "role": ["validate", "validate", "identify", "validate"],
            "condition": RUNS,
            "operation": "side",
            "direction": "down",
            "spindle_rpm": [700.0, 700.0, 900.0, 1200.0],
            "axial_depth_mm": [0.05, 20.0, 0.3, 0.3],
            "radial_depth_mm": 3.0,
            "feed_per_tooth_mm": 0.05,
            "feed_direction_deg": np.nan,
            "pose": "1",
            "stable": ["yes", "no", "yes", ""],
        },
        index=pd.Index(RUNS, name="run"),
    )
    return Batch("press", {**BATCH, **changes}, {"cell": "c"}, runs, {})


def observe(made=None, directions=("x", "y")):
    source = tables(directions)
    return lobes.observe(made or batch(), lambda name: source[name], {})


@pytest.fixture(scope="module")
def observed():
    return observe()


def test_the_modes_of_both_directions_are_found(observed):
    modes = observed["modes"]
    assert list(modes["direction"]) == ["x", "x", "y", "y"]
    np.testing.assert_allclose(modes["frequency_hz"], np.tile(HZ, 2), rtol=5e-3)
    np.testing.assert_allclose(modes["stiffness_n_m"], np.tile(K, 2), rtol=0.03)


def test_the_diagram_is_that_of_the_true_structure(observed):
    diagram = observed["lobes"]
    true = Structure(np.repeat([0, 1], 2), 2 * np.pi * np.tile(HZ, 2), np.tile(ZETA, 2), np.tile(K, 2))
    cut = Cut(4, np.pi - np.arccos(1 - 3.0 / 6.0), np.pi, 2000e6, 800e6)
    some = diagram.iloc[::12]
    exact = stability_boundary(true, cut, some["rpm"].to_numpy()).depth * 1e3
    np.testing.assert_allclose(some["depth_mm"], exact, rtol=0.06)
    inside = (exact > some["depth_lo_mm"]) & (exact < some["depth_hi_mm"])
    assert inside.all()


def test_reconstruction_follows_the_measured_receptance(observed):
    used = observed["frf_used"]
    measured = used["real_m_n"] + 1j * used["imag_m_n"]
    modal = used["modal_real_m_n"] + 1j * used["modal_imag_m_n"]
    assert np.linalg.norm(modal - measured) < 0.02 * np.linalg.norm(measured)


def test_shallow_cuts_are_predicted_stable_and_deep_ones_not(observed):
    problem = lobes.problem(batch(), observed, {})
    probability = dict(zip(problem.runs, problem.probability_unstable, strict=True))
    assert probability["stable"] < 0.02
    assert probability["chatter"] > 0.98
    assert set(problem.runs) == {"stable", "chatter", "beside"}


def test_the_comparison_holds_the_validation_runs_with_labels(observed):
    table = lobes.problem(batch(), observed, {}).comparison()
    assert list(table["run"]) == ["stable", "chatter"]
    assert list(table["measured"]) == [0.0, 1.0]
    assert (table["before"] == table["after"]).all()
    assert set(table["unit"]) == {"1"}
    assert table["sigma"].isna().all()


def test_the_label_never_changes_the_prediction(observed):
    made = batch()
    flipped = replace(made, runs=made.runs.assign(stable=["no", "yes", "no", ""]))
    again = observe(flipped)
    pd.testing.assert_series_equal(
        observed["lobe_runs"]["probability_unstable"], again["lobe_runs"]["probability_unstable"]
    )


def test_the_report_has_the_blocks_of_the_contract(observed):
    blocks = lobes.report(batch(), observed, {}, Refusal(""), None)
    quantities = {"frequency", "damping", "stiffness", "mass"}
    assert set(blocks["modes"][0]) == {"position", "direction", "mode", *quantities}
    assert [mode["mode"] for mode in blocks["modes"]] == ["x1", "x2", "y1", "y2"]
    assert blocks["modes"][0]["position"] == 1
    assert blocks["lobes"][0]["boundary"] == "data/processed/press/lobes_final.parquet"
    lowest = blocks["lobes"][0]["lowest_mm"]
    assert lowest["ci95"][0] < lowest["value"] < lowest["ci95"][1]


def test_cross_receptances_are_not_taken_for_direct_ones(observed):
    source = tables()
    cross = source["frf"][source["frf"]["response"] == "1y"]
    cross = cross.assign(reference="1x", real_m_n=-0.3 * cross["real_m_n"], imag_m_n=0.7 * cross["imag_m_n"])
    source["frf"] = pd.concat([source["frf"], cross])
    found = lobes.observe(batch(), lambda name: source[name], {})
    pd.testing.assert_frame_equal(found["modes"], observed["modes"])


def test_a_response_across_is_tabulated_as_a_share_of_that_along():
    source = tables()
    cross = source["frf"][source["frf"]["response"] == "1x"].assign(response="1y")
    source["frf"] = pd.concat([source["frf"], cross.assign(real_m_n=0.03 * cross["real_m_n"], imag_m_n=0.0)])
    [row] = lobes.observe(batch(), lambda name: source[name], {})["mode_cross"].to_dict("records")
    assert (row["reference"], row["response"]) == ("1x", "1y")
    within = cross[cross["frequency_hz"] > 0]
    real, size = within["real_m_n"], np.hypot(within["real_m_n"], within["imag_m_n"])
    expected = 0.03 * np.sqrt((real**2).mean() / (size**2).mean())
    assert row["share"] == pytest.approx(expected, rel=0.05)


def two_positions():
    """The same structure at two positions, in the second slower by a tenth and half as stiff."""
    source = tables()
    second = source["frf"].assign(position="2", frequency_hz=0.9 * source["frf"]["frequency_hz"])
    second[["real_m_n", "imag_m_n"]] *= 2.0
    source["frf"] = pd.concat([source["frf"], second], ignore_index=True)
    return source


def test_a_position_without_runs_has_the_lobes_of_the_cut_that_most_runs_share():
    source = two_positions()
    made = batch()
    found = lobes.observe(made, lambda name: source[name], {})
    depths = found["lobes"].set_index("position")["depth_mm"]
    elsewhere = replace(made, runs=made.runs.assign(pose="2"))
    own = lobes.observe(elsewhere, lambda name: source[name], {})["lobes"].set_index("position")["depth_mm"]
    np.testing.assert_allclose(depths.loc["2"], own.loc["2"], rtol=1e-9)
    methods = found["lobe_methods"].groupby("position")
    assert methods["checked"].any().to_dict() == {"1": True, "2": False}
    assert set(found["lobe_runs"]["position"]) == {"1"}
    followed = found["mode_tracks"].groupby("position")["mode"].agg(list)
    assert followed["1"] == followed["2"] == ["x1", "x2", "y1", "y2"]


def test_runs_without_a_pose_belong_to_none_of_several_positions_and_a_note_says_so():
    source, made = two_positions(), batch()
    made.runs.loc[made.runs.index[1:3], "pose"] = ""
    found = lobes.observe(made, lambda name: source[name], {})
    assert list(found["lobe_runs"]["run"]) == [made.runs.index[0], made.runs.index[3]]
    assert found["lobes_refused"]["reason"].str.contains("2 runs without a pose").any()


def test_modes_in_x_and_z_use_z_as_the_second_direction(observed):
    in_z = observe(directions=("x", "z"))
    assert in_z["lobes_refused"]["reason"].str.contains("z is taken as the second direction").any()
    np.testing.assert_allclose(in_z["lobes"]["depth_mm"], observed["lobes"]["depth_mm"], rtol=1e-9)


def test_one_direction_alone_is_rigid_in_the_other_and_says_so():
    alone = observe(directions=("y",))
    assert alone["lobes_refused"]["reason"].str.contains("no modes in x: rigid there").any()
    assert len(alone["lobes"])


def test_turning_feed_and_structure_together_changes_nothing(observed):
    made = batch()
    turned = replace(made, runs=made.runs.assign(feed_direction_deg=180.0))
    np.testing.assert_allclose(observe(turned)["lobes"]["depth_mm"], observed["lobes"]["depth_mm"], rtol=1e-6)


def test_a_feed_across_exchanges_the_directions():
    made = batch()
    turned = replace(made, runs=made.runs.assign(feed_direction_deg=90.0))
    along_x, across_y = observe(directions=("x",)), observe(turned, directions=("y",))
    np.testing.assert_allclose(across_y["lobes"]["depth_mm"], along_x["lobes"]["depth_mm"], rtol=0.05)


def test_modes_are_identified_even_without_coefficients():
    found = observe(batch(coefficients={}))
    assert len(found["modes"]) == 4
    refusal = lobes.problem(batch(coefficients={}), found, {})
    assert isinstance(refusal, Refusal)
    assert "no cutting coefficients" in refusal.reason
    assert "lobes" not in lobes.report(batch(), found, {}, refusal, None)


def test_without_runs_the_lobes_are_refused_and_the_modes_kept():
    made = batch()
    empty = replace(made, runs=made.runs.iloc[:0])
    found = observe(empty)
    assert len(found["modes"]) == 4
    assert isinstance(lobes.problem(empty, found, {}), Refusal)


def test_without_impacts_there_is_nothing():
    source = {name: table.iloc[:0] for name, table in tables().items()}
    source["published"] = pd.DataFrame(columns=["observable", "quantity", "row", "axis", "measured", "note"])
    refused = lobes.observe(batch(), lambda name: source[name], {})
    assert isinstance(refused, Refusal)
    assert "impacts.csv" in refused.reason


def test_probability_is_a_half_at_the_boundary_and_grows_with_depth():
    samples = np.full((50, 3), 1e-3)
    low, middle, high = stability.probability_unstable(np.array([0.7e-3, 1e-3, 1.4e-3]), samples)
    assert middle == pytest.approx(0.5)
    assert low == pytest.approx(1 - high, abs=0.02)
    assert stability.probability_unstable(np.array([1e-6]), samples[:, :1])[0] == stability.LABEL_ERROR


@pytest.mark.parametrize("turn_deg", [0.0, 30.0])
@pytest.mark.parametrize(("direction", "normal"), [("up", 0.0), ("down", math.pi)])
def test_a_side_cut_of_a_rounded_end_knows_its_raw_face(direction, normal, turn_deg):
    """At the face's distance from the axis, 8 − 3 mm, in the frame of the modes; none in slots and beyond."""
    ball = Cutter(8e-3, 0.0, evenly_pitched(2), corner=8e-3)
    cutting = stability.Cutting(9e8, 5e8, np.zeros(2), ball, Edge(ball, 5e8, 4e8))
    first = pd.Series({"operation": "side", "direction": direction, "radial_depth_mm": 3.0})
    first["feed_direction_deg"] = turn_deg
    _, (cut,) = stability.cuts_of(first, cutting)
    assert cut.face.distance == pytest.approx(5e-3)
    assert cut.face.towards == pytest.approx(normal - math.radians(turn_deg))
    made = cut.at_depth(8e-3)
    assert (made.entry, made.exit) == pytest.approx((cut.entry, cut.exit))
    assert made.exit - made.entry > cut.at_depth(3e-3).exit - cut.at_depth(3e-3).entry > 0.0
    wide = stability.cuts_of(pd.Series({**first, "radial_depth_mm": 9.0}), cutting)[1][0]
    slot = stability.cuts_of(pd.Series({**first, "direction": "slot"}), cutting)[1][0]
    assert wide.face is None
    assert slot.face is None
