"""Published tables: what the prints say of themselves, and what can be made of them."""

import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml

from metro.batch.batch import Batch
from metro.observables.problem import Problem, Refusal
from metro.observables.published.misprints import grubbs
from metro.observables.published.observable import errors, loads, modes, observe, problems
from metro.structure import Structure

RAW = Path(__file__).parents[2] / "data" / "raw"


def batch(name: str) -> tuple[Batch, pd.DataFrame]:
    manifest = yaml.safe_load((RAW / name / "batch.yaml").read_text())
    published = pd.read_csv(RAW / name / "published.csv", dtype={"table": str, "row": str})
    return Batch(name, manifest, {"cell": manifest["cell"]}, pd.DataFrame(), {}), published


def residual_problems(name: str) -> list[Problem]:
    about, published = batch(name)
    observed = observe(about, lambda _: published, {})
    assert not isinstance(observed, Refusal)
    return problems(about, observed, {})


@pytest.fixture(scope="module")
def flatness() -> Problem:
    (problem,) = [p for p in residual_problems("irb6640-published") if p.observable == "flatness"]
    return problem


def test_published_batches_cite_and_name_themselves():
    for name in ("trimule-published", "kr160-published", "irb6640-published"):
        manifest = batch(name)[0].manifest
        assert manifest["batch"] == name
        assert manifest["source"] == "published"
        assert "table" in manifest["citation"]


def test_face_milling_tables_divide_by_the_prediction_and_sensorless_tables_by_the_measurement():
    face = errors(batch("irb6640-published")[1])
    face = face[face["convention"] != ""]
    assert len(face) == 25 + 24
    assert set(face["convention"]) == {"predicted", "neither", "both"}
    force = errors(batch("kr160-published")[1])
    assert set(force["convention"]) <= {"measured", "both"}
    assert (force["flag"] == "").all()


def test_the_misprints_of_the_face_milling_tables_are_the_only_flags():
    table = errors(batch("irb6640-published")[1])
    flagged = table[table["flag"] != ""].set_index(["row", "quantity"])
    gauge = ("P3", "displacement under 150 N, second gauge")
    inertia = ("machining head", "moment of inertia")
    indices = {("case 5", "X_m"), ("case 7", "X_m"), ("case 3", "X_g")}
    assert set(flagged.index) == indices | {gauge, inertia}
    assert "0.97 mm is an outlier among the other 7 points, 0.081 to 0.139" in flagged.loc[gauge, "flag"]
    assert "3.122 exceeds the sum of the other two, 2.367" in flagged.loc[inertia, "flag"]
    assert flagged.loc[("case 5", "X_m"), "of_predicted_percent"] == pytest.approx(12.06, abs=0.005)
    assert flagged.loc[("case 7", "X_m"), "of_predicted_percent"] == pytest.approx(23.88, abs=0.005)
    assert "X_g exceeds X_a" in flagged.loc[("case 3", "X_g"), "flag"]


def test_a_percentage_off_by_more_than_rounding_is_flagged_and_one_within_it_is_not():
    row = {
        "table": "1",
        "observable": "force",
        "quantity": "f",
        "axis": "x",
        "measured": 1.234,
        "predicted": 1.001,
    }
    rows = [
        {**row, "row": str(i), "unit": "N", "printed_error_percent": e}
        for i, e in enumerate((23.3, 22.0, 18.9, 26.0))
    ]
    table = errors(pd.DataFrame(rows))
    assert list(table["convention"]) == ["predicted", "neither", "measured", "neither"]


def test_printed_natural_frequencies_are_the_damped_ones():
    table = modes(batch("trimule-published")[1])
    assert len(table) == 8
    assert set(table["agrees_with"]) == {"damped"}
    first = table.iloc[0]
    assert first["undamped_hz"] == pytest.approx(21.3257 / math.sqrt(1 - 0.0608951**2), rel=5e-6)


def test_an_undamped_frequency_is_recognised():
    values = {
        "frequency": math.sqrt(4e6 / 100) / (2 * math.pi),
        "damping": 20.0,
        "stiffness": 4e6,
        "mass": 100.0,
    }
    rows = [{"table": "1", "row": "1", "axis": "x", "quantity": q, "measured": v} for q, v in values.items()]
    assert list(modes(pd.DataFrame(rows))["agrees_with"]) == ["undamped"]
    assert modes(pd.DataFrame(rows[:3])).empty


def test_the_printed_structure_is_not_linear_between_its_two_loads():
    table = loads(batch("irb6640-published")[1]).set_index(["axis", "load_n", "quantity"])["compliance_um_n"]
    x = table.xs("x").droplevel(1)
    assert x[150.0] == pytest.approx(
        1e3 * np.mean([0.440, 0.445, 0.443, 0.443, 0.442, 0.428, 0.495, 0.475]) / 150
    )
    assert x[250.0] < x[150.0]
    y = table.xs("y").droplevel(1)
    assert y[250.0] < 0.2 * y[150.0]


def test_a_compliance_leaves_out_the_value_that_is_called_a_misprint():
    table = loads(batch("irb6640-published")[1]).set_index(["axis", "load_n", "quantity"])
    gauge = table.loc[("z", 150.0, "displacement under 150 N, second gauge")]
    others = [0.109, 0.127, 0.115, 0.139, 0.136, 0.099, 0.081]
    assert gauge["points"] == len(others)
    assert gauge["compliance_um_n"] == pytest.approx(1e3 * np.mean(others) / 150)


def test_values_of_a_sound_column_are_rarely_called_a_misprint():
    """The chance that Grubbs's test states is one: of 4000 normal columns as many are called as it says."""
    rng = np.random.default_rng(3)
    chance = np.array([grubbs(rng.normal(size=8))[1] for _ in range(4000)])
    assert np.mean(chance < 0.05) == pytest.approx(0.05, abs=0.011)
    place, probability = grubbs(np.array([0.0, 0.1, -0.1, 0.05, 9.0, -0.05]))
    assert place == 4
    assert probability < 1e-6


def test_only_pairs_along_an_axis_become_a_residual():
    assert residual_problems("trimule-published") == []
    assert [p.observable for p in residual_problems("kr160-published")] == ["joint_force"]
    assert [p.observable for p in residual_problems("irb6640-published")] == ["flatness"]


def test_conditions_part_the_printed_points_and_both_roles_are_there(flatness):
    measured = np.concatenate([block.measured for block in flatness.blocks])
    table = batch("irb6640-published")[1].query("table == '6'")
    assert measured == pytest.approx(table["measured"].to_numpy() * 1e-3)
    assert [block.role for block in flatness.blocks] == ["identify", "validate"] * 2 + ["identify"]
    assert all(block.measured.size == 5 for block in flatness.blocks)


def test_residual_of_the_printed_path_is_37_micrometres_and_its_slope_nearly_one(flatness):
    model = flatness.base
    printed = np.concatenate([model.design(b, np.zeros(0))[1] for b in flatness.blocks])
    measured = np.concatenate([b.measured for b in flatness.blocks])
    assert np.sqrt(np.mean((measured - printed) ** 2)) == pytest.approx(37e-6, abs=1e-6)
    slope = printed @ measured / (printed @ printed)
    assert slope == pytest.approx(1.089, abs=0.005)
    residual = measured - slope * printed
    sd = np.sqrt(residual @ residual / 24 / (printed @ printed))
    assert abs(slope - 1) < 2.06 * sd


def test_a_stiffer_machine_deviates_less_and_a_printed_force_does_not_change(flatness):
    from dataclasses import replace

    block = flatness.blocks[0]
    (force,) = residual_problems("kr160-published")
    for problem, factor in ((flatness, 2.0), (force, 1.0)):
        stiffer = replace(problem.base, structure=replace(problem.base.structure, stiffness_factor=2.0))
        ratio = (
            problem.base.design(problem.blocks[0], np.zeros(0))[1]
            / stiffer.design(problem.blocks[0], np.zeros(0))[1]
        )
        assert ratio == pytest.approx(factor)
    assert flatness.base.structure == Structure()
    assert block.sigma == pytest.approx(19e-6)


def test_noise_that_nobody_stated_is_the_rounding_and_is_said_to_be():
    (force,) = residual_problems("kr160-published")
    assert force.blocks[0].sigma == pytest.approx(0.001 / math.sqrt(12))
    assert any("noise_n" in note for note in force.notes)


def test_a_batch_without_printed_rows_is_refused_by_name():
    refusal = observe(batch("kr160-published")[0], lambda _: pd.DataFrame(), {})
    assert isinstance(refusal, Refusal)
    assert "published.csv" in refusal.reason
