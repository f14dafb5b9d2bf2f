"""Where the flange and the tool tip of a serial arm are, and how they move with its joints.

Denavit–Hartenberg rows are standard (distal); joint angles q add to the table's θ₀ (physics.md §4). Other
conventions, linear axes and URDF are a :class:`metro.robot.chain.Chain` in their place.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from metro.joint_columns import Axes
from metro.robot.chain import Chain, chain_of_arm
from metro.same import Same
from metro.units import DEG, JSON, MM, Array

Geometry = Array | Chain

# m, along each axis of the flange, by which a declared tip may be wrong: spindle, holder and tool put it up
# to half a metre from the flange, and the row of another tool points anywhere.
FARTHEST_TIP = 1.0


@dataclass(frozen=True, eq=False)
class Arm:
    """A serial arm with a tool on its flange and the work frame that it cuts in.

    Attributes
    ----------
    dh : (n, 4) rows θ₀ (rad), α (rad), d (m), a (m), or the chain of its joints.
    tool : (3,) tip in the flange frame, m.
    work : (4, 4) work frame in the base frame.
    """

    dh: Geometry
    tool: Array
    work: Array

    def tip(self, q: Array) -> Array:
        """Tip in the work frame, m, shape (..., 3), for joint angles ``q`` (..., n) in rad."""
        flange = forward(self.dh, q)
        in_base = flange[..., :3, :3] @ self.tool + flange[..., :3, 3]
        return (in_base - self.work[:3, 3]) @ self.work[:3, :3]

    @property
    def axes(self) -> Axes:
        """Columns of its joints in tables."""
        return axes(self.dh)

    def flange_axes(self, q: Array) -> Array:
        """Axes of the flange in the work frame, columns of (..., 3, 3)."""
        return np.asarray(self.work[:3, :3].T @ forward(self.dh, q)[..., :3, :3])

    def with_tip_moved(self, offset: Array) -> Arm:
        """Return the arm with its tip elsewhere by ``offset`` (3,), m, frame of the flange."""
        return replace(self, tool=self.tool + offset)

    def lever(self, q: Array) -> Array:
        """Vector from the flange's origin to the tip, base frame, m, shape (..., 3)."""
        return forward(self.dh, q)[..., :3, :3] @ self.tool


def arm_of_cell(cell: JSON, manifest: JSON) -> Arm | None:
    """Build the arm from the contract's cell and manifest; None where the cell has no joints.

    Without ``tool_in_flange_mm`` the tip is the flange, without ``work_in_base`` the work frame is the base.
    """
    geometry = geometry_of_cell(cell)
    if geometry is None:
        return None
    frame = manifest.get("work_in_base") or {}
    position = np.asarray(frame.get("xyz_mm", (0.0, 0.0, 0.0)), dtype=float) * MM
    turn = np.asarray(frame.get("rpy_deg", (0.0, 0.0, 0.0)), dtype=float) * DEG
    tool = np.asarray(manifest.get("tool_in_flange_mm", (0.0, 0.0, 0.0)), dtype=float) * MM
    return Arm(geometry, tool, transform(position, rotation(*turn)))


def geometry_of_cell(cell: JSON) -> Geometry | None:
    """Return the joints of a cell's arm: standard rows as they are, all else as a chain; None without any."""
    arm = cell.get("arm") or {}
    if not (arm.get("dh") or arm.get("chain")):
        return None
    base = arm.get("base") or {}
    place = transform(
        np.asarray(base.get("xyz_mm", (0.0, 0.0, 0.0)), dtype=float) * MM,
        rotation(*(np.asarray(base.get("rpy_deg", (0.0, 0.0, 0.0)), dtype=float) * DEG)),
    )
    made = chain_of_arm(arm, place)
    return np.asarray(arm["dh"], dtype=float) * (DEG, DEG, MM, MM) if made is None else made


def prismatic(dh: Geometry) -> np.ndarray:
    """Return which joints shift instead of turning, (n,) bool."""
    return dh.prismatic if isinstance(dh, Chain) else np.zeros(len(dh), dtype=bool)


def axes(dh: Geometry) -> Axes:
    """Return the columns of the joints of an arm."""
    return _axes(Same(dh))


@lru_cache(maxsize=64)  # asked for each prediction of a fit
def _axes(dh: Same[Geometry]) -> Axes:
    return Axes(tuple(bool(shifts) for shifts in prismatic(dh.value)))


def rotation(roll: float, pitch: float, yaw: float) -> Array:
    """Rotation matrix R = R_z(yaw) R_y(pitch) R_x(roll), (3, 3); angles in rad."""
    (sr, sp, sy), (cr, cp, cy) = np.sin([roll, pitch, yaw]), np.cos([roll, pitch, yaw])
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def transform(position: Array, turn: Array) -> Array:
    """Homogeneous matrix (4, 4) of a frame at ``position`` (3,) with axes ``turn`` (3, 3)."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn, position
    return matrix


def link_frames(dh: Geometry, q: Array) -> Array:
    """Frames of the base and after each joint, in the base frame.

    Parameters
    ----------
    dh : (n, 4). q : (..., n) joint angles, rad.

    Returns
    -------
    Array
        (..., n + 1, 4, 4): T_0 = I, T_i = A_1 … A_i, with A_i = Rot_z(θ) Trans(0, 0, d) Trans(a, 0, 0)
        Rot_x(α). (The printed eq. 2 of [K] has cosθ cosα where sinθ sinα belongs.) Of a chain T_0 is the
        frame of the first joint's axis.
    """
    if isinstance(dh, Chain):
        return dh.frames(np.asarray(q, dtype=float))
    theta0, alpha, d, a = dh.T
    c, s = np.cos(theta0 + q), np.sin(theta0 + q)
    ca, sa, zero = np.cos(alpha) + 0 * c, np.sin(alpha) + 0 * c, 0 * c
    rows = [
        [c, -s * ca, s * sa, a * c],
        [s, c * ca, -c * sa, a * s],
        [zero, sa, ca, d + zero],
        [zero, zero, zero, zero + 1.0],
    ]
    step = np.moveaxis(np.array(rows), (0, 1), (-2, -1))
    frames = [np.broadcast_to(np.eye(4), (*c.shape[:-1], 4, 4))]
    for i in range(len(dh)):
        frames.append(frames[-1] @ step[..., i, :, :])
    return np.stack(frames, axis=-3)


def forward(dh: Geometry, q: Array) -> Array:
    """Flange frame in the base frame, (..., 4, 4), for joint angles ``q`` (..., n) in rad."""
    return np.asarray(link_frames(dh, q)[..., -1, :, :])


def jacobian(dh: Geometry, q: Array) -> Array:
    """Geometric Jacobian of the flange in the base frame.

    Returns
    -------
    Array
        (..., 6, n): velocity of the flange's origin (m/s), then angular velocity (rad/s), per joint rate.
    """
    frames = link_frames(dh, q)
    axis, origin = frames[..., :-1, :3, 2], frames[..., :-1, :3, 3]
    linear, angular = np.cross(axis, frames[..., -1:, :3, 3] - origin), axis
    if (shifts := prismatic(dh)).any():
        linear = np.where(shifts[:, None], axis, linear)
        angular = np.where(shifts[:, None], 0.0, axis)
    return np.moveaxis(np.concatenate([linear, angular], axis=-1), -1, -2)
