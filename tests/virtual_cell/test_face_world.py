"""Things of the harder world that shape a face, against closed forms, and what is read of it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from virtual_cell.face import Passes, Surroundings, surface
from virtual_cell.units import MM, UM
from virtual_cell.world.faces import (
    fixture,
    machine_troubles,
    mount,
    path,
    scan,
    servo,
    swing,
    warmth,
    work_troubles,
)
from virtual_cell.world.faces.finish import Cutting, FaceRun, Influence, finished, gain

PASSES = Passes((0.12, 0.06), 0, 0.01, 0.008, 0.04, 0.014)
SIZE = PASSES.size
RNG = np.random.default_rng


def run(passes=PASSES, force=(60.0, -20.0, 80.0), **changes):
    """Return a face on a force that steps in at the plate's edge."""
    begun = passes.period * np.arange(len(passes.axes))

    def load(s):
        return np.outer((s >= 0.0) & (s <= passes.length), force)

    one = FaceRun(
        3, 10, 2000.0, 6000.0, ((0.0, 90.0), (800.0, 900.0)), "A", 1, passes, begun, load, 2e-3, 4, 0.6
    )
    return replace(one, **changes)


def flat(passes=PASSES):
    s = np.linspace(-passes.lead, passes.length + passes.lead, 300)
    return [(s, np.zeros(300)) for _ in passes.axes]


def at(points, number=0, s=None, t=0.0, offset=None):
    points = np.atleast_2d(np.asarray(points, float))
    s = points[:, 0] if s is None else np.asarray(s, float)
    offset = np.zeros_like(points) if offset is None else offset
    return Cutting(number, s, np.broadcast_to(np.asarray(t, float), (len(points),)), points, offset)


POINTS = RNG(1).uniform([0.002, 0.002], [0.118, 0.058], (2000, 2))


@pytest.mark.parametrize("along", [0, 1])
def test_without_corners_and_with_plain_causes_a_face_is_the_idealised_one(along):
    """The rim of the other simulator, of tilt and steady growth."""
    passes = Passes((0.08, 0.08), along, 0.01, 0.008, 0.04, 0.014)
    points = RNG(2).uniform(0.002, 0.078, (1500, 2))
    tilt, rate, face = (1.3e-3, -0.8e-3), 2e-7, run(passes)
    tilted = mount.Mount(mount._shims(*tilt, 0.07), 0.07).in_face(face, RNG(0))
    growing = Influence(height=lambda cutting: -rate * cutting.t)
    ours = finished(face, 0.0, flat(passes), [tilted, growing], points)
    theirs = surface(passes, flat(passes), Surroundings(tilt=tilt, growth=rate), points)
    np.testing.assert_allclose(ours, theirs, atol=1e-10)


def test_a_corner_of_the_teeth_leaves_its_radius_at_the_last_edge_and_nothing_in_the_overlap():
    z = finished(run(), 0.3e-3, flat(), [], POINTS)
    np.testing.assert_allclose(z, 0.0, atol=1e-15)
    edge = np.array([[0.06, 0.0], [0.06, 0.15e-3]])
    fillet = finished(run(), 0.3e-3, flat(), [], edge)
    np.testing.assert_allclose(fillet, [0.3e-3, 0.3e-3 - math.sqrt(0.3e-3**2 - 0.15e-3**2)], rtol=1e-6)


def test_gains_of_several_causes_multiply():
    half = Influence(gain=lambda _, s, __: np.full(len(s), 0.5))
    np.testing.assert_allclose(gain([half, Influence(), half], 0, np.zeros(3), np.zeros(3)), 0.25)


def test_a_spindle_warms_and_cools_as_the_differential_equation_says():
    warm, spans = warmth.Warmth((4e-6, 9e-6), (100.0, 900.0)), ((0.0, 200.0), (600.0, 750.0))
    t = np.linspace(0.0, 1500.0, 16)

    def rate(now, longer):
        on = any(start <= now < stop for start, stop in spans)
        return [
            (length * on - x) / tau for length, tau, x in zip(warm.lengths, warm.times, longer, strict=True)
        ]

    expected = solve_ivp(rate, (0.0, 1500.0), [0.0, 0.0], t_eval=t, max_step=2.0).y.sum(axis=0)
    np.testing.assert_allclose(warm.longer(t, spans), expected, atol=2e-8)


def test_a_spindle_is_made_to_grow_at_a_mean_rate_and_less_where_it_is_warm():
    session = [
        run(order=i, started=400.0 * i, earlier=tuple((400.0 * j, 400.0 * j + 70.0) for j in range(i)))
        for i in range(8)
    ]
    warm, error = warmth.at_rate(warmth.Warmth((2e-6, 6e-6), (120.0, 1200.0)), 3e-7, session)
    slopes = [warm.at_first(one) for one in session]
    assert np.mean(slopes) == pytest.approx(3e-7, rel=1e-9)
    assert slopes[0] > slopes[-1]
    assert error == pytest.approx(np.std(slopes) / 3e-7)
    z = warm.in_face(session[0], RNG(0)).height(at([[0.0, 0.0], [0.0, 0.0]], t=[0.0, 20.0]))
    np.testing.assert_allclose(z, [0.0, -warm.since(session[0], np.array([20.0]))[0]], atol=1e-10)


def test_a_plate_that_is_bent_between_far_supports_is_a_parabola_with_the_other_curvature_across():
    """Pure bending: w = M/2 u² along, −ν times the same curvature per length across."""
    bent = fixture.Fixture((0.9999, 0.9999), (2e-6, 0.0), (0.0, 0.0), 0.0)
    points = fixture.grid(SIZE)
    entries, beside = fixture.second_degree(bent.shape(points, SIZE), points, SIZE)
    np.testing.assert_allclose(entries, [1e-6, 0.0, -0.33 * 1e-6 * (0.06 / 0.12) ** 2], atol=2e-9)
    assert beside < 2e-3


def test_a_plate_overhanging_its_supports_bends_less_there():
    whole = fixture.Fixture((0.9999, 0.9999), (2e-6, 0.0), (0.0, 0.0), 0.0)
    points = np.array([[0.0, 0.03], [0.06, 0.03], [0.12, 0.03]])
    high = [np.ptp(one.shape(points, SIZE)) for one in (whole, replace(whole, supports=(0.5, 0.5)))]
    # Moment M within |u| < a and M (1-|u|)/(1-a) beyond: w(1) - w(0) = M a²/2 + M a (1-a) + M (1-a)²/3.
    assert high[1] / high[0] == pytest.approx((0.5**2 / 2 + 0.25 + 0.5**2 / 3) / 0.5, rel=2e-3)


def test_a_fixture_is_bent_to_the_entries_that_are_asked_for():
    made, error = fixture.bending(fixture.drawn(RNG(4)), (30e-6, -12e-6, 9e-6), SIZE)
    points = fixture.grid(SIZE)
    np.testing.assert_allclose(
        fixture.second_degree(made.shape(points, SIZE), points, SIZE)[0], [30e-6, -12e-6, 9e-6], rtol=1e-6
    )
    assert 0.0 < error < 0.4


def test_a_shim_under_the_front_pad_tilts_the_spindle_about_x_by_its_height_over_one_and_a_half_radii():
    one = mount.Mount((30e-6, 0.0, 0.0), 0.06)
    np.testing.assert_allclose(one.tilt("A"), (30e-6 / 0.09, 0.0), atol=1e-12)
    turned = replace(one, yaw={"A": 0.0, "B": math.pi / 2.0})
    np.testing.assert_allclose(turned.tilt("B"), (0.0, 30e-6 / 0.09), atol=1e-12)


def test_mounts_have_the_mean_tilt_that_is_asked_for_and_some_turn_with_the_wrist():
    errors = []
    for seed in range(30):
        made, error = mount.tilted((2e-3, -1e-3), {"A": math.pi, "B": math.pi - 0.5}, RNG(seed))
        np.testing.assert_allclose(
            np.mean([made.tilt("A"), made.tilt("B")], axis=0), (2e-3, -1e-3), atol=1e-12
        )
        errors.append(error)
    assert 3 < np.count_nonzero(errors) < 20
    assert max(errors) == pytest.approx(math.tan(0.25), rel=1e-6)


def test_a_drive_droops_under_a_step_and_comes_back_with_its_time_constant():
    one, face = servo.Servo((0.0, 0.0, 1e-7), 0.25), run()
    s, z = one.droop(face)
    inside = (s > 0.002) & (s < 0.1)
    np.testing.assert_allclose(z[inside], 8e-6 * np.exp(-s[inside] / (0.25 * 0.04)), rtol=0.02, atol=1e-9)
    made, error = servo.decaying(RNG(3), -50e-6, 0.012, [face, run(force=(40.0, -10.0, 50.0))])
    assert np.mean(
        [servo._fitted(made, one, 0.012)[0] for one in (face, run(force=(40.0, -10.0, 50.0)))]
    ) == (pytest.approx(-50e-6, rel=1e-6))
    assert 0.05 < error < 0.6


def test_a_swing_has_its_frequency_and_its_amplitude_and_is_no_pure_wave():
    one = swing.Swing(2.0, 10e-6, 1e-3, 30.0, 0.1, 0.1)
    t = np.linspace(0.0, 60.0, 20_001)
    z = one.in_face(run(), RNG(5)).height(at(np.zeros((len(t), 2)), t=t))
    wave = np.exp(-2j * np.pi * 2.0 * t)
    assert 2.0 * abs((z * wave).mean()) == pytest.approx(10e-6, rel=0.1)
    assert 2.0 * abs((z * wave**2).mean()) == pytest.approx(1e-6, rel=0.3)
    assert one.impurity == pytest.approx(math.hypot(0.1 / math.sqrt(2.0), 0.1))


# what is read of a face


def scanner(**changes):
    silent = dict.fromkeys(("spikes", "rolled", "burr", "holes", "missing", "drift", "shift", "turn"), 0.0)
    one = scan.drawn(RNG(7), SIZE, known=1.0, sides=0.0)
    usual = {"sigma": 1e-9, "spacing": 0.5 * MM, "again": (0.0, 0.0)}
    return replace(one, **(silent | usual | changes))


def read(one, seed=3, height=lambda points: np.zeros(len(points))):
    rng = RNG(seed)
    placed = scan.placing(one, rng)
    cloud = scan.scanned(one, placed, SIZE, leaving=(0, SIZE[0]), height=height, rng=rng)
    if one.place == "outline":
        return cloud * MM
    return (cloud @ one.to_work[:3, :3].T + one.to_work[:3, 3]) * MM


def test_a_scanner_without_errors_reads_the_face():
    cloud = read(scanner(), height=lambda points: 1e-3 * points[:, 0])
    np.testing.assert_allclose(cloud[:, 2], 1e-3 * cloud[:, 0], atol=2e-7)
    assert len(cloud) == 240 * 120


def test_noise_has_its_size_and_is_correlated_over_its_length():
    one = scanner(length=3.0 * MM, correlated=1.0)
    cloud = read(replace(one, sigma=10.0 * UM))
    assert cloud[:, 2].std() == pytest.approx(10.0 * UM, rel=0.1)
    grid = cloud[:, 2].reshape(240, 120)
    for lag in (2, 6, 12):  # a Gaussian of 3 mm: exp(-lag²/(2·3²)) in the product of two such kernels
        alike = float((grid[lag:] * grid[:-lag]).mean() / grid.var())
        assert alike == pytest.approx(math.exp(-((lag * 0.5) ** 2) / (2.0 * 3.0**2)), abs=0.12)


def test_spikes_holes_edges_and_missing_strips_come_in_their_shares():
    spiky = np.abs(read(scanner(spikes=0.01, spike=20.0, sigma=1.0 * UM))[:, 2]) > 6.0 * UM
    assert spiky.mean() == pytest.approx(0.0095, abs=0.003)
    assert len(read(scanner(holes=0.04, hole=3.0 * MM))) == pytest.approx(0.96 * 28_800, abs=2)
    assert len(read(scanner(missing=0.1))) == pytest.approx(0.9 * 28_800, rel=0.01)
    rolled = read(scanner(rolled=50.0 * UM, soft=0.4 * MM))
    near = np.minimum(rolled[:, :2], np.array(SIZE) - rolled[:, :2]).min(axis=1)
    np.testing.assert_allclose(rolled[:, 2], -50.0 * UM * np.exp(-near / 0.4e-3), atol=3e-7)
    burr = read(scanner(burr=100.0 * UM, wide=0.2 * MM, kept=0.5))
    assert (burr[burr[:, 0] < 0.115, 2] < 1.0 * UM).all()
    assert 0.3 < (burr[burr[:, 0] > 0.1195, 2] > 5.0 * UM).mean() < 0.7


def test_a_scan_drifts_along_its_way_and_an_outline_fit_takes_place_and_tilt_away():
    drifted = read(scanner(drift=20.0 * UM, direction=0.0, steady=1.0))
    middle = [drifted[np.abs(drifted[:, 0] - x) < 2e-3, 2].mean() for x in (0.01, 0.11)]
    assert 8.0 * UM < abs(middle[1] - middle[0]) < 24.0 * UM
    across = [drifted[np.abs(drifted[:, 1] - y) < 2e-3, 2].mean() for y in (0.01, 0.05)]
    assert abs(across[1] - across[0]) < 0.1 * UM
    one = scanner(place="outline", shift=200.0 * UM, turn=1e-3)
    assert np.abs(read(one, height=lambda points: 5e-4 + 2e-3 * points[:, 1])[:, 2]).max() < 2e-7


def test_a_declared_place_is_wrong_by_an_offset_and_two_tilts_the_same_in_all_scans():
    one = scanner(shift=100.0 * UM, turn=5e-4)
    placed = scan.placing(one, RNG(8))
    cloud = scan.scanned(
        one, placed, SIZE, leaving=(0, SIZE[0]), height=lambda points: np.zeros(len(points)), rng=RNG(9)
    )
    work = (cloud @ one.to_work[:3, :3].T + one.to_work[:3, 3]) * MM
    plane = np.linalg.lstsq(
        np.column_stack([np.ones(len(work)), work[:, :2] - np.array(SIZE) / 2.0]), work[:, 2], rcond=None
    )[0]
    np.testing.assert_allclose(plane, [placed.off[0], -placed.off[2], placed.off[1]], atol=1e-7)


def test_drawn_scanners_stay_within_the_published_ranges():
    rng = RNG(11)
    some = [scan.drawn(rng, SIZE, known=0.6, sides=0.3) for _ in range(200)]
    for name, low, high in (
        ("spikes", 0.001, 0.01),
        ("soft", 0.1 * MM, 1.0 * MM),
        ("drift", 1.0 * UM, 20.0 * UM),
        ("length", 0.3 * MM, 5.0 * MM),
        ("shift", 5.0 * UM, 200.0 * UM),
        ("turn", 5e-5, 1e-3),
    ):
        values = [getattr(one, name) for one in some]
        assert low * 0.99 <= min(values) < 1.3 * low, name
        assert 0.75 * high < max(values) <= high * 1.01, name
    places = [one.place for one in some]
    assert {place: places.count(place) > 5 for place in ("declared", "outline", "sides")} == dict.fromkeys(
        ("declared", "outline", "sides"), True
    )
    assert all(one.missing == 0.0 for one in some if one.place == "outline")
    sides = [one for one in some if one.sides]
    assert all(one.sides * sum(SIZE) <= 0.091 * SIZE[0] * SIZE[1] for one in sides)


# troubles


def test_each_trouble_of_the_work_is_where_and_when_it_should_be():
    middle, corner = [0.06, 0.03], [0.119, 0.059]
    heated = work_troubles.HeatedSide(90e-6, 30.0).in_face(run(), RNG(0)).height
    early, late = (heated(at([middle, corner], t=t)) for t in (0.0, 1e4))
    np.testing.assert_allclose(early, 0.0, atol=1e-12)
    assert late[1] - late[0] == pytest.approx(90e-6, rel=0.3)
    cold = work_troubles.CoolantSwitched(20e-6, 5.0, 1.0).in_face(run(), RNG(1)).height
    assert cold(at([middle], t=0.0)) == 0.0
    assert cold(at([middle], t=run().duration + 60.0)) == pytest.approx(20e-6, rel=1e-3)
    shim = work_troubles.CreepingShim(100e-6, (1.0, 1.0), 300.0)
    first, last = (
        shim.in_face(run(started=t), RNG(2)).height(at([[0.12, 0.06], [0.0, 0.0], [0.06, 0.03]]))
        for t in (0.0, 6000.0)
    )
    np.testing.assert_allclose(first, 0.0, atol=1e-12)
    np.testing.assert_allclose(last, [100e-6, 0.0, 100e-6 / 8.0], atol=1e-12)
    gone = work_troubles.VacuumRelease(50e-6, 0.03, (0.5, 0.5), 1.0).in_face(run(), RNG(3)).height
    np.testing.assert_allclose(gone(at([middle, corner], t=run().duration)), [-50e-6, 0.0], atol=1e-12)
    dents = [
        work_troubles.ChipUnderClamp(50e-6, 0.03, 0.5).in_face(run(), RNG(seed)).height for seed in range(60)
    ]
    assert 15 < sum(dent is not None for dent in dents) < 45
    hums = [work_troubles.ThinPlate(2.0, 0.2, 30e-6).in_face(run(order=i), RNG(i)).height for i in (0, 9)]
    t = np.linspace(0.0, 20.0, 4001)
    sizes = [np.ptp(hum(at(np.tile(middle, (4001, 1)), t=t))) / 2.0 for hum in hums]
    np.testing.assert_allclose(sizes, [9e-6, 30e-6], rtol=0.01)
    hard = work_troubles.HardInclusion(2.0, 0.01, 1.0).in_face(run(), RNG(4)).gain
    s = np.linspace(0.0, 0.12, 400)
    gains = np.array([hard(number, s, s) for number in range(6)])
    assert gains.max() == pytest.approx(3.0, abs=0.01)
    assert gains.min() == 1.0
    assert (gains.max(axis=1) > 1.0).sum() in (1, 2)


def test_each_trouble_of_the_machine_is_where_and_when_it_should_be():
    blended = machine_troubles.CornerBlending(-40e-6, 0.03).in_face(run(), RNG(0)).height
    np.testing.assert_allclose(blended(at(np.zeros((3, 2)), s=[0.05, 0.105, 0.12])), [0.0, -10e-6, -40e-6])
    way = machine_troubles.WornWay(30e-6, 0.02, (0.5, 0.25))
    for location, place in ((1, 0.06), (2, 0.03)):
        worn = way.in_face(run(location=location), RNG(0)).height
        np.testing.assert_allclose(worn(at([[place, 0.01], [place + 0.025, 0.01]])), [30e-6, 0.0], atol=1e-12)
    sag = machine_troubles.PowerSag(0.2, 5.0, 6.0).in_face(run(), RNG(1)).gain
    t = np.linspace(0.0, run().duration, 3000)
    assert sag(0, t, t).max() == pytest.approx(1.0 + 0.4 * (1.0 / 0.8 - 1.0), rel=1e-3)
    lost = machine_troubles.LostInsert(0.35, 0.5, 20e-6)
    before, during, after = (lost.in_face(run(order=order), RNG(0)) for order in (2, 3, 4))
    assert before.height is None
    assert before.gain is None
    t = np.array([0.0, run().duration])
    loss = 1.0 + 0.6 * (0.75 * 1.5 - 1.0)
    np.testing.assert_allclose(during.gain(0, t, t), [1.0, loss])
    np.testing.assert_allclose(during.height(at(np.zeros((2, 2)), t=t)), [0.0, 20e-6])
    np.testing.assert_allclose(after.gain(0, t, t), [loss, loss])
    assert after.height is None
    hose = machine_troubles.SnaggingHose(25e-6, "A")
    assert hose.in_face(run(wrist="B"), RNG(0)).height is None
    s = np.linspace(0.0, 0.12, 2000)
    pulled = hose.in_face(run(), RNG(0)).height(at(np.zeros((2000, 2)), s=s))
    assert pulled.max() == pytest.approx(25e-6, rel=0.01)
    assert pulled[-1] < 0.1 * pulled.max()
    wheel = machine_troubles.ScannerWheel(10e-6, 0.04, math.pi / 2.0).in_face(run(), RNG(0)).reading
    np.testing.assert_allclose(wheel(POINTS), wheel(POINTS + np.array([0.3, 0.04])), atol=1e-12)
    assert np.ptp(wheel(POINTS)) > 18e-6


def test_raw_stock_that_is_no_plane_changes_the_depth_over_a_face_by_its_slope():
    rises = []
    for seed in range(300):
        deeper = path.Stock(40e-6).in_face(run(), RNG(seed)).gain
        ends = deeper(0, np.array([0.0, 0.12]), np.zeros(2))
        rises.append((ends[1] - ends[0]) * 2e-3)
    assert np.std(rises) == pytest.approx(40e-6, rel=0.12)


def test_gears_wave_by_their_size_alike_in_all_faces_of_a_pose():
    gears = path.GearWave(1e-6, (0.02, 0.033), (0.3, 1.9))
    one, again, other = (gears.in_face(run(wrist=wrist), RNG(i)).height for i, wrist in enumerate("AAB"))
    places = at(RNG(5).uniform(0.0, 0.5, (5000, 2)))
    np.testing.assert_array_equal(one(places), again(places))
    assert np.abs(one(places) - other(places)).max() > 0.5e-6
    assert one(places).std() == pytest.approx(1e-6, rel=0.05)
