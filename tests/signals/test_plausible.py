"""Units by range and extent: what was measured passes, a factor of a wrong unit does not."""

import numpy as np
import pytest

from metro.signals import plausible

TIME = np.arange(1000) / 5000.0
FORCE = np.outer(np.sin(np.linspace(0.0, 20.0, 500)), [300.0, 500.0, 100.0])
PEAK = float(np.linalg.norm(FORCE, axis=1).max())
JOINTS = [f"q{i}" for i in range(1, 7)]
SIZE = np.array([200.0, 100.0, 30.0])
PATH = np.column_stack([np.linspace(-10.0, 210.0, 50), np.full(50, 40.0), np.zeros(50)])


@pytest.mark.parametrize(
    ("factor", "unit"), [(1e3, "milliseconds"), (1e6, "microseconds"), (1 / 60, "minutes"), (5000.0, "count")]
)
def test_stamps_in_another_unit_are_told_from_the_declared_rate(factor, unit):
    assert unit in plausible.clock(factor * TIME, 5000.0)


def test_a_rate_that_is_not_quite_the_declared_one_or_not_declared_is_no_unit():
    assert (
        plausible.clock(TIME, 4000.0) == plausible.clock(TIME, 45000.0) == plausible.clock(TIME, None) == ""
    )


@pytest.mark.parametrize(("factor", "unit"), [(1.0, ""), (1e-3, "in kN"), (1e3, "in mN")])
@pytest.mark.parametrize("known", [None, 700.0])
def test_a_force_over_the_chips_section_tells_its_unit(factor, unit, known):
    """A peak of 592 N over 0.2 mm2: 2960 N/mm2, of aluminium with its edge force."""
    told = plausible.cutting_force(factor * PEAK, 0.2, known)
    assert bool(told) == bool(unit)
    assert unit in told


def test_a_soft_work_is_not_taken_for_kilonewtons_where_its_coefficient_is_declared():
    soft = 0.004 * PEAK  # 12 N/mm2
    assert "declare coefficients.ktc_n_mm2" in plausible.cutting_force(soft, 0.2, None)
    assert plausible.cutting_force(soft, 0.2, 30.0) == ""
    assert plausible.cutting_force(soft, np.nan, None) == plausible.cutting_force(0.0, 0.2, None) == ""


def test_angles_in_radians_and_jumps_of_a_counter_are_told_with_their_row():
    way = np.linspace(-170.0, 120.0, 100)[:, None] * [1.0, 0.2]
    assert plausible.angles(JOINTS[:2], way) == ""
    assert "radians" in plausible.angles(JOINTS[:2], np.radians(way))
    wrapped = way.copy()
    wrapped[50:, 0] -= 360.0
    told = plausible.angles(JOINTS[:2], wrapped)
    assert "row 51 of the log, column q1" in told  # the first sample after the jump, counted from one
    assert "the encoder wraps" in told
    wrapped[50:, 0] += 100.0
    assert "lost its place" in plausible.angles(JOINTS[:2], wrapped)


def test_a_joint_that_is_not_where_it_was_told_to_be_is_named():
    rows = np.tile(np.arange(6.0), (20, 1))
    assert plausible.following(rows, rows + 4.0) == ""
    glitch = 40.0 * (np.arange(20) == 3)[:, None]
    assert plausible.following(rows, rows + glitch) == ""
    off = rows - 30.0 * np.eye(6)[3]
    assert "column q4_deg: is 30°" in plausible.following(rows, off)


def test_an_idle_run_of_another_path_is_told():
    cut = np.linspace(0.0, 1.0, 30)[:, None] * np.arange(6.0)
    assert plausible.same_place(cut, cut[::3] + 3.0) == ""
    assert "column q6_set_deg" in plausible.same_place(cut, cut + 30.0 * np.eye(6)[5])
    assert "column q6_set_deg" in plausible.same_place(cut, cut - 30.0 * np.eye(6)[5])


@pytest.mark.parametrize(
    ("along", "up", "words"),
    [
        (1.0, 1.0, ""),
        (1e-3, 1.0, "seems to be in metres"),
        (1e3, 1.0, "seems to be in micrometres"),
        (1.0, 1e-3, "heights seem to be in metres"),
        (1.0, 1e3, "heights seem to be in micrometres"),
    ],
)
def test_a_trace_tells_its_units_by_length_and_height(along, up, words):
    x = np.linspace(0.0, 100.0, 200)
    told = plausible.trace(along * x, up * 0.05 * np.sin(x), 120.0)
    assert bool(told) == bool(words)
    assert words in told
    assert plausible.trace(1e-3 * x, np.sin(x), None) == ""  # nothing to compare its length with


def test_a_path_tells_its_unit_and_whether_it_passes_the_work():
    assert plausible.tip_path(PATH, SIZE) == ""
    assert "in metres" in plausible.tip_path(1e-3 * PATH, SIZE)
    assert "in micrometres" in plausible.tip_path(1e3 * PATH, SIZE)
    assert "one place" in plausible.tip_path(0 * PATH, SIZE)
    for axis, name in enumerate(("x_mm", "y_mm")):
        for far in (-1000.0, 1000.0):
            assert f"column {name}: found" in plausible.tip_path(PATH + far * np.eye(3)[axis], SIZE)


def test_a_hit_in_kilonewtons_is_told_from_a_record_without_one():
    hit = np.exp(-(((np.arange(2000) - 500) / 10.0) ** 2)) + 1e-4 * np.random.default_rng(1).normal(size=2000)
    assert plausible.hammer_force(200.0 * hit) == ""
    assert "in kN" in plausible.hammer_force(0.2 * hit)
    assert plausible.hammer_force(0.01 * np.random.default_rng(2).normal(size=2000)) == ""


def test_a_receptance_in_another_unit_and_a_band_in_kilohertz_are_told():
    frequency = np.linspace(10.0, 3000.0, 400)
    receptance = 1 / (1e6 * (1 - (frequency / 800.0) ** 2 + 0.06j * frequency / 800.0))
    assert plausible.frf(frequency, receptance) == ""
    assert "in kHz" in plausible.frf(1e-3 * frequency, receptance)
    assert "µm/N" in plausible.frf(frequency, 1e3 * receptance)


@pytest.mark.parametrize("stiffness_n_mm", [0.1, 2.0, 40.0])
def test_a_soft_structure_is_not_taken_for_another_unit(stiffness_n_mm):
    """A mass of 2.5 kg on so soft a spring; the same numbers as of a hard one in mm/N, but for the mass."""
    frequency, stiffness = np.linspace(1.0, 100.0, 400), 1e3 * stiffness_n_mm
    natural = np.sqrt(stiffness / 2.5) / (2.0 * np.pi)
    receptance = 1 / (stiffness * (1 - (frequency / natural) ** 2 + 0.06j * frequency / natural))
    assert plausible.frf(frequency, receptance) == ""
    assert "µm/N" in plausible.frf(frequency, 1e6 * receptance)
    assert plausible.softness(frequency, receptance)[1] == pytest.approx(2.5, rel=0.2)
