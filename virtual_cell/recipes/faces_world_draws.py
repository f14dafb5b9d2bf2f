"""A milling arm in a real workshop, drawn: its mechanics, metal, tools, programme, scanner and load tests.

Both styles draw the world from the same ranges; they differ in their programme.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from virtual_cell.arm import rotation_rpy
from virtual_cell.face import Passes
from virtual_cell.hidden import drawn_size
from virtual_cell.milling import Coefficients, scattered
from virtual_cell.recipes.faces_draws import Case, Milling
from virtual_cell.recipes.faces_world_programme import PROGRAMMES, cases, milling, plate
from virtual_cell.recipes.irb6640 import ARM, DAMPING, MASS, NEAR, WORK_MM
from virtual_cell.side_force import SideCut, full_cut
from virtual_cell.tip_compliance import tip_compliance
from virtual_cell.units import DEG, MM, UM, Array
from virtual_cell.world.draws import either_sign, uniform
from virtual_cell.world.faces import fixture, load_test, mount, path, scan, servo, structure, warmth
from virtual_cell.world.faces.finish import Cause
from virtual_cell.world.faces.load_test import LoadTest
from virtual_cell.world.faces.scan import Scanner
from virtual_cell.world.faces.structure import BendingArm, Compliance, Structure

_LEAD_MM = (4.0, 9.0)  # of the path beyond where the cutter touches the plate
_DAMPED = {wrist: np.array(pair) for wrist, pair in DAMPING.items()}


@dataclass(frozen=True)
class Metal:
    """Work and edges through a session.

    Attributes
    ----------
    common, own : relative standard deviations in each face, of all coefficients together and of each.
    drift : relative change of all over the session. blunts : relative growth of the edge forces per metre.
    other_bar : relative change of all from a share of the session on, and that share.
    """

    common: float
    own: float
    drift: float
    blunts: float
    other_bar: tuple[float, float]

    def cut(self, metal: Coefficients, share: float, metres: float, rng: np.random.Generator) -> Coefficients:
        """Return the coefficients of a face after a share of the session and some metres of cut."""
        factor = (1.0 + self.common * rng.standard_normal()) * (1.0 + self.drift * share)
        factor *= 1.0 + (self.other_bar[0] if share >= self.other_bar[1] else 0.0)
        edge = factor * (1.0 + self.blunts * metres)
        now = replace(
            metal.softened(factor), kte=metal.kte * edge, kre=metal.kre * edge, kae=metal.kae * edge
        )
        return scattered(now, self.own, rng)


@dataclass(frozen=True)
class Place:
    """Where the plate lies for a pose, and how the wrist is turned.

    ``origin`` (3,) m, of the plate's corner in the base; ``axes`` (3, 3) of the tool, as columns.
    """

    origin: Array
    axes: Array

    def compliance(self, arm: BendingArm, size: tuple[float, float]) -> Compliance:
        """Return the compliance (n, 3, 3), m/N, of the tip over the plate."""
        return tip_compliance(arm, self.origin, self.axes, size, NEAR)


@dataclass(frozen=True)
class Always:
    """What shapes every face, in every batch, at least a little.

    ``warm`` spindle, ``bow`` of the clamped work, ``tilt`` of the spindle, ``servo`` that droops, ``gears``
    that turn unevenly, raw ``stock`` that is no plane.
    """

    warm: warmth.Warmth
    bow: fixture.Fixture
    tilt: mount.Mount
    servo: servo.Servo
    gears: path.GearWave
    stock: path.Stock

    @property
    def causes(self) -> tuple[Cause, ...]:
        """All of them."""
        return (self.warm, self.bow, self.tilt, self.servo, self.gears, self.stock)


@dataclass(frozen=True)
class Workshop:
    """What a batch of faces is made on and with.

    Attributes
    ----------
    size : of the plate along work x, y, m. corner : radius of the teeth's corners, m. lead : of the path, m.
    arm, places, poses : the arm, and for each pose where it works and how it gives way there.
    yaw : of each wrist, rad. masses : (3, 3) kg, as declared.
    depth_error : m, standard deviation of the axial depth.
    speed_error : largest relative error of the spindle's speed. always : what shapes every face.
    troubles : what is hidden in this batch, and is none of these. clumped : whether repeats follow one
    another.
    """

    size: tuple[float, float]
    milling: Milling
    corner: float
    lead: float
    arm: BendingArm
    places: Mapping[str, Place]
    poses: Mapping[str, Structure]
    yaw: Mapping[str, float]
    masses: Mapping[str, Array]
    loads: LoadTest
    scanner: Scanner
    cases: tuple[Case, ...]
    clumped: bool
    hammered: bool
    metal: Metal
    depth_error: float
    speed_error: float
    pauses: path.Pauses
    always: Always
    troubles: tuple[Cause, ...] = ()

    def passes(self, orientation: str) -> Passes:
        """Return the passes along the plate (L) or across (T)."""
        mill, along = self.milling, 0 if orientation == "L" else 1
        return Passes(
            self.size, along, mill.width, mill.tool.radius, mill.speed, mill.tool.radius + self.lead
        )


def drawn(rng: np.random.Generator, style: str) -> Workshop:
    """Draw a cell with everything that is always there, and nothing that is hidden on purpose."""
    programme = PROGRAMMES[style]
    mill = milling(rng, programme)
    size = plate(rng, mill.width)
    programmed = cases(rng, programme)
    names = sorted({case.pose for case in programmed})
    yaw = {"A": math.pi, "B": math.pi - uniform(rng, 12.0, 35.0) * DEG}
    arm, places, poses = _poses(rng, size, names, yaw)
    usual = full_cut(side_cut(mill, programmed[0].depth_mm * MM, size[0]))
    always = Always(
        warm=warmth.drawn(rng),
        bow=fixture.drawn(rng),
        tilt=mount.drawn(rng),
        servo=servo.drawn(rng, usual),
        gears=path.drawn_gears(rng),
        stock=path.Stock(drawn_size(rng, 5.0, 50.0) * UM),
    )
    return Workshop(
        size=size,
        milling=mill,
        corner=uniform(rng, 0.1, 0.4) * MM,
        lead=uniform(rng, *_LEAD_MM) * MM,
        arm=arm,
        places=places,
        poses=poses,
        yaw=yaw,
        masses={name: load_test.mass_error(rng, pose.mass) for name, pose in poses.items()},
        loads=load_test.drawn(rng, size, many=programme.many_loads),
        scanner=scan.drawn(rng, size, known=programme.known, sides=programme.sides),
        cases=programmed,
        clumped=bool(rng.uniform() < programme.clumped),
        hammered=bool(rng.uniform() < programme.struck),
        metal=_metal(rng),
        depth_error=drawn_size(rng, 10.0, 100.0) * UM,
        speed_error=drawn_size(rng, 0.0005, 0.005),
        pauses=path.drawn_pauses(rng),
        always=always,
    )


def side_cut(milling: Milling, depth: float, length: float, metal: Coefficients | None = None) -> SideCut:
    """Return the cut of a pass of some ``length`` at an axial ``depth``, both m."""
    mill = milling
    return SideCut(
        mill.tool, metal or mill.metal, mill.spindle_rpm, mill.speed, depth, mill.width, "down", length
    )


def _metal(rng: np.random.Generator) -> Metal:
    other = either_sign(rng) * uniform(rng, 0.01, 0.04) if rng.uniform() < 0.25 else 0.0
    return Metal(
        common=drawn_size(rng, 0.003, 0.01),
        own=drawn_size(rng, 0.003, 0.01),
        drift=either_sign(rng) * drawn_size(rng, 0.005, 0.03),
        blunts=drawn_size(rng, 0.001, 0.008),
        other_bar=(other, uniform(rng, 0.3, 0.7)),
    )


def _poses(
    rng: np.random.Generator, size: tuple[float, float], names: list[str], yaw: Mapping[str, float]
) -> tuple[BendingArm, dict[str, Place], dict[str, Structure]]:
    """Draw an arm and where the plate lies; again where that is out of reach."""
    while True:
        joints = replace(ARM, stiffness=ARM.stiffness * np.exp(rng.normal(0.0, 0.2, 6)))
        arm = structure.drawn_arm(rng, joints)
        first = np.array(WORK_MM) + rng.uniform(-1.0, 1.0, 3) * np.array([150.0, 220.0, 120.0])
        apart = np.array([rng.uniform(-250.0, -80.0), rng.uniform(220.0, 450.0), 0.0])
        origins = {"1": first * MM, "2": (first + apart) * MM}
        friction = structure.drawn_friction(rng)
        seeds = dict(zip(names, rng.spawn(len(names)), strict=True))
        try:
            places = {name: Place(origins[name[1]], rotation_rpy(0.0, 0.0, yaw[name[0]])) for name in names}
            poses = {
                name: _structure(seeds[name], name[0], places[name].compliance(arm, size), friction, size)
                for name in names
            }
        except (RuntimeError, np.linalg.LinAlgError):
            continue
        return arm, places, poses


def _structure(
    rng: np.random.Generator,
    wrist: str,
    compliance: Compliance,
    friction: structure.Friction,
    size: tuple[float, float],
) -> Structure:
    light, lossy = np.diag(np.exp(rng.normal(0.0, 0.06, 3))), np.exp(rng.normal(0.0, 0.25, 2))
    mass = light @ MASS[wrist] @ light
    a0, a1 = (_DAMPED[wrist] * lossy).tolist()
    static = np.linalg.inv(compliance(np.array([size]) / 2.0)[0])
    modes = structure.drawn_modes(rng, 1.0 / float(np.linalg.inv(static)[2, 2]))
    loss = structure.drawn_loss(rng, a0 * mass + a1 * static)
    return Structure(compliance, compliance, mass, a0, a1, loss, modes, friction)
