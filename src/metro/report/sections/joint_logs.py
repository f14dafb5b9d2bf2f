"""The joints of an arm by logs of its free motion: what each log determines, friction, weight, inertia."""

from __future__ import annotations

import math

import pandas as pd

from metro.report.content import Bullets, Heading, Item, Paragraph, Picture, Table
from metro.report.figures import joint_logs as figures
from metro.report.numbers import listing, number, probability, with_interval
from metro.report.results import Results
from metro.units import JSON, printed

NOT_IDENTIFIABLE, AT_MOST = "not identifiable", "≤"
T95 = 2.045  # Student's quantile of 29 degrees of freedom: intervals are of 30 stretches
BEYOND = {
    "load": "friction grows with the torque that the links ask of the gear, by {size} of it",
    "speed": "friction differs by {size} (rms) from the line of Coulomb and viscous friction: {shape}",
    "time": "the Coulomb level changes by {size} along the log",
    "viscous_time": "viscous friction changes by {size} along the log",
    "temperature": "the Coulomb level changes by {size} with the joint's temperature",
    "viscous_temperature": "viscous friction changes by {size} with the joint's temperature",
}
SLOW = 0.12  # of the fastest speed: what changes friction below it is near standstill
RUNS = 3  # runs whose friction is drawn


def joint_logs(results: Results) -> list[Item]:
    """Write what the joint logs say; nothing of a batch without."""
    table = results.tables.get("joint_log")
    if table is None:
        return []
    about = results.identified.get("joints") or {}
    items: list[Item] = [Heading("The joints by logs of free motion"), _motion(table)]
    if "coulomb" in table:
        items += [_friction(table, about), *_beyond(results.tables.get("joint_log_terms"))]
        items += _curves(results, table)
    remarks = table[table["remark"] != ""].groupby(["run", "remark"], sort=False)["joint"]
    if remarks.ngroups:
        lines = [f"Run {run}, joints {listing([str(j) for j in js])}: {why}." for (run, why), js in remarks]
        items.append(Bullets(lines))
    return items


def _motion(table: pd.DataFrame) -> Table:
    followed = table["tracking_mdeg"].notna().any()
    tested = "condition" in table
    header = ["run", "joint", "from (°)", "to (°)", "top speed (°/s)", "torque, rms"]
    header += ["off set-point, rms (m°)"] if followed else []
    header += ["combinations", "condition", "residual, rms"] if tested else []
    rows = []
    for _, r in table.iterrows():
        row = [str(r["run"]), str(r["joint"]), *(number(r[n]) for n in ("low_deg", "high_deg"))]
        row += [number(r["fastest_deg_s"]), f"{number(r['torque_rms'])} {printed(r['unit'])}"]
        row += [number(r["tracking_mdeg"])] if followed else []
        if tested and math.isfinite(r["condition"]):
            row += [str(int(r["determined"])), number(r["condition"], 2), number(r["noise"], 2)]
        elif tested:
            row += ["–"] * 3
        rows.append(row)
    caption = "The motion of the logs."
    if tested:
        caption += (
            " Combinations: how many combinations of the links' masses, centres of gravity and moments of "
            "inertia the torque of the joint determines, of 10 for each link that it carries; condition: of "
            "the least squares. A large condition number means that some are known poorly."
        )
    if followed:
        flange = table.groupby("run")["flange_um"].first().dropna()
        off = listing([f"{number(value, 2)} µm in run {run}" for run, value in flange.items()])
        caption += f" The flange deviates from its commanded position by {off} (rms)." if len(flange) else ""
    else:
        caption += " The logs hold no set-points: how well the arm follows cannot be said."
    widths = [1.2, 0.6, 0.8, 0.8, 1, 1.2, *([1.1] if followed else []), *([1.1, 0.9, 1] if tested else [])]
    return Table(header, rows, caption, widths, numeric=list(range(1, len(header))), small=True)


def _friction(table: pd.DataFrame, about: JSON) -> Table:
    fitted = table[table["condition"].notna()]
    amperes = bool((fitted["unit"] == "A").any())
    unit = "A" if amperes else "N m"
    header = ["run", "joint", f"Coulomb ({unit})", f"viscous ({unit} s/rad)", f"weight, largest ({unit})"]
    header += [f"inertia ({'A s²/rad' if amperes else 'kg m²'})"]
    rows = []
    for _, r in fitted.iterrows():
        cells = [_identified(r, name) for name in ("coulomb", "viscous", "gravity", "inertia")]
        rows.append([str(r["run"]), str(r["joint"]), *cells])
    caption = (
        "Friction of the joints, the largest torque of the links' weight in the log, and the inertia about "
        "the joint's own axis in the middle of the motion, the motor's included, with 95 % intervals. Each "
        "joint is fitted on its own. "
    )
    shown = [cell for row in rows for cell in row]
    if NOT_IDENTIFIABLE in shown:
        caption += (
            "Not identifiable: this motion does not determine the quantity, whose interval is wider than the "
            "value and than the torque of the joint. "
        )
    if any(cell.startswith(AT_MOST) for cell in shown):
        caption += (
            f"{AT_MOST}: it cannot be distinguished from zero; the upper end of the interval is given. "
        )
    if amperes:
        caption += (
            "The drive constants are not known (drives.torque_per_ampere_nm_a in cell.yaml): currents in "
            "amperes are all that can be said."
        )
    else:
        caption += f"In the intervals: {about.get('drives', '')}."
    return Table(header, rows, caption, [1.1, 0.5, 1.4, 1.4, 1.4, 1.4], numeric=[1, 2, 3, 4, 5], small=True)


def _identified(row: pd.Series, name: str) -> str:
    """Write a quantity of a joint, or how large it may be, or that the log does not determine it.

    An interval about zero that is narrow beside the torque of the joint determines a quantity: it is small.
    An inertia is never zero, so that an interval about zero determines none.
    """
    value, half = float(row[name]), T95 * float(row[f"{name}_sd"])
    if not math.isfinite(value):
        return NOT_IDENTIFIABLE
    if half <= abs(value):
        return _interval(value, row[f"{name}_sd"])
    speed = math.radians(float(row["fastest_deg_s"])) if name == "viscous" else 1.0
    small = name != "inertia" and half * speed <= float(row["torque_rms"])
    most = half + (abs(value) if name == "gravity" else value)  # a weight pulls either way
    return f"{AT_MOST} {number(most, 2)}" if small else NOT_IDENTIFIABLE


def _interval(value: float, sd: float) -> str:
    return with_interval(value, [value - T95 * sd, value + T95 * sd]) if math.isfinite(value) else "–"


def _beyond(terms: pd.DataFrame | None) -> list[Item]:
    """Say what the friction has beyond Coulomb and viscous, with the evidence for it."""
    if terms is None:
        return [
            Paragraph(
                "No log shows friction beyond Coulomb and viscous: neither with speed, load, temperature nor "
                "time.",
                "note",
            )
        ]
    lines = []
    for _, r in terms.iterrows():
        if r["name"] == "load":
            size = f"{_interval(100 * r['value'], 100 * r['sd'])} %"
        else:
            value = abs(r["value"]) if r["name"] == "speed" else r["value"]
            size = f"{_interval(value, r['sd'])} {r['unit']}"
        said = BEYOND[r["name"]].format(size=size, shape=_shape(r))
        evidence = (
            f"probability of it by chance {probability(r['p'])}, error on held-out stretches "
            f"{number(r['held_out'], 2)} times that without"
        )
        lines.append(f"Run {r['run']}, joint {r['joint']}: {said} ({evidence}).")
    return [Bullets(lines, small=len(lines) > 6)]


def _shape(term: pd.Series) -> str:
    """Say what a term of speed looks like."""
    if term["value"] > 0:
        return "it falls at first as the joint gets faster (Stribeck)"
    if term["scale"] <= SLOW:
        return (
            "near standstill it is less than Coulomb friction, as where gears give way before they slide, or "
            "where angles and torques are not of one time"
        )
    return "viscous friction levels off as the joint gets faster"


def _curves(results: Results, table: pd.DataFrame) -> list[Item]:
    curve = results.tables.get("joint_log_curve")
    if curve is None:
        return []
    items: list[Item] = []
    for run in list(curve["run"].drop_duplicates())[:RUNS]:
        caption = (
            f"Friction by speed in run {run}: means of bins with their scatter, the torque of the links and "
            "what is constant taken away, and the line of Coulomb and viscous friction. Where the motion "
            "does not determine Coulomb friction, the torque may be weight as well, and nothing is drawn."
        )
        drawn = figures.friction(curve[curve["run"] == run], table[table["run"] == run])
        items.append(Picture(drawn, caption, caption))
    return items
