"""How the arm gives way at the tip: joints that are coupled, a base and a bracket that bend, modes, friction.

The tip's mass moves on a stiffness that depends on its place on the plate, with damping that is not
proportional and dry friction that sticks before it slips. Structural modes beside it are oscillators of their
own, which the force and the start of every pass excite.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from virtual_cell.arm import Arm
from virtual_cell.hidden import drawn_size
from virtual_cell.units import UM, Array
from virtual_cell.world.draws import uniform

_STEP = 0.002  # s, of the motion of the tip
Compliance = Callable[[Array], Array]


@dataclass(frozen=True)
class BendingArm(Arm):
    """An arm whose joints pull on each other, with a base and a bracket that bend.

    Attributes
    ----------
    coupled : (6, 6) relative compliance of the joints: ones on its diagonal, what couples them beside it.
    base : rad/(N m), by which the base tilts about each horizontal axis.
    bracket : (3, 3) m/N, of what is between flange and tip, along the tool's axes.
    """

    coupled: Array
    base: float
    bracket: Array

    def yields(self, q: Array, force: Array) -> Array:
        """Return the displacement (3,), m, of the tip under a force (3,), N, both in the base frame."""
        linear, root = self.jacobian(q)[:3], 1.0 / np.sqrt(self.stiffness)
        moved = linear @ (root * (self.coupled @ (root * (linear.T @ force))))
        position, axes = self.pose(q)
        moment = np.cross(position, force)
        moved = moved + np.cross(self.base * np.array([moment[0], moment[1], 0.0]), position)
        return np.asarray(moved + axes @ (self.bracket @ (axes.T @ force)))

    @property
    def joints_alone(self) -> BendingArm:
        """The arm with a rigid base and a rigid bracket."""
        return replace(self, base=0.0, bracket=np.zeros((3, 3)))


@dataclass(frozen=True)
class Mode:
    """A structural mode seen at the tip.

    Attributes
    ----------
    hz, damping : frequency and damping ratio. towards : (3,) its direction at the tip. stiffness : N/m.
    kick : m, height to which the start of a pass makes it swing.
    """

    hz: float
    damping: float
    towards: Array
    stiffness: float
    kick: float

    @property
    def compliance(self) -> Array:
        """Static compliance (3, 3), m/N."""
        return np.outer(self.towards, self.towards) / self.stiffness

    def rung(self, push: Array) -> Array:
        """Return its swing (n,), m, along its direction under a force (n,), N, every ``_STEP`` s."""
        from scipy.signal import bilinear, lfilter

        w = 2.0 * math.pi * self.hz
        above, below = bilinear(
            [1.0 / self.stiffness], [1.0 / w**2, 2.0 * self.damping / w, 1.0], 1.0 / _STEP
        )
        return np.asarray(lfilter(above, below, push))

    def kicked(self, since: Array) -> Array:
        """Return its swing (n,), m, along z at times since the start of a pass, s."""
        w, after = 2.0 * math.pi * self.hz, np.maximum(since, 0.0)
        return np.asarray(self.kick * np.exp(-self.damping * w * after) * np.sin(w * after))


@dataclass(frozen=True)
class Friction:
    """Dry friction in gears and bearings, at the tip: Dahl's, which is a spring before it slips.

    Attributes
    ----------
    along : (3,) direction. level : N, at which it slips. length : m, of presliding.
    """

    along: Array
    level: float
    length: float

    def after(self, friction: float, moved: float) -> float:
        """Return the friction, N, after the tip has moved by so much from where it was ``friction``."""
        if moved == 0.0:
            return friction
        limit = math.copysign(self.level, moved)
        return limit + (friction - limit) * math.exp(-abs(moved) / self.length)


@dataclass(frozen=True)
class Structure:
    """The arm at one pose.

    Attributes
    ----------
    in_tests, in_cut : (n, 2) → (n, 3, 3), m/N, without the modes. mass : (3, 3), kg, as it is.
    lossy : N s/m, what the damping has beside a0 mass + a1 stiffness.
    """

    in_tests: Compliance
    in_cut: Compliance
    mass: Array
    a0: float
    a1: float
    lossy: Array
    modes: tuple[Mode, ...]
    friction: Friction

    def tested(self, points: Array) -> Array:
        """Return the static compliance (n, 3, 3), m/N, that load tests meet, but for the friction."""
        return np.asarray(self.in_tests(points) + sum(mode.compliance for mode in self.modes))

    def receptance(self, at: Array, frequency: Array) -> Array:
        """Return the receptance (n, 3, 3), complex, m/N, at a point (2,), m; ``frequency`` (n,), Hz."""
        omega = 2.0 * math.pi * frequency[:, None, None]
        stiffness = np.linalg.inv(self.in_tests(at[None])[0])
        damping = self.a0 * self.mass + self.a1 * stiffness + self.lossy
        total = np.linalg.inv(stiffness - omega**2 * self.mass + 1j * omega * damping)
        for mode in self.modes:
            ratio = omega / (2.0 * math.pi * mode.hz)
            total = total + mode.compliance / (1.0 - ratio**2 + 2j * mode.damping * ratio)
        return np.asarray(total)


def pulled(structure: Structure, points: Array, force: Array) -> Array:
    """Return where slow forces (n, 3), N, at points (n, 2), m, bring the tip from rest: (n, 3), m."""
    compliance, friction = structure.tested(points), structure.friction
    moved = np.einsum("nij,nj->ni", compliance, force)
    for _ in range(3):  # the friction depends on the way, and the way on the friction a little
        way = moved @ friction.along
        holds = friction.level * np.sign(way) * -np.expm1(-np.abs(way) / friction.length)
        left = force - holds[:, None] * friction.along
        moved = np.einsum("nij,nj->ni", compliance, left)
    return np.asarray(moved)


def heights(structure: Structure, places: Sequence[Array], loads: Sequence[Array], shown: int) -> list[Array]:
    """Return the height of the tip, pass by pass, (n,) m, every :data:`_STEP` s.

    Parameters
    ----------
    places : (n, 2) m, of the tip in each pass and on its way back. loads : (n, 3) N, work frame.
    shown : number of steps at the beginning of each pass that are wanted.
    """
    state, friction, held = np.zeros(6), structure.friction, 0.0
    along, found = friction.along, []
    for at, load in zip(places, loads, strict=True):
        step, push = _steps(structure, at)
        drag = push @ along
        pushed = np.einsum("nij,nj->ni", push, load)
        z = np.empty(len(at))
        for i in range(len(at)):
            before = float(along @ state[:3])
            state = step[i] @ state + pushed[i] - held * drag[i]
            held = friction.after(held, float(along @ state[:3]) - before)
            z[i] = state[2]
        found.append(z)
    for mode in structure.modes:
        swing = mode.rung(np.concatenate(loads) @ mode.towards) * float(mode.towards[2])
        ends = np.cumsum([len(load) for load in loads])[:-1]
        since = np.arange(max(len(load) for load in loads)) * _STEP
        kicked = mode.kicked(since)
        parts = zip(found, np.split(swing, ends), strict=True)
        found = [z + part + kicked[: len(z)] for z, part in parts]
    return [z[:shown] for z in found]


def step_places(speed: float, lead: float, period: float) -> Array:
    """Return places of the axis along a pass and beyond its end, (n,) m, at the steps of a period, s."""
    return np.asarray(-lead + speed * _STEP * np.arange(round(period / _STEP)))


def _steps(structure: Structure, at: Array) -> tuple[Array, Array]:
    """Trapezoidal steps of position and velocity (n, 6, 6), and what a force does in them (n, 6, 3)."""
    h, one = _STEP, np.eye(3)
    stiffness = np.linalg.inv(structure.in_cut(at))
    damping = structure.a0 * structure.mass + structure.a1 * stiffness + structure.lossy
    inverse = np.linalg.inv(structure.mass + 0.5 * h * damping + 0.25 * h**2 * stiffness)
    from_speed = inverse @ (structure.mass - 0.5 * h * damping - 0.25 * h**2 * stiffness)
    from_place, from_force = -h * (inverse @ stiffness), h * inverse
    step = np.empty((len(at), 6, 6))
    step[:, 3:, :3], step[:, 3:, 3:] = from_place, from_speed
    step[:, :3, :3] = one + 0.5 * h * from_place
    step[:, :3, 3:] = 0.5 * h * (one + from_speed)
    return step, np.concatenate([0.5 * h * from_force, from_force], axis=1)


def drawn_arm(rng: np.random.Generator, arm: Arm) -> BendingArm:
    """Draw what an arm has beside its joints.

    Joints coupled by up to 1–8 % of the geometric mean of two; base and bracket with some per cent of the
    whole compliance each (Abele et al. 2007; Schneider et al. 2014: a fifth lies outside of the joints).
    """
    beside = np.triu(rng.uniform(-1.0, 1.0, (6, 6)), 1) * drawn_size(rng, 0.01, 0.08)
    root = rng.standard_normal((3, 3))
    bracket = root @ root.T
    bracket *= drawn_size(rng, 1.5e-8, 6e-8) / float(np.trace(bracket) / 3.0)
    return BendingArm(
        arm.dh,
        arm.tip,
        arm.tool_axes,
        arm.stiffness,
        arm.masses,
        np.eye(6) + beside + beside.T,
        drawn_size(rng, 4e-9, 2e-8),
        bracket,
    )


def drawn_modes(rng: np.random.Generator, stiffness: float) -> tuple[Mode, ...]:
    """Draw one or two modes at 6–25 Hz, 8–40 times as stiff as the tip, ``stiffness`` N/m, is along z."""
    modes = []
    for _ in range(int(rng.integers(1, 3))):
        towards = rng.standard_normal(3)
        towards /= np.linalg.norm(towards)
        rigid, kick = drawn_size(rng, 8.0, 40.0) * stiffness, drawn_size(rng, 0.2, 2.0) * UM
        modes.append(Mode(uniform(rng, 6.0, 25.0), drawn_size(rng, 0.015, 0.06), towards, rigid, kick))
    return tuple(modes)


def drawn_friction(rng: np.random.Generator) -> Friction:
    """Draw friction of 1–8 N at the tip, which slips after 15–150 µm."""
    along = np.array([0.0, 0.0, 1.0]) + rng.normal(0.0, 0.5, 3)
    return Friction(
        along / np.linalg.norm(along), drawn_size(rng, 1.0, 8.0), drawn_size(rng, 15.0, 150.0) * UM
    )


def drawn_loss(rng: np.random.Generator, damping: Array) -> Array:
    """Draw what damping (3, 3), N s/m, has beside its proportional part: 10–40 % of it, not its shape."""
    root = rng.standard_normal((3, 3))
    loss = root @ root.T
    return np.asarray(loss * (uniform(rng, 0.1, 0.4) * float(np.trace(damping) / np.trace(loss))))
