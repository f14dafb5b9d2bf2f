"""Where a point on the flange is by corrected rows, and how that changes with each correction.

The position is B · ∏ Rz(θ₀ + δθ + q + ε(q)) Tz(d + δd) Tx(a + δa) Rx(α + δα) Ry(β) · tool. The turn β about y
is there where an axis is nearly parallel to the next one: there a tilt about y changes d and θ without bound,
so that the four numbers of a row do not do (Hayati & Mirmirani, J. Robot. Syst. 2 (1985) 397). What the
joints turn by beyond their readings, ε, is linear in the parameters of the effects (:mod:`.effects`).

Every column of the Jacobian is that of a turn about, or a shift along, an axis of the present frames, and so
is exact at every iterate. The base is turned by a rotation vector from where it is.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from metro.units import Array

BASE = ("base x", "base y", "base z", "base rx", "base ry", "base rz")
TOOL = ("tool x", "tool y", "tool z")
KINDS = ("offset", "twist", "link offset", "length", "tilt")  # θ, α, d, a, β
NEAR_PARALLEL = 0.1  # sine of the twist below which the tilt is a parameter


@dataclass(frozen=True, eq=False)
class State:
    """An arm with its corrections.

    Attributes
    ----------
    rows : (n, 5) θ₀, α (rad), d, a (m), β (rad), corrections included.
    prismatic : (n,) bool.
    base : (4, 4) of the rows' base in the frame of the measurement. tool : (3,) m, in the last frame; of
        several points (k, 3).
    stations : (s, 3) from which distances were measured, m, in the rows' base frame, where ``base`` then
        stays: a distance does not show how the frame of the measurement is turned.
    """

    rows: Array
    prismatic: np.ndarray
    base: Array
    tool: Array
    stations: Array = field(default_factory=lambda: np.zeros((0, 3)))

    def frames(self, q: Array) -> tuple[Array, Array]:
        """Frames (n + 1, m, 4, 4) before and after each joint; x axes (n, m, 3) before β turns them."""
        theta, alpha, d, a, beta = self.rows.T
        frame = np.broadcast_to(self.base, (len(q), 4, 4))
        frames, normals = [frame], []
        for i, shifts in enumerate(self.prismatic):
            turn = theta[i] + (0.0 if shifts else 1.0) * q[:, i, None]
            along = d[i] + (1.0 if shifts else 0.0) * q[:, i, None]
            c, s = np.cos(turn), np.sin(turn)
            x, y, z, origin = np.moveaxis(frame[:, :3], -1, 0)
            new_x = c * x + s * y
            side = c * y - s * x
            new_y = np.cos(alpha[i]) * side + np.sin(alpha[i]) * z
            new_z = np.cos(alpha[i]) * z - np.sin(alpha[i]) * side
            normals.append(new_x)
            frame = np.zeros((len(q), 4, 4))
            frame[:, :3, 0] = np.cos(beta[i]) * new_x - np.sin(beta[i]) * new_z
            frame[:, :3, 1] = new_y
            frame[:, :3, 2] = np.cos(beta[i]) * new_z + np.sin(beta[i]) * new_x
            frame[:, :3, 3] = origin + along * z + a[i] * new_x
            frame[:, 3, 3] = 1.0
            frames.append(frame)
        return np.array(frames), np.array(normals)

    @property
    def head(self) -> int:
        """Number of the parameters of base, points and stations, which those of the rows follow."""
        return len(BASE) + self.tool.size + self.stations.size

    def arm_to(self, point: np.ndarray | None, count: int) -> Array:
        """Return where the point of each of ``count`` rows is in the last frame, (m, 3); None: the first."""
        points = np.atleast_2d(self.tool)
        return np.asarray(points[np.zeros(count, dtype=int) if point is None else point])

    def position(self, q: Array, point: np.ndarray | None = None) -> Array:
        """Position (m, 3) of a point on the flange, m, at joints ``q`` (m, n); ``point`` (m,): which one."""
        last = self.frames(q)[0][-1]
        arm = self.arm_to(point, len(q))
        return np.asarray(np.einsum("mij,mj->mi", last[:, :3, :3], arm) + last[:, :3, 3])


def names(state: State) -> tuple[str, ...]:
    """Return the parameters as :func:`jacobian` has them: base, points, stations, five for each joint."""
    count = state.tool.size // len(TOOL)
    tools = TOOL if count == 1 else tuple(f"{one} of point {k}" for k in range(1, count + 1) for one in TOOL)
    stations = tuple(f"{axis} of station {k}" for k in range(1, len(state.stations) + 1) for axis in "xyz")
    return (
        *BASE,
        *tools,
        *stations,
        *(f"joint {i} {kind}" for i in range(1, len(state.rows) + 1) for kind in KINDS),
    )


def jacobian(state: State, q: Array, which: np.ndarray | None = None) -> tuple[Array, Array]:
    """Return the positions (m, 3), and derivatives (m, 3, head + 5 n) by the parameters of :func:`names`.

    ``which``: (m,) point on the flange, from 0; None: the first. The places of stations move no point.
    """
    frames, normals = state.frames(q)
    last = frames[-1]
    point = np.einsum("mij,mj->mi", last[:, :3, :3], state.arm_to(which, len(q))) + last[:, :3, 3]
    own = np.zeros(len(q), dtype=int) if which is None else which
    columns = [np.broadcast_to(axis, point.shape) for axis in np.eye(3)]
    columns += [np.cross(axis, point - state.base[:3, 3]) for axis in np.eye(3)]
    for one in range(state.tool.size // len(TOOL)):
        columns += [last[:, :3, k] * (own == one)[:, None] for k in range(3)]
    columns += [np.zeros_like(point)] * state.stations.size
    for i in range(len(state.rows)):
        axis, lever = frames[i][:, :3, 2], point - frames[i][:, :3, 3]
        tip = point - frames[i + 1][:, :3, 3]
        columns += [np.cross(axis, lever), np.cross(normals[i], tip), axis, normals[i]]
        columns += [np.cross(frames[i + 1][:, :3, 1], tip)]
    return point, np.stack(columns, axis=-1)


def turning(state: State, derivatives: Array) -> Array:
    """Return of :func:`jacobian` the columns (m, 3, n) of the joints themselves: per rad, or m of shift."""
    first = state.head
    columns = [first + len(KINDS) * i + (2 if shifts else 0) for i, shifts in enumerate(state.prismatic)]
    return derivatives[..., columns]


def moved(state: State, step: Array) -> State:
    """Return the state after a step (head + 5 n) of the parameters of :func:`names`."""
    from scipy.spatial.transform import Rotation

    base = state.base.copy()
    base[:3, :3] = Rotation.from_rotvec(step[3:6]).as_matrix() @ base[:3, :3]
    base[:3, 3] += step[:3]
    rows = state.rows + step[state.head :].reshape(-1, len(KINDS))
    points = len(BASE) + state.tool.size
    tool = state.tool + step[len(BASE) : points].reshape(state.tool.shape)
    stations = state.stations + step[points : state.head].reshape(-1, 3)
    return replace(state, base=base, tool=tool, stations=stations, rows=rows)


def free_of_geometry(state: State) -> np.ndarray:
    """Return which parameters a calibration may free, (head + 5 n).

    A tilt at nearly parallel axes alone: where they are not parallel it is no more than a combination of the
    others. The base where positions were measured.
    """
    near = np.abs(np.sin(state.rows[:, 1])) < NEAR_PARALLEL
    per_joint = np.ones((len(state.rows), len(KINDS)), dtype=bool)
    per_joint[:, -1] = near
    head = np.ones(state.head, dtype=bool)
    head[: len(BASE)] = not len(state.stations)
    return np.concatenate([head, per_joint.ravel()])
