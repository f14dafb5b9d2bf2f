"""What tables say of the tip's dynamics: damping from impacts, modes they lack, matrices no structure has."""

import numpy as np
import pandas as pd
import pytest

from metro.observables.flatness.dynamics import TipDynamics, tip_block, tip_dynamics
from metro.surface.tip_stiffness import basis_over
from metro.units import MM

MASS = np.array([[654.58, 0.0, 382.51], [0.0, 903.38, 0.0], [382.51, 0.0, 269.57]])
SOFT = np.linalg.inv(np.diag([3.32e5, 7.15e5, 8.77e5]))
A0, A1 = 0.9228, 0.00209
X, Y = (c.ravel() for c in np.meshgrid([10.0, 100.0, 190.0], [10.0, 90.0]))
ENTRIES = ("mxx", "mxy", "mxz", "myy", "myz", "mzz")


def loads(scale: np.ndarray | float = 1.0) -> tuple:
    """Three loads at each of six points, in mm and N; ``scale`` the compliance of the first point."""
    place = np.repeat(np.column_stack([X, Y, 0 * X]) * MM, 3, axis=0)
    force = np.tile(150 * np.eye(3), (6, 1))
    moved = force @ SOFT
    moved[:3] = force[:3] @ (SOFT * scale)
    return place, force, moved


def mass(*factors: float) -> pd.DataFrame:
    rows = []
    for point, (factor, x, y) in enumerate(zip(factors, X, Y, strict=False), start=1):
        given = (MASS * factor)[np.triu_indices(3)]
        rows.append(
            {
                "pose": "A",
                "point": f"P{point}",
                "x_mm": x,
                "y_mm": y,
                **dict(zip(ENTRIES, given, strict=True)),
            }
        )
    return pd.DataFrame(rows)


def modes(position: str = "A", shift: float = 1.0, count: int = 3) -> pd.DataFrame:
    omega = np.sqrt(np.linalg.eigvals(np.linalg.solve(MASS, np.linalg.inv(SOFT))).real)
    omega = np.sort(omega)[:count] * np.append(np.full(count - 1, 1.0), shift)
    ratio = A0 / (2 * omega) + A1 * omega / 2
    return pd.DataFrame(
        {"position": position, "direction": "z", "frequency_hz": omega / (2 * np.pi), "frequency_sd_hz": 0.01}
        | {"damping": ratio, "damping_sd": 0.02 * ratio, "stiffness_n_m": 1e6}
    )


def told(mass_table: pd.DataFrame, mode_table: pd.DataFrame, tests: tuple | None = None) -> tuple:
    tests = loads() if tests is None else tests
    basis = basis_over(tests[0][:, 0], tests[0][:, 1], 3)
    return tip_dynamics("A", basis, tests, mass_table, mode_table)


def test_impacts_at_the_pose_or_at_a_point_of_it_tell_a0_and_a1() -> None:
    for position in ("A", "A/P3"):
        found, notes = told(mass(1.0), modes(position))
        assert isinstance(found, TipDynamics)
        assert found.damping is not None
        assert found.damping.values == pytest.approx([A0, A1])
        assert any("damping from 3 of the modes" in note for note in notes)
        assert not any("do not have" in note for note in notes)


def test_impacts_elsewhere_or_none_leave_the_damping_in_doubt() -> None:
    for table in (modes("B"), modes("AB"), pd.DataFrame()):
        found, _ = told(mass(1.0), table)
        assert isinstance(found, TipDynamics)
        assert found.damping is None
        (at_once,) = found.beside  # how much of the compliance belongs to other modes is not known either
        assert np.isinf(at_once.frequency)
        assert np.square(at_once.reach) == pytest.approx(SOFT[2, 2], rel=1e-6)
    assert told(mass(1.0), modes("A"))[0].beside == ()


def test_one_mode_shows_the_damping_at_its_frequency() -> None:
    one = modes(count=1)
    found, notes = told(mass(1.0), one)
    assert found.damping.ratio(2.0 * np.pi * one["frequency_hz"].to_numpy()) == pytest.approx(
        one["damping"][0]
    )
    assert any("damping from 1 of the modes" in note for note in notes)


def beside(stiffness: dict[str, float]) -> pd.DataFrame:
    """Modes of M and K, blown along z, and one at 8 Hz along some axes that loses much less than theirs."""
    theirs = modes()
    other = [
        {"position": "A", "direction": axis, "frequency_hz": 8.0 + 0.01 * at, "frequency_sd_hz": 0.01}
        | {"damping": 0.01, "damping_sd": 1e-4, "stiffness_n_m": value}
        for at, (axis, value) in enumerate(stiffness.items())
    ]
    return pd.concat([theirs, pd.DataFrame(other)], ignore_index=True)


def test_a_mode_that_mass_and_stiffness_do_not_have_says_nothing_of_their_damping_but_swings_itself() -> None:
    found, notes = told(mass(1.0), beside({"y": 4e6, "z": 1e8}))
    assert found.damping.values == pytest.approx([A0, A1])
    (mode,) = found.beside
    assert mode.frequency == pytest.approx(2.0 * np.pi * 8.005)
    assert (mode.ratio, mode.reach) == (pytest.approx(0.01), pytest.approx((0.0, 5e-4, 1e-4)))
    assert any("those that blows along z show swing beside them" in note for note in notes)


def test_a_mode_that_no_blow_along_z_shows_does_not_move_the_tip_along_z() -> None:
    assert told(mass(1.0), beside({"x": 1e7, "y": 4e6}))[0].beside == ()


def test_where_the_lowest_mode_is_another_one_nothing_is_said_to_swing_beside() -> None:
    found, _ = told(mass(1.0), modes().assign(frequency_hz=0.5 * modes()["frequency_hz"]))
    assert found.beside == ()
    assert found.damping is not None


def test_modes_that_mass_and_stiffness_do_not_have_are_told_and_the_lowest_of_them_is_to_be_checked() -> None:
    higher = modes().assign(frequency_hz=2.0 * modes()["frequency_hz"])
    (said,) = [note for note in told(mass(1.0), higher)[1] if "do not have" in note]
    assert said.startswith("Pose A: ")
    assert said.endswith("The lowest of the arm's modes is among them: check mass.csv and loads.csv.")
    (said,) = [note for note in told(mass(1.0), modes(shift=1.3))[1] if "do not have" in note]
    assert said.endswith("these three: those that blows along z show swing beside them.")
    assert "do not have 30.39 Hz along z." in said
    within = told(mass(0.8, 1.0, 1.2), modes(shift=1.05))[1]  # where the mass is known to some 20 %
    assert not any("do not have" in note for note in within)


def test_a_mode_of_the_spindle_is_no_mode_of_the_arm() -> None:
    spindle = modes().tail(1).assign(frequency_hz=800.0, damping=0.01, damping_sd=1e-5)
    found, notes = told(mass(1.0), pd.concat([modes(), spindle]))
    assert found.damping.values == pytest.approx([A0, A1])
    assert not any("do not have" in note for note in notes)


def test_several_masses_are_interpolated_and_their_error_is_stated() -> None:
    tilted = 1 + 0.4 * X / 200
    found, notes = told(mass(*tilted), pd.DataFrame())
    np.testing.assert_allclose(found.mass(np.array([0.05]), np.array([0.03]))[0], 1.1 * MASS)
    assert any("through 6 points" in note for note in notes)


@pytest.mark.parametrize("file", ["mass.csv", "loads.csv"])
def test_a_matrix_that_is_not_positive_definite_is_named_by_file_pose_and_point(file: str) -> None:
    turned = np.diag([1.0, 1.0, -1.0])
    if file == "mass.csv":
        found, notes = told(mass(1.0).assign(mzz=200.0), pd.DataFrame())  # 654.58 · 200 < 382.51²
        point = "point P1"
    else:
        found, notes = told(mass(1.0), pd.DataFrame(), loads(turned))
        point = "at x 10, y 10 mm"
    assert found is None
    (said,) = [note for note in notes if "positive definite" in note]
    assert file in said
    assert "pose A" in said
    assert point in said


def test_without_a_mass_nothing_rings() -> None:
    assert told(mass(), modes()) == (None, [])


def test_the_block_of_the_contract_holds_the_weighted_mean_and_each_pose() -> None:
    one = told(mass(1.0), modes())[0].damping
    other = one.shifted(np.array([0.1, 0.0]))
    assert tip_block({}) == {}
    alone = tip_block({"A": one})["tip"]
    assert alone["a0"]["value"] == pytest.approx(A0)
    assert alone["a1"]["unit"] == "s"
    assert "poses" not in alone
    both = tip_block({"A": one, "B": other})["tip"]
    assert both["a0"]["value"] == pytest.approx(A0 + 0.05)
    assert both["poses"]["B"]["a0"]["value"] == pytest.approx(A0 + 0.1)
    width = [np.diff(block["a0"]["ci95"])[0] for block in (both, alone)]
    assert width[0] == pytest.approx(width[1] / np.sqrt(2))
