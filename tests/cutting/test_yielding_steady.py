"""The steady cut of a tool that yields, against a march in time written here, closed forms and limits."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from metro.cutting.chip import Cut
from metro.cutting.cutter import Cutter, evenly_pitched
from metro.cutting.engagement import Engagement, engagement
from metro.cutting.force import force_basis
from metro.cutting.law import EdgeLaw
from metro.cutting.yielding_steady import ANGLES, NotBalancedError, deflection
from metro.cutting.yielding_steady import yielding as solved
from metro.signals.orders import order_matrix, to_orders
from virtual_cell.chips import Engagement as TrueEngagement
from virtual_cell.chips import Tool
from virtual_cell.milling import Cut as TrueCut
from virtual_cell.milling import forces, in_millimetres
from virtual_cell.motion import Orbit, Straight

RADIUS, HELIX, DEPTH, FEED, WIDTH = 6e-3, math.radians(35), 1.5e-3, 70e-6, 4.2e-3
SLOT = Engagement(0.0, math.pi)
CUTS = {
    "slot": Cut(FEED, DEPTH, SLOT),
    "up": Cut(FEED, DEPTH, engagement("side", "up", WIDTH, RADIUS)),
    "down": Cut(FEED, DEPTH, engagement("side", "down", WIDTH, RADIUS)),
}
SHEAR, EDGE = (850.0, 330.0, 190.0), (15.0, 18.0, 5.0)  # N/mm², N/mm
STEEL = np.array([850e6, 330e6, 190e6, 15e3, 18e3, 5e3])
SOFT = np.diag([1 / 5e6, 1 / 3e6])
SPEED, ORDERS = 520.0, 20


def tool(teeth=4, runout=0.0, angles=None):
    return Cutter(RADIUS, HELIX, angles or evenly_pitched(teeth), runout, 0.7)


def rigid(cutter, cut, true_path=False):
    return force_basis(cutter, EdgeLaw(), cut, true_path)[:: 720 // ANGLES] @ STEEL


def yielding(cutter, cut, compliance, true_path=False):
    return solved(cutter, EdgeLaw(), cut, STEEL, compliance, true_path=true_path).basis @ STEEL


def rms(wave):
    return math.sqrt(np.mean(np.sum(np.asarray(wave) ** 2, axis=-1)))


def marched(cutter, cut, compliance, *, steps=360, slices=400, turns=4):
    """Step the tool through its angles from rest; at each, iterate force and deflection. Circular paths."""
    teeth, angles = cutter.teeth, np.array(cutter.tooth_angles)
    z = (np.arange(slices) + 0.5) * cut.axial_depth / slices
    lag = z * math.tan(cutter.helix) / cutter.radius
    off = cutter.runout_radius * np.cos(cutter.runout_angle - angles[:, None] + lag)  # (N, H)
    index = (np.arange(teeth)[:, None] + np.arange(1, teeth + 1)) % teeth  # tooth of pass m before tooth j
    pitch = np.mod(angles[index] - angles[:, None], 2 * math.pi)
    pitch[:, -1] = 2 * math.pi
    feed = cut.feed_per_tooth * teeth * pitch / (2 * math.pi)
    back = pitch / (2 * math.pi) * steps
    history, force = np.zeros((steps * (turns + 1), 2)), np.zeros((steps * turns, 3))
    entry, leaving = math.cos(cut.engagement.entry), math.cos(cut.engagement.exit)
    for i in range(steps * turns):
        phi = np.mod(2 * math.pi * i / steps + angles[:, None] - lag, 2 * math.pi)
        sine, cosine = np.sin(phi), np.cos(phi)
        past = i + steps - back
        low = np.floor(past + 1e-9).astype(int)
        share = (past - low)[..., None]
        then = (1 - share) * history[low] + share * history[np.minimum(low + 1, i + steps - 1)]
        q = history[i + steps - 1]
        for _ in range(60):
            near = q - then  # (N, M, 2)
            gained = near[:, :, 0, None] * sine[:, None] + near[:, :, 1, None] * cosine[:, None]
            h = (feed[..., None] * sine[:, None] + off[:, None] - off[index] + gained).min(axis=1)
            inside = h > 0.0
            if cut.engagement.entry > 0.0:
                inside &= cosine + q[1] / cutter.radius < entry
            if cut.engagement.exit < math.pi:
                inside &= cosine + q[1] / cutter.radius > leaving
            inside &= sine > -0.5
            ft, fr, fa = (inside * (STEEL[k] * h + STEEL[k + 3]) * cut.axial_depth / slices for k in range(3))
            f = np.array([-np.sum(ft * cosine + fr * sine), np.sum(ft * sine - fr * cosine), np.sum(fa)])
            following = compliance @ f[:2]
            if np.abs(following - q).max() < 1e-12:
                break
            q = 0.5 * (q + following)
        history[i + steps], force[i] = q, f
    return force[-steps:], history[-steps:]


@pytest.mark.parametrize(
    ("cut", "runout", "angles"),
    [
        ("slot", 8e-6, None),
        ("down", 8e-6, None),
        ("up", 0.0, None),
        ("down", 0.0, (0.0, 1.62, 3.1, 4.75)),
    ],
)
def test_force_and_deflection_are_those_of_a_march_in_time(cut, runout, angles):
    cutter, here = tool(4, runout, angles), CUTS[cut]
    compliance = np.array([[1 / 8e6, 0.02 / 1e6], [0.02 / 1e6, 1 / 6e6]])
    force, bent = marched(cutter, here, compliance)
    stiff, _ = marched(cutter, here, np.zeros((2, 2)), turns=1)
    change = yielding(cutter, here, compliance) - rigid(cutter, here)
    assert rms(force - stiff) > 0.002 * rms(stiff)
    assert rms(change - (force - stiff)) < 0.15 * rms(force - stiff) + 1e-3 * rms(stiff)
    found = deflection(cutter, EdgeLaw(), here, STEEL, compliance)
    assert rms(found - bent[:: len(bent) // len(found)]) < 4e-3 * rms(bent)


def test_a_tool_that_hardly_yields_cuts_as_a_rigid_one():
    for cut in CUTS.values():
        for true_path in (False, True):
            cutter = tool(3, 8e-6)
            change = yielding(cutter, cut, SOFT * 1e-6, true_path) - rigid(cutter, cut, true_path)
            assert rms(change) < 1e-6 * rms(rigid(cutter, cut, true_path))


def test_with_equal_teeth_a_slot_on_circular_paths_is_cut_as_by_a_rigid_tool():
    cutter, cut = tool(4), CUTS["slot"]
    force = rigid(cutter, cut)
    assert yielding(cutter, cut, SOFT) == pytest.approx(force, abs=1e-9 * np.abs(force).max())
    bent = deflection(cutter, EdgeLaw(), cut, STEEL, SOFT)
    assert bent == pytest.approx(force[:: ANGLES // len(bent), :2] @ SOFT, rel=1e-9, abs=1e-12)


@settings(max_examples=15, deadline=None)
@given(
    st.integers(1, 4),
    st.sampled_from(sorted(CUTS)),
    st.floats(0.0, 15e-6),
    st.tuples(st.floats(4.0, 50.0), st.floats(4.0, 50.0), st.floats(-0.02, 0.02)),
    st.sampled_from([0.0, 0.2]),
)
def test_the_deflection_is_that_of_a_spring_under_the_force(teeth, cut, runout, spring, exponent):
    angles = tuple(a + 0.02 * math.sin(5 * i) for i, a in enumerate(evenly_pitched(teeth)))
    cutter, law = tool(teeth, runout, angles), EdgeLaw(size_exponent=exponent, reference_thickness=50e-6)
    compliance = np.array([[1 / spring[0], spring[2]], [spring[2], 1 / spring[1]]]) * 1e-6
    bent = deflection(cutter, law, CUTS[cut], STEEL, compliance)
    force = solved(cutter, law, CUTS[cut], STEEL, compliance).basis @ STEEL
    expected = force[:: ANGLES // len(bent), :2] @ compliance
    # At the few angles where a tooth just touches there may be no better balance than a hundredth.
    assert bent == pytest.approx(expected, abs=0.011 * np.abs(expected).max())
    assert np.median(np.abs(bent - expected)) < 5e-4 * np.abs(expected).max()


@pytest.mark.parametrize(("cut", "side"), [("down", -1.0), ("up", 1.0)])
def test_the_raw_edge_stays_where_it_is(cut, side):
    # To first order each height of the edge enters (or leaves) where dφ = q_y / (R sin φ), q as of then.
    cutter, here, small = tool(2), CUTS[cut], 1e-3
    bent = deflection(cutter, EdgeLaw(), here, STEEL, SOFT * small)
    raw = here.engagement.entry if cut == "down" else here.engagement.exit
    height = (np.arange(400) + 0.5) * DEPTH / 400
    angle = np.mod(raw + cutter.lag_per_depth * height, 2 * math.pi)
    grid = 2 * math.pi * np.arange(len(bent) + 1) / len(bent)
    there = np.interp(angle, grid, np.append(bent[:, 1], bent[0, 1])).mean()
    thrust = STEEL[2] * FEED * math.sin(raw) + STEEL[5]
    expected = side * cutter.teeth / (2 * math.pi) * DEPTH * thrust * there / (RADIUS * math.sin(raw))
    change = (yielding(cutter, here, SOFT * small) - rigid(cutter, here))[:, 2].mean()
    assert change == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("teeth", [2, 4])
def test_a_softer_tool_evens_out_more_of_the_runout(teeth):
    cutter, cut = tool(teeth, 8e-6), CUTS["down"]
    waves = rigid(cutter, cut), *(yielding(cutter, cut, SOFT * softer) for softer in (0.3, 1.0, 2.0))
    spectra = np.abs(np.fft.rfft([wave[:, 2] for wave in waves]))[:, 1:30]
    uneven = np.linalg.norm(spectra[:, np.arange(1, 30) % teeth != 0], axis=1)
    assert uneven[0] > 1.05 * uneven[1] > 1.15 * uneven[2] > 1.3 * uneven[3]


def test_a_tool_that_is_drawn_into_the_work_has_no_steady_cut():
    # Towards +y the tangential force grows with the deflection faster than the spring does.
    with pytest.raises(NotBalancedError):
        yielding(tool(2, 8e-6), CUTS["slot"], np.diag([1 / 40e6, 1 / 0.4e6]))


@pytest.mark.parametrize(
    ("side", "teeth", "runout", "enough"),
    [("slot", 2, 8e-6, 0.15), ("down", 4, 0.0, 0.3), ("up", 2, 8e-6, 0.15)],
)
def test_the_change_of_the_force_is_that_of_the_simulator(side, teeth, runout, enough):
    motion = Straight(FEED * teeth * SPEED / (2 * math.pi), 10 * RADIUS, side=side, edge=RADIUS - WIDTH)
    change = yielding(tool(teeth, runout), CUTS[side], SOFT, True) - rigid(
        tool(teeth, runout), CUTS[side], True
    )
    expected = simulated_change(motion, teeth, runout, SOFT, SPEED)
    assert rms(to_orders(change, ORDERS) - expected) < enough * rms(expected)


@pytest.mark.parametrize(("teeth", "turn"), [(4, 1.0), (2, -1.0)])
def test_on_an_orbit_the_change_of_the_force_is_that_of_the_simulator(teeth, turn):
    # With one stiffness all around the change is the same in every direction of feed.
    orbit, round_spring = 0.6 * RADIUS, np.eye(2) / 8e6
    motion = Orbit(orbit, turn * FEED * teeth * SPEED / (2 * math.pi) / orbit, 0.0, 0.0)
    cut = Cut(FEED, DEPTH, SLOT, turn / orbit)
    change = yielding(tool(teeth), cut, round_spring, True) - rigid(tool(teeth), cut, True)
    expected = simulated_change(motion, teeth, 0.0, round_spring, SPEED + motion.rate)
    straight = yielding(tool(teeth), CUTS["slot"], round_spring, True) - rigid(
        tool(teeth), CUTS["slot"], True
    )
    assert rms(to_orders(change, ORDERS) - expected) < 0.25 * rms(expected)
    assert rms(to_orders(straight, ORDERS) - expected) > 0.5 * rms(expected)


def simulated_change(motion, teeth, runout, compliance, speed):
    """Order coefficients, in the feed frame, of what a spring changes in the force of the simulator."""
    cutter = Tool(RADIUS, HELIX, np.array(evenly_pitched(teeth)), runout, 0.7)
    engaged = TrueEngagement(cutter, motion, SPEED, 0.0, DEPTH)
    time = np.arange(round(12 * 517.3)) / 517.3 * 2 * math.pi / speed  # all phases of its points
    soft, stiff = (
        forces(TrueCut(engaged, in_millimetres(SHEAR, EDGE), 0.0, spring), time)
        for spring in (compliance, None)
    )
    x, y, z = (soft - stiff).T
    c, s = np.cos(motion.direction(time)), np.sin(motion.direction(time))
    change = np.stack([c * x + s * y, c * y - s * x, z], axis=1)
    steady = time > 8 * math.pi / speed
    return np.linalg.lstsq(order_matrix(speed * time[steady], ORDERS), change[steady], rcond=None)[0]


@pytest.mark.parametrize("true_path", [False, True])
@pytest.mark.parametrize("cut", list(CUTS))
def test_from_a_tool_that_hardly_differs_one_step_gives_the_derivative(cut, true_path):
    before, law = CUTS[cut], EdgeLaw()

    def force(runout, soft, start=None):
        found = solved(tool(4, runout), law, before, STEEL, SOFT * soft, true_path=true_path, start=start)
        return found.basis @ STEEL

    start = deflection(tool(4, 8e-6), law, before, STEEL, SOFT, true_path=true_path)
    for runout, soft in ((8.008e-6, 1.0), (8e-6, 1.001)):
        expected = force(runout, soft) - force(8e-6, 1.0)
        change = force(runout, soft, start) - force(8e-6, 1.0, start)
        assert rms(change - expected) < 0.02 * rms(expected)
        assert rms(expected) > 1e-5 * rms(force(8e-6, 1.0))


@pytest.mark.parametrize("share", [0.3, 0.499, 0.4999, 0.5, 0.5001, 0.501, 0.7])
@pytest.mark.parametrize("direction", ["up", "down"])
@pytest.mark.parametrize("runout", [0.0, 3e-6])
def test_on_true_paths_a_stiff_tool_is_rigid_also_where_the_raw_edge_is_at_the_axis(runout, direction, share):
    """At half immersion the line of the edge is where the tool's deflection puts it, to either side of it."""
    cut = Cut(FEED, DEPTH, engagement("side", direction, share * 2.0 * RADIUS, RADIUS))
    cutter = tool(runout=runout)
    stiff = rigid(cutter, cut, true_path=True)
    assert rms(yielding(cutter, cut, 1e-15 * np.eye(2), true_path=True) - stiff) < 1e-6 * rms(stiff)
    soft = yielding(cutter, cut, 1e-7 * np.eye(2), true_path=True)
    circles = yielding(cutter, cut, 1e-7 * np.eye(2)) - rigid(cutter, cut)
    assert rms(soft - stiff - circles) < 0.02 * rms(stiff)
