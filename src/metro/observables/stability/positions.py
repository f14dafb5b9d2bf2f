"""Positions in the workspace with known modes, and interpolated modes in between, with their errors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.batch.capabilities import plural
from metro.dynamics.system import Structure
from metro.robot.stations import Stations, leave_one_out, stiffness_at
from metro.units import MM, Array


@dataclass(frozen=True)
class Tip:
    """Structure at a position.

    Attributes
    ----------
    position : its name; the part before "/" is the pose.
    structure : modes in x and in y (or z in its place).
    names : (m,) direction and number of each mode, "x1": the same mode has the same name at every position.
    sd : (3 m,) standard deviations of the logarithms of omega, zeta, stiffness.
    interpolated : whether the modes are those of other positions, interpolated.
    """

    position: str
    structure: Structure
    names: tuple[str, ...]
    sd: Array
    interpolated: bool = False

    @property
    def pose(self) -> str:
        """The pose that the position belongs to."""
        return self.position.split("/")[0]


def tips(modes: pd.DataFrame, notes: list[str]) -> list[Tip]:
    """Structures of the positions: x and y of the tool; with modes in x and z alone, z replaces y."""
    found: list[Tip] = []
    said: dict[str, list[str]] = {}
    for position, rows in modes[modes["used"].astype(bool)].groupby("position", sort=False):
        letters = [str(d).lstrip("+-") for d in rows["direction"]]
        second = "y" if "y" in letters or "z" not in letters else "z"
        doubts = ["modes in x and z: z is taken as the second direction of cutting"] if second == "z" else []
        doubts += [f"no modes in {d}: rigid there" for d in ("x", second) if d not in letters]
        for doubt in doubts:
            said.setdefault(doubt, []).append(str(position))
        inside = np.isin(letters, ["x", second])
        if inside.any():
            found.append(_tip(str(position), rows[inside], np.array(letters)[inside]))
    for doubt, positions in said.items():
        notes.append(f"position{'s' * (len(positions) > 1)} {', '.join(positions)}: {doubt}")
    return found


def _tip(position: str, rows: pd.DataFrame, letters: np.ndarray) -> Tip:
    """Structure of the modes ``rows``, direction by direction, each by its number.

    The number is that of the mode over all positions, where it was followed; else by rising frequency.
    """
    followed = "mode" in rows
    rank = rows["mode"].str.extract(r"(\d+)$")[0].astype(int) if followed else rows["frequency_hz"]
    order = np.lexsort((rank, letters))
    rows, letters = rows.iloc[order], letters[order]
    omega = 2 * np.pi * rows["frequency_hz"].to_numpy(float)
    axis = np.where(letters == "x", 0, 1)
    structure = Structure(axis, omega, rows["damping"].to_numpy(float), rows["stiffness_n_m"].to_numpy(float))
    pairs = (
        ("frequency_sd_hz", "frequency_hz"),
        ("damping_sd", "damping"),
        ("stiffness_sd", "stiffness_n_m"),
    )
    relative = [rows[sd].to_numpy(float) / rows[value].to_numpy(float) for sd, value in pairs]
    counted = [f"{d}{1 + int(np.sum(letters[:i] == d))}" for i, d in enumerate(letters)]
    names = tuple(rows["mode"].astype(str)) if followed else tuple(counted)
    return Tip(position, structure, names, np.concatenate(relative))


def places(stations: pd.DataFrame) -> dict[str, Array]:
    """Coordinates (3,), m, of the stations that the cell names."""
    columns = stations[["x_mm", "y_mm", "z_mm"]].to_numpy(float) * MM
    return {str(name): place for name, place in zip(stations["position"], columns, strict=True)}


def from_others(position: str, others: Sequence[Tip], where: Mapping[str, Array]) -> Tip | None:
    """Interpolate the modes at station ``position``; None if that is not possible.

    Modes are matched by their names, so at least two stations must have the same modes.
    The logarithms of their frequencies, damping ratios and stiffnesses vary like the end stiffness of a
    tabulated machine. The leave-one-out error of each adds to its standard deviation.
    """
    known = [tip for tip in others if tip.pose in where]
    if position not in where or len(known) < 2 or len({tip.names for tip in known}) > 1:
        return None
    parameters = np.stack([_parameters(tip.structure) for tip in known])
    table = Stations(np.stack([where[tip.pose] for tip in known]), parameters)
    try:
        value = stiffness_at(table, where[position]).value
    except ValueError:
        return None
    omega, zeta, stiffness = np.split(value, 3)
    own = np.sqrt(np.mean([tip.sd**2 for tip in known], axis=0))
    sd = np.hypot(own, leave_one_out(table))
    return Tip(position, Structure(known[0].structure.axis, omega, zeta, stiffness), known[0].names, sd, True)


def _parameters(structure: Structure) -> Array:
    return np.concatenate([structure.omega, structure.zeta, structure.stiffness])


def pairs(
    batch: Batch, tips: list[Tip], where: Mapping[str, Array], notes: list[str]
) -> list[tuple[pd.DataFrame, Tip]]:
    """Pair the runs of each pose with its structure; one structure alone serves every pose."""
    runs = batch.runs[(batch.runs["axial_depth_mm"] > 0) & (batch.runs["spindle_rpm"] > 0)]
    poses = [pose for pose in runs["pose"].dropna().astype(str).unique() if pose not in ("", "nan")]
    if len(tips) == 1:
        tip = tips[0]
        away = [pose for pose in poses if pose != tip.pose]
        if away:
            notes.append(f"the modes of position {tip.position} are used at pose {', '.join(away)} too")
        return [(runs, tip)] if len(runs) else []
    known = {tip.pose for tip in tips}
    interpolated = [from_others(pose, tips, where) for pose in poses if pose not in known]
    between = [tip for tip in interpolated if tip is not None]
    if between:
        named = ", ".join(tip.position for tip in between)
        notes.append(f"the modes at {named} are interpolated between the stations where they were measured")
    lost = [pose for pose in poses if pose not in known | {tip.pose for tip in between}]
    if lost and tips:
        notes.append(f"no modes at pose {', '.join(lost)}, and none to interpolate between: left out")
    nowhere = runs.index[~runs["pose"].astype(str).isin(poses)]
    if len(nowhere):
        notes.append(f"{plural(len(nowhere), 'run')} without a pose: no modes belong to them, left out")
    pairs = [(runs[runs["pose"].astype(str) == tip.pose], tip) for tip in [*tips, *between]]
    return [(rows, tip) for rows, tip in pairs if len(rows)]
