"""Milled faces in a real workshop: styles ``c`` and ``d``, in which everything of the world is always there.

The files are those of :mod:`virtual_cell.recipes.faces`. The truth says beside the hidden effects what was
drawn of the world, in plain units, and the relative error of each effect's translation to the contract.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from virtual_cell.face_files import face_manifest, face_row, write_frf
from virtual_cell.face_tables import PATH_STEP, mass_row, path_rows
from virtual_cell.hidden import Parameters, drawn_size
from virtual_cell.recipes.faces_draws import Case, feed_axes
from virtual_cell.recipes.faces_world_draws import Workshop, drawn, side_cut
from virtual_cell.recipes.faces_world_truth import world
from virtual_cell.session import spread
from virtual_cell.side_force import SideForce, full_cut, side_force
from virtual_cell.units import DEG, MM, Array
from virtual_cell.world.draws import uniform
from virtual_cell.world.faces import load_test, scan, structure
from virtual_cell.world.faces.causes import applied
from virtual_cell.world.faces.finish import FaceRun, Influence, Span, finished, gain
from virtual_cell.world.faces.terms import in_contract_terms
from virtual_cell.world.present import listed
from virtual_cell.write import RUN_COLUMNS, Row, fresh_folder, write_csv, write_ply, write_yaml

_HAMMER_HZ = np.arange(1.0, 55.0, 0.25)


def make(folder: Path, hidden: Mapping[str, Parameters | None], seed: int, style: str) -> Row:
    """Write a batch that hides effects or troubles (None: parameters drawn by the seed); return the truth.

    Raises
    ------
    KeyError
        For an effect or a style that is not known.
    """
    rng = np.random.default_rng([seed, 47])
    cell = drawn(rng, style)
    order = ordered(cell, rng)
    session = planned(cell, order, rng)
    cell, effects, errors = applied(cell, session, hidden, rng.spawn(1)[0])
    placed = scan.placing(cell.scanner, rng)
    fresh_folder(folder)
    rows = []
    for run, (case, replicate) in zip(session, order, strict=True):
        name = f"r{run.order + 1:02d}"
        write_ply(folder / f"scan/{name}.ply", _scanned(cell, run, placed, rng.spawn(1)[0]))
        place = run.order + 1
        row = face_row(cell.milling, cell.size, case, run=name, place=place, replicate=replicate)
        rows.append(row | {"return_s": _back(run)})
    for orientation in sorted({case.orientation for case in cell.cases}):
        write_csv(folder / f"path/{orientation}.csv", path_rows(cell.passes(orientation)))
    write_csv(folder / "runs.csv", rows, (*RUN_COLUMNS, "return_s"))
    _write_tests(folder, cell, rng)
    write_yaml(folder / "cell.yaml", {"cell": "milling-arm"})
    write_yaml(
        folder / "batch.yaml",
        face_manifest(folder.name, cell.milling, cell.size, scan.declared(cell.scanner)),
    )
    return {
        "batch": folder.name,
        "effects": effects,
        "translation_error": errors,
        "always_on": listed(in_contract_terms(cell, session), effects),
        "world": world(cell, placed),
        "seed": seed,
        "style": style,
    }


def ordered(cell: Workshop, rng: np.random.Generator) -> list[tuple[Case, int]]:
    """Return the order of cutting: repeats in clumps, or spread over the session."""
    if not cell.clumped:
        return spread(cell.cases, rng)
    shuffled = [cell.cases[i] for i in rng.permutation(len(cell.cases))]
    return [(case, number) for case in shuffled for number in range(1, case.replicates + 1)]


def planned(cell: Workshop, order: list[tuple[Case, int]], rng: np.random.Generator) -> list[FaceRun]:
    """Return the faces of a session in their order, with the force and the times of each."""
    runs: list[FaceRun] = []
    spans: list[Span] = []
    now = metres = 0.0
    for place, (case, _) in enumerate(order):
        own = rng.spawn(1)[0]
        passes, share = cell.passes(case.orientation), place / max(1, len(order) - 1)
        depth = case.depth_mm * MM + cell.depth_error * own.standard_normal()
        metal = cell.metal.cut(cell.milling.metal, share, metres, own)
        cut = side_cut(cell.milling, depth, passes.length, metal)
        off = cell.speed_error * own.uniform(-1.0, 1.0)
        force = side_force(cut, lambda _: 0.0, speed_error=off, phase=own.uniform(0.0, 2.0 * math.pi))
        blunt = replace(metal, ktc=0.0, krc=0.0, kac=0.0)
        edges = full_cut(replace(cut, coefficients=blunt))
        run = FaceRun(
            order=place,
            count=len(order),
            started=now,
            whole=now,
            earlier=tuple(spans),
            wrist=case.wrist,
            location=case.location,
            passes=passes,
            begun=cell.pauses.begun(len(passes.axes), passes.period, own),
            force=_OfPass(force, feed_axes(case)),
            depth=depth,
            teeth=cell.milling.tool.teeth,
            edge_share=float(edges[2] / full_cut(cut)[2]),
        )
        runs.append(run)
        spans.append((now, now + run.duration))
        now += run.duration + cell.pauses.pause(own)
        metres += len(passes.axes) * passes.length
    return [replace(run, whole=max(runs[-1].started, 1.0)) for run in runs]


def _back(run: FaceRun) -> float:
    """Return the time from the end of a pass of the path file to the next one, s, as a stopwatch reads it."""
    way = round(run.way / PATH_STEP) * PATH_STEP
    return round(float(np.diff(run.begun).mean()) - way / run.passes.speed, 2)


class _OfPass:
    """Mean force (n, 3), N, work frame, at places of the axis along a pass (n,), m."""

    def __init__(self, force: SideForce, axes: Array) -> None:
        self._force, self._axes = force, axes

    def __call__(self, s: Array) -> Array:
        return np.asarray(self._force.mean_at(s) @ self._axes)


def _scanned(cell: Workshop, run: FaceRun, placed: scan.Placing, rng: np.random.Generator) -> Array:
    """Mill a face and return its cloud (n, 3), mm."""
    causes = (*cell.always.causes, *cell.troubles)
    # Each cause draws by itself: what is hidden does not change what else is drawn.
    influences = [cause.in_face(run, own) for cause, own in zip(causes, rng.spawn(len(causes)), strict=True)]
    heights = _tip(cell, run, influences)
    passes = run.passes

    def read(points: Array) -> Array:
        z = finished(run, cell.corner, heights, influences, points)
        return np.asarray(z + sum(one.reading(points) for one in influences if one.reading is not None))

    leaving = (passes.along, passes.size[passes.along])
    return scan.scanned(cell.scanner, placed, passes.size, leaving=leaving, height=read, rng=rng)


def _tip(cell: Workshop, run: FaceRun, influences: list[Influence]) -> list[tuple[Array, Array]]:
    """Return where the axis is along each pass and how high the tip is there, both m."""
    passes, periods = run.passes, np.append(np.diff(run.begun), run.passes.period)
    places, loads = [], []
    for number, period in enumerate(periods.tolist()):
        s = structure.step_places(passes.speed, passes.lead, period)
        cutting = s < passes.length + passes.lead
        factor = gain(influences, number, s, run.time(number, s))
        loads.append(np.where(cutting[:, None], factor[:, None] * run.force(s), 0.0))
        places.append(passes.points(np.clip(s, 0.0, passes.length), number))
    shown = s[cutting]
    pose = cell.poses[f"{run.wrist}{run.location}"]
    return [(shown, z) for z in structure.heights(pose, places, loads, len(shown))]


def _write_tests(folder: Path, cell: Workshop, rng: np.random.Generator) -> None:
    """Write load tests, reduced mass, and hammer tests where the tip was struck."""
    middle = np.array(cell.size) / 2.0
    at = (float(middle[0] / MM), float(middle[1] / MM))
    tests = [load_test.rows(cell.loads, name, pose, rng) for name, pose in cell.poses.items()]
    write_csv(folder / "loads.csv", itertools.chain(*tests))
    write_csv(folder / "mass.csv", [mass_row(name, "P5", at, mass) for name, mass in cell.masses.items()])
    if cell.hammered:
        noise, aside = drawn_size(rng, 0.005, 0.04), uniform(rng, 2.0, 10.0) * DEG
        rows = [
            row
            for name, pose in cell.poses.items()
            for row in _struck(
                folder, name, pose.receptance(middle, _HAMMER_HZ), noise=noise, aside=aside, rng=rng
            )
        ]
        write_csv(folder / "impacts.csv", rows)


def _struck(
    folder: Path, name: str, seen: Array, *, noise: float, aside: float, rng: np.random.Generator
) -> list[Row]:
    """Write receptances of the tip, struck beside each axis by an angle, rad; return their rows."""
    rows = []
    for axis, word in enumerate("xyz"):
        towards = rng.standard_normal(3)
        towards[axis] = 0.0
        hit = math.cos(aside) * np.eye(3)[axis] + math.sin(aside) * towards / np.linalg.norm(towards)
        true = seen[:, axis, :] @ hit
        error = rng.standard_normal((len(true), 2)) @ np.array([1.0, 1j]) * math.sqrt(0.5)
        read = true + noise * np.abs(true).mean() * error
        rows.append(write_frf(folder, name, word, _HAMMER_HZ, read))
    return rows
