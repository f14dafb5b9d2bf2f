"""Stiffness at the tool tip: of an arm around its work, of a tabulated machine between its stations."""

from __future__ import annotations

import pandas as pd

from metro.report.content import Bullets, Heading, Item, Paragraph, Picture, Table
from metro.report.figures import robot as figures
from metro.report.numbers import listing, number, with_interval
from metro.report.results import Results
from metro.report.sections.while_cutting import compared, factor_of, scaled

BY_TESTS = "with 95 % intervals from those of the joints by load tests"
BY_CELL = "from those of the joints, which cell.yaml states"
CUT = "cut"  # the pose of the cuts in the tables of an arm
LONGEST = 30
FEW = 12  # stations that are all tabulated
NORMAL = 1.96


def arm_stiffness(results: Results) -> list[Item]:
    """Tabulate the principal stiffnesses of an arm's tip, and draw them over the work."""
    chart, shapes = results.tables.get("arm_map"), results.tables.get("arm_ellipsoids")
    if chart is None or shapes is None:
        return []
    rows = []
    factor = factor_of(results)
    for pose, part in shapes.groupby("pose", sort=False):  # from the softest axis up
        soft = part.iloc[0]
        axis = ", ".join(number(soft[f"axis_{a}"], 2) for a in "xyz")
        sizes = list(zip(part["stiffness_n_um"], part["sd_n_um"], strict=True))
        name, cuts = str(pose), factor is not None and pose == CUT
        rows.append([f"{name}, by load tests" if cuts else name, *(band(*size) for size in sizes), axis])
        if factor and cuts:
            rows.append([f"{name}, while cutting", *(scaled(*size, factor) for size in sizes), axis])
    tested = bool(shapes["sd_n_um"].notna().any())
    caption = (
        f"Principal stiffnesses of the tip (N/µm) {BY_TESTS if tested else BY_CELL}, and the direction in "
        "which it is softest, work frame."
    )
    use = compared(results)
    header = ["pose", "softest", "middle", "stiffest", "softest along (x, y, z)"]
    items: list[Item] = [
        Heading("Stiffness of the arm at the tip"),
        Table(header, rows[:LONGEST], caption, [1.3 if use else 1, 1.1, 1.1, 1.1, 1.5]),
        *([Paragraph(use)] if use else []),
    ]
    reached = int(chart["k_least_n_um"].notna().sum())
    if reached > 3:
        low, high = (number(float(f), 2) for f in (chart["k_least_n_um"].min(), chart["k_least_n_um"].max()))
        about = (
            f"Least stiffness over the work and around it, {low} to {high} N/µm, at the height of the "
            f"cut and "
            "with the tool held as there; strokes point where the tip is softest. Right: stiffness "
            "ellipsoid of "
            f"the pose “{shapes['pose'].iloc[0]}” from above and from the side."
        )
        about += " All by load tests." if use else ""
        items.append(Picture(figures.stiffness(chart, shapes), about, about))
    return items


def stations(results: Results) -> list[Item]:
    """Tabulate the stations with the errors of interpolation, and draw slices through the workspace."""
    table, surface = results.tables.get("end_stations"), results.tables.get("end_surface")
    errors, region = results.tables.get("end_errors"), results.tables.get("end_region")
    if table is None or surface is None or errors is None or region is None:
        return []
    named = _named(results, table)
    columns = ["x_mm", "y_mm", "z_mm", *(f"k{a}_n_um" for a in "xyz"), *(f"error_{a}_percent" for a in "xyz")]
    rows = [[str(r["position"]), *(number(r[c]) for c in columns)] for _, r in named.iterrows()]
    which = "at the stations" if len(named) == len(table) else "at the stations that the batch names"
    caption = f"End stiffness {which}, and the error of each as predicted from all {len(table) - 1} others."
    header = ["station", "x (mm)", "y", "z", "k x (N/µm)", "k y", "k z", "error x (%)", "error y", "error z"]
    about = (
        f"{_stiffest(region.iloc[0])} End stiffness over slices of the workspace, interpolated between "
        f"{len(table)} stations (dots: those of the slice), and the largest standard deviation of kriging."
    )
    return [
        Heading("End stiffness of the machine"),
        Bullets(_over_workspace(region.iloc[0])),
        _interpolation(errors, str(table["method"].iloc[0])),
        Table(header, rows, caption, [0] * 10, numeric=list(range(1, 10)), small=True),
        Picture(figures.stations(surface, table), about, about),
    ]


def _named(results: Results, table: pd.DataFrame) -> pd.DataFrame:
    """Return the stations at which runs were cut or modes measured; all if they are few, or none is named."""
    if len(table) <= FEW:
        return table
    runs = results.batch.runs
    poses = list(runs["pose"].astype(str)) if "pose" in runs else []
    tested = [str(mode.get("position")).split("/")[0] for mode in results.identified.get("modes") or []]
    named = table[table["position"].astype(str).isin({*poses, *tested})]
    return (named if len(named) else table).head(LONGEST)


def _interpolation(errors: pd.DataFrame, method: str) -> Table:
    """Tabulate how well each entry of the stiffness is interpolated."""
    rows = []
    for _, row in errors.iterrows():
        span = f"{number(row['least_n_um'])} … {number(row['greatest_n_um'])}"
        interval = f"({number(row['rms_low_percent'], 2)} … {number(row['rms_high_percent'], 2)})"
        left = f"{number(row['rms_percent'], 2)} {interval}"
        kriged = (number(row[f"kriging_{name}_percent"], 2) for name in ("rms", "sd"))
        rows.append([str(row["entry"]), span, left, *kriged, number(row["within_percent"], 2)])
    caption = (
        f"Interpolation between the stations by a {method}: leave-one-out error, rms with its 95 % interval, "
        "beside that of kriging, the standard deviation that kriging expects, and how many stations are "
        "within 1.96 of it. In percent of the stiffness; across two axes, of the root of their product."
    )
    header = ["entry", "range (N/µm)", "left out (%)", "kriging (%)", "expected (%)", "within (%)"]
    return Table(header, rows, caption, [0.6, 1.5, 1.6, 0.9, 0.9, 0.9], numeric=[3, 4, 5], small=True)


def _stiffest(region: pd.Series) -> str:
    place = ", ".join(f"{region[f'{a}_mm']:.0f}" for a in "xyz").replace("-", "−")
    spans = [f"{a} {region[f'{a}_low_mm']:.0f} … {region[f'{a}_high_mm']:.0f} mm" for a in "xyz"]
    return (
        f"The softest direction is stiffest at ({place}) mm, {number(region['softest_n_um'])} N/µm; it has "
        f"95 % of that within {listing(spans)}."
    ).replace(" -", " −")


def _over_workspace(region: pd.Series) -> list[str]:
    """State where stiffness is largest, how it falls towards the border, and which direction dominates."""
    falls = []
    for a in "xyz":
        inner, outer = region[f"inner_k{a}_n_um"], region[f"outer_k{a}_n_um"]
        falls.append(
            f"k {a} {number(inner)} to {number(outer)} N/µm ({number(100 * (outer / inner - 1), 2)} %)"
        )
    ratio = f"{number(region['ratio_low'], 2)} to {number(region['ratio_high'], 2)}"
    return [
        f"From the stations in the middle (the nearest 30 %) to those at the border (the farthest 30 %): "
        f"{listing(falls)}.",
        f"k {region['stiffest']} is the largest at {region['stiffest_count']} of {region['stations']} "
        f"stations, {ratio} times the second largest.",
    ]


def band(value: float, sd: float) -> str:
    """Write a value with its 95 % interval from its standard error."""
    half = NORMAL * sd
    return with_interval(float(value), [float(value - half), float(value + half)])


def more(count: int) -> str:
    """Say that a table of ``count`` rows was cut short."""
    return f" The first {LONGEST} of {count}." if count > LONGEST else ""
