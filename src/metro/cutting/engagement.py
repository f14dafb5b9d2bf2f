"""Where around the cutter the teeth are in the work: entry and exit immersion angles."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Engagement:
    """Immersion from ``entry`` to ``exit``, rad, clockwise from +y of the feed frame (towards +x).

    ``entry_face``, ``exit_face``: whether a face square to the feed cuts the arc short there, not an edge of
    the work along it.
    """

    entry: float
    exit: float
    entry_face: bool = False
    exit_face: bool = False


def engagement(operation: str, direction: str, radial_depth: float, radius: float) -> Engagement:
    """Return the immersion interval of a cut (physics.md §1).

    Parameters
    ----------
    operation : ``slot``, ``side``, ``face`` or ``helical`` (from the solid: the front half of the cutter).
    direction : ``up``, ``down`` or ``slot``; a face cut narrower than the cutter in direction ``slot`` is
        symmetric.
    radial_depth, radius : m.

    Raises
    ------
    ValueError
        If the radial depth is not within the cutter's diameter.
    """
    if operation in ("slot", "helical"):
        return Engagement(0.0, math.pi)
    if not 0.0 < radial_depth <= 2.0 * radius * (1.0 + 1e-9):
        raise ValueError(f"radial depth {radial_depth} m is not within the diameter {2 * radius} m")
    swept = math.acos(max(-1.0, 1.0 - radial_depth / radius))
    if direction == "up":
        return Engagement(0.0, swept)
    if direction == "down":
        return Engagement(math.pi - swept, math.pi)
    half = math.asin(min(1.0, radial_depth / (2.0 * radius)))
    return Engagement(math.pi / 2.0 - half, math.pi / 2.0 + half)


def with_wall_proud(arc: Engagement, radius: float, proud: float) -> Engagement:
    """Return the arc of a side cut whose wall stands ``proud``, m, of where it was (below zero: deeper).

    A tenth of the radial depth stays at least, the whole diameter is the most. Only a cut that ends or starts
    along the feed (up or down) has a wall.

    Parameters
    ----------
    radius : of the cutter, m.
    """
    radial = radius * (1.0 - math.cos(arc.exit - arc.entry))
    left = min(max(radial - proud, 0.1 * radial), 2.0 * radius)
    swept = math.acos(1.0 - left / radius)
    if math.isclose(arc.entry, 0.0, abs_tol=1e-9):
        return replace(arc, exit=swept)
    return replace(arc, entry=math.pi - swept)
