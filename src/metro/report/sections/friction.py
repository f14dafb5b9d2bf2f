"""Friction of the joints from the idle runs, and the joints for which it is not identifiable."""

from __future__ import annotations

import numpy as np
import pandas as pd

from metro.report.content import Bullets, Heading, Item, Picture, Table
from metro.report.figures import robot as figures
from metro.report.numbers import listing, number, with_interval
from metro.report.results import Results
from metro.units import DEG

HEADER = [
    *("joint", "Coulomb (N m)", "viscous (N m s/rad)"),
    *("at top speed (N m)", "top speed (°/s)", "residual (N m)"),
]


def friction(results: Results) -> list[Item]:
    """Tabulate Coulomb and viscous friction of each joint, and draw the friction over the speed."""
    table, curve = results.tables.get("joint_friction"), results.tables.get("joint_friction_curve")
    if table is None:
        return []
    rows = [_row(r) for _, r in table.iterrows()]
    caption = (
        "Friction of the joints from all idle runs together, with 95 % intervals; the weight of the links "
        "is fitted with it. At top speed: the viscous part there. Residual: rms of the remaining torque "
        "while the joint moves."
    )
    items: list[Item] = [
        Heading("Friction of the idle runs"),
        Table(HEADER, rows, caption, [0.5, 1.2, 1.4, 1.3, 1, 0.8], numeric=[1, 2, 3, 4, 5]),
    ]
    remarks = table[table["remark"] != ""].groupby("remark", sort=False)["joint"]
    if remarks.ngroups:
        items.append(Bullets([f"{_joints(list(joints))}: {remark}." for remark, joints in remarks]))
    if curve is not None:
        viscous = (table["viscous"] * table["fastest_deg_s"] * DEG).to_numpy(float)
        most = int(np.nanargmax(viscous))
        about = (
            f"Viscous friction is largest in joint {table['joint'].iloc[most]}, {number(viscous[most], 2)} "
            "N m at the top speed driven. Torque that each joint's friction takes at its speeds, the weight "
            "of the links taken away: means of bins with their scatter, and the line of the table. Of a "
            "joint that turns one way only the slope alone means anything."
        )
        items.append(Picture(figures.friction(curve, table), about, about))
    return items


def _row(r: pd.Series) -> list[str]:
    top = float(r["fastest_deg_s"])
    cells = [with_interval(r[name], [r[f"{name}_low"], r[f"{name}_high"]]) for name in ("coulomb", "viscous")]
    share = [r[name] * DEG * top for name in ("viscous", "viscous_low", "viscous_high")]
    return [
        str(r["joint"]),
        *cells,
        with_interval(share[0], share[1:]),
        number(top),
        number(r["noise_nm"], 2),
    ]


def _joints(joints: list[int]) -> str:
    return f"Joint{'s' if len(joints) > 1 else ''} {listing([str(j) for j in joints])}"
