"""Joint batches: side cuts and faces of one block by one arm with one tool, and one cause in all of them.

The side cuts are those of :mod:`arm`, with force, torques and wall; then faces are milled on the top of the
block with the wrist in two positions, and scanned; of those that are held out the dynamometer is read along
the first pass. What is hidden of the arm or the tool acts in every run; a stiffness may differ between walls
and faces, which is then not one cause.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from virtual_cell.arm import rotation_rpy
from virtual_cell.arm_cell import ArmCell
from virtual_cell.arm_effects import ARM_EFFECTS
from virtual_cell.dynamometer import record
from virtual_cell.hidden import Parameters, drawn_angle, drawn_signed, drawn_size
from virtual_cell.recipes import arm, faces
from virtual_cell.recipes.arm_draws import Bench, drawn
from virtual_cell.recipes.faces_draws import Case, FaceCell, Milling, Pose, feed_axes, load_tests, scanner_of
from virtual_cell.recipes.irb6640 import DAMPING, MASS
from virtual_cell.session import write_force
from virtual_cell.side_force import SideForce
from virtual_cell.tip_compliance import tip_compliance
from virtual_cell.units import DEG, MM, UM, Array
from virtual_cell.write import RUN_COLUMNS, Row, fresh_folder, write_csv, write_yaml

# In the order of the bench: what it is called, and where it shows.
SHOWN: Mapping[str, tuple[str, ...]] = {
    "stiffness_scale": ("force", "deformation", "flatness"),
    "tool_offset_error": ("joint_force", "deformation"),
    "friction_reversal": ("joint_force", "deformation", "waviness"),
    "gear_ripple": ("joint_force", "waviness"),
    "tool_runout": ("force",),
}
_WIDTH, _FEED = 10.0 * MM, 0.08 * MM
_WRISTS_DEG = {"A": (0.0,), "B": (25.0, -25.0, 12.0, -12.0, 0.0)}  # about the tool's axis, the first in reach
CASES = (
    Case("A", 1, "L", 2.0, "identify", 2),
    Case("A", 1, "T", 1.2, "identify", 2),
    Case("B", 1, "T", 2.0, "identify", 2),
    Case("A", 1, "L", 1.2, "validate", 1),
    Case("B", 1, "L", 1.6, "validate", 1),
)


def make(folder: Path, hidden: Mapping[str, Parameters | None], seed: int, style: str = "a") -> Row:
    """Write a batch that hides causes (name → parameters, or None: drawn by the seed); return the truth.

    A ``stiffness_scale`` may have a ``factor_of_faces``; its ``factor`` is then that of the walls alone.
    ``runs``: by run, the true mean force on the tool and by how much it moves what is compared.

    Raises
    ------
    KeyError
        For a cause that is not known.
    """
    unknown = sorted(set(hidden) - set(SHOWN))
    if unknown:
        raise KeyError(*unknown)
    rng = np.random.default_rng([seed, 59])
    cell, bench = drawn(rng, style)
    plates = _plates(cell, bench, rng.spawn(1)[0], varied=style == "b")
    causes = {name: given or _draw(name, rng, cell) for name, given in hidden.items()}
    for name, values in causes.items():
        cell, bench, plates = _hide(name, values, cell, bench, plates)
    plates = replace(plates, poses=_poses(cell, bench))
    fresh_folder(folder)
    rows, truth = arm.cut_all(folder, cell, bench, rng)
    listening = _Listener(folder, bench, plates, rng.spawn(1)[0])
    rows += faces.mill_all(folder, plates, rng, after=len(rows), listen=listening)
    write_csv(folder / "runs.csv", [{"pose": "p1"} | row for row in rows], RUN_COLUMNS)
    loads = arm.tested(cell, bench, rng) + faces.tested(folder, _gauged(plates, bench), rng)
    write_csv(folder / "loads.csv", loads, list(dict.fromkeys(name for row in loads for name in row)))
    write_yaml(folder / "cell.yaml", arm.CELL)
    write_yaml(folder / "batch.yaml", _manifest(folder.name, cell, bench, plates))
    truth_of_batch = {"batch": folder.name, "seed": seed, "style": style, "effects": causes}
    return truth_of_batch | {"runs": truth | listening.truth}


def _draw(name: str, rng: np.random.Generator, cell: ArmCell) -> Parameters:
    """Draw a cause as the batches of one observable do; a stiffness is that of all joints."""
    if name == "stiffness_scale":
        return {"factor": round(float(np.exp(drawn_signed(rng, 0.03, 0.4))), 3), "joint": "all"}
    if name == "tool_runout":
        return {"radius_um": drawn_size(rng, 2.0, 25.0), "angle_deg": drawn_angle(rng)}
    return ARM_EFFECTS[name].draw(rng, cell)


def _hide(
    name: str, values: Parameters, cell: ArmCell, bench: Bench, plates: FaceCell
) -> tuple[ArmCell, Bench, FaceCell]:
    """Hide a cause in all that a batch is made with."""
    if name == "tool_runout":
        angle = values["angle_deg"] * DEG
        tool = replace(bench.tool, runout=values["radius_um"] * UM, runout_angle=angle)
        plates = replace(plates, milling=replace(plates.milling, tool=tool))
        return cell, replace(bench, tool=tool), plates
    if name == "stiffness_scale":
        plates = replace(plates, factor=float(values.get("factor_of_faces") or values["factor"]))
    return ARM_EFFECTS[name].apply(cell, values), bench, plates


def _plates(cell: ArmCell, bench: Bench, rng: np.random.Generator, *, varied: bool) -> FaceCell:
    """Return what the faces are milled with; nothing is declared of the metal."""
    size = bench.size[:2]
    milling = Milling(bench.tool, bench.metal, {}, bench.plans[0].spindle_rpm, _FEED, _WIDTH)
    loads, scanner = load_tests(rng, varied, size), scanner_of(rng, varied, size)
    return FaceCell(size, milling, _poses(cell, bench), loads, scanner, CASES)


def _poses(cell: ArmCell, bench: Bench) -> dict[str, Pose]:
    """Return the arm over the block, by wrist; a wrist that does not get round is turned less."""
    near = next(iter(bench.lines.values())).q[0]
    return {f"{wrist}1": _pose(cell, bench, near, wrist) for wrist in _WRISTS_DEG}


def _pose(cell: ArmCell, bench: Bench, near: Array, wrist: str) -> Pose:
    for turned in _WRISTS_DEG[wrist]:
        over = cell.turn @ rotation_rpy(0.0, 0.0, turned * DEG)
        try:
            compliance = tip_compliance(cell.true, cell.origin, over, bench.size[:2], near, turn=cell.turn)
        except (RuntimeError, np.linalg.LinAlgError):
            continue
        return Pose(compliance, MASS[wrist], *DAMPING[wrist])
    raise RuntimeError(f"the arm does not reach over the block with wrist {wrist}")


def _gauged(plates: FaceCell, bench: Bench) -> FaceCell:
    """Return the plates as the load tests see them, whose gauge has a small error."""
    gain = 1.0 + float(bench.calibration[3])

    def seen(pose: Pose) -> Pose:
        return replace(pose, compliance=lambda at: gain * pose.compliance(at))

    return replace(plates, poses={name: seen(pose) for name, pose in plates.poses.items()})


class _Listener:
    """The dynamometer under the block, along the first pass of a face; ``truth`` of what it read."""

    def __init__(self, folder: Path, bench: Bench, plates: FaceCell, rng: np.random.Generator) -> None:
        self.folder, self.bench, self.plates, self.rng = folder, bench, plates, rng
        self.truth: dict[str, Row] = {}

    def __call__(self, run: str, case: Case, force: SideForce) -> Row:
        """Record the first pass of a face that is held out."""
        if case.role != "validate":
            return {}
        passes, feed = self.plates.passes(case.orientation), feed_axes(case)
        sensor, gain = self.bench.sensor, 1.0 + self.bench.calibration[:3]

        def in_work(t: Array) -> Array:
            return np.asarray(force.at(t, passes.speed * t - passes.lead, sensor.rate) @ feed * gain)

        seconds = (passes.length + 2.0 * passes.lead) / passes.speed
        time, read = record(sensor, in_work, seconds, self.rng)
        middle = np.array(self.plates.size)[None] / 2.0
        softer = self.plates.poses[case.pose].compliance(middle)[0] / self.plates.factor
        mean = force.turn.mean(axis=0) @ feed
        self.truth[run] = {"force_n": mean.tolist(), "mm_per_n": (softer[2] / MM).tolist()}
        return {"dynamometer": write_force(self.folder, run, time, read)}


def _manifest(name: str, cell: ArmCell, bench: Bench, plates: FaceCell) -> Row:
    content, scanning = arm.manifest(name, cell, bench), faces.manifest(name, plates)["instruments"]
    return content | {
        "title": "Side cuts and faces of one arm",
        "instruments": content["instruments"] | scanning,
    }
