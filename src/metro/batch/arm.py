"""The arm of a cell: its joints from rows or a URDF file, and what its other keys must fulfil."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from metro.batch.findings import Finding, linked_outside
from metro.joint_columns import Axes, axes_of
from metro.units import JSON

if TYPE_CHECKING:
    from metro.batch.tables import Table

SHORTEST_ARM_MM = 10.0
ROWS = ("convention", "joints")  # keys that say how rows are meant
LINKS = ("base_link", "tip_link")  # and those that say which part of a URDF file
MOVING = ("revolute", "prismatic")


def with_joints(arm: JSON, folder: Path, file: str) -> tuple[JSON, list[Finding]]:
    """Return an arm whose URDF file, where it names one, has been read into ``chain``; and what is wrong.

    ``folder``: that of ``file``, the cell.
    """
    if ("dh" in arm) == ("urdf" in arm):
        found = "found both" if "dh" in arm else "found neither"
        message = f"{found}, expected dh (Denavit-Hartenberg rows) or urdf (a file beside {Path(file).name})"
        return arm, [Finding("error", file, message, column="arm.dh")]
    useless = [key for key in (LINKS if "dh" in arm else ROWS) if key in arm]
    if useless:
        message = f"is of no use with arm.{'dh' if 'dh' in arm else 'urdf'}"
        return arm, [Finding("error", file, message, column=f"arm.{useless[0]}")]
    if "links" in arm and ("urdf" in arm or arm.get("convention") == "modified"):
        message = "are stated in the frames of standard Denavit-Hartenberg rows, expected arm.dh of these"
        return arm, [Finding("error", file, message, column="arm.links")]
    if "dh" in arm:
        return arm, [*_kinds(arm, file), *_units(arm["dh"], file)]
    return _of_urdf(arm, folder, file)


def _of_urdf(arm: JSON, folder: Path, file: str) -> tuple[JSON, list[Finding]]:
    from metro.formats import FormatError
    from metro.formats.urdf import read_urdf

    name = arm["urdf"]
    if Path(name).is_absolute() or ".." in Path(name).parts or "\0" in name:
        message = f'found "{name}", expected a file beside {Path(file).name}'
        return arm, [Finding("error", file, message, column="arm.urdf")]
    if outside := linked_outside(folder, folder / name, f"{Path(file).name}: arm.urdf"):
        return arm, outside
    try:
        joints = read_urdf(folder / name, arm.get("base_link", ""), arm.get("tip_link", ""))
    except FormatError as error:
        return arm, [Finding("error", file, f"{name}: {error.message}", column="arm.urdf")]
    chain = [
        {
            "name": joint.name,
            "kind": joint.kind,
            "origin": joint.origin.tolist(),
            "axis": joint.axis.tolist(),
        }
        for joint in joints
    ]
    return {**arm, "chain": chain}, []


def linear_axes(cell: JSON) -> tuple[bool, ...]:
    """Return of each axis of a cell's arm that moves whether it is linear; () without an arm."""
    arm = cell.get("arm") or {}
    if arm.get("chain"):
        kinds = [joint["kind"] for joint in arm["chain"]]
    else:
        kinds = arm.get("joints") or ["revolute"] * len(arm.get("dh") or ())
    return tuple(kind == "prismatic" for kind in kinds if kind in MOVING)


def counts(cell: JSON, file: str) -> Iterator[Finding]:
    """Check that lists with an entry per joint have as many entries as the arm has joints."""
    axes = len(linear_axes(cell))
    lists = {"arm.links": (cell.get("arm") or {}).get("links"), "joint_stiffness_nm_rad": None}
    lists["joint_stiffness_nm_rad"] = cell.get("joint_stiffness_nm_rad")
    lists |= {f"drives.{key}": value for key, value in (cell.get("drives") or {}).items()}
    for key, values in lists.items():
        if axes and isinstance(values, list) and len(values) != axes:
            message = f"has {len(values)} entries, expected {axes}: one for each joint of the arm"
            yield Finding("error", file, message, column=key)


def tables_agree(cell: JSON, tables: Mapping[str, Table]) -> Iterator[Finding]:
    """Check that tables with positions of joints have those of the arm's."""
    linear = linear_axes(cell)
    for name in ("loads", "mass", "payload"):
        table = tables[name]
        own = axes_of(table.frame)
        if linear and len(own) and own.linear != linear:
            expected = Axes(linear).positions
            message = (
                f"the table has {listed(own.positions)}, expected {listed(expected)}: one for each joint of "
                "the arm that moves"
            )
            yield Finding("error", table.file, message, column=own.positions[0])


def effects_agree(cell: JSON, known: JSON, file: str) -> Iterator[Finding]:
    """Check that what is declared of a joint is of one that the arm has."""
    axes = len(linear_axes(cell))
    for effect, values in known.items():
        joint = values.get("joint") if isinstance(values, dict) else None
        if axes and isinstance(joint, int) and joint > axes:
            message = f"found {joint}, expected a joint, 1 to {axes}, as the arm of the cell has"
            yield Finding("error", file, message, column=f"known.{effect}.joint")


def listed(names: Sequence[str]) -> str:
    """Write the columns of an arm's axes, from the first to the last."""
    return " to ".join(dict.fromkeys((names[0], names[-1])))


def _kinds(arm: JSON, file: str) -> Iterator[Finding]:
    """Check that every row has its kind, and that two joints or more move."""
    kinds, rows = arm.get("joints"), len(arm["dh"])
    if kinds is not None and len(kinds) != rows:
        message = f"has {len(kinds)} entries, expected {rows}: one for each row of arm.dh"
        yield Finding("error", file, message, column="arm.joints")
    elif kinds is not None and sum(kind in MOVING for kind in kinds) < 2:
        yield Finding("error", file, "found fewer than two joints that move", column="arm.joints")


def _units(rows: list[list[float]], file: str) -> Iterator[Finding]:
    """Check the units of an arm's rows: theta_deg, alpha_deg, d_mm, a_mm."""
    twist = max(abs(value) for row in rows for value in row[:2])
    length = max(abs(value) for row in rows for value in row[2:])
    if 0 < twist <= 2 * math.pi:
        message = f"found no angle beyond {twist:g}, expected degrees: theta and alpha seem to be in radians"
        yield Finding("error", file, message, column="arm.dh")
    if length < SHORTEST_ARM_MM:
        message = f"found no length beyond {length:g}, expected mm: d and a seem to be in metres"
        yield Finding("error", file, message, column="arm.dh")
