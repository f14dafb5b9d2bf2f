"""Machines and programmes of styles ``c`` and ``d``, drawn: everything of the harder world is on.

Ranges and where they are from are listed in the docs (world-boundary.md).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from virtual_cell.units import DEG, MM, N_MM, N_MM2, UM, Array
from virtual_cell.world.boundary import ears, hammer
from virtual_cell.world.boundary.cell import Cell, Session, Spindle, Tool
from virtual_cell.world.boundary.chatter import Law
from virtual_cell.world.boundary.flank import Flank
from virtual_cell.world.boundary.resonances import Resonances
from virtual_cell.world.draws import between

# Tangential, radial and axial chip force in N/mm², ploughing in N/mm, force of a squeezed volume in N/m³.
_METALS = (
    (760.0, 210.0, 180.0, 16.0, 17.5, 1.5e14),  # AA7075
    (560.0, 240.0, 120.0, 9.0, 10.0, 1.2e14),  # AlMgSi
    (1750.0, 700.0, 350.0, 26.0, 38.0, 1.9e14),  # Ti6Al4V
    (2050.0, 1150.0, 300.0, 22.0, 34.0, 4.0e14),  # carbon steel
)
_CELL_DEG = 6.0  # cuts begin and end between two steps of the march


@dataclass(frozen=True)
class Programme:
    """Tests as they are planned, and how they are heard and recorded.

    Attributes
    ----------
    speeds : rising, rev/min. kinds : directions of cut, each tested at every speed.
    held_out : those of the speeds. repeated : speeds at which all is done twice.
    depths : m, the ladder. beside : tests kept on either side of the boundary.
    order : ``ladder`` or ``random``.
    declared : factors on the tangential and radial chip force, as the manifest has them.
    records, rate : whether forces are recorded, and how fast, Hz.
    mains, mains_hz : N, Hz. crosstalk : (3, 3), 1 on its diagonal.
    noise : N. resonance : of the dynamometer, Hz and damping, in each axis.
    impact_files : ``frf`` or ``record``. per_turn, turns : of the march.
    """

    speeds: tuple[float, ...]
    kinds: tuple[str, ...]
    held_out: tuple[float, ...]
    repeated: tuple[float, ...]
    depths: tuple[float, ...]
    beside: int
    order: str
    declared: tuple[float, float]
    records: bool
    rate: float
    mains: float
    mains_hz: float
    crosstalk: Array
    noise: float
    resonance: tuple[tuple[float, float], ...]
    impact_files: str
    hammer: hammer.Hammer
    ears: ears.Ears
    per_turn: int
    turns: int


def drawn_cell(rng: np.random.Generator) -> Cell:
    """Draw a machine that hides nothing on purpose."""
    resonances = _resonances(rng)
    metal = np.array(_METALS[rng.integers(len(_METALS))])
    metal[:5] *= np.exp(rng.normal(0.0, 0.1, 5))
    diameter = float(rng.choice([8.0, 10.0, 12.0, 16.0, 20.0, 25.0])) * MM
    teeth = int(rng.choice([2, 3, 4, 5], p=[0.3, 0.3, 0.3, 0.1]))
    swept = _CELL_DEG * int(rng.integers(7, 21))
    ktc, krc, kac = (metal[:3] * N_MM2).tolist()
    kte, kre = (metal[3:5] * N_MM).tolist()
    law = Law(ktc, krc, kac, kte, kre, thin=between(rng, 2.0, 8.0) * UM)
    pressure, viscous = float(metal[5]), between(rng, 1.0, 15.0) * N_MM
    flank = Flank(
        land=math.sqrt(2.0 * viscous / pressure),
        springback=between(rng, 0.5, 3.0) * UM,
        pressure=pressure,
        friction=float(rng.uniform(0.1, 0.3)),
        growth=between(rng, 0.03, 0.3),
    )
    off = rng.normal(0.0, between(rng, 1.0, 5.0) * UM, teeth)
    tool = Tool(
        diameter, off - off.mean(), between(rng, 1.0, 5.0) * UM, float(rng.uniform(0.0, 2.0 * math.pi))
    )
    return Cell(
        resonances,
        _spindle(rng),
        tool,
        law,
        flank,
        _session(rng),
        feed=round(float(rng.uniform(0.04, 0.1)), 3) * MM,
        radial=0.5 * diameter * (1.0 - math.cos(swept * DEG)),
        direction=str(rng.choice(["down", "up", "slot"], p=[0.45, 0.4, 0.15])),
        fast=60.0 * float(resonances.hz.max()) / 5.0,
    )


def _spindle(rng: np.random.Generator) -> Spindle:
    """Draw a spindle; its bearings change by up to 3 % on their own, softer by balls or stiffer by heat."""
    softer = bool(rng.random() < 0.6)
    return Spindle(
        off=float(rng.uniform(-5e-3, 5e-3)),
        wander=between(rng, 1e-4, 3e-3),
        wander_s=between(rng, 0.2, 5.0),
        droop=between(rng, 5e-4, 5e-3),
        bearing=between(rng, 2e-3, 3e-2) * (-1.0 if softer else 1.0),
        bent=2.0 if softer else float(rng.uniform(1.0, 1.55)),
        damped=between(rng, 0.01, 0.1),
    )


def _session(rng: np.random.Generator) -> Session:
    return Session(
        common=between(rng, 3e-3, 1e-2),
        own=between(rng, 3e-3, 1e-2),
        drift=between(rng, 5e-3, 3e-2) * float(rng.choice([-1.0, 1.0])),
        depth_off=between(rng, 10.0, 60.0) * UM * float(rng.choice([-1.0, 1.0])),
        depth_sd=between(rng, 5.0, 30.0) * UM,
        grain=between(rng, 5e-3, 2e-2),
        settling=float(rng.uniform(3.0, 10.0)),
        warming=between(rng, 1e-3, 1e-2) * float(rng.choice([-1.0, 1.0])),
    )


def _resonances(rng: np.random.Generator) -> Resonances:
    """Draw one to three resonances near each axis; one in three has a close pair, one in two a soft work."""
    first, soft = between(rng, 150.0, 450.0), between(rng, 6e6, 25e6)
    hz: list[float] = []
    stiffness: list[float] = []
    heading: list[float] = []
    for axis in (0.0, 90.0):
        count = int(rng.choice([1, 2, 3], p=[0.45, 0.35, 0.2]))
        hz += (
            first * rng.uniform(0.85, 1.18) * np.cumprod([1.0, *rng.uniform(1.18, 1.5, count - 1)])
        ).tolist()
        stiffness += (
            soft * rng.uniform(0.8, 1.65) * np.array([1.0, *rng.uniform(0.9, 3.0, count - 1)])
        ).tolist()
        heading += (
            axis + rng.choice([-1.0, 1.0], count) * [between(rng, 0.5, 5.0) for _ in range(count)]
        ).tolist()
    if rng.random() < 0.33:
        twin = int(rng.integers(len(hz)))
        hz.append(hz[twin] * float(1.0 + rng.uniform(0.03, 0.08)))
        stiffness.append(stiffness[twin] * between(rng, 1.5, 5.0))
        heading.append(heading[twin] + float(rng.normal(0.0, 5.0)))
    m = len(hz)
    bearing = rng.uniform(0.3, 0.93, m)
    if rng.random() < 0.5:  # the least soft one is of the work or its fixture
        bearing[int(np.argmax(stiffness))] = 0.0
    apart = np.subtract.outer(heading, heading) * DEG
    joint = np.triu(rng.uniform(-0.3, 0.3, (m, m)) * np.abs(np.cos(apart)), 1)
    joint = joint + joint.T
    joint *= min(1.0, 0.8 / max(float(-np.linalg.eigvalsh(joint).min()), 1e-9))  # no motion gains energy
    damping = np.array([between(rng, 0.015, 0.05) for _ in range(m)])
    return Resonances(
        np.array(hz),
        damping,
        np.array(stiffness),
        np.array(heading) * DEG,
        np.eye(m) + joint,
        bearing,
        np.ones(m, dtype=bool),
    )


def drawn_programme(rng: np.random.Generator, cell: Cell, style: str) -> Programme:
    """Draw tests of a machine.

    Style ``c``: 12 to 16 speeds, tested speed after speed as people do, half of the batches with records at
    4096 Hz, and impacts as transfer functions. Style ``d``: 10 to 18 speeds, some tested twice, half of the
    batches in random order, records at another rate, and impacts as blows or as transfer functions. Where
    each speed is cut in two ways there are three fifths as many.
    """
    other = style == "d"
    highest = float(cell.resonances.hz.max())
    second = {"up": "down", "down": "up", "slot": str(rng.choice(["up", "down"]))}[cell.direction]
    kinds = (cell.direction, second) if rng.random() < 0.78 else (cell.direction,)
    count = int(rng.integers(10, 19)) if other else int(rng.integers(12, 17))
    count = round(0.62 * count) if len(kinds) > 1 else count  # about as many tests in all
    lowest = 60.0 * highest / rng.uniform(7.0, 11.5)  # more waves per turn are more than the march can
    ends = (lowest, min(lowest * rng.uniform(1.8, 3.2), cell.fast * 1.27))
    apart = np.cumsum(rng.uniform(0.5, 1.5, count))
    if other:  # people like to look where a lobe is high: some speeds lie close together
        apart = np.sort(np.concatenate([apart[: count - 2], rng.uniform(apart[0], apart[-1], 2)]))
    speeds = np.unique(10.0 * np.round(np.interp(apart, [apart[0], apart[-1]], ends) / 10.0))
    held = 1 + rng.permutation(len(speeds) - 2)[: round(len(speeds) / (4.0 if other else 3.5))]
    ratio = float(rng.uniform(1.12, 1.28))
    shallow = cell.level * float(rng.uniform(0.35, 0.55))
    steps = math.ceil(math.log(16.0) / math.log(ratio))
    sd = between(rng, 0.01, 0.05)
    records = bool(rng.random() < 0.5)
    crosstalk = np.eye(3) + (rng.uniform(5e-3, 3e-2, (3, 3)) * rng.choice([-1.0, 1.0], (3, 3))) * (
        1.0 - np.eye(3)
    )
    return Programme(
        speeds=tuple(speeds.tolist()),
        kinds=kinds,
        held_out=tuple(float(speeds[i]) for i in sorted(held)),
        repeated=tuple(float(speeds[i]) for i in rng.permutation(len(speeds))[: int(rng.integers(0, 4))])
        if other
        else (),
        depths=tuple(round(shallow * ratio**i / MM, 2) * MM for i in range(steps)),
        beside=int(rng.choice([2, 3])) if other else 2,
        order="random" if other and rng.random() < 0.5 else "ladder",
        declared=(float(np.exp(rng.normal(0.0, sd))), float(np.exp(rng.normal(0.0, sd)))),
        records=records,
        rate=float(rng.choice([3200.0, 5000.0])) if other else 4096.0,
        mains=between(rng, 0.1, 5.0),
        mains_hz=float(rng.choice([50.0, 60.0])),
        crosstalk=crosstalk,
        noise=between(rng, 0.3, 3.0),
        resonance=tuple((between(rng, 1150.0, 4000.0), between(rng, 0.02, 0.06)) for _ in range(3)),
        impact_files=str(rng.choice(["frf", "record"])) if other else "frf",
        hammer=hammer.drawn(rng, highest),
        ears=ears.drawn(rng),
        per_turn=120 if lowest * 8.0 >= 60.0 * highest else 180,
        turns=75,
    )
