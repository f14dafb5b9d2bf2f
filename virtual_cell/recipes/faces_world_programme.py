"""What faces of styles ``c`` and ``d`` are cut with, in which configurations, and how they are measured."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from virtual_cell.chips import Tool
from virtual_cell.hidden import drawn_size
from virtual_cell.milling import in_millimetres
from virtual_cell.recipes.faces_draws import FACTORS, Case, Milling
from virtual_cell.recipes.irb6640 import KNOWN
from virtual_cell.units import DEG, MM
from virtual_cell.world.draws import uniform


@dataclass(frozen=True)
class Programme:
    """What a style cuts, with what, and how it is measured; lengths in mm.

    Attributes
    ----------
    cutters : diameter and radial depth. teeth, rpm, feeds, depths : of which one is drawn; per tooth.
    conditions, replicates : from–to. levels : number of axial depths that the conditions take in turn.
    clumped : probability that repeats follow one another. struck : that the tip was struck.
    known, sides : see :func:`virtual_cell.world.faces.scan.drawn`. many_loads : load tests at more places.
    """

    cutters: tuple[tuple[float, float], ...]
    teeth: tuple[int, ...]
    rpm: tuple[float, ...]
    feeds: tuple[float, ...]
    depths: tuple[float, ...]
    conditions: tuple[int, int]
    replicates: tuple[int, int]
    levels: int
    clumped: float
    struck: float
    known: float
    sides: float
    many_loads: bool


PROGRAMMES = {
    "c": Programme(
        cutters=((12.0, 8.0), (16.0, 10.0), (16.0, 11.0), (20.0, 12.0), (20.0, 14.0)),
        teeth=(3, 4),
        rpm=(10000.0, 12000.0, 15000.0),
        feeds=(0.045, 0.055, 0.065),
        depths=(1.4, 1.8, 2.2),
        conditions=(4, 8),
        replicates=(2, 3),
        levels=2,
        clumped=0.3,
        struck=0.25,
        known=0.7,
        sides=0.1,
        many_loads=False,
    ),
    "d": Programme(
        cutters=((10.0, 7.0), (14.0, 9.0), (18.0, 11.0), (25.0, 15.0), (25.0, 18.0)),
        teeth=(3, 4, 5),
        rpm=(9500.0, 11000.0, 14000.0, 18000.0),
        feeds=(0.05, 0.07, 0.08),
        depths=(1.2, 1.6, 2.6),
        conditions=(5, 8),
        replicates=(2, 3),
        levels=3,
        clumped=0.5,
        struck=0.35,
        known=0.65,
        sides=0.12,
        many_loads=True,
    ),
}


def milling(rng: np.random.Generator, programme: Programme) -> Milling:
    """Draw tool and metal; the declared coefficients are from another bar: each is wrong by 1–4 %."""
    diameter, width = programme.cutters[rng.integers(len(programme.cutters))]
    teeth, rpm, feed = (float(rng.choice(of)) for of in (programme.teeth, programme.rpm, programme.feeds))
    true = {name: value * math.exp(rng.normal(0.0, 0.12)) for name, value in KNOWN.items()}
    off = drawn_size(rng, 0.01, 0.04)
    declared = {name: float(f"{value * (1.0 + off * rng.normal()):.4g}") for name, value in true.items()}
    values = list(true.values())
    tool = Tool(0.5 * diameter * MM, uniform(rng, 25.0, 45.0) * DEG, np.arange(teeth) * 2.0 * math.pi / teeth)
    metal = in_millimetres(values[:3], values[3:])
    return Milling(tool, metal, declared, rpm, feed * MM, width * MM)


def plate(rng: np.random.Generator, width: float) -> tuple[float, float]:
    """Draw a plate of a whole number of passes either way."""
    x, y = (
        max(3, round(extent / width)) * width for extent in (rng.uniform(0.1, 0.26), rng.uniform(0.06, 0.13))
    )
    return float(x), float(y)


def cases(rng: np.random.Generator, programme: Programme) -> tuple[Case, ...]:
    """Draw configurations and depths; about a third of the conditions is held out."""
    count = int(rng.integers(programme.conditions[0], programme.conditions[1] + 1))
    replicates = int(rng.integers(programme.replicates[0], programme.replicates[1] + 1))
    deep = float(rng.choice(programme.depths))
    levels = [
        round(deep * (1.0 - 0.45 * i / max(1, programme.levels - 1)), 2) for i in range(programme.levels)
    ]
    if rng.uniform() < 0.3:
        levels = levels[:1]
    chosen = [FACTORS[i] for i in rng.permutation(len(FACTORS))[:count]]
    held = max(1, round(count / 3.0))
    return tuple(
        Case(
            wrist,
            location,
            orientation,
            depth_mm=levels[i % len(levels)],
            role="validate" if i >= count - held else "identify",
            replicates=replicates,
        )
        for i, (wrist, location, orientation) in enumerate(chosen)
    )
