"""The tip of an arm as mass, spring and damper: mass by the links, a0 and a1, the struck tip."""

from __future__ import annotations

import pandas as pd

from metro.report.content import Bullets, Heading, Item, Paragraph, Picture, Table
from metro.report.figures import tip as figures
from metro.report.numbers import number, quantity, words
from metro.report.results import Results
from metro.units import JSON

MOST_POSITIONS = 3  # that are drawn
ENTRIES = {"mxx": "xx", "mxy": "xy", "mxz": "xz", "myy": "yy", "myz": "yz", "mzz": "zz"}
ABOUT_MASS = (
    "Mass matrix of the tip (kg), work frame: as mass.csv declares it, by the kinetic energy of the links "
    "of cell.yaml, and by equation 4 of FlePFaM from the same links, with what each differs from the "
    "declared one (Frobenius)."
)
EQUATION_4 = (
    "Equation 4 is the links' tensor of inertia about the base over the square of the tip's distance. It is "
    "no mass that the tip has: by it, a point mass at the tip has none along the line from the base (see the "
    "errata)."
)
WAYS = {
    "links, static": "the joints yield as to a static force on the tip",
    "links, least": "no stiffness of the joints is known: the least mass that the tip can have",
}


def tip(results: Results) -> list[Item]:
    """Write the mass of the tip, its damping with intervals, and the struck tip against M, C and K."""
    return [
        *_mass(results.tables.get("tip_mass"), results.tables.get("tip_mass_refused")),
        *_damping(results.identified.get("tip") or {}),
        *_struck(results),
    ]


def _mass(table: pd.DataFrame | None, refused: pd.DataFrame | None) -> list[Item]:
    if refused is not None:
        return [Heading("Mass at the tip"), Bullets([f"{reason}." for reason in refused["reason"]])]
    if table is None:
        return []
    rows = [
        [
            f"{r['pose']}, {r['point']}",
            str(r["way"]),
            *(number(float(r[name])) for name in ENTRIES),
            "–" if r["way"] == "declared" else number(float(r["difference_percent"]), 2),
        ]
        for _, r in table.iterrows()
    ]
    header = ["pose, point", "by", *ENTRIES.values(), "differs by (%)"]
    used = next(way for way in table["way"] if way in WAYS)
    of_links = table.loc[table["way"] == used, "difference_percent"]
    finding = (
        f"The links' kinetic energy differs from the declared mass by at most {number(of_links.max(), 2)} %. "
    )
    caption = f"{finding}{ABOUT_MASS} Links: {WAYS[used]}."
    numeric = list(range(2, len(header)))
    return [
        Heading("Mass at the tip"),
        Table(header, rows, caption, [1.1, 1.3, *([0.8] * 6), 1.1], numeric=numeric, small=True),
        Paragraph(EQUATION_4, "note"),
    ]


def _damping(tip: JSON) -> list[Item]:
    """Tabulate a0 and a1, of each pose where there are several, and their weighted mean."""
    named = [*(tip.get("poses") or {}).items(), ("all" if tip.get("poses") else "", tip)]
    rows = [
        [pose, *(quantity(block[name]) if name in block else "–" for name in ("a0", "a1"))]
        for pose, block in named
        if isinstance(block, dict) and "a0" in block
    ]
    if not rows:
        return []
    header = ["pose", words("a0"), words("a1")]
    caption = "C = a0 M + a1 K with 95 % intervals, from the damping ratios of the arm's modes."
    if len(rows) == 1:
        header, rows = header[1:], [rows[0][1:]]
    return [Heading("Damping at the tip"), Table(header, rows, caption, [1, *([2] * (len(header) - 1))])]


def _struck(results: Results) -> list[Item]:
    """Draw the receptance and the ring-down of the struck tip, measured and by M, C and K."""
    items: list[Item] = []
    drawings = (
        ("tip_receptance", figures.receptances, "Receptance of the struck tip"),
        ("tip_ringing", figures.ringing, "Acceleration of the tip after a blow"),
    )
    for name, draw, title in drawings:
        table = results.tables.get(name)
        if table is None:
            continue
        positions = list(table["position"].unique())
        shown = table[table["position"].isin(positions[:MOST_POSITIONS])]
        most = float(table["difference_percent"].max())
        more = (
            f" The first {MOST_POSITIONS} of {len(positions)} positions."
            if len(positions) > MOST_POSITIONS
            else ""
        )
        caption = (
            f"M, C and K differ from what was measured by at most {number(most, 2)} % (rms over the rms of "
            f"the measured; in brackets of each). {title}: measured, and by the mass, the load tests and the "
            f"identified a0 and a1.{more}"
        )
        items.append(Picture(draw(shown), caption, caption))
    return items
