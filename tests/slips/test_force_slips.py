"""A force record whose bookkeeping is wrong is found, with the line to write; one that is right is not."""

import re
from dataclasses import replace

import numpy as np
import pytest
from slip_cuts import BETA, CUTTER, SENSOR, records, setting, with_settings

from metro.cutting.cutter import evenly_pitched
from metro.slips.force import contradictions
from metro.slips.orientation import axes_text, signed_permutations
from metro.slips.physical import coefficients_text, impossible, mean_chip
from metro.slips.waveform import Coefficients, Record, design, fit

EVERY = list(signed_permutations())
OTHERS = [matrix for matrix in EVERY if not np.array_equal(matrix, np.eye(3))]
UPSIDE_DOWN = np.diag([1.0, 1.0, -1.0])
FEW = OTHERS[::9]


def said(given, cutter=CUTTER, sensor=SENSOR):
    slips = contradictions(given, cutter, sensor)
    return slips[0].text if slips else ""


def found_orientation(matrix):
    """What is said of records that were read with axes turned by a signed permutation."""
    return said([record.mapped(matrix) for record in records()])


def true_axes(matrix):
    """The line that undoes it: right-handed, with reads exchanged where it is not."""
    back = matrix.T
    right = np.linalg.det(back) > 0
    axes = axes_text(back if right else -back)
    if np.array_equal(matrix, UPSIDE_DOWN):
        return f"then write reads: tool, axes: {axes}"
    if right:
        return f"Likely: axes: {axes}"
    return "Likely: reads: tool" + ("" if np.array_equal(back, -np.eye(3)) else f", axes: {axes}")


def test_records_with_the_right_bookkeeping_contradict_nothing():
    for seed in range(2):
        assert said(records(seed=seed, noise=2.0)) == ""


@pytest.mark.parametrize("matrix", FEW, ids=axes_text)
def test_a_wrong_orientation_is_found_with_the_line_to_write(matrix):
    assert true_axes(matrix) in found_orientation(matrix)


@pytest.mark.slow
@pytest.mark.parametrize("matrix", OTHERS, ids=axes_text)
def test_each_of_the_wrong_orientations_is_found(matrix):
    assert true_axes(matrix) in found_orientation(matrix)


def test_an_axial_force_that_points_the_other_way_alone_is_to_be_checked_and_spoils_nothing():
    """Tables of coefficients do not agree on it: a right-hand helix pulls the tool out of its holder."""
    (doubt,) = contradictions([record.mapped(UPSIDE_DOWN) for record in records()], CUTTER, SENSOR)
    assert doubt.observables == ()
    assert "push the dynamometer by hand along its axis" in doubt.text
    (sure,) = contradictions([record.mapped(-UPSIDE_DOWN) for record in records()], CUTTER, SENSOR)
    assert "force" in sure.observables


def test_the_declared_axes_and_rotation_are_where_the_proposal_starts():
    sensor = SENSOR | {"axes": {"x": "-y", "y": "-x", "z": "-z"}, "rotation_deg": 90.0}
    half_turn = np.diag([-1.0, -1.0, 1.0])
    text = said([record.mapped(half_turn) for record in records()], sensor=sensor)
    assert "Likely: axes: {x: y, y: x, z: -z}" in text


def test_the_coefficients_that_the_proposal_gives_are_those_of_the_cut():
    text = found_orientation(np.diag([-1.0, -1.0, 1.0]))
    ktc = float(text.split("with K_tc ")[1].split(",")[0])
    assert ktc == pytest.approx(BETA[0] / 1e6, rel=0.03)
    assert "K_tc h + K_te is -" in text


@pytest.mark.parametrize(("declared", "teeth"), [(6, 3), (2, 3)])
def test_a_wrong_number_of_teeth_is_found(declared, teeth):
    cutter = replace(CUTTER, tooth_angles=evenly_pitched(declared))
    assert f"teeth: {teeth} (or every spindle_rpm" in said(records(), cutter=cutter)


def test_the_range_of_one_channel_in_the_plane_is_found():
    text = said([record.mapped(np.diag([1.0, 10.0, 1.0])) for record in records()])
    assert "the values of fy times 0.1" in text


def test_an_axial_force_that_the_helix_cannot_give_is_impossible():
    text = said([record.mapped(np.diag([1.0, 1.0, 10.0])) for record in records()])
    assert "K_ac h + K_ae" in text
    assert "exceeds" in text


def test_two_rows_of_the_run_table_that_are_exchanged_are_named():
    text = said(with_settings(records(), (0, 5, 2, 3, 4, 1)))
    assert "r2 with the row of r6" in text
    assert "r6 with the row of r2" in text


def test_up_and_down_exchanged_is_found_and_so_is_one_run_alone():
    assert "exchange up and down in the column direction" in said(
        with_settings(records(), (0, 1, 4, 5, 2, 3))
    )
    assert "the other direction (up or down) in the row of r4" in said(
        with_settings(records(), (0, 1, 2, 5, 4, 5))
    )


def test_runout_that_hides_half_of_the_teeth_is_no_slip():
    worn = replace(CUTTER, runout_radius=15e-6, runout_angle=0.4)
    assert said(records(cutter=worn)) == ""


def test_coefficients_are_impossible_beyond_their_error_alone():
    given = records()
    designs = [design(CUTTER, record.setting) for record in given]
    chip = mean_chip(given)
    slightly = records(beta=BETA * np.array([1.0, 1.0, -1e-3, 1.0, 1.0, -1e-3]), noise=20.0)
    for made, expected in ((given, False), (slightly, False), (records(beta=-BETA), True)):
        assert bool(impossible(fit(made, designs), chip, CUTTER.helix)) is expected


def test_coefficients_that_one_feed_cannot_part_are_given_as_what_they_sum_to():
    chip = 0.06e-3
    unparted = BETA.copy()
    unparted[1], unparted[4] = -100e6, BETA[4] + chip * (BETA[1] + 100e6)  # the same force at this chip
    said = coefficients_text(Coefficients(unparted, np.tile(unparted, (3, 1))), chip)
    assert "-100" not in said
    assert f"K_rc h + K_re {chip * BETA[1] / 1e3 + BETA[4] / 1e3:.3g}" in said
    parted = coefficients_text(Coefficients(BETA, np.tile(BETA, (3, 1))), chip)
    assert parted == "K_tc 850.0, K_rc 320.0, K_ac 180.0 N/mm2"


def depth_sweep(cutter, beta):
    """Slots at five depths, their starts at any phase, with a little noise."""
    rng, made = np.random.default_rng(4), []
    for i, depth in enumerate((1e-3, 2e-3, 3e-3, 4e-3, 5e-3)):
        cut = setting("slot", "slot", 0.1)
        cut = replace(cut, cut=replace(cut.cut, axial_depth=depth))
        basis = design(cutter, cut).basis @ beta
        turned = basis * np.exp(1j * rng.uniform(0.0, 2.0 * np.pi) * np.arange(len(basis)))[:, None]
        turned = turned + 0.5 * (rng.normal(size=basis.shape) + 1j * rng.normal(size=basis.shape))
        turned[0] = turned[0].real
        made.append(Record(f"r{i + 1}", cut, turned))
    return made


# Along the meridian of a ball the chip may slide towards the tip: of its axial force nothing is asked.
SLIDING = np.array([850e6, 320e6, -180e6, 15e3, 18e3, -4e3])
BALL = replace(CUTTER, corner=CUTTER.radius)


def test_an_end_that_nobody_declared_is_no_slip_of_the_axes():
    """A ball is pressed upwards by more than the little helix of a flat end can do."""
    flat = replace(CUTTER, helix=np.radians(8.0))
    ball = replace(flat, corner=flat.radius)
    given = depth_sweep(ball, np.array([850e6, 500e6, 50e6, 15e3, 18e3, 2e3]))
    assert contradictions(given, flat, SENSOR)
    assert not contradictions(given, flat, SENSOR, (ball,))


@pytest.mark.parametrize("matrix", FEW[:3], ids=axes_text)
def test_wrong_axes_of_a_ball_end_that_nobody_declared_are_found_with_the_end(matrix):
    given = [record.mapped(matrix) for record in depth_sweep(BALL, SLIDING)]
    (slip,) = contradictions(given, CUTTER, SENSOR, (BALL,))
    assert true_axes(matrix).removeprefix("Likely: ").removeprefix("then write ") in slip.text
    assert "with a ball end of the tool" in slip.text


@pytest.mark.parametrize(
    ("factor", "least", "way"),
    [(1e7, 850 * 1e7 / 1e5, "large"), (1e3, 850 * 1e3 / 1e5, "large"), (1e-3, 20 / 0.85, "small")],
)
def test_a_wrong_unit_of_all_channels_is_no_slip_of_the_axes(factor, least, way):
    """K_tc of 850 N/mm² is between 20 and 1e5, which are the least and the largest of any material."""
    (slip,) = contradictions([one.mapped(factor * np.eye(3)) for one in records()], CUTTER, SENSOR)
    assert slip.column == "instruments.dynamometer"
    told = re.search(r"at least (\S+) times too (large|small)", slip.remedy)
    assert float(told[1]) == pytest.approx(least, rel=0.05)
    assert told[2] == way
    assert "Check the unit of the force columns" in slip.remedy
    assert "axes" not in slip.remedy


QUARTER = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # with K_tc > 0 and K_rc < 0


@pytest.mark.parametrize("matrix", [*FEW[1:], QUARTER], ids=axes_text)  # FEW[0] turns z, which no wave shows
def test_the_unit_is_not_blamed_alone_where_the_axes_are_exchanged_too(matrix):
    assert "Check the unit of the force columns" not in said([one.mapped(1e5 * matrix) for one in records()])


def test_nor_where_rows_are_exchanged_or_where_the_records_are_noise():
    rows = with_settings([one.mapped(1e5 * np.eye(3)) for one in records()], [0, 1, 4, 3, 2, 5])
    assert "Check the unit of the force columns" not in said(rows)
    noise = [one.mapped(1e5 * np.eye(3)) for one in records(noise=20.0, seed=2)]
    assert "Check the unit of the force columns" not in said(noise)
