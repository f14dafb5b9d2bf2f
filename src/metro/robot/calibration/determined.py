"""Which parameters of the geometry a set of poses determines, and how well: redundancy, condition, O1."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.robot.calibration.effects import PLAUSIBLE
from metro.robot.calibration.model import BASE, KINDS, TOOL
from metro.units import Array

ORDER = ("length", "twist", "tilt", "link offset", "offset")  # of two that do the same, the first stays
FRAMES = len(BASE) + len(TOOL)


@dataclass(frozen=True, eq=False)
class Determined:
    """What a set of poses determines.

    Attributes
    ----------
    kept : (9 + 5 n) bool.
    condition : largest over least singular value, the parameters in units of what is plausible of them.
    o1 : observability index O1 = (∏ σ)^(1/L) / √m of the same (Borm & Menq, Int. J. Robot. Res. 10 (1991)
        51), m, the shift of the point per plausible correction.
    """

    kept: np.ndarray
    condition: float
    o1: float


def determined(derivatives: Array, allowed: np.ndarray, scatter: float, head: int = FRAMES) -> Determined:
    """Eliminate what poses do not determine.

    In the order base, tool, lengths, twists, tilts, link offsets, offsets, a parameter is dropped where what
    it moves the points by, beyond what those before it can, is less than the scatter for a correction
    of :data:`PLAUSIBLE`: its standard error would be larger than any correction.

    Parameters
    ----------
    derivatives : (m, 3, 9 + 5 n) of :func:`metro.robot.calibration.model.jacobian`.
    allowed : which may be freed. scatter : standard deviation of a coordinate, m. head : number of the
        parameters of base and points.
    """
    joints = (derivatives.shape[-1] - head) // len(KINDS)
    by_kind = [head + len(KINDS) * joint + KINDS.index(kind) for kind in ORDER for joint in range(joints)]
    order = [place for place in (*range(head), *by_kind) if allowed[place]]
    design = derivatives.reshape(-1, derivatives.shape[-1])[:, order] * PLAUSIBLE
    _, reduced = np.linalg.qr(design)
    directions: list[Array] = []
    kept = np.zeros(len(allowed), dtype=bool)
    for column, place in zip(reduced.T, order, strict=True):
        rest = column
        for _ in range(2):  # the second time removes what rounding left
            for direction in directions:
                rest = rest - direction * (direction @ rest)
        size = float(np.linalg.norm(rest))
        if size > max(scatter, 1e-9 * float(np.linalg.norm(column))):
            directions.append(rest / size)
            kept[place] = True
    chosen = [at for at, place in enumerate(order) if kept[place]]
    if not chosen:
        return Determined(kept, float("inf"), 0.0)
    singular = np.linalg.svd(reduced[:, chosen], compute_uv=False)
    o1 = float(np.exp(np.mean(np.log(singular))) / np.sqrt(len(derivatives)))
    return Determined(kept, float(singular[0] / singular[-1]), o1)
