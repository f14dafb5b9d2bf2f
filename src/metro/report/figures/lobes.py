"""Stability charts: boundaries with bands and test cuts, methods side by side, modes and positions."""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from metro.report import style
from metro.units import JSON

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

POSITIONS = 8
NO_CUTS: Mapping[str, JSON] = MappingProxyType({})
LEAST_SHOWN = 0.25  # of a panel that the boundary takes where it is deeper than anybody cuts
CUTS = ((0, "o", style.GREEN, "stable cut"), (1, "X", style.BEFORE, "chatter"))
BANDS = (
    ("depth_lo_mm", "depth_hi_mm", 0.22, "95 %, with model error"),
    ("depth_p05_mm", "depth_p95_mm", 0.6, "5–95 %, modes and forces"),
)
METHODS = (
    ("depth_mm", "all modes together", style.AFTER, "-", ""),
    ("single_mode_mm", "lowest of single modes", style.BEFORE, "--", ""),
    ("cdsem_mm", "single modes by CDSEM", style.PURPLE, "", "+"),
    ("semidiscretisation_mm", "semi-discretisation", style.MEASURED, "", "o"),
    ("tool_mm", "as the tool is", style.GREEN, "", "x"),
)


def lobes_chart(
    boundary: pd.DataFrame,
    tests: pd.DataFrame,
    islands: pd.DataFrame | None = None,
    *,
    advised: Mapping[str, JSON] = NO_CUTS,
    deepest_mm: float = math.inf,
) -> Figure:
    """Draw stability boundaries with their bands, islands of stability above them, and the test cuts.

    Parameters
    ----------
    boundary : ``position, rpm, depth_mm, depth_lo_mm, depth_hi_mm, depth_p05_mm, depth_p95_mm, kind``.
    tests : ``position, rpm, depth_mm, measured`` (1 = unstable), ``before``, ``after``; may be empty.
    islands : ``position, rpm, from_mm, to_mm``.
    advised : the recommended cut of each position.
    deepest_mm : see :func:`top_of`.
    """
    with style.style():
        figure, panels = panels_of(boundary)
        for position, axes in panels.items():
            line, here = drawn_with_tests(axes, position, boundary, tests, deepest_mm)
            if islands is not None:
                _islands(axes, islands[islands["position"] == position], line)
            _cuts(axes, here)
            draw_advised(axes, advised.get(str(position)))
        style.legend_of(figure, panels.values())
    return figure


def drawn_with_tests(
    axes: Axes, position: object, boundary: pd.DataFrame, tests: pd.DataFrame, deepest_mm: float = math.inf
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Draw the boundary of a position, with room for its tests; return it by speed, and these tests."""
    line = boundary[boundary["position"] == position].sort_values("rpm")
    here = tests[tests["position"].astype(str) == str(position)]
    draw_boundary(axes, line)
    axes.set_ylim(0, 1.15 * top_of(line["depth_mm"], here, deepest_mm))
    return line, here


def draw_advised(axes: Axes, cut: JSON | None) -> None:
    """Mark the recommended cut, with room above it; nothing where there is none."""
    if not cut:
        return
    depth = float(cut["axial_depth_mm"])
    axes.plot(
        *([cut["spindle_rpm"]], [depth]),
        marker="*",
        ms=11,
        ls="",
        mfc=style.YELLOW,
        mec=style.MEASURED,
        mew=0.6,
        clip_on=False,
        zorder=4,
        label="recommended cut",
    )
    axes.set_ylim(top=max(axes.get_ylim()[1], 1.15 * depth))


def panels_of(table: pd.DataFrame) -> tuple[Figure, dict[Any, Axes]]:
    """Return a figure with a panel of depth over speed for each of the first positions of a table."""
    positions = list(table["position"].drop_duplicates())[:POSITIONS]
    columns = min(2, len(positions))
    rows = -(-len(positions) // columns)
    figure, grid = style.new_figure(0.6 + 2.3 * rows, rows, columns)
    flat = [axes for row in grid for axes in row]
    for position, axes in zip(positions, flat, strict=False):
        axes.set_title(f"position {position}", loc="left")
        axes.set(xlabel="spindle speed (rpm)", ylabel="depth of cut (mm)")
    for axes in flat[len(positions) :]:
        axes.set_visible(False)
    return figure, dict(zip(positions, flat, strict=False))


def draw_boundary(axes: Axes, line: pd.DataFrame) -> None:
    """Draw both bands and the boundary, which is dotted where it is a flip."""
    rpm, depth = line["rpm"], line["depth_mm"]
    for low, high, alpha, label in BANDS:
        axes.fill_between(rpm, line[low], line[high], color=style.SKY, lw=0, alpha=alpha, label=label)
    axes.plot(rpm, depth, color=style.AFTER, label="boundary")
    flip = line["kind"] == "flip"
    if flip.any():
        axes.plot(rpm, depth.where(flip), color=style.MEASURED, lw=2.0, ls=":", label="flip")


def _islands(axes: Axes, islands: pd.DataFrame, line: pd.DataFrame) -> None:
    if len(islands):
        axes.vlines(
            islands["rpm"],
            islands["from_mm"],
            islands["to_mm"],
            color=style.GREEN,
            alpha=0.35,
            lw=400.0 / max(len(line), 1) / 2.0,
            label="stable island",
        )


def _cuts(axes: Axes, tests: pd.DataFrame) -> None:
    for unstable, mark, colour, label in CUTS:
        part = tests[tests["measured"].round() == unstable]
        if part.empty:
            continue
        axes.scatter(
            part["rpm"],
            part["depth_mm"],
            marker=mark,
            s=28,
            c=colour,
            edgecolors="white",
            lw=0.5,
            zorder=3,
            label=label,
        )


def top_of(depth: pd.Series, tests: pd.DataFrame, deepest_mm: float = math.inf) -> float:
    """Return the upper end of the depth axis: it includes tests and lobes, but not the peaks between.

    ``deepest_mm``: the depth beyond which nobody cuts with the tool. What is deeper is left out, but for the
    lowest depth of a boundary that lies there wholly.
    """
    lowest = float(depth.min())
    depths = [2.5 * lowest, float(depth.quantile(0.8))]
    top = min(max(depths), max(deepest_mm, (1.0 + LEAST_SHOWN) * lowest))
    return max([top, float(tests["depth_mm"].max())] if len(tests) else [top])


def methods_chart(methods: pd.DataFrame, deepest_mm: float = math.inf) -> Figure:
    """Draw the boundary by each method that found one, a panel per position.

    Parameters
    ----------
    methods : rows of ``lobe_methods``. deepest_mm : see :func:`top_of`.
    """
    with style.style():
        figure, panels = panels_of(methods)
        for position, axes in panels.items():
            part = methods[methods["position"] == position].sort_values("rpm")
            for column, label, colour, line, mark in METHODS:
                if not part[column].notna().any():
                    continue
                (drawn,) = axes.plot(part["rpm"], part[column], color=colour, ls=line, label=label)
                drawn.set(marker=mark, markersize=5, markerfacecolor="none")
            tops = (top_of(part[c], part[:0], deepest_mm) for c in ("depth_mm", "single_mode_mm"))
            axes.set_ylim(0, 1.15 * max(tops))
        style.legend_of(figure, panels.values())
    return figure


def governing_modes(methods: pd.DataFrame) -> Figure:
    """Draw the mode that, solved alone, chatters first, over spindle speed; a row per position.

    Parameters
    ----------
    methods : rows of ``lobe_methods``.
    """
    from matplotlib.patches import Patch

    positions = list(methods["position"].drop_duplicates())
    modes = sorted(methods["governing_mode"].unique())
    colours = dict(zip(modes, _colours(len(modes)), strict=True))
    with style.style():
        figure, [[axes]] = style.new_figure(0.9 + 0.3 * len(positions))
        for row, position in enumerate(positions):
            part = methods[methods["position"] == position].sort_values("rpm")
            middle = part["rpm"].to_numpy(float)
            edges = np.concatenate([middle[:1], (middle[1:] + middle[:-1]) / 2.0, middle[-1:]])
            shades = [colours[mode] for mode in part["governing_mode"]]
            axes.barh(row, np.diff(edges), left=edges[:-1], height=0.8, color=shades)
        axes.set_yticks(range(len(positions)), [f"position {p}" for p in positions])
        axes.set_xlabel("spindle speed (rpm)")
        axes.grid(visible=False)
        handles = [Patch(color=colours[mode], label=f"mode {mode}") for mode in modes]
        figure.legend(handles=handles, loc="outside upper center", ncols=len(modes))
    return figure


def _colours(count: int) -> list[str]:
    """Return ``count`` different colours; they are from a continuous scale if the series has too few."""
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    if count <= len(style.SERIES):
        return list(style.SERIES[:count])
    return [to_hex(colour) for colour in colormaps["turbo"](np.linspace(0.03, 0.97, count))]


def positions_chart(
    boundary: pd.DataFrame, advised: JSON | None = None, deepest_mm: float = math.inf
) -> Figure:
    """Draw the boundaries of all positions in one panel; dashed where the modes were interpolated.

    Parameters
    ----------
    boundary : ``position, rpm, depth_mm, interpolated``. advised : the recommended cut. deepest_mm : see
        :func:`top_of`.
    """
    groups = list(boundary.groupby("position", sort=False))
    with style.style():
        figure, [[axes]] = style.new_figure(3.0)
        for (position, line), colour in zip(groups, _colours(len(groups)), strict=True):
            look = "--" if line["interpolated"].any() else "-"
            axes.plot(line["rpm"], line["depth_mm"], color=colour, ls=look, label=f"position {position}")
        axes.set(xlabel="spindle speed (rpm)", ylabel="depth of cut (mm)")
        tops = sorted(top_of(line["depth_mm"], line[:0], deepest_mm) for _, line in groups)
        axes.set_ylim(0, 1.15 * max([tops[0], *(top for top in tops if top <= deepest_mm)]))
        draw_advised(axes, advised)
        figure.legend(loc="outside upper center", ncols=4)
    return figure
