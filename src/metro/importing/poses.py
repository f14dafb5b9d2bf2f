"""Measured poses among unknown files: joints and a measured position, by the names of columns."""

from __future__ import annotations

import re

from metro.formats.channels import parted
from metro.importing.look import Column, Seen
from metro.importing.propose import Proposal
from metro.joint_columns import MOST_AXES

LEAST_AXES = 2
# Joints with names of their own, as ROS has them, are counted in the order of their columns.
_NAMED = re.compile(r"\w*[a-z]_joint|\w*(?:shoulder|elbow|wrist)\w*", re.IGNORECASE)
_NUMBERED = re.compile(r"(?:q|j|a|joint|axis|angle|theta)[ _\[(]*(\d)[\])]?", re.IGNORECASE)
_POSITION = re.compile(
    r"(?:(?:measure[a-z]*|meas|actual|tracker|laser|leica|faro|camera|target)[ _]*)?([xyz])", re.IGNORECASE
)
_SIGMA = re.compile(r"(?:\w*_)?(?:std|sigma|sd)_?([xyz])", re.IGNORECASE)
_TEMPERATURE = re.compile(r"(?:\w*_)?(?:temperature|temp)(?:_c)?", re.IGNORECASE)


def measured_poses(seen: Seen) -> Proposal | None:
    """Propose how measured poses are read; None where a file shows none."""
    names = [(column, *parted(column.name)) for column in seen.columns]
    names = [(column, bare.strip(), unit) for column, bare, unit in names]
    joints = _joints([(column, bare) for column, bare, _ in names])
    position: dict[str, Column] = {}
    for column, bare, _ in names:
        if match := _POSITION.fullmatch(bare):
            position.setdefault(match[1].lower(), column)
    if len(joints) < LEAST_AXES or set(position) != set("xyz"):
        return None
    found = {f"q{at}_deg": column for at, column in enumerate(joints, start=1)}
    found |= {f"{axis}_mm": position[axis] for axis in "xyz"}
    scatter = {match[1].lower(): column for column, bare, _ in names if (match := _SIGMA.fullmatch(bare))}
    if set(scatter) == set("xyz"):
        found |= {f"sigma_{axis}_mm": scatter[axis] for axis in "xyz"}
    units = {column.label: column.unit or unit for column, _, unit in names}
    stated = {name: unit for name, column in found.items() if (unit := units[column.label])}
    warm = next((column for column, bare, _ in names if _TEMPERATURE.fullmatch(bare)), None)
    if warm is not None:
        found["temperature_c"], stated["temperature_c"] = warm, "1"
    columns: dict[str, str | int | tuple[str, int]] = {name: column.name for name, column in found.items()}
    why = {name: f"the name {source}" for name, source in columns.items()}
    return Proposal("poses", ((seen.path.name, ""),), seen.path.name, columns, why, stated=stated)


def _joints(names: list[tuple[Column, str]]) -> list[Column]:
    """Return the columns of the joints in their order; none where they are not counted without a gap."""
    numbered = {int(match[1]): column for column, bare in names if (match := _NUMBERED.fullmatch(bare))}
    axes = sorted(numbered)
    if axes and axes[0] in (0, 1) and axes == list(range(axes[0], axes[0] + len(axes))):
        return [numbered[axis] for axis in axes][:MOST_AXES]
    return [column for column, bare in names if _NAMED.fullmatch(bare)][:MOST_AXES]
