"""How large an effect of the boundary is, on a machine whose answers are known in closed form."""

import numpy as np
import pytest

from metro.effects.effect import Effect, EffectParameter
from metro.observables.stability.problem import LabelProblem
from proof import label_oracle as room
from proof.label_oracle import label_oracle

RPM = np.arange(2000.0, 6000.0, 500.0)
DEPTHS = np.array([0.5, 0.8, 1.25, 2.0])  # mm; the boundary of the base model is 1 mm everywhere
SD = 0.15


@pytest.fixture(autouse=True)
def few_draws(monkeypatch):
    monkeypatch.setattr(room, "DRAWS", 30)
    monkeypatch.setattr(room, "DEVIATIONS", 32)


class Case:
    """Log depth of the boundary: 0 of the base model, moved by what effects do."""

    rpm = RPM

    def deviations(self, draws, _seed):
        return np.zeros((draws, len(RPM)))


class Problem(LabelProblem):
    """Boundaries that move by a number, in the logarithm, which is all that effects change."""

    @property
    def point_tooth_hz(self):
        return np.full(len(RPM), 100.0)

    def boundaries(self, changes):
        raised = np.array([[change(0.0)] for change in changes])
        return np.log(1e-3) + np.tile(raised, len(RPM)), np.full((len(changes), len(RPM)), 300.0)

    def estimates(self, changes):
        return self.boundaries(changes)


def effect(name):
    def apply(model, values):
        return model + values[name]

    return Effect(name, ("lobes",), (EffectParameter(name, "1", -5.0, 5.0, 0.1, (-1.0,)),), apply, "", "", "")


LIBRARY = (effect("raised"), effect("more"))


def problem(moved, speeds=6, held=2):
    point = np.repeat(np.arange(speeds), len(DEPTHS))
    depth = np.tile(DEPTHS, speeds) * 1e-3
    unstable = np.log(depth) > np.log(1e-3) + moved
    names = tuple(f"t{i}" for i in range(len(point)))
    roles = tuple("validate" if p < held else "identify" for p in point)
    chance = np.full(len(point), 0.5)
    return Problem(
        "lobes", names, names, roles, unstable, RPM[point], depth, chance, (), (Case(),), point,
        np.full(len(point), np.nan), SD,
    )  # fmt: skip


def size(moved, **settings):
    found = label_oracle(problem(moved, **settings), {"raised": {"raised": moved}}, LIBRARY, 3.0)
    return found["sizes"]["raised"]


def test_what_is_always_there_acts_beside_what_is_hidden_and_has_no_size():
    task, hidden = problem(1.0), {"raised": {"raised": 0.6}}
    alone, beside, listed = (
        label_oracle(task, hidden, LIBRARY, 3.0, also)
        for also in (None, {"more": {"more": 0.4}}, {"more": [{"more": 0.4}]})
    )
    assert listed == beside
    assert set(beside["sizes"]) == {"raised"}
    # The boundary is at 0.6 and 0.4 together: labels of the truth are predicted by both, and not by one.
    assert beside["exact"] < alone["exact"]


def test_a_larger_effect_is_larger_and_none_at_all_has_no_size():
    sizes = [size(moved) for moved in (0.0, 0.1, 0.5, 1.0)]
    assert sizes[0] == 0.0
    assert sizes[1] < 0.5 < sizes[2] < sizes[3]
    assert sizes[3] > 1.0


def test_fewer_tests_tell_less():
    assert size(1.0, speeds=4, held=2) < size(1.0)


def test_with_what_the_truth_says_held_out_labels_are_predicted_as_well_as_their_floor_allows():
    found = label_oracle(problem(0.5), {"raised": {"raised": 0.5}}, LIBRARY, 3.0)
    assert found["after"] < found["before"]
    assert found["exact"] <= found["floor"]  # these labels are free of the errors that are allowed for


def test_the_oracle_learns_the_parameters_from_the_identification_tests():
    told = label_oracle(problem(0.5), {"raised": {"raised": 0.5}}, LIBRARY, 3.0)
    misled = label_oracle(problem(0.5), {"raised": {"raised": -0.5}}, LIBRARY, 3.0)
    assert misled["after"] == told["after"] < misled["exact"]


def test_of_two_effects_each_is_weighed_beside_the_other():
    hidden = {"raised": {"raised": 0.5}, "more": {"more": -0.5}}
    sizes = label_oracle(problem(0.0), hidden, LIBRARY, 3.0)["sizes"]
    assert sizes["raised"] == pytest.approx(sizes["more"], rel=0.5)
    assert min(sizes.values()) > 0.5


def test_what_the_library_lacks_is_as_large_as_labels_are_unlikely():
    sizes = [
        label_oracle(problem(moved), {"odd": {"x": 1.0}}, LIBRARY, 3.0)["sizes"]["odd"]
        for moved in (0.0, 0.8)
    ]
    assert sizes[0] == 0.0
    assert sizes[1] > 0.5


def test_wrong_labels_are_unlikely_though_the_boundary_is_right():
    task = problem(0.0)
    task.unstable[[0, 8, 15]] ^= True
    found = label_oracle(task, {"wrong_labels": {"share": 0.1}}, LIBRARY, 3.0)
    assert found["sizes"]["wrong_labels"] > 1.0
    assert found["after"] is None


def test_it_says_where_there_are_too_few_tests():
    assert label_oracle(problem(0.5), {"raised": {"raised": 0.5}}, LIBRARY, 3.0)["enough"]
    assert not label_oracle(problem(0.5, held=1), {"raised": {"raised": 0.5}}, LIBRARY, 3.0)["enough"]
    assert not label_oracle(problem(0.5, speeds=4), {"raised": {"raised": 0.5}}, LIBRARY, 3.0)["enough"]
