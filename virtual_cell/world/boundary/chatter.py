"""Cutting tests of a real machine, marched in time: chatter grows until teeth leave the cut.

All tests march together, in equal steps of the spindle's angle. A step takes longer where the spindle has
slowed down, so a wandering spindle changes the waves that fit between two teeth. The state moves exactly
under a force that is held over a step: that of the middle of the step, extrapolated from the two before.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from virtual_cell.regeneration import cleared
from virtual_cell.units import RPM, Array
from virtual_cell.world.boundary.flank import Flank

_MOST_FEEDS = 12.0  # per tooth, by which a tip may stray before the test is stopped


@dataclass(frozen=True)
class Law:
    """Force of a chip: N/m² by its thickness, and a ploughing part (N/m) that thin chips have less of.

    ``thin``: m, thickness over which the ploughing part rises to its full value.
    """

    ktc: float
    krc: float
    kac: float
    kte: float
    kre: float
    thin: float


@dataclass(frozen=True)
class Cuts:
    """n tests as they really are.

    Attributes
    ----------
    a, b, c : (n, 2m, 2m), (2m, 2), (2, 2m): state of the structure, ẋ = A x + B f, tip = C x.
    law, flank : of the force. radius, feed : m, feed per tooth.
    teeth : (N,) places of the teeth, rad, clockwise; reach : (N,) how much further than nominal each cuts, m.
    rpm, depth : (n,) true mean speed, rev/min, and depth, m. entry, leave : (n,) rad from +y clockwise.
    strength : (n, 3) factors on the tangential, radial and axial force of the chip.
    worn : (n,) factor on the width of the wear land.
    speed : (n, turns) relative deviation of the speed in each turn. clog : (n, turns) factor on the chip
        force of that turn. wave : (n, turns) factor on the depth in each turn, of uneven stock.
    grain : relative standard deviation of the force from step to step.
    settling : turns over which the tool enters.
    play, play_force : of a joint with a gap: half its width, m, and by how much less stiff (N/m) it is
        inside, in x and y.
    friction : (2,) N, dry, in x and y; sliding : m/s, the speed at which it is full.
    """

    a: Array
    b: Array
    c: Array
    law: Law
    flank: Flank
    radius: float
    feed: float
    teeth: Array
    reach: Array
    rpm: Array
    depth: Array
    entry: Array
    leave: Array
    strength: Array
    worn: Array
    speed: Array
    clog: Array
    wave: Array
    grain: float
    settling: float
    play: float = 0.0
    play_force: tuple[float, float] = (0.0, 0.0)
    friction: tuple[float, float] = (0.0, 0.0)
    sliding: float = 1.0

    @property
    def turns(self) -> int:
        """Turns of the spindle that are marched."""
        return int(self.speed.shape[1])


@dataclass(frozen=True)
class Course:
    """What happened: tip (n, steps, 2), m, over the last turns; force on the tool (n, steps, 3), N, or None.

    ``seconds``: (n, turns) each turn took. ``made``: (n,) turns until the test was stopped, all where it was
    not: nobody goes on when the tip strays by many feeds, and no law of the force holds for it.
    """

    tip: Array
    force: Array | None
    seconds: Array
    made: np.ndarray

    @property
    def stopped(self) -> np.ndarray:
        """(n,) whether a test was stopped."""
        stopped: np.ndarray = self.made < self.seconds.shape[1]
        return stopped


def march(cuts: Cuts, per_turn: int, last: int, rng: np.random.Generator, *, forces: bool = False) -> Course:
    """Cut all tests, in ``per_turn`` steps of a turn; keep the tip of the ``last`` turns.

    The tool starts at rest. ``forces``: keep the forces of all turns.
    """
    n, turns = len(cuts.rpm), cuts.turns
    dt = 60.0 / (cuts.rpm * per_turn)
    angle = 2.0 * math.pi * (np.arange(per_turn) + 0.5) / per_turn
    place = np.round(cuts.teeth * per_turn / (2.0 * math.pi)).astype(int)
    feed = cuts.feed * len(place) * np.mod(np.roll(place, -1) - place, per_turn) / per_turn
    exact, push = _held(cuts, dt)
    rated = cuts.a * dt[:, None, None]
    surface, state = np.zeros((n, per_turn)), np.zeros((n, cuts.a.shape[1]))
    m = cuts.a.shape[1] // 2
    lines = cuts.b[m:]
    tips = np.zeros((n, last * per_turn, 2), dtype=np.float32)
    kept = np.zeros((n, turns * per_turn, 3), dtype=np.float32) if forces else None
    before = np.zeros((n, 2))
    surface_speed = cuts.rpm * RPM * cuts.radius
    going, made = np.ones(n, dtype=bool), np.zeros(n, dtype=int)
    for turn in range(turns):
        slower = -cuts.speed[:, turn]  # a slower turn takes longer
        step, pushed = _stretched(exact, push, rated, slower)
        into_slope = 1.0 / (surface_speed * (1.0 + cuts.speed[:, turn]))
        factor = cuts.strength * cuts.clog[:, turn, None]
        going &= np.abs(state[:, :m] @ lines).max(axis=1) < _MOST_FEEDS * cuts.feed
        made += going
        state[~going] = 0.0
        entered = np.where(going, cuts.depth * cuts.wave[:, turn], 0.0)
        rough = 1.0 + cuts.grain * rng.standard_normal((per_turn, n))
        for k in range(per_turn):
            i = turn * per_turn + k
            tip, velocity = state[:, :m] @ lines, state[:, m:] @ lines
            at = (k + place) % per_turn
            sine, cosine = np.sin(angle[at]), np.cos(angle[at])
            inside = (angle[at] > cuts.entry[:, None]) & (angle[at] < cuts.leave[:, None])
            reach = tip[:, :1] * sine + tip[:, 1:] * cosine + cuts.reach
            chip = cleared(surface, at, reach, np.where(inside, feed * sine, 0.0))
            slope = (velocity[:, :1] * sine + velocity[:, 1:] * cosine) * into_slope[:, None]
            depth = entered * rough[k] * min(1.0, (i + 1.0) / (cuts.settling * per_turn))
            law = _along_edges(cuts, chip, slope, factor)
            force = _in_plane(law, sine, cosine) * depth[:, None]
            if kept is not None:
                kept[:, i] = force
            if turn >= turns - last:
                tips[:, i - (turns - last) * per_turn] = tip
            load = force[:, :2] + _joint(cuts, tip, velocity)
            held = 1.5 * load - 0.5 * (before if i else load)
            before = load
            state = np.matmul(step, state[:, :, None])[:, :, 0] + np.matmul(pushed, held[:, :, None])[:, :, 0]
    seconds = 60.0 / (cuts.rpm[:, None] * (1.0 + cuts.speed))
    return Course(tips, kept, seconds, made)


def _held(cuts: Cuts, dt: Array) -> tuple[Array, Array]:
    """Exact step (n, 2m, 2m), and effect (n, 2m, 2) of a unit force held over it."""
    from scipy.linalg import expm

    size = cuts.a.shape[1]
    joined = np.zeros((len(dt), size + 2, size + 2))
    joined[:, :size, :size], joined[:, :size, size:] = cuts.a, cuts.b
    both = expm(joined * dt[:, None, None])
    return both[:, :size, :size], both[:, :size, size:]


def _stretched(step: Array, push: Array, rated: Array, longer: Array) -> tuple[Array, Array]:
    """Step and effect of a step that is longer by a share (n,), to second order in it."""
    by = rated * longer[:, None, None]
    first = np.matmul(step, by)
    return step + first + 0.5 * np.matmul(first, by), push * (1.0 + longer[:, None, None])


def _along_edges(cuts: Cuts, chip: Array, slope: Array, factor: Array) -> tuple[Array, Array, Array]:
    """Tangential, radial and axial force (n, N) per depth, N/m, of teeth that meet a slope."""
    law, cutting = cuts.law, chip > 0.0
    ploughed = 1.0 - np.exp(-chip / law.thin)
    pressed = np.where(cutting, cuts.flank.squeezed(slope, cuts.worn[:, None]), 0.0)
    tangential = law.ktc * factor[:, :1] * chip + law.kte * ploughed + cuts.flank.friction * pressed
    radial = law.krc * factor[:, 1:2] * chip + law.kre * ploughed + pressed
    return tangential, radial, law.kac * factor[:, 2:] * chip


def _in_plane(of_edges: tuple[Array, Array, Array], sine: Array, cosine: Array) -> Array:
    """Force on the tool (n, 3) per depth, N/m, of teeth that stand in these directions."""
    tangential, radial, axial = of_edges
    parts = (-tangential * cosine - radial * sine, tangential * sine - radial * cosine, axial)
    return np.stack([part.sum(axis=1) for part in parts], axis=1)


def _joint(cuts: Cuts, tip: Array, velocity: Array) -> Array:
    """Force (n, 2), N, on the tip of joints that are no springs: a gap, and dry friction."""
    force = np.zeros_like(tip)
    if cuts.play:
        force += np.array(cuts.play_force) * np.clip(tip, -cuts.play, cuts.play)
    if any(cuts.friction):
        force -= np.array(cuts.friction) * np.tanh(velocity / cuts.sliding)
    return force
