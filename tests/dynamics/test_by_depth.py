"""Lobes of ball ends and lead angles: against a march in time over slices of the edge, and limits."""

import math
from dataclasses import replace

import numpy as np
import pytest
from machines import TWO

from metro.cutting.cutter import Cutter, evenly_pitched
from metro.dynamics.by_depth import boundary_of_edge, depths_anew
from metro.dynamics.lobes import stability_boundary
from metro.dynamics.system import Cut, Edge, RawFace, immersion

R = 5e-3
KTC, KRC, KAC = 9e8, 5e8, 4e8
DAMPING = 1.8e8  # N/m², of the process
FLAT = Cutter(R, 0.0, evenly_pitched(2))
BALL = Cutter(R, 0.0, evenly_pitched(2), corner=R)
NOSE = Cutter(R, 0.0, evenly_pitched(2), corner=1e-3)
RPM = np.linspace(2500.0, 6000.0, 8)


def slot(tool, krc=KRC, kac=KAC):
    edge = Edge(tool, krc, kac)
    return Cut(2, 0.0, math.pi, KTC, edge.radial(1e-3), edge=edge)


def marched_growth(structure, corner, rpm, depth, *, face=None, towards=0.0, rubbing=0.0):
    """Growth of small vibrations per tooth period, of a tool with a corner and two teeth, without helix.

    One for each speed and depth (n,), all in the same steps. The edge is summed over slices of equal height:
    chip normal to the edge, three forces of it, their parts in the plane; each mode is integrated by
    Störmer's rule. A slot, or beside a raw face at a distance: a slice cuts while its own circle is beyond
    the face. A slice that moves into the work is pushed back by its height times ``rubbing``, by its speed
    over that of the spindle.
    """
    periods, steps = 160, 300
    z = depth[:, None] * (np.arange(200) + 0.5) / 200
    kappa = np.where(z < corner, np.arccos(np.clip(1.0 - z / corner, -1.0, 1.0)), math.pi / 2)
    width = depth[:, None] / 200 / np.sin(kappa)
    chip = np.sin(kappa)  # normal to the edge, per chip in the plane
    tangential = KTC * chip * width
    inward = (KRC * np.sin(kappa) - KAC * np.cos(kappa)) * chip * width
    radius = R - corner + np.where(z < corner, corner * np.sin(kappa), corner)
    phi = math.pi * np.arange(steps) / steps
    outward = np.stack([np.sin(phi), np.cos(phi)], axis=1)
    ahead = np.stack([-np.cos(phi), np.sin(phi)], axis=1)
    reach = radius * np.cos(phi - towards)[:, None, None]
    there = np.ones(reach.shape, bool) if face is None else reach > face
    pushed, pressed = ((there * each).sum(axis=2)[:, :, None] for each in (tangential, inward))
    per_chip = pushed * ahead[:, None] - pressed * outward[:, None]
    pushed_back = rubbing * depth * there.mean(axis=2) / (2.0 * math.pi * rpm / 60.0)
    along = structure.directions[structure.axis]
    damping, square = 2.0 * structure.zeta * structure.omega, structure.omega**2
    per_force = square / structure.stiffness
    dt = (60.0 / (2 * rpm) / steps)[:, None]
    q = np.full((len(rpm), len(square)), 1e-6)
    v = np.zeros_like(q)
    tip = np.zeros((periods * steps, len(rpm), 2))
    for n in range(periods * steps):
        at = n % steps
        tip[n] = q @ along
        change = tip[n] - tip[n - steps] if n >= steps else tip[n]
        into = pushed_back[at] * (v @ along @ outward[at])
        force = (change @ outward[at])[:, None] * per_chip[at] - into[:, None] * outward[at]
        v = v + dt * (per_force * (force @ along.T) - damping * v - square * q)
        q = q + dt * v
    size = np.linalg.norm(tip.reshape(periods, steps, len(rpm), 2), axis=(1, 3))
    return (size[-1] / size[periods // 2]) ** (1.0 / (periods - 1 - periods // 2))


def dies_below_and_grows_above(corner, rpm, depth, **beside):
    """March 4 % below and above each depth; whether the boundary lies between."""
    below_and_above = np.concatenate([0.96 * depth, 1.04 * depth])
    growth = marched_growth(TWO, corner, np.tile(rpm, 2), below_and_above, **beside)
    return (growth[: len(rpm)] < 1.0).all() and (growth[len(rpm) :] > 1.0).all()


@pytest.mark.parametrize("tool", [BALL, NOSE], ids=["ball", "bull nose"])
def test_a_vibration_dies_below_the_boundary_and_grows_above_it(tool):
    rpm = RPM[[1, 5]]
    found = boundary_of_edge(TWO, slot(tool), rpm)
    assert dies_below_and_grows_above(tool.corner, rpm, found.depth)


def side(tool, direction):
    """Side cut of half of the radius, and what the march takes of its face."""
    entry, leave = immersion(direction, R / 2, 2 * R)
    edge, towards = Edge(tool, KRC, KAC), 0.0 if direction == "up" else math.pi
    cut = Cut(2, entry, leave, KTC, edge.radial(1e-3), edge=edge, face=RawFace(R / 2, towards))
    return cut, {"face": R / 2, "towards": towards}


def test_beside_a_raw_face_what_is_engaged_alone_damps_the_process():
    cut, beside = side(BALL, "up")
    damped, rpm = replace(cut, damping=DAMPING), RPM[[1]]
    depth, without = (boundary_of_edge(TWO, one, rpm).depth for one in (damped, cut))
    assert depth[0] > 1.1 * without[0]
    assert dies_below_and_grows_above(R, rpm, depth, rubbing=DAMPING, **beside)


@pytest.mark.parametrize("direction", ["up", "down"])
@pytest.mark.parametrize("tool", [BALL, NOSE], ids=["ball", "bull nose"])
def test_beside_a_raw_face_each_height_is_engaged_by_its_own_circle(tool, direction):
    """Half of the radius is cut: a ball that is 0.6 mm deep does not yet reach the face."""
    cut, beside = side(tool, direction)
    rpm = RPM[[1, 5]]
    found = boundary_of_edge(TWO, cut, rpm)
    whole = boundary_of_edge(TWO, replace(cut, face=None), rpm)
    assert dies_below_and_grows_above(tool.corner, rpm, found.depth, **beside)
    assert tool is NOSE or (found.depth > 1.5 * whole.depth).all()
    assert cut.at_depth(0.6e-3).exit == cut.at_depth(0.6e-3).entry or tool is NOSE


def test_of_a_flat_end_nothing_changes():
    cut = Cut(2, 0.3, 2.0, KTC, KRC)
    plain, found = stability_boundary(TWO, cut, RPM), boundary_of_edge(TWO, cut, RPM)
    edged = boundary_of_edge(TWO, Cut(2, 0.3, 2.0, KTC, KRC, edge=Edge(FLAT, KRC, KAC)), RPM)
    assert np.array_equal(found.depth, plain.depth)
    assert found.boundary() is found.solved[0]
    assert edged.depth == pytest.approx(plain.depth, rel=1e-9)


def test_a_lead_angle_has_the_radial_coefficient_of_its_one_inclination():
    kappa = math.radians(45)
    leading = Cutter(R, 0.0, evenly_pitched(2), taper=math.pi / 2 - kappa)
    found = boundary_of_edge(TWO, slot(leading), RPM)
    same = Cut(2, 0.0, math.pi, KTC, KRC * math.sin(kappa) - KAC * math.cos(kappa))
    assert found.depth == pytest.approx(stability_boundary(TWO, same, RPM).depth, rel=1e-9)


def test_the_boundary_of_a_ball_is_that_of_the_coefficients_at_its_own_depth():
    """Of a ball the means over the height are closed forms: with κ at the top, h = R (1 − cos κ)."""
    found = boundary_of_edge(TWO, slot(BALL), RPM)
    for rpm, depth in zip(RPM, found.depth, strict=True):
        top = math.acos(1.0 - depth / R)
        sine = (top / 2 - math.sin(2 * top) / 4) / (1.0 - math.cos(top))
        cosine = math.sin(top) ** 2 / 2 / (1.0 - math.cos(top))
        same = Cut(2, 0.0, math.pi, KTC, KRC * sine - KAC * cosine)
        alone = stability_boundary(TWO, same, np.array([rpm])).depth[0]
        assert depth == pytest.approx(alone, rel=5e-3)
    one_inclination = stability_boundary(TWO, slot(BALL).at_depth(1e-4), RPM).depth
    assert np.abs(np.log(found.depth / one_inclination)).max() > 0.05


def test_the_samples_of_a_ball_follow_its_coefficients():
    deviations = 0.01 * np.random.default_rng(3).normal(size=(5, 3 * len(TWO.omega) + 2))
    found = boundary_of_edge(TWO, slot(BALL), RPM)
    exact = depths_anew(TWO, slot(BALL), RPM, deviations)
    ratio = found.samples(TWO, deviations) / exact
    assert np.median(np.abs(np.log(ratio))) < 0.02
