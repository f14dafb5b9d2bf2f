"""Effects of the boundary, hidden in a march that knows no lobes; the modes are told a little wrong."""

import numpy as np
import pytest
from worded import in_words

from metro.dynamics.stability_model import StabilityModel
from metro.dynamics.system import Cut, Structure
from metro.effects.library import library
from metro.loop.labels.verdict import judge_labels
from metro.loop.search.trial import Gates
from metro.observables.stability.boundary import MODEL_SD
from metro.observables.stability.cases import Case
from metro.observables.stability.problem import LabelProblem
from virtual_cell.recipes import boundary

GATES = Gates(model_form_budget=0.007, materiality=0.004, false_additions=0.05, held_out_gain=3.0, seed=1)
SD = np.repeat([0.004, 0.03, 0.02, 0.03], 2)  # of log frequency, damping, stiffness, coefficients
MISSING = {"frequency_hz": 245.0, "damping": 0.03, "stiffness_n_um": 8.0, "axis": "x"}


def problem(hidden, seed):
    """Tests of the march; the base model has modes and coefficients in error as SD says."""
    rng = np.random.default_rng(seed)
    done, wrong = boundary.cut_tests(hidden), np.exp(SD * rng.standard_normal(8))
    columns = ("omega", "damping", "stiffness")
    true = np.concatenate([[getattr(m, name)[0] for m in boundary.MODES] for name in columns])
    structure = Structure(np.array([0, 1]), *np.split(true * wrong[:6], 3))
    entry = np.pi - np.arccos(1 - 2 * boundary.RADIAL_MM / boundary.DIAMETER_MM)
    law = boundary.LAW
    cut = Cut(boundary.TEETH, entry, np.pi, law.ktc * wrong[6], law.krc * wrong[7])
    rpm = np.array(boundary.RPM)
    model = StabilityModel(structure, (cut,), boundary.DIAMETER_MM / 2e3)
    point = np.searchsorted(rpm, done.rpm)
    probability = 1 / (
        1 + np.exp(-1.7 * (np.log(done.depth) - np.log(model.boundary(rpm)[0])[point]) / MODEL_SD)
    )
    runs = tuple(f"t{i:02d}" for i in range(len(point)))
    roles = tuple("validate" if speed in boundary.HELD_OUT else "identify" for speed in done.rpm)
    return LabelProblem(
        "lobes", runs, runs, roles, done.unstable, done.rpm, done.depth, probability, (),
        (Case("1", model, rpm, SD),), point, done.chatter_hz(),
    )  # fmt: skip


def judged(hidden, seed):
    task = problem(hidden, seed)
    return in_words(judge_labels(task, task.comparison(), [], library("lobes"), GATES)[1])


@pytest.mark.parametrize(
    ("name", "values"),
    [
        pytest.param("process_damping", {"coefficient_n_mm": 300.0}, marks=pytest.mark.slow),
        pytest.param("mode_coupling", {"angle_deg": -40.0}, marks=pytest.mark.slow),
        ("spindle_speed_softening", {"change_per_krpm": 0.06}),
        pytest.param("missing_mode", MISSING, marks=pytest.mark.slow),
    ],
)
def test_an_effect_of_the_march_is_found(name, values):
    verdict = judged({name: values}, 16)
    assert verdict["status"] == "explained"
    assert [effect["effect"] for effect in verdict["effects"]] == [name]
    assert verdict["after"]["rms"] < 0.7 * verdict["before"]["rms"]
    found = verdict["effects"][0]["parameters"]
    for key in set(values) - {"damping", "axis"}:  # labels hardly tell the damping of a mode
        low, high = found[key]["ci95"]
        assert low <= values[key] <= high
    if name == "missing_mode":
        assert found["axis"]["value"] == "x"


@pytest.mark.slow
def test_what_softens_with_speed_or_yields_with_depth_is_told_by_the_next_test():
    """High lobes are those of fast speeds: by these tests alone either may be the cause."""
    verdict = judged({"spindle_speed_softening": {"change_per_krpm": -0.06}}, 16)
    assert verdict["status"] == "undetermined"
    assert verdict["indistinguishable"] == [["spindle_speed_softening", "depth_yielding"]]
    assert "it may be a depth yielding" in verdict["unexplained"]["signature"]
    assert "its result best distinguishes" in verdict["next_experiment"]


def test_no_effect_is_found_where_there_is_none():
    verdict = judged({}, 11)
    assert verdict["status"] == "clean"
    assert verdict["effects"] == []


@pytest.mark.slow
def test_a_small_effect_is_not_named_for_sure():
    verdict = judged({"process_damping": {"coefficient_n_mm": 20.0}}, 12)
    assert verdict["effects"] == []
    assert verdict["status"] in ("clean", "undetermined")
    assert verdict["next_experiment"]
