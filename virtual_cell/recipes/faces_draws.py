"""A milling arm, its plates and its scanner, drawn: what differs between batches of faces.

What a batch may hide is a field of the :class:`FaceCell`, too; drawn cells hide nothing.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from virtual_cell.arm import Arm, rotation_rpy
from virtual_cell.chips import Tool
from virtual_cell.face import Passes, Surroundings
from virtual_cell.milling import Coefficients, in_millimetres
from virtual_cell.recipes.irb6640 import ARM, DAMPING, KNOWN, MASS, NEAR, WORK_MM, WRIST_YAW_DEG
from virtual_cell.scanner import Scanner
from virtual_cell.tip_compliance import tip_compliance
from virtual_cell.units import DEG, MM, UM, Array

FACTORS = tuple(itertools.product("AB", (1, 2), "LT"))  # wrist, location, orientation
# diameter and radial depth; below half of the diameter a pass goes over the axis of the one before it
_CUTTERS_MM = ((12.0, 8.0), (16.0, 7.0), (16.0, 10.0), (20.0, 8.0), (20.0, 12.0), (20.0, 14.0))
_MOST_POINTS = 30_000  # of a scan
_LEAD = 4.0 * MM  # of the path beyond where the cutter touches the plate


@dataclass(frozen=True)
class Case:
    """A condition: levels of the factors, axial depth, role; the depth in mm."""

    wrist: str
    location: int
    orientation: str
    depth_mm: float
    role: str
    replicates: int = 2

    @property
    def condition(self) -> str:
        """Name of the condition."""
        return f"{self.wrist}{self.location}{self.orientation}-{self.depth_mm:g}".lower()

    @property
    def pose(self) -> str:
        """Name of the pose."""
        return f"{self.wrist}{self.location}"


def feed_axes(case: Case) -> Array:
    """Axes of the feed frame in the work frame, as rows (3, 3)."""
    if case.orientation == "L":
        return np.eye(3)
    return np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


@dataclass(frozen=True)
class Pose:
    """The arm at a pose: ``compliance`` (n, 2) → (n, 3, 3) m/N; ``mass`` (3, 3) kg; C = a0 M + a1 K."""

    compliance: Callable[[Array], Array]
    mass: Array
    a0: float
    a1: float


@dataclass(frozen=True)
class LoadTests:
    """Pulls in N at ``places`` (mm), so often each; error of the ``gauge``, m."""

    places: tuple[tuple[float, float], ...]
    newtons: tuple[float, float]
    repeats: int
    gauge: float


@dataclass(frozen=True)
class Milling:
    """Tool, metal, and the settings that all faces share: spindle in rpm, all others in m.

    ``declared``: the coefficients as the manifest has them, in the contract's units.
    """

    tool: Tool
    metal: Coefficients
    declared: Mapping[str, float]
    spindle_rpm: float
    feed: float
    width: float

    @property
    def speed(self) -> float:
        """Feed, m/s."""
        return self.feed * self.tool.teeth * self.spindle_rpm / 60.0


@dataclass(frozen=True)
class FaceCell:
    """What a batch of faces is made on and with, and what it hides.

    Attributes
    ----------
    size : of the plate along work x, y, m. poses : by name. hammered : whether the tip was struck in them.
    factor : stiffness in the cut over that of the load tests. around : what else shapes every face.
    wear : relative growth of the force over a face. step : share of the passes of a face from which on the
        tool sits higher, and by how much, m. missed : place (share) of the one pass that is set too deep, and
        by how much, m. walk : m, standard deviation of the steps of the height from pass to pass.
    """

    size: tuple[float, float]
    milling: Milling
    poses: Mapping[str, Pose]
    loads: LoadTests
    scanner: Scanner
    cases: tuple[Case, ...]
    hammered: bool = False
    factor: float = 1.0
    around: Surroundings = field(default_factory=Surroundings)
    wear: float = 0.0
    step: tuple[float, float] = (1.0, 0.0)
    missed: tuple[float, float] = (0.0, 0.0)
    walk: float = 0.0

    def passes(self, orientation: str) -> Passes:
        """Return the passes along the plate (L) or across (T)."""
        mill, along = self.milling, 0 if orientation == "L" else 1
        lead = mill.tool.radius + _LEAD
        return Passes(self.size, along, mill.width, mill.tool.radius, mill.speed, lead)


def drawn(rng: np.random.Generator, style: str, cases: tuple[Case, ...] | None = None) -> FaceCell:
    """Draw a cell, and its programme where ``cases`` are not given.

    In style ``a`` plate, tool and scanner are always the same; in ``b`` they differ, and the tip was struck
    with a hammer in a third of the batches.
    """
    varied = style == "b"
    milling = _milling(rng, varied)
    size = _plate(rng, varied, milling.width)
    cases = cases or _cases(rng, varied)
    return FaceCell(
        size=size,
        milling=milling,
        poses=_poses(rng, varied, size, sorted({case.pose for case in cases})),
        loads=load_tests(rng, varied, size),
        scanner=scanner_of(rng, varied, size),
        cases=cases,
        hammered=varied and bool(rng.uniform() < 1.0 / 3.0),
    )


def _milling(rng: np.random.Generator, varied: bool) -> Milling:
    """Draw tool and metal; what is declared of the metal has an error of one per cent."""
    diameter, width, teeth, rpm, feed = 16.0, 10.0, 4, 12000.0, 0.05
    if varied:
        diameter, width = _CUTTERS_MM[rng.integers(len(_CUTTERS_MM))]
        teeth, rpm = int(rng.choice([3, 4])), float(rng.choice([9000.0, 12000.0, 15000.0]))
        feed = float(rng.choice([0.04, 0.05, 0.06]))
    true = {name: value * math.exp(rng.normal(0.0, 0.1)) for name, value in KNOWN.items()}
    declared = {name: float(f"{value * (1.0 + rng.normal(0.0, 0.01)):.4g}") for name, value in true.items()}
    values = list(true.values())
    tool = Tool(0.5 * diameter * MM, 30.0 * DEG, np.arange(teeth) * 2.0 * math.pi / teeth)
    metal = in_millimetres(values[:3], values[3:])
    return Milling(tool, metal, declared, rpm, feed * MM, width * MM)


def _plate(rng: np.random.Generator, varied: bool, width: float) -> tuple[float, float]:
    """Draw a plate of a whole number of passes either way."""
    wanted = (rng.uniform(0.1, 0.3), rng.uniform(0.06, 0.15)) if varied else (0.2, 0.1)
    x, y = (round(extent / width) * width for extent in wanted)
    return float(x), float(y)


def eight_cases(replicates: int) -> tuple[Case, ...]:
    """Return all configurations at one depth: four of them, each two of which share one level, identify."""
    return tuple(
        Case(*levels, 2.0, "identify" if _even(levels) else "validate", replicates) for levels in FACTORS
    )


def _even(levels: tuple[str, int, str]) -> bool:
    return ((levels[0] == "B") + (levels[1] == 2) + (levels[2] == "T")) % 2 == 0


def _cases(rng: np.random.Generator, varied: bool) -> tuple[Case, ...]:
    """Draw configurations, their depths, and which of them are held out: two of six, three of eight."""
    count, replicates = (int(rng.integers(4, 9)), int(rng.integers(2, 4))) if varied else (6, 2)
    deep = float(rng.choice([1.5, 2.0, 2.5])) if varied else 2.0
    shallow = deep if varied and rng.uniform() < 1.0 / 3.0 else 0.5 * deep + 0.2
    chosen = [FACTORS[i] for i in rng.permutation(len(FACTORS))[:count]]
    held = max(1, round(count / 3.0))
    return tuple(
        Case(
            wrist,
            location,
            orientation,
            depth_mm=(deep, shallow)[i % 2],
            role="validate" if i >= count - held else "identify",
            replicates=replicates,
        )
        for i, (wrist, location, orientation) in enumerate(chosen)
    )


def _poses(
    rng: np.random.Generator, varied: bool, size: tuple[float, float], names: list[str]
) -> dict[str, Pose]:
    """Draw an arm and where the plate lies; again where that is out of reach."""
    while True:
        arm = replace(ARM, stiffness=ARM.stiffness * np.exp(rng.normal(0.0, 0.15, 6)))
        reach = np.array([150.0, 200.0, 100.0]) if varied else np.zeros(3)
        first = np.array(WORK_MM) + rng.uniform(-1.0, 1.0, 3) * reach
        apart = np.array([rng.uniform(-250.0, -100.0), rng.uniform(250.0, 450.0), 0.0])
        places = {"1": first * MM, "2": (first + apart) * MM}
        light, lossy = np.diag(np.exp(rng.normal(0.0, 0.05, 3))), np.exp(rng.normal(0.0, 0.2, 2))
        try:
            return {
                name: Pose(
                    _compliance(arm, places[name[1]], name[0], size),
                    light @ MASS[name[0]] @ light,
                    *(np.array(DAMPING[name[0]]) * lossy).tolist(),
                )
                for name in names
            }
        except (RuntimeError, np.linalg.LinAlgError):
            continue


def _compliance(arm: Arm, origin: Array, wrist: str, size: tuple[float, float]) -> Callable[[Array], Array]:
    return tip_compliance(arm, origin, rotation_rpy(0.0, 0.0, WRIST_YAW_DEG[wrist] * DEG), size, NEAR)


def load_tests(rng: np.random.Generator, varied: bool, size: tuple[float, float]) -> LoadTests:
    """Draw how the tip is pulled at nine places of a plate."""
    x, y = ((10.0, 0.5 * extent / MM, extent / MM - 10.0) for extent in size)
    places = tuple((float(round(a, 1)), float(round(b, 1))) for a in x for b in y)
    repeats = int(rng.integers(2, 4)) if varied else 2
    return LoadTests(places, (150.0, 250.0), repeats, 2.0 * UM)


def scanner_of(rng: np.random.Generator, varied: bool, size: tuple[float, float]) -> Scanner:
    """Draw a scanner at a known place somewhere about the plate, looking down."""
    if not varied:
        spacing, sigma, correlated, off, turn = 1.0 * MM, 15.0 * UM, 0.5, 8.0 * UM, (90.0, 0.0, 0.0)
        at = (260.0, -35.0, -120.0)
    else:
        spacing, sigma = rng.uniform(0.6, 1.2) * MM, rng.uniform(6.0, 25.0) * UM
        correlated, off = rng.uniform(0.2, 0.8), rng.uniform(3.0, 10.0) * UM
        turn = (rng.uniform(-180.0, 180.0), *rng.uniform(-3.0, 3.0, 2))
        at = tuple(rng.uniform(-400.0, 400.0, 3).round(2).tolist())
    spacing = max(spacing, math.sqrt(size[0] * size[1] / _MOST_POINTS))
    to_work = np.eye(4)
    to_work[:3, :3] = rotation_rpy(turn[1] * DEG, turn[2] * DEG, turn[0] * DEG)
    to_work[:3, 3] = at
    digits = round(spacing / MM, 2) * MM, round(sigma / UM, 1) * UM
    return Scanner(*digits, to_work, off, 2.0 * off / max(size), correlated)
