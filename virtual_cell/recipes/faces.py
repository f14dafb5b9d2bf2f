"""Milled faces for blind tests: scans of every face, load tests, reduced mass, now and then hammer tests.

Faces are cut in random order, repeats spread over the session. A pass of the mean force over a turn is traced
from the true chips at entry, in full cut and at exit.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from virtual_cell.face import surface
from virtual_cell.face_effects import applied, pass_gains, pass_levels
from virtual_cell.face_files import face_manifest, face_row, write_frf
from virtual_cell.face_tables import load_rows, mass_row, path_rows
from virtual_cell.hidden import Parameters
from virtual_cell.milling import scattered
from virtual_cell.recipes import faces_world
from virtual_cell.recipes.faces_draws import Case, FaceCell, Pose, drawn, eight_cases, feed_axes
from virtual_cell.recipes.faces_world_programme import PROGRAMMES
from virtual_cell.scanner import scan
from virtual_cell.session import spread
from virtual_cell.side_force import SideCut, SideForce, side_force
from virtual_cell.tip import Tip, tip_heights
from virtual_cell.units import MM, Array
from virtual_cell.write import RUN_COLUMNS, Row, fresh_folder, write_csv, write_ply, write_yaml

Listener = Callable[[str, Case, SideForce], Row]
_SCATTER, _SPEED_ERROR = 0.01, 0.003
_REPEATS, _COARSE = 9, 1.1 * MM  # of a study: faces of each configuration, and pitch of their scans
_HAMMER_HZ, _HAMMER_NOISE = np.arange(0.5, 60.0, 0.125), 0.01


def make(folder: Path, hidden: Mapping[str, Parameters | None], seed: int, style: str = "a") -> Row:
    """Write a batch that hides effects (name → parameters, or None: drawn by the seed); return the truth.

    Styles ``c`` and ``d`` are of the harder world, :mod:`virtual_cell.recipes.faces_world`.

    Raises
    ------
    KeyError
        For an effect that is not known.
    """
    if style in PROGRAMMES:
        return faces_world.make(folder, hidden, seed, style)
    rng = np.random.default_rng([seed, 41])
    truth = _made(folder, drawn(rng, style), hidden, rng)
    return {**truth, "seed": seed, "style": style}


def make_eight_cases(
    folder: Path, hidden: Mapping[str, Parameters | None], seed: int, replicates: int = 3
) -> Row:
    """Write a batch of all eight configurations on a fixed bench, half of them held out; return the truth."""
    rng = np.random.default_rng([seed, 43])
    return _made(folder, drawn(rng, "a", eight_cases(replicates)), hidden, rng) | {"seed": seed}


def make_study(folder: Path, hidden: Mapping[str, Parameters | None], seed: int, style: str = "a") -> Row:
    """Write the whole study of Iglesias et al. 2025 (tables 1, 2): eight configurations, each cut nine times.

    The 72 scans are as coarse as the heights at the points of the path allow, so that the batch is small.

    Raises
    ------
    ValueError
        For a style of the harder world, which has programmes of its own.
    """
    if style in PROGRAMMES:
        raise ValueError(f"a study is made in the styles a and b, not in {style}")
    rng = np.random.default_rng([seed, 45])
    cell = drawn(rng, style, eight_cases(_REPEATS))
    cell = replace(cell, scanner=replace(cell.scanner, spacing=max(cell.scanner.spacing, _COARSE)))
    return _made(folder, cell, hidden, rng) | {"seed": seed, "style": style}


def _made(
    folder: Path, cell: FaceCell, hidden: Mapping[str, Parameters | None], rng: np.random.Generator
) -> Row:
    cell, effects = applied(cell, hidden, rng.spawn(1)[0])
    fresh_folder(folder)
    rows = mill_all(folder, cell, rng)
    write_csv(folder / "runs.csv", rows, RUN_COLUMNS)
    write_csv(folder / "loads.csv", tested(folder, cell, rng))
    write_yaml(folder / "cell.yaml", {"cell": "milling-arm"})
    write_yaml(folder / "batch.yaml", manifest(folder.name, cell))
    return {"batch": folder.name, "effects": effects}


def mill_all(
    folder: Path,
    cell: FaceCell,
    rng: np.random.Generator,
    *,
    after: int = 0,
    metres: float = 0.0,
    listen: Listener | None = None,
) -> list[Row]:
    """Mill and scan every face of a cell into ``folder``; return the rows of the run table.

    ``after`` so many runs, and so many ``metres`` of cut of the same tool. ``listen(run, case, force)`` is
    called for every face with the force along its passes, and returns the further columns of its row.
    """
    rows = []
    for place, (case, replicate) in enumerate(spread(cell.cases, rng), start=after + 1):
        run = f"r{place:02d}"
        worn = replace(cell, milling=replace(cell.milling, metal=cell.milling.metal.after(metres)))
        settings, hiding, scanning = rng.spawn(3)
        force = _force(worn, case, settings)
        write_ply(folder / f"scan/{run}.ply", _cut(worn, case, force, hiding, scanning))
        heard = listen(run, case, force) if listen else {}
        rows.append(
            face_row(cell.milling, cell.size, case, run=run, place=place, replicate=replicate) | heard
        )
        metres += rows[-1]["cut_length_mm"] * MM
    for orientation in sorted({case.orientation for case in cell.cases}):
        write_csv(folder / f"path/{orientation}.csv", path_rows(cell.passes(orientation)))
    return rows


def _cut(
    cell: FaceCell,
    case: Case,
    force: SideForce,
    hiding: np.random.Generator,
    scanning: np.random.Generator,
) -> Array:
    """Mill one face with a force along its passes, and scan it, each with its own chance."""
    passes, pose, depth = cell.passes(case.orientation), cell.poses[case.pose], case.depth_mm * MM
    tip = Tip(pose.mass, pose.a0, pose.a1, lambda at: cell.factor * np.linalg.inv(pose.compliance(at)))
    feed = feed_axes(case)

    def load(s: Array) -> Array:
        return np.asarray(force.mean_at(s) @ feed)

    count = len(passes.axes)
    heights = tip_heights(passes, tip, load, pass_gains(cell, count, depth))
    phase, levels = hiding.uniform(0.0, 2.0 * math.pi), pass_levels(cell, count, hiding)
    around = replace(cell.around, phase=phase, levels=levels)
    return scan(cell.scanner, cell.size, lambda at: surface(passes, heights, around, at), scanning)


def _force(cell: FaceCell, case: Case, rng: np.random.Generator) -> SideForce:
    """Mean force along a pass; the metal and the spindle are a little different in every face."""
    mill = cell.milling
    metal, length = scattered(mill.metal, _SCATTER, rng), cell.passes(case.orientation).length
    rpm, axial = mill.spindle_rpm, case.depth_mm * MM
    cut = SideCut(mill.tool, metal, rpm, mill.speed, axial, mill.width, "down", length)
    return side_force(cut, lambda _: 0.0, speed_error=_SPEED_ERROR * rng.uniform(-1.0, 1.0), phase=0.0)


def tested(folder: Path, cell: FaceCell, rng: np.random.Generator) -> list[Row]:
    """Return the load tests; write reduced mass and, where the tip was struck, the hammer tests of poses."""
    tests, middle = cell.loads, np.array(cell.size) / 2.0
    at = (float(middle[0] / MM), float(middle[1] / MM))
    loads = [
        load_rows(
            name,
            pose.compliance,
            tests.places,
            tests.newtons,
            gauge=tests.gauge,
            rng=rng,
            repeats=tests.repeats,
        )
        for name, pose in cell.poses.items()
    ]
    write_csv(folder / "mass.csv", [mass_row(name, "P5", at, pose.mass) for name, pose in cell.poses.items()])
    if cell.hammered:
        rows = [row for name, pose in cell.poses.items() for row in _struck(folder, name, pose, middle, rng)]
        write_csv(folder / "impacts.csv", rows)
    return list(itertools.chain(*loads))


def _struck(folder: Path, name: str, pose: Pose, at: Array, rng: np.random.Generator) -> list[Row]:
    """Write the receptances of the tip, struck and heard along each axis at the middle of the plate."""
    rows = []
    seen = receptance(pose, at, _HAMMER_HZ)
    for axis, word in enumerate("xyz"):
        true = seen[:, axis, axis]
        noise = rng.standard_normal((len(true), 2)) @ np.array([1.0, 1j]) * math.sqrt(0.5)
        read = true + _HAMMER_NOISE * np.abs(true).mean() * noise
        rows.append(write_frf(folder, name, word, _HAMMER_HZ, read))
    return rows


def receptance(pose: Pose, at: Array, frequency: Array) -> Array:
    """Receptance (n, 3, 3), complex, m/N, of the tip at a point (2,), m; ``frequency`` (n,), Hz; e^{+iωt}."""
    omega = 2.0 * math.pi * frequency[:, None, None]
    stiffness = np.linalg.inv(pose.compliance(at[None])[0])
    damping = pose.a0 * pose.mass + pose.a1 * stiffness
    return np.asarray(np.linalg.inv(stiffness - omega**2 * pose.mass + 1j * omega * damping))


def manifest(name: str, cell: FaceCell) -> Row:
    """Return batch.yaml of a batch of faces."""
    scanner = cell.scanner
    seen = {
        "spacing_mm": round(scanner.spacing / MM, 6),
        "sigma_mm": round(scanner.sigma / MM, 6),
        "to_work": [[round(float(v), 9) for v in row] for row in scanner.to_work],
    }
    return face_manifest(name, cell.milling, cell.size, seen)
