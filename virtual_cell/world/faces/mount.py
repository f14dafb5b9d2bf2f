"""How the spindle is mounted on the flange, and how the plane of the passes was taught: both tilt it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from virtual_cell.hidden import drawn_size
from virtual_cell.units import DEG, MM, Array
from virtual_cell.world.draws import uniform
from virtual_cell.world.faces.finish import Cutting, FaceRun, Influence

_PADS = np.array([90.0, 210.0, 330.0]) * DEG  # of the flange, about the spindle


@dataclass(frozen=True)
class Mount:
    """Three pads on which the spindle rests.

    Attributes
    ----------
    shims : (3,) m, what lies under each pad. circle : m, radius on which they are.
    yaw : of each wrist, rad, by which the pads are turned in the work frame; None: the three heights are
        those of points that were touched to teach the plane of the passes, which does not turn.
    """

    shims: tuple[float, float, float]
    circle: float
    yaw: Mapping[str, float] | None = None

    def tilt(self, wrist: str) -> tuple[float, float]:
        """Return the angles of the spindle about work x and y, rad, right-handed."""
        turned = 0.0 if self.yaw is None else self.yaw[wrist]
        at = self.circle * np.column_stack([np.cos(_PADS + turned), np.sin(_PADS + turned)])
        _, rise_x, rise_y = np.linalg.solve(np.column_stack([np.ones(3), at]), np.array(self.shims))
        return float(rise_y), float(-rise_x)

    def in_face(self, run: FaceRun, rng: np.random.Generator) -> Influence:
        """Return what the tilted rim leaves: its front and its back cut at other heights."""
        del rng
        about_x, about_y = self.tilt(run.wrist)

        def tilted(cutting: Cutting) -> Array:
            return np.asarray(cutting.offset @ np.array([-about_y, about_x]))

        return Influence(height=tilted)


def _shims(about_x: float, about_y: float, circle: float) -> tuple[float, float, float]:
    heights = circle * (about_x * np.sin(_PADS) - about_y * np.cos(_PADS))
    low = float(heights.min())
    return tuple((heights - low).tolist())


def drawn(rng: np.random.Generator) -> Mount:
    """Draw a spindle that was squared to the work to 5–100 µrad."""
    angle, towards = drawn_size(rng, 5.0, 100.0) * 1e-6, rng.uniform(0.0, 2.0 * math.pi)
    circle = uniform(rng, 50.0, 90.0) * MM
    return Mount(_shims(angle * math.cos(towards), angle * math.sin(towards), circle), circle)


def tilted(
    about: tuple[float, float], yaw: Mapping[str, float], rng: np.random.Generator
) -> tuple[Mount, float]:
    """Return a mount whose mean tilt over the wrists is ``about`` work x and y, rad, and how far they differ.

    Shims and chips under the flange (one third of the cases) turn with the wrist; a plane that was taught by
    touching three points of raw stock does not.

    Parameters
    ----------
    yaw : of the wrists that are used, rad.
    """
    circle = uniform(rng, 50.0, 90.0) * MM
    if rng.uniform() > 1.0 / 3.0 or len(yaw) < 2:
        return Mount(_shims(*about, circle), circle), 0.0
    middle = float(np.mean(list(yaw.values())))
    turned = {wrist: angle - middle for wrist, angle in yaw.items()}
    units = [Mount(_shims(*unit, circle), circle, turned) for unit in ((1.0, 0.0), (0.0, 1.0))]
    mean = np.column_stack([np.mean([unit.tilt(wrist) for wrist in yaw], axis=0) for unit in units])
    about_x, about_y = np.linalg.solve(mean, np.array(about)).tolist()
    mount = Mount(_shims(about_x, about_y, circle), circle, turned)
    apart = np.array([mount.tilt(wrist) for wrist in yaw]) - np.array(about)
    return mount, float(np.linalg.norm(apart, axis=1).mean() / np.linalg.norm(about))
