"""Where tool and work are, from touched points: tool centre point and work object in one least squares.

A tip at t in the flange's frame is at R t + x when the controller states the flange's pose (R, x). Touching
one fixed point p with several orientations gives R t + x = p; touching three, two and one points of a block's
faces (3-2-1) gives the plane z = 0, then the direction of y = 0, then the place of x = 0 of the work frame.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from metro.robot.orientation import euler_of_matrix
from metro.units import Array

FACES = ("primary", "secondary", "tertiary")  # z = 0, y = 0, x = 0 of the work frame
LEAST = {"primary": 3, "secondary": 2, "tertiary": 1}
CONDITION = 1e8  # of a least squares problem in metres, from which on it has no solution
Frame = tuple[Array, Array]


@dataclass(frozen=True, eq=False)
class Touches:
    """Poses of the flange, as the controller states them, in which the tip touched something.

    Attributes
    ----------
    turn : (n, 3, 3), place : (n, 3) m, of the flange in the base. what : (n,) names: one of ``FACES`` of the
        work, or any other name for a fixed point. sigma : (n,) m, of a touch along each axis; NaN: not known.
    """

    turn: Array
    place: Array
    what: Sequence[str]
    sigma: Array

    def of(self, name: str) -> Array:
        """Which rows touched ``name``, (n,)."""
        return np.array([each == name for each in self.what])


@dataclass(frozen=True, eq=False)
class Placed:
    """Calibrated tool and work.

    Attributes
    ----------
    tip : (3,) m in the flange's frame. tip_covariance : (3, 3) m²; zero where the tip was given.
    frame : origin (3,) m and angles (3,) rx, ry, rz in rad of the work in the base; None if not touched.
    frame_covariance : (6, 6) of origin and angles. rms : of the residuals, m. dof : their number less that of
        the unknowns. stated : whether the errors come from the stated sigma, else from the residuals.
    """

    tip: Array
    tip_covariance: Array
    frame: Frame | None
    frame_covariance: Array
    rms: float
    dof: int
    stated: bool


def calibrate(touches: Touches, tip: Array | None = None) -> Placed:
    """Return tip and work frame from ``touches``; ``tip`` (3,) m is used where no fixed point was touched.

    Raises
    ------
    ValueError
        If the touches do not determine the tip, or the frame; the reason is a part of a sentence.
    """
    points = list(dict.fromkeys(name for name in touches.what if name not in FACES))
    start, fixed = _tip(touches, points) if points else (tip, np.zeros((0, 3)))
    if start is None:
        raise ValueError("no fixed point was touched, and tool_in_flange_mm does not give the tip")
    framed = any(touches.of(face).any() for face in FACES)
    tips = touches.turn @ start + touches.place
    base = _frame(touches, tips) if framed else (np.zeros(3), np.eye(3))
    free = len(points) > 0
    given = np.concatenate([start if free else np.zeros(0), fixed.ravel(), np.zeros(6 if framed else 0)])
    stated = bool(np.isfinite(touches.sigma).all())
    weight = touches.sigma if stated else np.ones(len(touches.sigma))

    def residuals(unknown: Array) -> Array:
        at = unknown[:3] if free else start
        tips = touches.turn @ at + touches.place
        parts = []
        for k, name in enumerate(points):
            own, point = touches.of(name), unknown[3 + 3 * k : 6 + 3 * k]
            parts.append(((tips[own] - point) / weight[own, None]).ravel())
        if framed:
            origin, axes = _moved(base, unknown[-6:])
            in_work = (tips - origin) @ axes
            for axis, face in zip((2, 1, 0), FACES, strict=True):
                own = touches.of(face)
                parts.append(in_work[own, axis] / weight[own])
        return np.concatenate(parts)

    unknown, jacobian, left = _solved(residuals, given)
    dof = len(left) - len(unknown)
    if not stated and dof < 1:
        raise ValueError(
            f"{len(left)} measured coordinates for {len(unknown)} unknowns leave no residual for an error "
            "estimate"
        )
    variance = 1.0 if stated else float(left @ left) / dof
    covariance = variance * np.linalg.inv(jacobian.T @ jacobian)
    frame, spread = None, np.zeros((6, 6))
    if framed:
        origin, axes = _moved(base, unknown[-6:])
        frame = (origin, euler_of_matrix(axes))
        change = _change(base, unknown[-6:])
        spread = change @ covariance[-6:, -6:] @ change.T
    rms = float(np.sqrt(np.mean((left * (weight[0] if stated else 1.0)) ** 2)))
    own = np.asarray(covariance[:3, :3] if free else np.zeros((3, 3)))
    return Placed(unknown[:3] if free else start, own, frame, spread, rms, dof, stated)


def _tip(touches: Touches, points: list[str]) -> tuple[Array, Array]:
    """Tip (3,) and fixed points (k, 3) by linear least squares of R t − p = −x."""
    rows, right = [], []
    for k, name in enumerate(points):
        own = touches.of(name)
        for turn, place in zip(touches.turn[own], touches.place[own], strict=True):
            row = np.zeros((3, 3 + 3 * len(points)))
            row[:, :3], row[:, 3 + 3 * k : 6 + 3 * k] = turn, -np.eye(3)
            rows.append(row)
            right.append(-place)
    design = np.concatenate(rows)
    if np.linalg.matrix_rank(design, tol=np.linalg.norm(design, 2) * 1e-3) < design.shape[1]:
        raise ValueError(
            "the orientations in which a fixed point was touched do not determine the tip: expected three or "
            "more that do not all turn about one axis"
        )
    solved = np.linalg.lstsq(design, np.concatenate(right), rcond=None)[0]
    return solved[:3], solved[3:].reshape(-1, 3)


def _frame(touches: Touches, tips: Array) -> Frame:
    """First origin (3,) and axes (3, 3, columns) of the work from the tips of a 3-2-1 touching."""
    found = {face: tips[touches.of(face)] for face in FACES}
    few = [f"{LEAST[face]} points of face {face}" for face in FACES if len(found[face]) < LEAST[face]]
    if few:
        raise ValueError(f"a work frame takes {' and '.join(few)} or more")
    middle = found["primary"].mean(axis=0)
    _, size, across = np.linalg.svd(found["primary"] - middle)
    if size[1] < 1e-3 * size[0] or size[0] == 0.0:
        raise ValueError("the points of face primary lie on one line, expected them spread over the face")
    z = across[2]
    # The tool comes from outside the material, so that the flange is above the primary face.
    outside = (touches.place - tips)[touches.of("primary")].mean(axis=0)
    z = z if z @ outside > 0.0 else -z
    edge = found["secondary"]
    along = edge - edge.mean(axis=0)
    along = along - np.outer(along @ z, z)
    length, way = np.linalg.svd(along)[1:]
    if length[0] < 1e-6:
        raise ValueError("the points of face secondary are one point, expected them apart along the face")
    y = np.cross(z, way[0])
    y = y if y @ (middle - edge.mean(axis=0)) > 0.0 else -y  # the material is on the side of positive y
    x = np.cross(y, z)
    corner = found["tertiary"].mean(axis=0)
    if x @ (middle - corner) < 0.0:
        raise ValueError(
            "the faces make no right-handed frame with the block at positive x and y: secondary and tertiary "
            "may be exchanged"
        )
    axes = np.column_stack([x, y, z])
    origin = axes @ np.array([x @ corner, y @ edge.mean(axis=0), z @ middle])
    return origin, axes


def _moved(base: Frame, change: Array) -> Frame:
    """Origin and axes moved by a shift (m) and a rotation vector (rad) in the base frame."""
    from scipy.spatial.transform import Rotation

    return base[0] + change[:3], Rotation.from_rotvec(change[3:]).as_matrix() @ base[1]


def _change(base: Frame, at: Array) -> Array:
    """Differentiate origin and angles by shift and rotation vector, (6, 6), by central differences."""
    step = 1e-6
    columns = []
    for k in range(6):
        sides = []
        for sign in (-1.0, 1.0):
            origin, axes = _moved(base, at + sign * step * np.eye(6)[k])
            sides.append(np.concatenate([origin, euler_of_matrix(axes)]))
        turned = sides[1] - sides[0]
        turned[3:] = np.angle(np.exp(1j * turned[3:]))
        columns.append(turned / (2.0 * step))
    return np.column_stack(columns)


def _solved(residuals: Callable[[Array], Array], start: Array) -> tuple[Array, Array, Array]:
    """Return unknowns, Jacobian and residuals of nonlinear least squares."""
    from scipy.optimize import least_squares

    found = least_squares(residuals, start, jac="3-point", method="lm", x_scale="jac", xtol=1e-15, ftol=1e-15)
    if np.linalg.cond(found.jac) > CONDITION:
        raise ValueError("the touched points do not determine tool and work: spread them further")
    return found.x, found.jac, found.fun
