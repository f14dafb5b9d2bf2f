"""Stiffness at the tool tip: of an arm around its work, of a tabulated machine between its stations."""

from __future__ import annotations

from metro.report.content import Heading, Item, Picture, Table
from metro.report.figures import robot as figures
from metro.report.numbers import listing, number, with_interval
from metro.report.results import Results

LONGEST = 30
NORMAL = 1.96


def arm_stiffness(results: Results) -> list[Item]:
    """Tabulate the principal stiffnesses of an arm's tip, and draw them over the work."""
    chart, shapes = results.tables.get("arm_map"), results.tables.get("arm_ellipsoids")
    if chart is None or shapes is None:
        return []
    rows = []
    for pose, part in shapes.groupby("pose", sort=False):  # from the softest axis up
        soft = part.iloc[0]
        axis = ", ".join(number(soft[f"axis_{a}"], 2) for a in "xyz")
        rows.append([str(pose), *(band(r["stiffness_n_um"], r["sd_n_um"]) for _, r in part.iterrows()), axis])
    caption = (
        "Principal stiffnesses of the tip (N/µm) with 95 % intervals from those of the joints, and the "
        "direction "
        "in which it is softest, work frame."
    )
    header = ["pose", "softest", "middle", "stiffest", "softest along (x, y, z)"]
    items: list[Item] = [
        Heading("Stiffness of the arm at the tip"),
        Table(header, rows[:LONGEST], caption, [1, 1.1, 1.1, 1.1, 1.5]),
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
        items.append(Picture(figures.stiffness(chart, shapes), about, about))
    return items


def stations(results: Results) -> list[Item]:
    """Tabulate each station's stiffness with its leave-one-out error, and draw the surface."""
    table, surface = results.tables.get("end_stations"), results.tables.get("end_surface")
    if table is None or surface is None:
        return []
    columns = ["x_mm", "y_mm", "z_mm", *(f"k{a}_n_um" for a in "xyz"), *(f"error_{a}_percent" for a in "xyz")]
    rows = [[str(r["position"]), *(number(r[c]) for c in columns)] for _, r in table.head(LONGEST).iterrows()]
    first = table.iloc[0]
    errors = listing(
        [
            f"{a} {number(first[f'rms_{a}_percent'], 2)} % ({number(first[f'rms_{a}_low_percent'], 2)} … "
            f"{number(first[f'rms_{a}_high_percent'], 2)})"
            for a in "xyz"
        ]
    )
    caption = (
        f"End stiffness at the stations, and the error of each as told by all others. Between stations: "
        f"{first['method']}. Leave-one-out error, rms with its 95 % interval: {errors}."
    )
    header = ["station", "x (mm)", "y", "z", "k x (N/µm)", "k y", "k z", "error x (%)", "error y", "error z"]
    about = "End stiffness over the workspace as the stations (dots) tell it, seen along the third axis."
    return [
        Heading("End stiffness of the machine"),
        Table(header, rows, caption + more(len(table)), [0] * 10, numeric=list(range(1, 10)), small=True),
        Picture(figures.stations(surface, table), about, about),
    ]


def band(value: float, sd: float) -> str:
    """Write a value with its 95 % interval from its standard error."""
    half = NORMAL * sd
    return with_interval(float(value), [float(value - half), float(value + half)])


def more(count: int) -> str:
    """Say that a table of ``count`` rows was cut short."""
    return f" The first {LONGEST} of {count}." if count > LONGEST else ""
