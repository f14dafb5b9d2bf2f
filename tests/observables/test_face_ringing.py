"""A face left by a tip that rings, against a sweep of the cutter step by step and a disc over the result."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.signal import lsim

from metro.batch.batch import Batch
from metro.observables.cut import conditions as cutting_force
from metro.observables.flatness.beside import AT_ONCE_SD, REACH_SD, SIGN_SD, Beside
from metro.observables.flatness.doubt import damping_doubt
from metro.observables.flatness.dynamics import ArmMode, TipDynamics
from metro.observables.flatness.face_setting import FaceSetting
from metro.observables.flatness.model import FlatnessModel
from metro.observables.flatness.path import Pace, force_over_period, make_path, passages
from metro.observables.flatness.pose_field import PoseField
from metro.observables.flatness.ringing import Ringing, make_ringing
from metro.observables.flatness.rung import LOSSIER, lossier
from metro.observables.problem import Block
from metro.structure import Structure
from metro.surface.tip_damping import Rayleigh, SharedRatio
from metro.surface.tip_field import field_in
from metro.surface.tip_stiffness import basis_over
from metro.units import MM, UM

MASS = np.array([[654.58, 0.0, 382.51], [0.0, 903.38, 0.0], [382.51, 0.0, 269.57]])
STIFFNESS = np.diag([3.32e5, 7.15e5, 8.77e5])
A0, A1 = 0.9228, 0.00209
SIZE, RADIUS, DISC = (80.0, 30.0), 8 * MM, 1.5 * MM
COEFFICIENTS = {"ktc": 905.0, "krc": 402.0, "kac": 468.0, "kte": 16.4, "kre": 19.9, "kae": 21.7}


def softer(x: np.ndarray) -> np.ndarray:
    """Compliance of the arm along x (m), as a factor."""
    return 1 + 4 * np.asarray(x)


def make_batch(rpm: float = 12000.0) -> Batch:
    manifest = {
        "format": 1,
        "tool": {"diameter_mm": 16, "teeth": 4, "helix_deg": 30},
        "work": {"size_mm": [*SIZE, 10.0]},
    }
    row = {"run": "r1", "operation": "face", "direction": "down", "spindle_rpm": rpm, "axial_depth_mm": 2.0}
    row |= {"radial_depth_mm": 10.0, "feed_per_tooth_mm": 0.05, "feed_direction_deg": 0.0}
    return Batch("plate", manifest, {"cell": "c"}, pd.DataFrame([row]).set_index("run"), {})


def path() -> pd.DataFrame:
    s, lanes = np.arange(-12.0, SIZE[0] + 12.1, 2.0), np.array([22.0, 12.0, 2.0])
    number = np.repeat([1, 2, 3], len(s))
    return pd.DataFrame({"pass": number, "x_mm": np.tile(s, 3), "y_mm": np.repeat(lanes, len(s))})


def dynamics() -> TipDynamics:
    x, y = (c.ravel() for c in np.meshgrid([0.0, 0.08], [0.0, 0.03]))
    soft = np.linalg.inv(STIFFNESS) * softer(x)[:, None, None]
    basis = basis_over(x, y, 3)
    mass = field_in(basis_over(x, y, 1), x, y, np.tile(MASS, (4, 1, 1)))
    known = Rayleigh(np.array([A0, A1]), np.diag([1e-4, 1e-9]), float("nan"))
    return TipDynamics(mass, field_in(basis, x, y, soft), known)


def ringing(batch: Batch, known: TipDynamics) -> tuple[Ringing, np.ndarray]:
    full = cutting_force.mean_force_on_tool(batch, "r1", COEFFICIENTS)
    found = make_ringing(batch, "r1", make_path(path()), known, COEFFICIENTS, full=full, disc=1.5e-3)
    assert isinstance(found, Ringing)
    return found, full


def stepped(batch: Batch) -> tuple[np.ndarray, np.ndarray]:
    """Time and height of the tip through all three passes: Runge-Kutta steps of 2 ms on the smooth arm."""
    tool = cutting_force.cutter(batch)
    force, period, speed = force_over_period(batch, "r1", COEFFICIENTS, make_path(path()), tool)
    step, way = 2e-3, 0.104
    half = np.arange(2 * round(3 * period / step) + 1) * step / 2
    into = half % period
    back = np.clip((into - way / speed) / (period - way / speed), 0, 1)
    place = np.minimum(speed * into, way) * (1 - back) - 0.012
    push = np.stack(
        [np.interp(into / period * len(force), np.arange(len(force)), f) for f in force.T], axis=1
    )
    inverse = np.linalg.inv(MASS)
    steady, pushed = np.zeros((6, 6)), np.zeros((len(half), 6))
    steady[:3, 3:], steady[3:, 3:] = np.eye(3), -A0 * np.eye(3)
    springs = np.zeros((6, 6))
    springs[3:] = -inverse @ np.hstack([STIFFNESS, A1 * STIFFNESS])
    turn = steady + springs / softer(place)[:, None, None]
    pushed[:, 3:] = push @ inverse.T
    state, heights = np.zeros(6), []
    for i in range(0, len(half) - 2, 2):
        heights.append(state[2])
        one = turn[i] @ state + pushed[i]
        two = turn[i + 1] @ (state + step / 2 * one) + pushed[i + 1]
        three = turn[i + 1] @ (state + step / 2 * two) + pushed[i + 1]
        four = turn[i + 2] @ (state + step * three) + pushed[i + 2]
        state = state + step / 6 * (one + 2 * two + 2 * three + four)
    return half[:-2:2], np.array(heights)


@pytest.fixture(scope="module")
def swept() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A map (x, y, z) of the face: the rim of the cutter goes over it, and what is lowest stays."""
    batch = make_batch()
    time, heights = stepped(batch)
    _, period, speed = force_over_period(
        batch, "r1", COEFFICIENTS, make_path(path()), cutting_force.cutter(batch)
    )
    x, y = np.arange(0.25, SIZE[0], 0.5) * MM, np.arange(0.25, SIZE[1], 0.5) * MM
    z = np.full((len(x), len(y)), np.inf)
    for number, lane in enumerate(np.array([22.0, 12.0, 2.0]) * MM):
        for axis in np.arange(-12.0, SIZE[0] + 12.0, 0.05) * MM:  # of the cutter, along the pass
            at = np.interp(number * period + (axis + 12 * MM) / speed, time, heights)
            reach = np.sqrt(np.maximum(RADIUS**2 - (y - lane) ** 2, 0))
            for side in (1, -1):
                rim = axis + side * reach
                near = np.clip(np.round((rim - x[0]) / (0.5 * MM)).astype(int), 0, len(x) - 1)
                over = np.flatnonzero((np.abs(y - lane) < RADIUS) & (np.abs(rim - x[near]) < 0.026 * MM))
                z[near[over], over] = np.minimum(z[near[over], over], at)
    return x, y, z


def test_the_face_is_that_of_a_cutter_swept_over_it_step_by_step_under_the_disc(swept: tuple) -> None:
    batch, known = make_batch(), dynamics()
    rung, full = ringing(batch, known)
    x, y, z = swept
    at_x, at_y = (
        c.ravel() for c in np.meshgrid(np.arange(12.0, 69.0, 2.0) * MM, np.array([2.0, 12.0, 22.0]) * MM)
    )
    seen = passages(make_path(path()), at_x, at_y, RADIUS)
    soft = known.compliance(seen.x.ravel(), seen.y.ravel()) @ full
    cuts = soft[:, 2].reshape(seen.x.shape) + rung.heights(Structure(), seen)
    found = np.where(seen.valid, cuts, np.inf).min(axis=1)
    grid_x, grid_y = np.meshgrid(x, y, indexing="ij")
    truth = np.array(
        [z[np.hypot(grid_x - a, grid_y - b) <= DISC].mean() for a, b in zip(at_x, at_y, strict=True)]
    )
    assert np.ptp(truth) > 20 * UM
    # the sweep's grid is 0.5 mm: on the steep flank at the exit, 33 µm a mm, its discs are a little off
    apart = np.abs(found - truth)
    assert np.sqrt(np.mean(apart**2)) < 0.01 * np.ptp(truth)
    assert apart.max() < 0.025 * np.ptp(truth)
    static = np.where(seen.valid, soft[:, 2].reshape(seen.x.shape), np.inf).min(axis=1)
    assert np.median(np.abs(static - truth)) > 5 * np.median(apart)


def test_a_softer_arm_in_the_cut_rings_slower_and_farther() -> None:
    rung, _ = ringing(make_batch(), dynamics())
    seen = passages(make_path(path()), np.arange(0.02, 0.06, 1e-3), np.full(40, 0.022), RADIUS)
    stiff, soft = (rung.heights(Structure(f), seen)[:, 0] for f in (1.0, 0.5))
    assert np.ptp(soft) > 1.3 * np.ptp(stiff)


def test_teeth_count_only_where_they_are_slower_than_ten_times_the_highest_mode() -> None:
    seen = passages(make_path(path()), np.array([0.03, 0.04]), np.array([0.02, 0.014]), RADIUS)
    fast, slow = (ringing(make_batch(rpm), dynamics())[0] for rpm in (12000.0, 1500.0))
    assert fast.teeth is None
    assert slow.teeth is not None
    apart = slow.heights(Structure(), seen) - replace(slow, teeth=None).heights(Structure(), seen)
    assert 0.1 * UM < np.abs(apart).max() < 20 * UM


def test_without_a_size_of_the_work_or_a_mass_nothing_is_said_to_ring() -> None:
    batch = make_batch()
    assert (
        make_ringing(batch, "r1", make_path(path()), None, COEFFICIENTS, full=np.zeros(3), disc=1.5e-3)
        is None
    )
    batch.manifest.pop("work")
    assert (
        make_ringing(batch, "r1", make_path(path()), dynamics(), COEFFICIENTS, full=np.zeros(3), disc=1.5e-3)
        is None
    )


def face_of(rung: Ringing, full: np.ndarray) -> tuple[FaceSetting, PoseField]:
    """Return discs in two passes under a force of 1 N along z, and the arm's compliance."""
    at_x, at_y = (
        c.ravel() for c in np.meshgrid(np.arange(12.0, 69.0, 4.0) * MM, np.array([12.0, 22.0]) * MM)
    )
    x, y = (np.repeat(c, 4) for c in (at_x, at_y))  # four places in each disc, here all in its middle
    basis = basis_over(np.array([0.0, 0.08, 0.0, 0.08]), np.array([0.0, 0.0, 0.03, 0.03]), 3)
    soft = np.linalg.inv(STIFFNESS)[2] @ full
    setting = FaceSetting(
        pose="A",
        x=x,
        y=y,
        disc=1.5e-3,
        first=np.arange(len(at_x)),
        passages=passages(make_path(path()), x, y, RADIUS),
        pace=Pace(0.04, 10.0, np.zeros(3), np.ones(3), 0.01),
        size=(0.08, 0.03),
        force=np.array([0.0, 0.0, 1.0]),
        loaded=np.concatenate([np.zeros(6), soft * np.array([1.16, 0.16, 0.0])]),
        ringing=rung,
    )
    return setting, PoseField("A", basis, (True, True, True))


def test_a_damping_that_nothing_tells_is_in_doubt_by_as_much_as_faces_of_arms_differ() -> None:
    rung, full = ringing(make_batch(), replace(dynamics(), damping=None))
    setting, field = face_of(rung, full)
    columns = damping_doubt(field, setting)
    assert columns is not None
    share, _ = FlatnessModel((field,)).finished(setting, np.zeros(1))
    rng = np.random.default_rng(3)

    def height(ratio: float) -> np.ndarray:
        moved = replace(rung, damping=SharedRatio(ratio)).heights(Structure(), setting.middle)
        return setting.mean((share * moved).sum(axis=1))

    drawn = [height(0.05 * 2.0 ** rng.standard_normal()) - height(0.05) for _ in range(300)]
    expected = np.sqrt(np.mean(np.square(drawn), axis=0))
    found = np.sqrt((columns**2).sum(axis=1))
    assert expected.max() > 0.5 * UM
    assert np.linalg.norm(found - expected) < 0.15 * np.linalg.norm(expected)


def test_a_mode_beside_those_of_the_tip_takes_its_compliance_from_the_slower_ones() -> None:
    """A force that is held: then both compliances give the same, at once the stiffer mode gives more."""
    rung, _ = ringing(make_batch(), dynamics())
    mode = ArmMode(2.0 * np.pi * 9.0, 0.03, (1e-4, 3e-4, 2e-4))
    swing = rung.swung(mode)
    step, force = rung.step, np.vstack([rung.force[:, :-1].reshape(-1, 3), rung.force[-1, -1:]])
    time, lowest = step * np.arange(len(force)), float(rung.modes.frequency[:, 0].mean())
    ratio = float(rung.damping.ratio(np.array(lowest)))
    for axis, reach in enumerate(mode.reach):
        apart = np.zeros(len(force))
        for sign, (frequency, damping) in ((1, (mode.frequency, mode.ratio)), (-1, (lowest, ratio))):
            system = ([frequency**2], [1.0, 2.0 * damping * frequency, frequency**2])
            apart += sign * lsim(system, force[:, axis], time)[1]
        truth = 2e-4 * reach * np.convolve(apart[:-1], rung.weights, mode="same")
        np.testing.assert_allclose(swing[axis].ravel(), truth, atol=5e-3 * np.abs(truth).max())


def test_design_and_prediction_of_a_face_agree_on_what_other_modes_give() -> None:
    known = replace(dynamics(), beside=(ArmMode(2.0 * np.pi * 9.0, 0.03, (0.0, 3e-4, 2e-4)),))
    rung, full = ringing(make_batch(), known)
    setting, field = face_of(rung, full)
    model = FlatnessModel((field,), ringing=("A",), beside=(Beside("A", known.beside),))
    names = [one.name for one in model.parameters]
    beta = np.zeros(len(names))
    beta[[names.index(f"swing_1_{axis}_A") for axis in "yz"]] = -0.7, 1.1
    count, none = len(setting.first), np.zeros(0)
    zeros, axis = np.zeros((count, 0)), np.full(count, "z")
    block = Block("r1", "c", "identify", 0, np.zeros(count), np.ones(count), setting, axis, zeros, none, {})
    matrix, offset = model.design(block, np.zeros(1), beta)
    predicted = model.predictions(block, np.zeros((1, 1)), beta)[0]
    np.testing.assert_allclose(predicted, offset + matrix @ beta, atol=1e-12)
    still = model.predictions(block, np.zeros((1, 1)), np.zeros(len(names)))[0]
    assert np.abs(predicted - still).max() > 0.5 * UM
    elsewhere = replace(model, beside=(Beside("B", known.beside),))
    np.testing.assert_allclose(elsewhere.predictions(block, np.zeros((1, 1)), beta)[0], still, atol=1e-12)


def test_a_face_changes_smoothly_with_the_frequencies_of_the_tip() -> None:
    """A step in it, however small, ends a descent where derivatives promise more."""
    rung, full = ringing(make_batch(), dynamics())
    setting, field = face_of(rung, full)
    model = FlatnessModel((field,), ringing=("A",))
    names = [one.name for one in model.parameters]
    count, none, place = len(setting.first), np.zeros(0), names.index("ringing_off_A")
    zeros, axis = np.zeros((count, 0)), np.full(count, "z")
    block = Block("r1", "c", "identify", 0, np.zeros(count), np.ones(count), setting, axis, zeros, none, {})

    def height(off: float) -> np.ndarray:
        beta = np.zeros(len(names))
        beta[place] = off
        matrix, offset = model.design(block, np.zeros(1), beta)
        predicted = model.predictions(block, np.zeros((1, 1)), beta)[0]
        np.testing.assert_allclose(predicted, offset + matrix @ beta, atol=1e-12)
        return predicted

    offs = np.linspace(-0.02, 0.02, 401)
    change = np.diff([height(off) for off in offs], axis=0)
    assert np.abs(change).max() > 1e-3 * UM  # it does change
    # A jump would differ from its neighbours by all of itself, however small the steps.
    assert np.abs(np.diff(change, axis=0)).max() < 0.2 * np.abs(change).max()


def test_what_follows_a_force_at_once_is_taken_from_what_swings_slowly() -> None:
    rung, _ = ringing(make_batch(), dynamics())
    swing = rung.swung(ArmMode(np.inf, 0.0, (1e-4, 3e-4, 2e-4)))
    step, force = rung.step, np.vstack([rung.force[:, :-1].reshape(-1, 3), rung.force[-1, -1:]])
    time, lowest = step * np.arange(len(force)), float(rung.modes.frequency[:, 0].mean())
    ratio = float(rung.damping.ratio(np.array(lowest)))
    system = ([lowest**2], [1.0, 2.0 * ratio * lowest, lowest**2])
    for axis, reach in enumerate((1e-4, 3e-4, 2e-4)):
        apart = force[:, axis] - lsim(system, force[:, axis], time)[1]
        truth = 2e-4 * reach * np.convolve(apart[:-1], rung.weights, mode="same")
        np.testing.assert_allclose(swing[axis].ravel(), truth, atol=5e-3 * np.abs(truth).max())


def test_a_tip_without_blows_may_follow_in_part_at_once_and_one_with_blows_only_as_these_say() -> None:
    said = Beside("A", (ArmMode(np.inf, 0.0, (2e-4, 2e-4, 2e-4)),)).believed
    assert [(one.name, value, sd) for one, value, sd in said] == [
        (f"at_once_{axis}_A", 0.0, AT_ONCE_SD) for axis in "xyz"
    ]
    said = Beside("A", (ArmMode(50.0, 0.03, (2e-4, 0.0, 2e-4)),)).believed
    assert [(one.name, value, sd) for one, value, sd in said] == [
        ("swing_1_x_A", 0.0, SIGN_SD),
        ("swing_1_z_A", 1.0, REACH_SD),
    ]


def test_a_tip_loses_more_by_what_a_higher_damping_ratio_makes_of_its_ringing() -> None:
    rung, full = ringing(make_batch(), replace(dynamics(), damping=None))
    setting, _ = face_of(rung, full)
    for tuning in (1.0, 1.07):
        tuned = rung.tuned(tuning)
        known, more = (replace(tuned, damping=SharedRatio(ratio)) for ratio in (0.05, 0.05 + LOSSIER))
        truth = (more.at(more.moved(), setting.middle) - known.at(known.moved(), setting.middle)) / LOSSIER
        found = lossier(setting, tuning)
        assert np.abs(truth).max() > 10 * UM
        np.testing.assert_allclose(found, truth, atol=2e-3 * np.abs(truth).max())


def test_a_face_does_not_jump_where_another_passage_becomes_the_lowest() -> None:
    """What decides are the heights by the parameters at hand, however far from those of the load tests."""
    rung, full = ringing(make_batch(), dynamics())
    setting, field = face_of(rung, full)
    model = FlatnessModel((field,), ringing=("A",))
    names = [one.name for one in model.parameters]
    count, none = len(setting.first), np.zeros(0)
    zeros, axis = np.zeros((count, 0)), np.full(count, "z")
    block = Block("r1", "c", "identify", 0, np.zeros(count), np.ones(count), setting, axis, zeros, none, {})
    at = [names.index(one) for one in ("force_off", "loss_off_A", "ringing_off_A")]
    beta = np.zeros(len(names))
    beta[at] = 0.4, 0.03, 0.02
    beta[len(model.believed) :] = setting.loaded[field.used]
    step = np.zeros(len(names))
    step[at[0]] = 1e-3
    change, switched = [], 0
    for number in range(200):
        here = beta + number * step
        matrix, offset = model.design(block, np.zeros(1), here)
        predicted = model.predictions(block, np.zeros((1, 1)), here + step)[0]
        change.append(predicted - offset - matrix @ (here + step))
        share, _ = model.finished(setting, np.zeros(1), here)
        switched += int(((share > 0.1) & (share < 0.9)).any())
    assert switched > 5  # else the test shows nothing
    assert np.abs(change).max() < 0.05 * UM


def test_the_columns_of_a_face_are_the_slopes_of_its_heights() -> None:
    """Of every base parameter, away from where all are zero: a descent ends early on any other slopes."""
    rung, full = ringing(make_batch(), replace(dynamics(), damping=None))
    setting, field = face_of(rung, full)
    modes = (ArmMode(np.inf, 0.0, (3e-4, 3e-4, 2e-4)),)
    model = FlatnessModel((field,), placed=True, ringing=("A",), beside=(Beside("A", modes),))
    names = [one.name for one in model.parameters]
    count, none = len(setting.first), np.zeros(0)
    zeros, axis = np.zeros((count, 0)), np.full(count, "z")
    block = Block("r1", "c", "identify", 0, np.zeros(count), np.ones(count), setting, axis, zeros, none, {})
    beta = np.zeros(len(names))
    beta[[names.index(one) for one in ("force_off", "loss_off_A", "ringing_off_A")]] = -0.2, 0.05, 0.04
    beta[[names.index(f"at_once_{axis}_A") for axis in "xyz"]] = 0.1, -0.2, 0.3
    beta[len(model.believed) :] = 0.9 * setting.loaded[field.used]
    matrix, _ = model.design(block, np.zeros(1), beta)
    for place, name in enumerate(names):
        step = np.zeros(len(names))
        step[place] = 1e-7 * UM / max(float(np.abs(matrix[:, place]).max()), 1e-12)
        high, low = (model.predictions(block, np.zeros((1, 1)), beta + by)[0] for by in (step, -step))
        slope = (high - low) / (2.0 * step[place])
        error = np.linalg.norm(slope - matrix[:, place]) / max(np.linalg.norm(matrix[:, place]), 1e-12)
        assert error < 0.01, name
