"""Published tables: printed errors recomputed, errata, consistency of modal tables, load tests."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from metro.report.content import Bullets, Heading, Item, Paragraph, Picture, Section, Table
from metro.report.figures import force as figures
from metro.report.numbers import number
from metro.report.results import Results
from metro.report.sections.along_path import along_path
from metro.report.sections.printed_bias import CANNOT, bias
from metro.units import printed

CONVENTION = {"measured": "(m − p)/m", "predicted": "(m − p)/p"}


def published(results: Results) -> Section | None:
    """Write the content of the printed tables and whether it is consistent; None for other batches."""
    table = results.tables.get("published_errors")
    if table is None:
        return None
    tip = results.tables.get("published_matrices")
    items: list[Item] = [*_errata(table, tip)]
    for name, rows in table.groupby("table", sort=False):
        pairs = rows[rows["predicted"].notna()]
        items += [*_pairs(str(name), pairs), *along_path(results, str(name))] if len(pairs) else []
    if any(isinstance(item, Picture) for item in items):
        items.append(Paragraph(CANNOT, "note"))
    items += _single(table[table["predicted"].isna()], results)
    items += _modes(results.tables.get("published_modes"))
    items += _matrices(tip)
    items += _loads(results.tables.get("published_loads"))
    items += _forces(results, table)
    return Section("Published tables", items)


def _errata(table: pd.DataFrame, tip: pd.DataFrame | None) -> list[Item]:
    flagged = table[table["flag"].fillna("") != ""]
    errata = [f"Table {r['table']}, {r['row']}, {r['quantity']}: {r['flag']}." for _, r in flagged.iterrows()]
    if tip is not None:
        wrong = tip[tip["flag"] != ""]
        errata += [f"Section {r['table']}, {r['row']}: {r['flag']}." for _, r in wrong.iterrows()]
    noted = table[table["note"].fillna("").str.contains("erratum: ")]
    unflagged = noted[~noted.index.isin(flagged.index)]
    texts = [
        f"Table {r['table']}: {str(r['note']).partition('erratum: ')[2]}." for _, r in unflagged.iterrows()
    ]
    stated = list(dict.fromkeys(texts))
    if not errata and not stated:
        return [Paragraph("Every printed error follows from the printed values, within rounding.")]
    return [Heading("Errata"), Bullets([*errata, *stated])]


def _pairs(name: str, pairs: pd.DataFrame) -> list[Item]:
    clear = pairs["convention"][pairs["convention"].isin(list(CONVENTION))]
    most = str(clear.mode().iloc[0]) if len(clear) else ""
    fits = int(pairs["convention"].isin([most, "both"]).sum())
    stated = int(pairs["printed_error_percent"].notna().sum())
    says = f" Printed errors: {fits} of {stated} follow from {CONVENTION[most]}." if most else ""
    columns = [_as_printed(pairs[c]) for c in ("measured", "predicted", "printed_error_percent")]
    rows = [
        [
            str(r["row"]),
            _named(r),
            *(column[i] for column in columns),
            number(r["of_measured_percent"], 4),
            number(r["of_predicted_percent"], 4),
        ]
        for i, (_, r) in enumerate(pairs.iterrows())
    ]
    shown = printed(str(pairs["unit"].iloc[0]))
    header = [
        "row",
        "quantity",
        f"measured ({shown})",
        f"predicted ({shown})",
        "printed error (%)",
        "(m − p)/m (%)",
        "(m − p)/p (%)",
    ]
    strong = [i for i, flag in enumerate(pairs["flag"].fillna("")) if flag]
    bold = " Rows in bold cannot be right as printed." if strong else ""
    caption = f"Table {name}: printed pairs and recomputed errors.{says}{bold}"
    table = Table(header, rows, caption, [1, 1.5, 1, 1, 1, 1, 1], numeric=[2, 3, 4, 5, 6], strong=strong)
    return [table, *bias(name, pairs)]


def _single(rows: pd.DataFrame, results: Results) -> list[Item]:
    """Tabulate printed values without a prediction that no other table of this section shows."""
    derived = [
        t
        for n in ("published_modes", "published_loads", "published_matrices")
        if (t := results.tables.get(n)) is not None
    ]
    elsewhere = {str(name) for t in derived for name in t["table"]}
    remaining = rows[~rows["table"].astype(str).isin(elsewhere)]
    items: list[Item] = []
    for name, part in remaining.groupby("table", sort=False):
        body = [
            [
                str(r["row"]),
                _named(r),
                f"{r['measured']:.10g}",
                printed(str(r["unit"])),
            ]
            for _, r in part.iterrows()
        ]
        items.append(
            Table(
                ["row", "quantity", "printed", "unit"],
                body,
                f"Table {name}: printed values.",
                [1, 2, 1, 1],
                numeric=[2],
            )
        )
    return items


def _named(row: pd.Series) -> str:
    """Name the quantity of a printed value, and its axis."""
    return f"{row['quantity']} {row['axis'] if pd.notna(row['axis']) else ''}".strip()


def _as_printed(values: pd.Series) -> list[str]:
    """Write values to the decimals of the most precise of them, like a printed column."""
    decimals = max((len(f"{v:.10g}".partition(".")[2]) for v in values.dropna()), default=0)
    return [f"{v:.{decimals}f}".replace("-", "−") if pd.notna(v) else "–" for v in values]


def _modes(modes: pd.DataFrame | None) -> list[Item]:
    if modes is None or modes.empty:
        return []
    rows = [
        [
            f"{r['axis']}, {r['row']}",
            f"{r['printed_hz']:.4f}",
            f"{r['undamped_hz']:.4f}",
            f"{r['damped_hz']:.4f}",
            str(r["agrees_with"]),
        ]
        for _, r in modes.sort_values(["axis", "row"], kind="stable").iterrows()
    ]
    header = ["mode", "printed (Hz)", "undamped (Hz)", "damped (Hz)", "the print is"]
    caption = "Printed frequencies against those of the printed stiffness, mass and damping ratio."
    return [Table(header, rows, caption, [1, 1, 1, 1, 1], numeric=[1, 2, 3])]


def _matrices(tip: pd.DataFrame | None) -> list[Item]:
    if tip is None or tip.empty:
        return []
    columns = ["a0", "a1", "missed_percent", "a0_printed", "a1_printed", "printed_missed_percent"]
    rows = [[str(r["row"]), *(number(float(r[c]), 4) for c in columns)] for _, r in tip.iterrows()]
    header = ["point", "a0 (1/s)", "a1 (s)", "misses C by (%)", "a0 printed", "a1 printed", "misses C by (%)"]
    caption = (
        "Damping C = a0 M + a1 K: least squares over the printed matrices of mass, stiffness and damping, "
        "and the coefficients as printed; what each misses of the printed C."
    )
    return [Table(header, rows, caption, [1.2, 1, 1, 1, 1, 1, 1], numeric=[1, 2, 3, 4, 5, 6])]


def _loads(loads: pd.DataFrame | None) -> list[Item]:
    if loads is None or loads.empty:
        return []
    rows = [
        [
            str(r["quantity"]),
            str(r["axis"]),
            number(r["load_n"]),
            str(int(r["points"])),
            number(r["compliance_um_n"]),
            number(r["sd_um_n"], 2),
        ]
        for _, r in loads.sort_values(["axis", "load_n"], kind="stable").iterrows()
    ]
    header = [
        "quantity",
        "axis",
        "load (N)",
        "points",
        "displacement over load (µm/N)",
        "scatter over points",
    ]
    caption = (
        "Compliance of the printed load tests. A linear structure has the same at every load; where it "
        "differs, no one stiffness describes the machine. Values that the errata name are left out."
    )
    return [Table(header, rows, caption, [2.6, 0.6, 0.8, 0.7, 1.5, 1.2], numeric=[2, 3, 4, 5])]


def _forces(results: Results, table: pd.DataFrame) -> list[Item]:
    """Draw the helical cut on which the coefficients were checked, with the statements of the source."""
    forces, runs = results.tables.get("published_forces"), results.batch.runs
    if forces is None or runs.empty:
        return []
    row: Any = runs[runs["operation"] == "helical"].iloc[0]
    settings = (
        f"{number(row['spindle_rpm'], 4)} rpm, {row['feed_per_tooth_mm']:g} mm per tooth, "
        f"{row['axial_depth_mm']:g} mm per orbit"
    )
    means = forces[["fx_n", "fy_n", "fz_n"]].mean()
    plane = float(np.hypot(forces["fx_n"], forces["fy_n"]).max())
    caption = (
        f"The force reaches {number(plane)} N in the plane and {number(forces['fz_n'].max())} N along z. "
        f"Force on the tool over one orbit, computed from the printed coefficients: {settings}."
    )
    said = [str(note).partition("validation: ")[2] for note in table["note"].dropna()]
    text = (
        f"Mean along z {number(means['fz_n'])} N; in the plane the force turns with the orbit, "
        f"{number(row['orbit_rpm'] / 60.0)} times per second."
    )
    statements = " ".join(f"The source says: {note.rstrip('.')}." for note in said if note)
    effect = " Such a fluctuation is what the effect orbit stiffness describes." if statements else ""
    alt = f"Forces over one orbit and over two revolutions; mean along z {number(means['fz_n'])} N."
    return [
        Heading("The validation cut"),
        Paragraph(f"{text} {statements}{effect}".strip()),
        Picture(figures.orbit(forces, float(row["spindle_rpm"])), caption, alt),
    ]
