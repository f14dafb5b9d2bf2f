"""Stability: the boundary by every method, its governing modes, positions, and the test cuts on it."""

from __future__ import annotations

import numpy as np
import pandas as pd

from metro.report.content import Bullets, Heading, Item, Picture, Table
from metro.report.cuts import deepest_cut, not_drawn
from metro.report.figures import lobes as figures
from metro.report.figures.comparison import predictions
from metro.report.numbers import listing, number, probability, quantity
from metro.report.results import Results
from metro.report.sections import findings
from metro.report.sections.chatter import chatter_items
from metro.report.sections.decisions import advised_cuts, least_of
from metro.units import JSON, Array

LONGEST, SHORT = 30, 10
_NOTHING_PERCENT = 0.001
_NO_TESTS = pd.DataFrame(columns=["position", "rpm", "depth_mm", "measured"], dtype=float)


def boundaries(results: Results) -> list[Item]:
    """Write the lowest depth of each position, the methods side by side, and the positions."""
    blocks: list[JSON] = results.identified.get("lobes") or []
    if not blocks:
        return chatter_items(results)
    items: list[Item] = [Heading("Stability"), _lowest(blocks)]
    methods, boundary = results.tables.get("lobe_methods"), results.tables.get("lobes_final")
    items += boundary_items(results)
    if methods is not None:
        items += _methods(methods, boundary, deepest_cut(results.batch.manifest))
    stations = results.tables.get("lobe_stations")
    if boundary is not None and boundary["position"].nunique() > 1:
        best = boundary.groupby("position")["depth_mm"].min()
        caption = (
            f"At every speed a cut is stable up to {number(best.min())} mm at position {best.idxmin()} and "
            f"up to {number(best.max())} mm at position {best.idxmax()}. Stability boundaries of all "
            "positions."
        )
        if boundary["interpolated"].any():
            caption += " Dashed: with modes interpolated between the positions where they were measured."
        cuts = advised_cuts(results.verdict)
        least = least_of(cuts) if cuts else None
        caption += f" Star: the recommended cut, at position {least['position']}." if least else ""
        caption += not_drawn(boundary["depth_mm"], deepest_cut(results.batch.manifest))
        chart = figures.positions_chart(boundary, least, deepest_cut(results.batch.manifest))
        items += [Picture(chart, caption, caption), _limits(results, boundary)]
    if stations is not None:
        items.append(_stations(stations))
    return items + chatter_items(results)


def boundary_items(results: Results) -> list[Item]:
    """Draw the boundary of a batch without held-out tests; with tests another figure draws it."""
    boundary = results.tables.get("lobes_final")
    if boundary is None or results.compared("lobes") is not None:
        return []
    lowest = findings.lowest_boundary(boundary, [("depth_mm", "")])
    return [_boundary_chart(results, boundary, _NO_TESTS, f"{lowest} Stability boundary with its bands.")]


def _boundary_chart(results: Results, boundary: pd.DataFrame, tests: pd.DataFrame, caption: str) -> Picture:
    """Draw the boundary with its tests and the recommended cuts."""
    cuts, deepest = advised_cuts(results.verdict), deepest_cut(results.batch.manifest)
    known = set(boundary["position"].astype(str).unique()[: figures.POSITIONS])
    caption += " Star: the recommended cut." if known & set(cuts) else ""
    caption = f"{caption}{not_drawn(boundary['depth_mm'], deepest)}".lstrip()
    islands = results.tables.get("lobe_islands")
    chart = figures.lobes_chart(boundary, tests, islands, advised=cuts, deepest_mm=deepest)
    return Picture(chart, caption, caption)


def _limits(results: Results, boundary: pd.DataFrame) -> Table:
    """Tabulate the limit of the depth of cut by speed and position, at the speeds of the runs."""
    grid = boundary.pivot_table(index="rpm", columns="position", values="depth_mm", sort=False).sort_index()
    cut = results.batch.runs["spindle_rpm"].astype(float).unique()
    grid = (
        grid[grid.index.isin(cut)] if grid.index.isin(cut).any() else grid.iloc[:: max(1, len(grid) // SHORT)]
    )
    grid = grid.head(LONGEST)
    rows, deepest = [], deepest_cut(results.batch.manifest)
    for rpm, depths in grid.iterrows():
        known = depths.dropna()
        ratio = number(float(known.max() / known.min()), 2)
        ends = f"{known.idxmax()} / {known.idxmin()}"
        cells = (f"> {deepest:g}" if d > deepest else number(float(d)) for d in depths)
        rows.append([number(float(str(rpm)), 4), *cells, ratio, ends])
    spread = (grid.max(axis=1) / grid.min(axis=1)).dropna()
    least, most = (number(float(str(rpm)), 4) for rpm in (spread.idxmin(), spread.idxmax()))
    caption = (
        "Limit of the depth of cut (mm) by speed and position. The greatest is "
        f"{number(spread.min(), 2)} times the least at {least} rpm"
    )
    caption += f" and {number(spread.max(), 2)} times at {most} rpm." if most != least else "."
    header = ["speed (rpm)", *map(str, grid.columns), "greatest / least", "at positions"]
    widths = [0.9, *([0.8] * len(grid.columns)), 1.1, 0.9]
    return Table(header, rows, caption, widths, numeric=list(range(len(header) - 1)), small=True)


def _lowest(blocks: list[JSON]) -> Table:
    rows = [
        [
            str(block.get("position", "–")),
            quantity(lowest)
            if isinstance(lowest := block.get("lowest_mm"), dict)
            else f"{number(lowest)} mm",
        ]
        for block in blocks
    ]
    return Table(["position", "lowest limit of the depth of cut"], rows, "Stability boundaries.", [1, 2])


def _methods(methods: pd.DataFrame, boundary: pd.DataFrame | None, deepest: float) -> list[Item]:
    lines = [("depth_mm", " by all modes together"), ("single_mode_mm", " by single modes")]
    compared = methods[methods.groupby("position")["checked"].transform("any")]
    caption = (
        f"{findings.lowest_boundary(compared, lines)} The boundary by each method, with the "
        "coefficients of the base model. Published diagrams of this kind take the lowest of all "
        "modes solved alone, by complete discretisation with Euler's method (CDSEM)."
        f"{not_drawn(compared['depth_mm'], deepest)}"
    )
    governing = f"{_governing_words(methods)} Direction and number by rising frequency."
    return [
        Picture(figures.methods_chart(compared, deepest), caption, caption),
        Bullets(agreement(methods, boundary)),
        Picture(figures.governing_modes(methods), governing, governing),
    ]


def agreement(methods: pd.DataFrame, boundary: pd.DataFrame | None) -> list[str]:
    """Say by how much the methods differ from each other, in percent of depth."""
    notes = []
    if boundary is not None and "error_mm" in boundary:
        error = float((100.0 * boundary["error_mm"] / boundary["depth_mm"]).max())
        notes.append(f"Two resolutions of the default method differ by at most {number(error, 2)} %.")
    pairs = (
        ("semidiscretisation_mm", "depth_mm", "Semi-discretisation, which shares no step with it, differs"),
        ("tool_mm", "depth_mm", "With the tool's helix, pitch and declared runout the boundary differs"),
        ("cdsem_mm", "single_mode_mm", "CDSEM differs from the exact boundary of single modes"),
        ("single_mode_mm", "depth_mm", "The lowest of the single modes differs from all modes together"),
    )
    checked = methods[methods["checked"]]
    for column, reference, words in pairs:
        change = 100.0 * (checked[column] / checked[reference] - 1.0).to_numpy(float)
        known = change[np.isfinite(change)]
        if len(known):
            notes.append(f"{words} by {_spread(known)}, over {len(known)} speeds.")
        missing = len(change) - len(known)
        if missing and column != "single_mode_mm":
            notes.append(f"At {missing} speeds {_METHODS[column]} found no boundary near the default one's.")
    return notes


_METHODS = {
    "semidiscretisation_mm": "semi-discretisation",
    "tool_mm": "the solution with the tool's helix, pitch and runout",
    "cdsem_mm": "CDSEM",
}


def _spread(change: Array) -> str:
    """Range and median size of changes in percent."""
    size = np.abs(change)
    if size.max() < _NOTHING_PERCENT:
        return f"less than {_NOTHING_PERCENT:g} %"
    low, high, median = (number(float(x), 2) for x in (change.min(), change.max(), np.median(size)))
    return f"{low} to {high} %, {median} % in the median"


def _governing_words(methods: pd.DataFrame) -> str:
    share = methods["governing_mode"].value_counts(normalize=True)
    shares = listing([f"{mode} at {100 * s:.0f} % of the speeds" for mode, s in share.items()])
    words = f"The mode that, solved alone, chatters first is {shares}."
    if methods["position"].nunique() < 2:
        return words
    rising: list[str] = []
    falling: list[str] = []
    for position, part in methods.groupby("position", sort=False):
        order = part.sort_values("rpm")["governing_mode"].str.extract(r"(\d+)$")[0].astype(int)
        (rising if order.is_monotonic_increasing else falling).append(str(position))
    said = []
    said += [f"its number rises with the speed at {_positions(rising)}"] if rising else []
    said += [f"it falls again at {_positions(falling)}"] if falling else []
    return f"{words[:-1]}; {listing(said)}."


def _positions(names: list[str]) -> str:
    return f"position{'s' if len(names) > 1 else ''} {listing(names)}"


def _stations(stations: pd.DataFrame) -> Table:
    columns = ("x_mm", "y_mm", "z_mm", "lowest_mm", "lowest_from_others_mm", "depth_error_percent")
    known = stations[stations["lowest_from_others_mm"].notna()]
    rows = [[str(row["position"]), *(number(row[c]) for c in columns)] for _, row in known.iterrows()]
    header = ["position", "x (mm)", "y", "z", "lowest (mm)", "from the others", "depth error (%)"]
    caption = (
        "Boundary of a position as predicted from the other positions, with the coefficients of the base "
        "model: modes interpolated between stations, median error of depth over the speeds."
    )
    if beyond := [
        str(position) for position in stations["position"] if position not in set(known["position"])
    ]:
        caption += f" Position {listing(beyond)}: too far from the others to be predicted from them."
    return Table(header, rows, caption, [0.8, 0.8, 0.8, 0.8, 1, 1.2, 1.2], numeric=[1, 2, 3, 4, 5, 6])


def cut_items(results: Results, frame: pd.DataFrame) -> list[Item]:
    """Draw the held-out test cuts on the boundary and tabulate the probability of each."""
    tests, drawn = placed(results, frame), predictions(frame)
    rows = [
        [
            str(r["run"]),
            number(r["rpm"]),
            number(r["depth_mm"]),
            "chatter" if r["measured"] > 0.5 else "stable",
            *(probability(r[kind.column]) for kind in drawn),
        ]
        for _, r in tests.head(LONGEST).iterrows()
    ]
    header = [
        "run",
        "speed (rpm)",
        "depth (mm)",
        "found",
        *(f"P(chatter), {kind.label}" for kind in drawn),
    ]
    more = f" The first {LONGEST} of {len(tests)}." if len(tests) > LONGEST else ""
    caption, widths = f"Held-out test cuts.{more}", [1.4, 1, 1, 1, *([1.6] * len(drawn))]
    numeric = [1, 2, *range(4, len(header))]
    table = Table(header, rows, caption, widths, numeric=numeric, small=len(rows) > SHORT)
    return [*tested_boundary(results, frame), table]


def tested_boundary(results: Results, frame: pd.DataFrame) -> list[Picture]:
    """Draw the held-out test cuts on the stability boundary, where there is one."""
    boundary = results.tables.get("lobes_final")
    if boundary is None:
        return []
    right = {k: int(((frame[k] > 0.5) == (frame["measured"] > 0.5)).sum()) for k in ("before", "after")}
    caption = (
        f"Stability boundary and held-out test cuts. The predicted side is right for {right['before']} of "
        f"{len(frame)} cuts with the base model"
    )
    changed = bool((frame["before"] != frame["after"]).any())
    caption += f" and for {right['after']} with the effects found." if changed else "."
    return [_boundary_chart(results, boundary, placed(results, frame), caption)]


def placed(results: Results, frame: pd.DataFrame) -> pd.DataFrame:
    """Join the held-out labels to the position, speed and depth of their cuts."""
    runs = results.batch.runs
    at = runs.reindex(frame["run"])
    position = at["pose"].astype(str).to_numpy() if "pose" in runs else [""] * len(frame)
    return frame.assign(
        position=position,
        rpm=at["spindle_rpm"].to_numpy(float),
        depth_mm=at["axial_depth_mm"].to_numpy(float),
    )
