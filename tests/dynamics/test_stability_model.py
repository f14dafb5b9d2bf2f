"""The parts of a stability model: turned modes, process damping, softening, one more mode."""

from dataclasses import replace

import numpy as np
import pytest
from machines import TWO

from metro.dynamics.lobes import spectral_radius, stability_boundary
from metro.dynamics.softening import Softening
from metro.dynamics.stability_model import StabilityModel, estimated
from metro.dynamics.system import Cut, Structure

SIDE = Cut(3, 0.0, 0.4 * np.pi, 1e9, 4e8)
DAMPED = replace(SIDE, damping=3e8)
RPM = np.array([900.0, 1350.0])


def marched_radius(structure, cut, rpm, depth, steps):
    """Largest multiplier by brute force: impulses by matrix exponential, force held over each small step."""
    from scipy.linalg import expm

    m, period = len(structure.omega), float(cut.tooth_period(rpm))
    along = structure.directions[structure.axis]
    free = np.zeros((2 * m, 2 * m))
    free[:m, m:] = np.eye(m)
    free[m:, :m] = -np.diag(structure.omega**2)
    free[m:, m:] = -np.diag(2 * structure.zeta * structure.omega)
    push = np.concatenate([np.zeros((m, 2)), along * (structure.omega**2 / structure.stiffness)[:, None]])
    place = np.concatenate([along.T, np.zeros((2, m))], axis=1)
    speed = np.concatenate([np.zeros((2, m)), along.T], axis=1)
    dt, spindle = period / steps, 2 * np.pi / (cut.teeth * period)
    size = 2 * m + 2 * (steps + 1)
    total = np.eye(size)
    for i in range(steps):
        phi = cut.pitch * (i + 0.5) / steps + cut.pitch * np.arange(-cut.teeth, cut.teeth)
        phi = phi[(phi > cut.entry) & (phi < cut.exit)]
        normal = np.stack([np.sin(phi), np.cos(phi)], axis=1)
        force = np.stack([
            -(cut.ktc * np.cos(phi) + cut.krc * np.sin(phi)), cut.ktc * np.sin(phi) - cut.krc * np.cos(phi)
        ], axis=1)  # fmt: skip
        regenerative = depth * force.T @ normal
        damping = -depth * cut.damping / spindle * normal.T @ normal
        exponent = np.zeros((2 * m + 2, 2 * m + 2))
        exponent[: 2 * m, : 2 * m] = free + push @ (regenerative @ place + damping @ speed)
        exponent[: 2 * m, 2 * m :] = -push @ regenerative
        step = expm(exponent * dt)
        moved = np.zeros((2 * m, size))
        moved[:, : 2 * m] = step[: 2 * m, : 2 * m]
        moved[:, -4:] = 0.5 * np.tile(step[: 2 * m, 2 * m :], 2)  # mean of what was there a period before
        state = moved @ total
        total = np.concatenate([state, place @ state, total[2 * m : -2]])
    return np.abs(np.linalg.eigvals(total)).max()


@pytest.mark.parametrize("cut", [DAMPED, Cut(3, 0.0, np.pi, 1e9, 4e8, 2e8)])
def test_process_damping_moves_the_boundary_as_brute_force_says(cut):
    found = stability_boundary(TWO, cut, RPM)
    plain = stability_boundary(TWO, replace(cut, damping=0.0), RPM)
    assert np.all(found.depth > 1.02 * plain.depth)
    for rpm, depth in zip(RPM, found.depth, strict=True):
        assert marched_radius(TWO, cut, rpm, depth, 60) == pytest.approx(1.0, abs=2e-3)


def test_below_the_boundary_with_process_damping_the_cut_is_stable_and_above_it_is_not():
    depth = stability_boundary(TWO, DAMPED, RPM).depth
    assert np.all(spectral_radius(TWO, DAMPED, RPM, 0.98 * depth) < 1.0)
    assert np.all(spectral_radius(TWO, DAMPED, RPM, 1.02 * depth) > 1.0)


def test_process_damping_fades_with_speed():
    slow, fast = (
        stability_boundary(TWO, DAMPED, rpm).depth / stability_boundary(TWO, SIDE, rpm).depth
        for rpm in (np.array([300.0]), np.array([3000.0]))
    )
    assert slow > 1.2 * fast > 1.2


@pytest.mark.parametrize("angle", [0.3, -1.1])
def test_turning_the_modes_is_turning_the_cut_the_other_way(angle):
    cut = replace(SIDE, damping=1e8)
    turned = stability_boundary(TWO.turned(angle), cut, RPM)
    feed = stability_boundary(TWO, replace(cut, entry=cut.entry + angle, exit=cut.exit + angle), RPM)
    assert turned.depth == pytest.approx(feed.depth, rel=1e-4)
    assert turned.chatter_hz == pytest.approx(feed.chatter_hz, rel=1e-4)


def test_modes_turned_by_a_right_angle_change_places():
    swapped = Structure(1 - TWO.axis, TWO.omega, TWO.zeta, TWO.stiffness)
    assert stability_boundary(TWO.turned(np.pi / 2), SIDE, RPM).depth == pytest.approx(
        stability_boundary(swapped, SIDE, RPM).depth, rel=1e-4
    )


def test_the_receptance_of_turned_modes_is_a_turned_tensor():
    c, s = np.cos(0.4), np.sin(0.4)
    turn = np.array([[c, -s], [s, c]])
    omega = np.array([200.0, 300.0])
    assert TWO.turned(0.4).receptance(omega) == pytest.approx(turn @ TWO.receptance(omega) @ turn.T)


def test_each_speed_has_the_softened_structure_of_its_own():
    model = StabilityModel(TWO, (SIDE, DAMPED), 0.006, softening=(Softening(-0.08, 1000.0),))
    depth, chatter = model.boundary(RPM)
    for i, rpm in enumerate(RPM):
        f = 1.0 - 8e-5 * rpm
        own = Structure(TWO.axis, np.sqrt(f) * TWO.omega, TWO.zeta, f * TWO.stiffness)
        alone = stability_boundary(own, SIDE, np.array([rpm]))
        assert depth[i] == pytest.approx(alone.depth[0], rel=1e-4)
        assert chatter[i] == pytest.approx(alone.chatter_hz[0], rel=1e-4)


def test_a_model_without_stiffness_is_refused():
    with pytest.raises(ValueError, match="no stiffness left at 1350"):
        StabilityModel(TWO, (SIDE,), 0.006, (Softening(-1.0, 1000.0),)).boundary(RPM)


def test_a_mode_far_stiffer_than_the_rest_changes_nothing():
    more = TWO.with_mode(1, 2 * np.pi * 50.0, 0.05, 1e12)
    assert stability_boundary(more, SIDE, RPM).depth == pytest.approx(
        stability_boundary(TWO, SIDE, RPM).depth, rel=1e-3
    )


@pytest.mark.parametrize("growth", [30.0, 200.0])
def test_what_yields_with_depth_is_stable_up_to_where_depth_and_compliance_agree(growth):
    model, rpm = StabilityModel(TWO, (SIDE,), 0.01, yielding=growth), np.linspace(800.0, 2600.0, 25)
    depth, hz = model.boundary(rpm)
    stiff, _ = replace(model, yielding=0.0).boundary(rpm)
    assert np.abs(np.log(depth / stiff)).max() > 0.1
    agreed, heard = [], []
    for speed, found in zip(rpm, depth, strict=True):
        factor = 1.0 / (1.0 + growth * found)
        softer = replace(TWO, omega=TWO.omega * np.sqrt(factor), stiffness=TWO.stiffness * factor)
        alone = stability_boundary(softer, SIDE, np.array([speed]))
        agreed.append(float(alone.depth[0]))
        heard.append(float(alone.chatter_hz[0]))
    off = np.abs(np.log(depth / agreed))
    # Interpolated between compliances, it is off where lobes meet.
    assert np.quantile(off, [0.5, 0.8]) == pytest.approx([0.0, 0.0], abs=0.025)
    assert np.quantile(np.abs(np.log(hz / heard)), [0.5, 0.9]) == pytest.approx([0.0, 0.0], abs=0.01)


@pytest.mark.parametrize("shares", [(), (0.2, 0.9, 0.0, 0.5)])
def test_a_yield_of_next_to_nothing_changes_nothing(shares):
    softening = Softening(-0.1, 1000.0, shares=shares)
    model, rpm = StabilityModel(TWO, (SIDE, DAMPED), 0.01, (softening,)), np.linspace(800.0, 2600.0, 9)
    for one in (lambda m: m.boundary(rpm), lambda m: tuple(p[0] for p in estimated([m], rpm))):
        for plain, yielded in zip(one(model), one(replace(model, yielding=1e-9)), strict=True):
            np.testing.assert_allclose(yielded, plain, rtol=1e-6)
