"""What makes an arm stand beside where its geometry has it: each effect linear in its own parameters.

An effect either turns (or shifts) one joint beyond its reading, or moves the measured point as a whole. Its
parameters have a prior of mean 0, so that what the poses do not show stays 0 (standard deviations below).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from metro.robot.calibration.model import State
from metro.robot.calibration.poses import Poses
from metro.robot.rigid_body import GRAVITY
from metro.units import DEG, Array

PLAUSIBLE = 5e-3  # rad or m: standard deviation of what a correction or an effect may be before the data
OF_CURVE = 1e-3  # and of a curve's values: 3.4 arcmin, some times the transmission error of a precision gear
SPACING = 4.0 * DEG  # of a curve's knots: it follows up to some 36 cycles per turn
SHIFT_SPACING = 0.02  # m, of a joint that shifts
OLD = 1e-3  # K or s of range below which nothing can be said of a drift

LOADED = 1e3  # N m of the load, to which a joint's compliance is given: it then turns by some 5 mrad
COMPLIANCE = "compliance"  # name of that parameter
SHORT = 0.01  # of the longest offset or length of a row: along less than that no mass lies
Basis = Callable[[Poses, State], Array]
Link = tuple[int, bool]  # joint from 0, and whether its length is meant and not its offset


@dataclass(frozen=True, eq=False)
class Effect:
    """One effect.

    Attributes
    ----------
    code : its kind; ``title`` in words.
    joint : that it turns, from 0; −1 where it moves the point as a whole.
    basis : (m, k) by the poses and the geometry: what the joint turns by per unit of each parameter; of one
        that moves the point (m, 3, k), m.
    names : of its k parameters; empty for those of a curve.
    prior : standard deviation of a parameter before the data.
    late : whether it is looked for only after all that are no curve: what has no shape explains anything.
    """

    code: str
    title: str
    joint: int
    basis: Basis
    names: tuple[str, ...] = ()
    prior: float = PLAUSIBLE
    late: bool = False

    @property
    def label(self) -> str:
        """What it is called in tables."""
        return f"{self.title}, joint {self.joint + 1}" if self.joint >= 0 else self.title


def library(poses: Poses, nominal: State, up: Array) -> tuple[Effect, ...]:
    """Return the effects that these poses may show.

    ``nominal``: rows of the arm. ``up`` (3,): the vertical in the base frame of the rows.
    """
    links, joints = _links(nominal), range(len(nominal.rows))
    loaded = bool(np.ptp(poses.payload) > 0.0)
    return (
        *(effect for joint in joints for effect in _of_joint(joint, nominal, poses)),
        *(effect for joint in joints for effect in _of_gravity(joint, nominal, links, up, loaded)),
        *_of_all(poses, links, up, loaded),
    )


def _links(nominal: State) -> tuple[Link, ...]:
    """Return along what the masses of an arm lie: the offset and the length of each row that has one."""
    size = np.abs(nominal.rows[:, 2:4])
    kinds = ((joint, kind) for joint in range(len(size)) for kind in (0, 1))
    return tuple((joint, kind == 1) for joint, kind in kinds if size[joint, kind] > SHORT * size.max())


def _of_joint(joint: int, nominal: State, poses: Poses) -> Iterator[Effect]:
    shifts = bool(nominal.prismatic[joint])
    if not shifts:
        names = ("sin q", "cos q", "sin 2q", "cos 2q")
        yield Effect("eccentricity", "gear eccentricity", joint, _eccentricity(joint), names)
    if np.ptp(poses.came[:, joint]) > 0.0:
        yield Effect("approach", "direction of approach", joint, _approach(joint), ("half play",))
    curve = _curve(joint, SHIFT_SPACING if shifts else SPACING, shifts, poses)
    yield Effect("curve", "curve of the reading", joint, curve, (), OF_CURVE, late=True)


def _of_gravity(
    joint: int, nominal: State, links: Sequence[Link], up: Array, loaded: bool
) -> Iterator[Effect]:
    # A mass along a joint's own offset lies on its axis.
    own = tuple(link for link in links if link[0] >= joint and link != (joint, False))
    if nominal.prismatic[joint] or not own:
        return
    elasticity = _elasticity(joint, own, up, loaded)
    yield Effect("elasticity", "elasticity under gravity", joint, elasticity, _names(own, loaded))
    yield Effect("torque_side", "play by the side of gravity's torque", joint, _side(joint, up), ("play",))


def _of_all(poses: Poses, links: Sequence[Link], up: Array, loaded: bool) -> Iterator[Effect]:
    # The first link turns with the first joint alone, as does an error of its row.
    own = tuple(link for link in links if link[0] > 0)
    tilt, title = _base_tilt(own, up, loaded), "tilt of the base under the arm's weight"
    yield Effect("base_tilt", title, -1, tilt, _names(own, loaded))
    if np.ptp(poses.time) > OLD:
        centre, span = float(np.mean(poses.time)), float(np.ptp(poses.time))
        moved = _drift(lambda p: (p.time - centre) / span)
        yield Effect("drift", "drift with time", -1, moved, ("x", "y", "z"))
    if np.isfinite(poses.temperature).all() and np.ptp(poses.temperature) > OLD:
        middle, range_ = float(np.mean(poses.temperature)), float(np.ptp(poses.temperature))
        warm = _warmth(lambda p: (p.temperature - middle) / range_)
        yield Effect("warmth", "growth with temperature", -1, warm, ("x", "y", "z", "scale"))


def _names(links: Sequence[Link], loaded: bool) -> tuple[str, ...]:
    own = tuple(f"{'length' if length else 'offset'} of link {joint + 1}" for joint, length in links)
    return (*own, COMPLIANCE) if loaded else own


def _eccentricity(joint: int) -> Basis:
    def basis(poses: Poses, _state: State) -> Array:
        q = poses.q[:, joint]
        return np.column_stack([np.sin(q), np.cos(q), np.sin(2 * q), np.cos(2 * q)])

    return basis


def _moments(links: Sequence[Link], poses: Poses, state: State, up: Array) -> list[Array]:
    """Moments (m, 3) about any point of a weight of 1 at the end of each link's unit vector."""
    frames, normals = state.frames(poses.q)
    down = -state.base[:3, :3] @ up
    along = [normals[joint] if length else frames[joint][:, :3, 2] for joint, length in links]
    return [np.cross(direction, down) for direction in along]


def _of_load(poses: Poses, frames: Array, joint: int, state: State, up: Array) -> Array:
    """Moment (m, 3) about a joint's origin of the load, which hangs at the flange, over :data:`LOADED`."""
    weight = -GRAVITY * poses.payload[:, None] / LOADED * (state.base[:3, :3] @ up)
    return np.cross(frames[-1][:, :3, 3] - frames[joint][:, :3, 3], weight)


def _elasticity(joint: int, links: Sequence[Link], up: Array, loaded: bool) -> Basis:
    """Compliance times first moment of what hangs on each link: a torque about the joint's axis each.

    Of a load of which the mass is known, the compliance alone.
    """

    def basis(poses: Poses, state: State) -> Array:
        frames = state.frames(poses.q)[0]
        moments = _moments(links, poses, state, up)
        moments += [_of_load(poses, frames, joint, state, up)] if loaded else []
        axis = frames[joint][:, :3, 2]
        return np.stack([np.sum(each * axis, axis=1) for each in moments], axis=-1)

    return basis


def _base_tilt(links: Sequence[Link], up: Array, loaded: bool) -> Basis:
    """Turn of the base by a compliance, alike about all horizontal axes, times the moments of the links."""

    def basis(poses: Poses, state: State) -> Array:
        lever = state.position(poses.q, poses.point) - state.base[:3, 3]
        moments = _moments(links, poses, state, up)
        moments += [_of_load(poses, state.frames(poses.q)[0], 0, state, up)] if loaded else []
        return np.stack([np.cross(turn, lever) for turn in moments], axis=-1)

    return basis


def _side(joint: int, up: Array) -> Basis:
    def basis(poses: Poses, state: State) -> Array:
        frames, _ = state.frames(poses.q)
        point = state.position(poses.q)
        torque = np.cross(point - frames[joint][:, :3, 3], -state.base[:3, :3] @ up)
        return np.asarray(np.sign(np.sum(torque * frames[joint][:, :3, 2], axis=1)))[:, None]

    return basis


def _approach(joint: int) -> Basis:
    return lambda poses, _state: poses.came[:, [joint]]


def _curve(joint: int, spacing: float, shifts: bool, poses: Poses) -> Basis:
    """Cubic B-splines over the turn, closed; of a joint that shifts, over its range with a knot to spare."""
    turn = 2.0 * np.pi
    count = round(turn / spacing)
    low = float(poses.q[:, joint].min()) - spacing
    if shifts:
        count = int(np.ceil((float(poses.q[:, joint].max()) + spacing - low) / spacing)) + 1
    start = low if shifts else 0.0
    place = (poses.q[:, joint] - start) / spacing
    used = np.flatnonzero(_splines(place, count, closed=not shifts).any(axis=0))

    def basis(other: Poses, _state: State) -> Array:
        where = (other.q[:, joint] - start) / spacing
        return _splines(where, count, closed=not shifts)[:, used]

    return basis


def _splines(place: Array, count: int, *, closed: bool) -> Array:
    """Values (m, count) of cubic B-splines with knots at 0, 1, … of places (m,) in units of their spacing."""
    from_knot = place[:, None] - np.arange(count)
    if closed:
        from_knot = (from_knot + count / 2) % count - count / 2
    u = np.abs(from_knot)
    beyond = np.maximum(2.0 - u, 0.0)  # products, as a power takes ten times as long
    return np.asarray(np.where(u < 1.0, 2 / 3 + u * u * (u / 2 - 1.0), beyond * beyond * beyond / 6))


def _drift(by: Callable[[Poses], Array]) -> Basis:
    return lambda poses, _state: by(poses)[:, None, None] * np.eye(3)


def _warmth(by: Callable[[Poses], Array]) -> Basis:
    def basis(poses: Poses, state: State) -> Array:
        lever = state.position(poses.q, poses.point) - state.base[:3, 3]
        axes = np.broadcast_to(np.eye(3), (len(poses), 3, 3))
        return np.asarray(by(poses)[:, None, None] * np.concatenate([axes, lever[..., None]], axis=-1))

    return basis
