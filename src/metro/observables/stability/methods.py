"""The lobes by other methods than the default one: single modes, CDSEM, semi-discretisation, the real tool.

Tables for the report: ``lobe_methods`` (depths by method, and the governing mode), ``lobe_islands`` (depths
above the boundary at which the cut is stable again), ``lobe_stations`` (each station from the others).
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from metro.cutting.cutter import Cutter
from metro.dynamics import cdsem, periodmap, semidiscretisation
from metro.dynamics.by_depth import boundary_of_edge
from metro.dynamics.islands import all_crossings
from metro.dynamics.system import Cut, Structure
from metro.dynamics.teeth import Engagement, eccentric_teeth, equal_teeth
from metro.observables.stability.boundary import Lobes
from metro.observables.stability.positions import Tip, from_others
from metro.units import MM, Array

EVERY = 6  # speeds of the diagram at which the slower methods are solved
METHOD_COLUMNS = (
    *("position", "rpm", "depth_mm", "single_mode_mm", "governing_mode"),
    *("checked", "cdsem_mm", "semidiscretisation_mm", "tool_mm"),
)
ISLAND_COLUMNS = ("position", "rpm", "from_mm", "to_mm")
STATION_COLUMNS = (
    *("position", "x_mm", "y_mm", "z_mm", "lowest_mm", "lowest_from_others_mm", "depth_error_percent"),
)
_WIDE = 1.001  # ratio of the depths that an island spans, at least
_EVEN = 1e-9  # rad, between pitches
_NOTHING = 0.001  # % of depth
_RIVAL = 1.3  # times the lowest depth: the published method differs from the exact one by some percent
_PER_CYCLE = 30  # steps of semi-discretisation per cycle of the fastest mode; the fine solution doubles them
_ALIKE = 1.5  # ratio of the steps of speeds that are solved as one stack: fast ones need few
_LEAST_STEPS = 24  # per passage of a tooth


def methods(lobes: Lobes, tool: Cutter, feed_per_tooth: float, *, check: bool = True) -> pd.DataFrame:
    """Depths by each method, the lowest over the directions of feed.

    ``single_mode_mm``: the lowest of all modes solved alone, exactly; ``governing_mode``: that mode. At the
    speeds that are ``checked`` (none without ``check``), ``cdsem_mm``: that depth by the published method;
    ``semidiscretisation_mm``: all modes together, in the direction with the lowest depth by the default
    method; ``tool_mm``: likewise with the tool's helix, pitch and declared runout. The last two are
    extrapolated from two step sizes. They are NaN if there is no boundary near that of the default method.
    """
    finite = np.flatnonzero(np.isfinite(lobes.boundary.depth))
    rpm, depth = lobes.boundary.rpm[finite], lobes.boundary.depth[finite]
    structure = lobes.tip.structure
    exact = np.stack([cdsem.governing_depths(structure, cut, rpm) for cut in lobes.cuts])
    alone = exact.min(axis=0)
    checked = (np.arange(len(rpm)) % EVERY == 0) & check
    slow = np.full((3, len(rpm)), np.nan)
    if checked.any():
        # Whatever is far above the lowest exact boundary is not the lowest by the published method either.
        some = exact[:, :, checked]
        some = np.where(some <= _RIVAL * some.min(axis=(0, 1)), some, np.inf)
        published = [
            cdsem.cdsem_depths(structure, cut, rpm[checked], one)
            for cut, one in zip(lobes.cuts, some, strict=True)
        ]
        slow[0, checked] = np.min(published, axis=(0, 1))
    for i, (cut, turn) in enumerate(zip(lobes.cuts, lobes.turns, strict=True)):
        here = checked & (lobes.which[finite] == i)
        if here.any():
            equal, own = equal_teeth(cut), real_teeth(cut, turn, tool, feed_per_tooth)
            at = (rpm[here], depth[here])
            slow[1, here] = _extrapolated(structure, equal, *at)
            slow[2, here] = slow[1, here] if own == equal else _extrapolated(structure, own, *at)
    names = np.array(lobes.tip.names)[alone.argmin(axis=0)]
    columns = (lobes.tip.position, rpm, depth / MM, alone.min(axis=0) / MM, names, checked, *(slow / MM))
    return pd.DataFrame(dict(zip(METHOD_COLUMNS, columns, strict=True)))


def left_out(table: pd.DataFrame, tool: Cutter) -> list[str]:
    """Say which properties of the tool the default method omits, with their effect, from a methods' table."""
    parts = [f"its helix of {np.degrees(tool.helix):.3g}°"] if tool.helix else []
    parts += ["its uneven pitch"] if np.ptp(_pitch(tool)) > _EVEN else []
    parts += ["its runout"] if tool.runout_radius else []
    if not parts:
        return []
    change = 100.0 * (table["tool_mm"] / table["depth_mm"] - 1.0)[table["checked"]].to_numpy(float)
    known = change[np.isfinite(change)]
    place = table["position"].iloc[0]
    what = f"position {place}: the boundary is that of the tool without {' and '.join(parts)}"
    lost = len(change) - len(known)
    none = (
        f"; at {lost} of {len(change)} speeds semi-discretisation with it finds no boundary near"
        if lost
        else ""
    )
    if not len(known):
        return [what + none]
    size = np.abs(known)
    moved_by = f"by {known.min():.2g} to {known.max():.2g} %, {np.median(size):.2g} % in the median"
    moved_by = moved_by if size.max() >= _NOTHING else f"by less than {_NOTHING:g} %"
    return [f"{what}; with it semi-discretisation moves the depth {moved_by}, over {len(known)} speeds{none}"]


def _pitch(tool: Cutter) -> Array:
    """Angles from each tooth to the next, rad."""
    return np.diff(np.append(tool.tooth_angles, tool.tooth_angles[0] + 2.0 * np.pi))


def real_teeth(cut: Cut, turn: float, tool: Cutter, feed_per_tooth: float) -> Engagement:
    """Return the engagement of the declared tool, for a cut that was turned by ``turn`` (rad)."""
    angle = np.array(tool.tooth_angles)
    pitch = _pitch(tool)
    reach = tool.runout_radius * np.cos(tool.runout_angle - angle)
    lag = float(np.tan(tool.helix)) / tool.radius
    if np.ptp(pitch) <= _EVEN and not tool.runout_radius:
        return equal_teeth(cut, lag)
    in_feed_frame = replace(cut, entry=cut.entry + turn, exit=cut.exit + turn)
    eccentric = eccentric_teeth(in_feed_frame, pitch, reach, feed_per_tooth, lag)
    windows = [replace(w, entry=w.entry - turn, exit=w.exit - turn) for w in eccentric.windows]
    return replace(eccentric, cut=cut, windows=tuple(windows))


def _extrapolated(structure: Structure, engagement: Engagement, rpm: Array, around: Array) -> Array:
    """Depths in the limit of small steps; the method has second order, so a third of the change remains."""
    period = engagement.turn * 60.0 / (2.0 * np.pi * rpm)
    cycles = structure.omega.max() * period / (2.0 * np.pi)
    passages = engagement.cut.teeth * engagement.turn / (2.0 * np.pi)
    needed = np.ceil(np.maximum(_PER_CYCLE * cycles, _LEAST_STEPS * passages)).astype(int)
    # With uneven teeth another crossing may be the lowest; a helix changes the lowest only a little.
    uneven = passages > 1.5
    search = semidiscretisation.lowest_boundary if uneven else semidiscretisation.boundary_near
    depths = np.full(len(rpm), np.nan)
    for rows in periodmap.stacks(needed, _ALIKE):
        steps = int(needed[rows].max())
        depths[rows] = search(structure, engagement, rpm[rows], around[rows], steps)
        known = rows[np.isfinite(depths[rows])]
        if len(known):
            near = depths[known]
            fine = semidiscretisation.boundary_near(structure, engagement, rpm[known], near, 2 * steps)
            depths[known] += (fine - near) * 4.0 / 3.0
    return depths


def islands(lobes: Lobes, deepest: float) -> pd.DataFrame:
    """Ranges of depth (mm) above the boundary in which every direction of feed is stable again."""
    rpm = lobes.boundary.rpm
    crossings = [all_crossings(lobes.tip.structure, cut, rpm, deepest) for cut in lobes.cuts]
    rows = []
    for speed in np.flatnonzero(np.all([one.complete for one in crossings], axis=0)):
        edges = np.sort(np.concatenate([*(one.depth[one.speed == speed] for one in crossings), [deepest]]))
        for low, high in itertools.pairwise(edges):
            if high > low * _WIDE and not any(
                one.unstable(int(speed), (low + high) / 2.0) for one in crossings
            ):
                rows.append((lobes.tip.position, rpm[speed], low / MM, high / MM))
    return pd.DataFrame(rows, columns=list(ISLAND_COLUMNS))


def stations(solved: Sequence[Lobes], where: Mapping[str, Array]) -> pd.DataFrame:
    """Each station's own lobes, and its lobes interpolated from the other stations."""
    measured = [one for one in solved if not one.tip.interpolated and one.tip.pose in where]
    rows = []
    for one in measured if len(measured) > 1 else []:
        others = [other.tip for other in measured if other is not one]
        interpolated = from_others(one.tip.pose, others, where)
        row = (one.tip.position, *(where[one.tip.pose] / MM), np.min(one.boundary.depth) / MM)
        rows.append((*row, *_interpolation_error(one, interpolated)))
    return pd.DataFrame(rows, columns=list(STATION_COLUMNS))


def _interpolation_error(own: Lobes, interpolated: Tip | None) -> tuple[float, float]:
    """Lowest depth (mm) with the interpolated modes, and the median error (%) of all depths."""
    if interpolated is None:
        return np.nan, np.nan
    rpm = own.boundary.rpm
    depth = np.min([boundary_of_edge(interpolated.structure, cut, rpm).depth for cut in own.cuts], axis=0)
    ratio = np.abs(np.log(depth / own.boundary.depth))
    return float(depth.min()) / MM, 100.0 * float(np.median(ratio[np.isfinite(ratio)]))
