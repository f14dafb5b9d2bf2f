"""Deflection feedback: against the linear recursion written out, limits, and a march in the test."""

import math

import numpy as np
import pandas as pd
import pytest

from metro.batch.batch import Batch
from metro.cutting.cutter import Cutter, evenly_pitched
from metro.cutting.engagement import Engagement, engagement
from metro.cutting.force import Cut, mean_force
from metro.cutting.law import EdgeLaw
from metro.observables.force.yielding import ANGLES, LIMIT, NotConvergedError, ratios, yielding_force
from metro.observables.force.yielding_table import yielding_table
from metro.observables.problem import Refusal

# [T] table 4, N/m² and N/m
TITANIUM = np.array([10145e6, 11036.5e6, 5000e6, 591.92e3, 100.03e3, 214.32e3])
SHARP = TITANIUM * (1, 1, 1, 0, 0, 0)
LAW = EdgeLaw()
FEED, DEPTH, RADIUS = 0.05e-3, 0.2e-3, 6e-3
SLOT = Cut(FEED, DEPTH, Engagement(0.0, math.pi))
MIDDLE = Cut(FEED, DEPTH, Engagement(math.pi / 4, 3 * math.pi / 4))  # one straight tooth of four at a time
KRC = TITANIUM[1]


def tool(helix=0.0, runout=0.0, angles=None):
    return Cutter(RADIUS, helix, angles or evenly_pitched(4), runout, 0.6)


def even(kappa):
    """Stiffness alike in x and y at which a tooth's radial force is kappa times the chip's spring force."""
    return np.eye(2) * KRC * DEPTH / kappa


def turned(kx, ky, angle):
    c, s = math.cos(angle), math.sin(angle)
    turn = np.array([[c, -s], [s, c]])
    return turn.T @ np.diag([kx, ky]) @ turn


def passes(values):
    """Values whenever a tooth is at an immersion of 90 degrees."""
    return values[:: ANGLES // 4]


def test_the_chip_of_each_passing_follows_the_linear_recursion():
    kappa = 0.7
    found = yielding_force(tool(), LAW, MIDDLE, TITANIUM, even(kappa))
    axial = passes(found.force[:, 2])
    chip = (axial / DEPTH - TITANIUM[5]) / TITANIUM[2]
    expected, moved = [], 0.0
    for _ in range(
        len(chip)
    ):  # h = h0 + (q − q'), q = −(K_rc h + K_re) a/k along the tooth, which points along x
        edge = TITANIUM[4] * DEPTH / even(kappa)[0, 0]
        expected.append((FEED - edge - moved) / (1.0 + kappa))
        moved = -kappa * expected[-1] - edge
    np.testing.assert_allclose(chip, expected, rtol=1e-5)


def test_the_entry_transient_settles_by_the_predicted_ratio():
    kappa = 2.0
    found = yielding_force(tool(), LAW, MIDDLE, SHARP, even(kappa))
    rest = passes(found.rigid[:, 2] - found.force[:, 2])[:8]
    _, settling = ratios(tool(), LAW, MIDDLE, SHARP, even(kappa))
    assert settling == pytest.approx(kappa / (1.0 + kappa), rel=1e-6)
    np.testing.assert_allclose(rest[1:] / rest[:-1], settling, rtol=1e-5)


@pytest.mark.parametrize("stiffness", [even(1.5), turned(4e6, 3e7, 0.4)])
def test_equal_teeth_in_steady_cutting_feel_no_deflection(stiffness):
    found = yielding_force(tool(math.radians(40)), LAW, MIDDLE, TITANIUM, stiffness, revolutions=12)
    np.testing.assert_allclose(found.force[-ANGLES:], found.rigid[-ANGLES:], atol=1e-3)
    assert np.abs(found.force - found.rigid)[: ANGLES // 4].max() > 20.0


def test_the_steady_force_has_the_mean_of_the_rigid_model():
    cutter = tool(math.radians(40))
    found = yielding_force(cutter, LAW, SLOT, TITANIUM, np.eye(2) * 2e7, revolutions=10)
    np.testing.assert_allclose(
        found.force[-ANGLES:].mean(axis=0), mean_force(cutter, LAW, SLOT, TITANIUM), atol=0.2
    )


def test_a_stiffer_machine_differs_less_in_proportion():
    differences = []
    for stiffness in (1e9, 1e10, 1e11):
        found = yielding_force(
            tool(math.radians(40), 8e-6), LAW, SLOT, TITANIUM, np.eye(2) * stiffness, revolutions=1
        )
        differences.append(np.abs(found.force - found.rigid).max())
    np.testing.assert_allclose(np.array(differences[:-1]) / differences[1:], 10.0, rtol=0.1)


@pytest.mark.parametrize(("kappa", "converges"), [(0.9, True), (1.1, False)])
def test_the_plain_scheme_diverges_below_the_predicted_stiffness_and_newton_does_not(kappa, converges):
    cut = Cut(FEED, DEPTH, MIDDLE.engagement)
    ratio, _ = ratios(tool(), LAW, cut, SHARP, even(kappa))
    assert ratio == pytest.approx(kappa, rel=1e-6)
    newton = yielding_force(tool(), LAW, cut, SHARP, even(kappa))
    assert newton.iterations <= 2
    if converges:
        plain = yielding_force(tool(), LAW, cut, SHARP, even(kappa), scheme="fixed_point")
        assert plain.iterations > 50
        np.testing.assert_allclose(plain.force, newton.force, atol=1e-3)
        return
    with pytest.raises(NotConvergedError, match=f"after {LIMIT} iterations") as refused:
        yielding_force(tool(), LAW, cut, SHARP, even(kappa), scheme="fixed_point")
    assert refused.value.iterations == LIMIT
    assert refused.value.residual > 1.0


def test_newton_solves_once_while_the_teeth_stay_in_cut():
    found = yielding_force(tool(math.radians(40)), LAW, MIDDLE, TITANIUM, np.eye(2) * 5e7)
    assert found.iterations == 1
    assert found.residual < 1e-4


@pytest.mark.parametrize("seed", range(8))
def test_force_and_deflection_balance_where_teeth_leave_the_cut(seed):
    rng = np.random.default_rng(seed)
    stiffness = turned(*10 ** rng.uniform(5.9, 7.0, 2), rng.uniform(0.0, math.pi))
    cut = Cut(0.02e-3, DEPTH, SLOT.engagement if seed % 2 else engagement("side", "down", 3e-3, RADIUS))
    found = yielding_force(tool(math.radians(40), 8e-6 * (seed % 3)), LAW, cut, TITANIUM, stiffness)
    np.testing.assert_allclose(found.deflection @ stiffness.T, found.force[:, :2], atol=0.01)
    assert 1 < found.iterations < LIMIT


def marched(cutter, cut, coefficients, stiffness, revolutions):
    """Force (n, 3) of straight edges by stepping through every angle: any earlier passing may have cut last.

    At each angle the balance is found by small relaxation steps.
    """
    n = revolutions * ANGLES
    moved, force = np.zeros((n, 2)), np.zeros((n, 3))
    travel = cut.feed_per_tooth * cutter.teeth / (2.0 * math.pi)
    deviation = cutter.radius_deviation(np.array([0.0]))[:, 0]
    compliance = np.linalg.inv(stiffness)
    for i in range(n):
        teeth = []
        for j, angle in enumerate(cutter.tooth_angles):
            phi = 2.0 * math.pi * i / ANGLES + angle
            if not cut.engagement.entry < phi % (2.0 * math.pi) < cut.engagement.exit:
                continue
            u = np.array([math.sin(phi), math.cos(phi)])
            rigid, clear = [], []
            for m in range(1, 4 * cutter.teeth):
                back = float(cutter.pitch(m)[j])
                before = i - round(back * ANGLES / (2.0 * math.pi))
                past = u @ moved[before] if before >= 0 else 0.0
                rigid.append(travel * back * u[0] + deviation[j] - deviation[(j + m) % cutter.teeth])
                clear.append(rigid[-1] - past)
            teeth.append((u, min(clear), min(rigid) > 0.0))
        q = np.zeros(2)
        for _ in range(600):
            total = np.zeros(3)
            for u, clear, rubs in teeth:
                shear = max(0.0, clear + u @ q)
                t, r, a = (coefficients[:3] * shear + coefficients[3:] * rubs) * cut.axial_depth
                total += (-t * u[1] - r * u[0], t * u[0] - r * u[1], a)
            step = 0.25 * (compliance @ total[:2] - q)
            q += step
            if np.abs(step).max() < 1e-13:
                break
        moved[i], force[i] = q, total
    return force


def test_a_march_through_every_angle_gives_the_same_force_of_unequal_teeth_that_leave_the_cut():
    cutter = tool(runout=10e-6, angles=tuple(np.radians([0.0, 80.0, 180.0, 275.0])))
    # between two angles: an edge without helix is in the work or not, never in part
    cut = Cut(0.02e-3, DEPTH, Engagement(math.radians(40.25), math.radians(139.75)))
    stiffness = turned(1.5e6, 6e6, 0.5)
    found = yielding_force(cutter, LAW, cut, TITANIUM, stiffness, revolutions=1)
    expected = marched(cutter, cut, TITANIUM, stiffness, 1)
    np.testing.assert_allclose(found.force, expected, atol=1e-3)
    rubs_only = np.isclose(expected[:, 2], TITANIUM[5] * DEPTH)
    assert 0.05 < rubs_only.mean() < 0.5  # a tooth is in the work, and yields out of its chip


def test_a_pitch_between_two_angles_lies_between_its_neighbours():
    def force(half_steps):
        cutter = tool(angles=(0.0, math.pi + half_steps * math.pi / ANGLES))
        cut = Cut(FEED, DEPTH, Engagement(math.radians(30.0), math.radians(150.0)))
        return yielding_force(cutter, LAW, cut, TITANIUM, turned(4e6, 2e7, 0.5)).force

    below, between, above = force(0), force(1), force(2)
    # in the second revolution, where tooth 0 is at 60 to 140 degrees and alone in the work
    second = slice(ANGLES + 120, ANGLES + 280)
    error = np.abs(between - 0.5 * (below + above))[second].max()
    assert error < 0.02 * np.abs(above - below)[second].max()


def test_a_machine_so_soft_that_the_tool_digs_in_is_refused():
    cut = Cut(0.1e-3, 1e-3, Engagement(0.0, math.acos(0.5)))
    with pytest.raises(NotConvergedError, match="newton: force and deflection differ by"):
        yielding_force(tool(math.radians(40)), LAW, cut, TITANIUM, turned(2e5, 2e7, 1.2))


def batch(operation="slot", pose="1", **manifest):
    runs = pd.DataFrame(
        {
            "run": ["a"],
            "order": [1],
            "operation": operation,
            "direction": "slot",
            "feed_per_tooth_mm": 0.05,
            "axial_depth_mm": 0.2,
            "radial_depth_mm": 12.0,
            "feed_direction_deg": math.nan if operation == "helical" else 90.0,
            "spindle_rpm": 2000.0,
            "pose": pose,
            "dynamometer": "a.csv",
        }
    ).set_index("run")
    names = ("ktc", "krc", "kac", "kte", "kre", "kae")
    values = {
        f"{name}_{'n_mm2' if name.endswith('c') else 'n_mm'}": value / (1e6 if name.endswith("c") else 1e3)
        for name, value in zip(names, TITANIUM, strict=True)
    }
    filled = {
        "tool": {"diameter_mm": 12, "teeth": 4, "helix_deg": 40},
        "coefficients": values,
        "work": {"size_mm": [100, 60, 20]},
        "work_in_base": {"xyz_mm": [-50, -30, -100], "rpy_deg": [0, 0, 0]},
    }
    return Batch("b", filled | manifest, {"cell": "c"}, runs, {})


STATIONS = pd.DataFrame(
    [
        ("1", 0, 0, 0, 2, 40, 9),
        ("2", 0, 0, -200, 3, 60, 12),
        ("3", 100, 0, 0, 2, 30, 9),
        ("4", 0, 100, 0, 2, 40, 7),
    ],
    columns=["position", "x_mm", "y_mm", "z_mm", "kx_n_um", "ky_n_um", "kz_n_um"],
)


def row(of, stations=STATIONS):
    table = yielding_table(of, lambda _: stations, {})
    assert isinstance(table, pd.DataFrame)
    return table.iloc[0]


def test_a_run_at_a_station_has_the_stations_stiffness_turned_into_its_feed_frame():
    found = row(batch())
    assert (found.position, found.method, found.kxx_n_um) == ("1", "as tabulated", 2.0)
    ratio, _ = ratios(tool(math.radians(40)), LAW, SLOT, TITANIUM, np.diag([40e6, 2e6]))
    assert found.fixed_point_ratio == pytest.approx(ratio, rel=1e-9)


def test_a_run_elsewhere_is_at_the_middle_of_its_work():
    found = row(batch(pose=""))
    assert found.position == ""
    assert (found.x_mm, found.y_mm, found.z_mm) == pytest.approx((0.0, 0.0, -100.0))
    assert 2.0 < found.kxx_n_um < 3.0
    assert found.leave_one_out_x_percent > 0.0


def test_a_work_that_is_turned_meets_another_axis_of_the_machine():
    frame = {"xyz_mm": [0, 0, 0], "rpy_deg": [90, 0, 0]}  # work y along base z
    ratio, _ = ratios(tool(math.radians(40)), LAW, SLOT, TITANIUM, np.diag([9e6, 2e6]))
    assert row(batch(work_in_base=frame)).fixed_point_ratio == pytest.approx(ratio, rel=1e-9)


def test_stiffness_across_the_axes_is_that_of_a_machine_seen_from_a_turned_work():
    c, s = math.cos(math.radians(20)), math.sin(math.radians(20))
    seen = (2.0 * c**2 + 40.0 * s**2, 38.0 * s * c, 2.0 * s**2 + 40.0 * c**2)
    across = STATIONS.assign(**dict(zip(("kx_n_um", "kxy_n_um", "ky_n_um"), seen, strict=True)), kz_n_um=9.0)
    upright = STATIONS.assign(kx_n_um=2.0, ky_n_um=40.0, kz_n_um=9.0)
    found = row(batch(), across)
    turned_work = row(batch(work_in_base={"xyz_mm": [0, 0, 0], "rpy_deg": [0, 0, 20]}), upright)
    names = ["plane_xx_n_um", "plane_xy_n_um", "plane_yx_n_um", "plane_yy_n_um"]
    assert list(found[names]) == pytest.approx([seen[0], seen[1], seen[1], seen[2]])
    for quantity in (*names, "fixed_point_ratio", "difference_n", "entry_difference_n"):
        assert found[quantity] == pytest.approx(turned_work[quantity], rel=1e-6)


def test_one_of_a_pair_across_counts_for_both_and_two_of_them_each_for_itself():
    one, both = (
        row(batch(), STATIONS.assign(kxy_n_um=3.0)),
        row(batch(), STATIONS.assign(kxy_n_um=3.0, kyx_n_um=1.0)),
    )
    assert (one.plane_xy_n_um, one.plane_yx_n_um) == pytest.approx((3.0, 3.0))
    assert (both.plane_xy_n_um, both.plane_yx_n_um) == pytest.approx((3.0, 1.0))


def test_the_deflection_is_the_force_over_the_whole_matrix():
    stiffness = np.array([[2e7, -5e6], [3e6, 4e7]])
    found = yielding_force(tool(math.radians(40)), LAW, SLOT, TITANIUM, stiffness)
    np.testing.assert_allclose(found.deflection @ stiffness.T, found.force[:, :2], atol=0.01)


def test_a_helical_run_counts_with_the_worst_of_its_directions():
    straight = row(batch())
    helical = row(batch("helical"))
    assert helical.difference_n >= straight.difference_n - 1e-9


def test_a_soft_machine_makes_the_plain_scheme_diverge_and_the_table_says_so():
    soft = STATIONS.assign(kx_n_um=0.5, ky_n_um=0.5)
    found = row(batch(), soft)
    assert found.fixed_point_ratio > 1.0
    assert found.iterations_fixed_point == "diverges"
    assert found.iterations_newton < 20
    assert int(row(batch(), STATIONS.assign(kx_n_um=50.0)).iterations_fixed_point) < 10


def test_a_run_far_beyond_the_stations_is_refused_with_its_place():
    frame = {"xyz_mm": [2000, 0, 0], "rpy_deg": [0, 0, 0]}
    found = row(batch(pose="", work_in_base=frame))
    assert "(2050, 30, 0) mm lies" in found.refused


def test_a_cell_without_stations_or_a_batch_without_coefficients_is_refused():
    none = yielding_table(batch(), lambda _: STATIONS.iloc[:0], {})
    assert isinstance(none, Refusal)
    assert "stations" in none.reason
    unknown = yielding_table(batch(coefficients={}), lambda _: STATIONS, {})
    assert isinstance(unknown, Refusal)
    assert "ktc" in unknown.reason
