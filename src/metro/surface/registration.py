"""Where a scanned block lies: 3-2-1 from its top and two sides, else all its faces against a box at once.

Only faces determine the place: on a lone face every shift within its plane fits equally well, and the edge
of the points lies half a pitch inside the edge of the face. What the patches of the faces do not determine
is refused, by the condition of the normal equations and by the uncertainty of the place.

The work frame has its origin in a corner of the block, z = 0 on its top. Since a box looks the same after
half a turn, a scan is taken to lie as its own axes show: x, y, z within 35 degrees of the work's.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from metro.surface.patches import Patches, block_faces, find_patches
from metro.surface.points import Points, drawn
from metro.units import MM, UM, Array

MOST_POINTS = 2_000_000  # of a larger cloud so many are drawn: a face's noise is averaged out long before
ENOUGH = 20  # patches of a side that carry a datum of their own
FEWEST = 6  # patches of a side: fewer may be a burr or a clamp
EDGE = 0.5 * MM  # below the top's plane; rounded edges, burrs and the top's own form end above
CONDITION = 1e-6  # of the normal equations with lengths over half the diagonal; a lone face has about 1e-16
WORST = 0.1 * MM  # standard deviation of the place in the plane
BEYOND = 0.05  # share of a side by which the top may run over the block, and of its patches that may do more
STEPS = 20
ROUNDED = 1e-12

_CORNERS = np.array([[-0.5, -0.5], [-0.5, 0.5], [0.5, -0.5], [0.5, 0.5]])  # of the top, from its middle
NORMALS = {"x-": (-1, 0, 0), "x+": (1, 0, 0), "y-": (0, -1, 0), "y+": (0, 1, 0), "z+": (0, 0, 1)}


@dataclass(frozen=True)
class Registration:
    """A rigid motion from scanner to work coordinates, ``points @ rotation.T + shift``, in m.

    Attributes
    ----------
    rotation, shift : (3, 3) and (3,).
    method : how it was found. faces : number of patches of each face that was seen.
    sd : (2,) standard deviation of x and y at the corner of the top where it is worst.
    condition : smallest over largest eigenvalue of the normal equations; 0 where something is free.
    """

    rotation: Array
    shift: Array
    method: Literal["3-2-1", "box"]
    faces: dict[str, int]
    sd: Array
    condition: float

    def apply(self, points: Array) -> Array:
        """Move points (n, 3) into the work frame."""
        return np.asarray(points @ self.rotation.T + self.shift)


@dataclass(frozen=True)
class Block:
    """What a cloud shows of a block: its faces by name, the box (3,), (3,) of its points, and their pitch."""

    faces: dict[str, Patches]
    low: Array
    high: Array
    pitch: float

    @property
    def known(self) -> dict[str, Patches]:
        """The faces of enough patches to be one."""
        return {name: face for name, face in self.faces.items() if len(face) >= FEWEST}

    @property
    def has_sides(self) -> bool:
        """Whether more is seen than the top alone."""
        return "z+" in self.known and len(self.known) > 1

    def on_top(self, points: Array, depth: float) -> np.ndarray:
        """Mask (n,) of the points within ``depth`` of the top's plane; of all, where no side is seen.

        Those nearer than half of it to a side are left out: they are of the side, or of the edge.
        """
        kept = np.ones(len(points), dtype=bool)
        if not self.has_sides:
            return kept
        for name, face in self.known.items():
            centre, normal = _plane(face, "xyz".index(name[0]))
            distance = (points - centre) @ normal  # grows along +x, +y, +z
            inside = {"-": distance > depth / 2, "+": distance < -depth / 2}[name[1]]
            kept &= np.abs(distance) <= depth if name == "z+" else inside
        return kept


def see_block(points: Points, size: Array) -> Block:
    """Find the faces of a block of ``size`` (3,) in a cloud (n, 3) whose axes lie about along the work's."""
    pitch = float(np.sqrt(size[0] * size[1] / len(points)))
    some = drawn(points, MOST_POINTS)
    low, high = np.percentile(some, [0.5, 99.5], axis=0)
    faces = block_faces(find_patches(some, pitch), (low + high) / 2)
    if len(faces.get("z+", ())) >= ENOUGH:
        faces = {"z+": faces["z+"]} | _below(some, pitch, faces["z+"], (low + high) / 2)
    return Block(faces, low, high, pitch)


def _below(points: Array, pitch: float, top: Patches, middle: Array) -> dict[str, Patches]:
    """Return the sides by the points below the top alone.

    Beside the points of the top, a strip of a side that is narrower than a cell would be part of no flat
    patch.
    """
    centre, up = _plane(top, 2)
    deep = points[(points - centre) @ up < -max(EDGE, pitch / 2)]
    faces = block_faces(find_patches(deep, pitch), middle) if len(deep) else {}
    return {name: face for name, face in faces.items() if name != "z+"}


def register(block: Block, size: Array) -> Registration:
    """Find where a block of ``size`` (3,) m lies by what is seen of it.

    Raises
    ------
    ValueError
        Saying what to scan, where the faces do not determine the place, or do not fit a block of that size.
    """
    faces = block.known
    if "z+" not in faces or len(faces["z+"]) < ENOUGH:
        raise ValueError(f"no top is seen along the scan's own z: {_wanted(block, 0.0)}")
    sides = {name: len(face) for name, face in faces.items() if name != "z+"}
    datum = {
        axis: max((n for n in sides if n[0] == axis), key=sides.__getitem__, default="") for axis in "xy"
    }
    if all(sides.get(name, 0) >= ENOUGH for name in datum.values()):
        registration = _three_two_one(faces, datum, size)
    else:
        registration = _against_box(faces, _from_box(block.low, block.high, size), size)
    if registration.condition < CONDITION or registration.sd.max() > WORST:
        raise ValueError(_wanted(block, registration.condition))
    top = registration.apply(faces["z+"].centres)[:, :2]
    outside = (top < -BEYOND * size[:2]) | (top > (1 + BEYOND) * size[:2])
    if outside.any(axis=1).mean() > BEYOND:
        spans = " × ".join(f"{span / MM:.4g}" for span in np.ptp(top, axis=0))
        expected = " × ".join(f"{side / MM:.4g}" for side in size[:2])
        raise ValueError(
            f"the top spans {spans} mm along the scan's x and y and runs over the block of {expected} mm: "
            "turn the scan so that its axes lie about along the work's, or give instruments.scanner.to_work"
        )
    return registration


def _wanted(block: Block, condition: float) -> str:
    seen = ", ".join(f"{name} {len(face)}" for name, face in sorted(block.faces.items())) or "none"
    half = block.pitch / 2 / UM
    return (
        f"the faces seen (flat patches: {seen}) do not determine the place of the block in x and y "
        "(condition "
        f"{condition:.1g}, at least {CONDITION:.0g} needed): scan the top together with 5 mm or more of a "
        "long and of a short side, the scan's axes about along the work's, or give "
        "instruments.scanner.to_work; the edge of the points is no datum: it lies half a pitch "
        f"({half:.0f} um) inside that of the face"
    )


def _from_box(low: Array, high: Array, size: Array) -> Array:
    """Shift that brings the middle of the cloud's box to that of the block, its top to z = 0."""
    return np.array([*(size[:2] / 2 - (low + high)[:2] / 2), -high[2]])


def _three_two_one(faces: dict[str, Patches], datum: dict[str, str], size: Array) -> Registration:
    """Top: three points, long side: two, short side: one; each by all the patches of its face."""
    along, across = (0, 1) if size[0] >= size[1] else (1, 0)  # the long side runs along this axis
    long, short = faces[datum["xy"[across]]], faces[datum["xy"[along]]]
    top, up = _plane(faces["z+"], 2)
    _, outward = _plane(long, across)
    e = np.zeros((3, 3))
    e[2] = up
    e[across] = outward - (outward @ up) * up
    e[across] /= np.linalg.norm(e[across])
    e[along] = np.cross(e[1], e[2]) if along == 0 else np.cross(e[2], e[0])
    shift = np.array([0.0, 0.0, -top @ up])
    sd = np.zeros(2)
    turn = _slope_sd(long, e[across], e[along])
    for axis, face in ((across, long), (along, short)):
        place = size[axis] if datum["xy"[axis]].endswith("+") else 0.0
        shift[axis] = place - face.centres.mean(axis=0) @ e[axis]
        arm = _reach(face, e, shift, size, axis)
        sd[axis] = np.hypot(_offset_sd(face, e[axis]), turn * arm)
    counts = {name: len(face) for name, face in sorted(faces.items())}
    return Registration(e, shift, "3-2-1", counts, sd, _condition(faces, e, shift, size))


def _plane(face: Patches, axis: int) -> tuple[Array, Array]:
    """Centre (3,) of a face, and its normal (3,) that points to +``axis``."""
    normal = face.normal
    return face.centres.mean(axis=0), normal * np.sign(normal[axis])


def _reach(face: Patches, e: Array, shift: Array, size: Array, axis: int) -> float:
    """Largest distance, along the face, from its middle to an end of the top."""
    other = 1 - axis
    middle = face.centres.mean(axis=0) @ e[other] + shift[other]
    return float(max(abs(middle), abs(size[other] - middle)))


def _offset_sd(face: Patches, normal: Array) -> float:
    return float(np.std(face.centres @ normal, ddof=1) / np.sqrt(len(face)))


def _slope_sd(face: Patches, normal: Array, along: Array) -> float:
    u = face.centres @ along
    u = u - u.mean()
    residual = face.centres @ normal
    residual = residual - residual.mean()
    residual = residual - (u @ residual) / (u @ u) * u
    return float(np.sqrt(residual @ residual / (len(face) - 2) / (u @ u)))


def _rows(faces: dict[str, Patches], rotation: Array, shift: Array, size: Array) -> tuple[Array, Array]:
    """Distances (m,) of all patches from the box, and their derivatives (m, 6) by shift and by turn.

    The turn is about the middle of the top and counted in lengths at half its diagonal, so that all six have
    one unit.
    """
    middle, half = np.array([size[0] / 2, size[1] / 2, 0.0]), float(np.hypot(size[0], size[1])) / 2
    distances, derivatives = [], []
    for name, face in faces.items():
        normal = np.array(NORMALS[name], float)
        place = size["xyz".index(name[0])] if name in ("x+", "y+") else 0.0
        at = face.centres @ rotation.T + shift
        distances.append(at @ normal - place)
        lever = np.cross(at - middle, normal) / half
        derivatives.append(np.column_stack([np.broadcast_to(normal, at.shape), lever]))
    return np.concatenate(distances), np.vstack(derivatives)


def _condition(faces: dict[str, Patches], rotation: Array, shift: Array, size: Array) -> float:
    _, design = _rows(faces, rotation, shift, size)
    eigenvalues = np.linalg.eigvalsh(design.T @ design)
    return max(0.0, float(eigenvalues[0] / eigenvalues[-1]))


def _against_box(faces: dict[str, Patches], start: Array, size: Array) -> Registration:
    """Point-to-plane steps (Chen & Medioni 1992) of all patches against the face that each belongs to."""
    middle, half = np.array([size[0] / 2, size[1] / 2, 0.0]), float(np.hypot(size[0], size[1])) / 2
    rotation, shift = np.eye(3), start
    for _ in range(STEPS):
        residual, design = _rows(faces, rotation, shift, size)
        step = -np.linalg.lstsq(design, residual, rcond=CONDITION)[0]
        turn = _turn(np.asarray(step[3:] / half, np.float64))
        rotation, shift = turn @ rotation, turn @ (shift - middle) + middle + step[:3]
        if np.abs(step).max() < ROUNDED:
            break
    residual, design = _rows(faces, rotation, shift, size)
    condition = _condition(faces, rotation, shift, size)
    sd = np.full(2, np.inf)
    if condition >= CONDITION:
        covariance = _covariance(design, residual, [len(face) for face in faces.values()])
        sd = np.sqrt(np.max([_at(covariance, corner / half) for corner in _CORNERS * size[:2]], axis=0))
    counts = {name: len(face) for name, face in sorted(faces.items())}
    return Registration(rotation, shift, "box", counts, sd, condition)


def _covariance(design: Array, residual: Array, counts: list[int]) -> Array:
    """Covariance (6, 6) of shift and turn where the patches of each face scatter by as much as they do.

    Patches of a narrow strip hold fewer points than those of the top, and scatter more.
    """
    ends = np.cumsum(counts)[:-1]
    parts = zip(np.split(design, ends), np.split(residual, ends), strict=True)
    freedom = 1.0 - 6.0 / max(len(residual), 7)
    scatter = sum((np.mean(rest**2) / freedom * rows.T @ rows for rows, rest in parts), np.zeros((6, 6)))
    inverse = np.linalg.inv(design.T @ design)
    return np.asarray(inverse @ scatter @ inverse)


def _at(covariance: Array, arm: Array) -> Array:
    """Variance (2,) of x and y at an ``arm`` (2,) from the middle of the top, in halves of its diagonal."""
    x, y = np.eye(6)[:2]
    moved = np.array([x - arm[1] * np.eye(6)[5], y + arm[0] * np.eye(6)[5]])
    return np.asarray(np.einsum("ij,jk,ik->i", moved, covariance, moved))


def _turn(vector: Array) -> Array:
    """Rotation (3, 3) by a rotation vector (3,), rad (Rodrigues)."""
    x, y, z = vector
    across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    angle = float(np.linalg.norm(vector))
    half = 0.5 * np.sinc(angle / 2 / np.pi) ** 2
    return np.asarray(np.eye(3) + np.sinc(angle / np.pi) * across + half * across @ across)
