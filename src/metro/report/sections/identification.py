"""Identified quantities with 95 % intervals, and the reasons why others could not be identified."""

from __future__ import annotations

from typing import Any

import pandas as pd

from metro.observables.catalogue import title
from metro.report.content import Bullets, Heading, Item, Paragraph, Section, Table, abreast, gathered
from metro.report.numbers import listing, number, quantity, words
from metro.report.results import Results
from metro.report.sections.force import mean_items
from metro.report.sections.lobes import boundaries
from metro.report.sections.modes import modes
from metro.report.sections.tip import tip
from metro.units import JSON, printed

COEFFICIENTS = {
    "ktc": "K_tc", "krc": "K_rc", "kac": "K_ac", "kte": "K_te", "kre": "K_re", "kae": "K_ae",
    "kfac": "K_Fac", "kfae": "K_Fae",
}  # fmt: skip
FORCE_SETS = {
    "mean": "mean forces, identification runs",
    "mean_all_runs": "mean forces, all runs",
    "mean_corrected": "mean forces, identification runs, less the effects found",
    "waveform": "waveform, identification runs",
}
FACES = {
    "xm": "X_m", "xa": "X_a", "xg": "X_g", "fltt": "FLTt", "fltp": "FLTp", "fltv": "FLTv", "fltq": "FLTq",
    "minimum_zone": "minimum zone", "xm_predicted": "X_m predicted", "points": "points",
}  # fmt: skip
RUN_BLOCKS = {
    "clock_offset_s": "clock offset",
    "tip_force": "tip force",
    "tip_force_by_torques": "tip force by the torques",
    "deformation": "deformation",
    "waviness": "waviness",
    "observability": "observability of the joints",
}
ABOUT = ("format", "batch", "metro", "not_identified")  # the batch and the file, not quantities
ELSEWHERE = {
    "faces": "flatness of faces",
    "tip_compliance": "stiffness by load tests",
    "levelling": "flatness by slopes",
    "pose": "the arm by measured poses",
    "texture": "surface texture",
    "areal": "areal parameters",
    "study": "factors and configurations",
    "arm": "the robot arm",
    "calibration": "tool, work and payload",
    "joints": "the joints",
}
# What is shown run by run, and what its interval holds; other sections show the same of some runs.
ABOUT_RUN_BLOCKS = {
    "tip_force": (
        "Force on the tip in the steady cut, mean of each run. The interval is that of its source: of a "
        "dynamometer, the scatter of the signal over the number of turns. The force by the joints' torques "
        "is another estimate, with an interval of its own."
    ),
    "deformation": (
        "Deflection of the tip in each run, predicted by the final model along the axes of the work. The "
        "interval is that of the model's parameters and of the force. The deformation of held-out walls is "
        "measured, along their normal; its interval is that of the measurement."
    ),
}
OF_ROBOT = ("observability", "waviness", "tip_force_by_torques")  # the robot's own section shows them
LONGEST, ABREAST = 30, 3
PLANE = ("xx", "xy", "yx", "yy")


def identification(results: Results) -> Section:
    """Write every block of ``identified.json``, and the reasons why others are missing."""
    identified = results.identified
    items: list[Item] = [
        *_force(
            identified.get("force") or {},
            mean_items(results.tables.get("mean_forces")),
            _effects((results.verdict.get("observables") or {}).get("force") or {}),
        ),
        *_yielding(
            results.tables.get("yielding"),
            ((identified.get("force") or {}).get("static_deflection") or {}).get("reason") or "",
        ),
        *modes(identified.get("modes") or [], results.tables),
        *boundaries(results),
        *_arm(identified.get("arm") or {}),
        *tip(results),
    ]
    if not items:
        items.append(Paragraph(_elsewhere(identified)))
    missing = _reasons(identified)
    if missing:
        items.append(Heading("Not identified"))
        items.append(Bullets([f"{name}: {reason}." for name, reason in missing]))
    return Section("Identification", items)


def _elsewhere(identified: JSON) -> str:
    """Say where the quantities are that other sections show, or that there are none."""
    blocks = [
        ELSEWHERE.get(name, words(name)) for name, block in identified.items() if name not in ABOUT and block
    ]
    if not blocks:
        return "Nothing could be identified from this batch."
    return f"The quantities identified from this batch are given in other sections: {listing(blocks)}."


def _reasons(identified: JSON) -> list[tuple[str, str]]:
    """Return the reasons why blocks, or parts of blocks, are missing; those with one reason together."""
    own = {title(str(name)): str(reason) for name, reason in (identified.get("not_identified") or {}).items()}
    for block, content in identified.items():
        if isinstance(content, dict) and block != "not_identified":
            parts = content.get("not_identified") or {}
            own |= {
                f"{words(block)}, {RUN_BLOCKS.get(name, words(name))}": str(reason)
                for name, reason in parts.items()
            }
    alike: dict[str, list[str]] = {}
    for name, reason in own.items():
        alike.setdefault(reason.rstrip("."), []).append(name)
    return [(listing(names), reason) for reason, names in alike.items()]


def _effects(verdict: JSON) -> str:
    """Name the effects that were found in the cutting force, as a subject."""
    return listing([words(effect["effect"]) for effect in verdict.get("effects") or []]) or "what was found"


def _force(force: JSON, drawn: list[Item], effects: str) -> list[Item]:
    """Write the coefficients, their figures ``drawn``, what ``effects`` made of them, and the speeds."""
    sets = {key: force[key] for key in FORCE_SETS if force.get(key)}
    if not sets:
        return []
    names = [name for name in COEFFICIENTS if any(name in block for block in sets.values())]
    rows = []
    for name in names:
        known = next(cell for block in sets.values() if (cell := block.get(name)))
        cells = [
            f"{quantity(cell, with_unit=False)}{' *' if _biased(force, key, name) else ''}" if cell else "–"
            for key, block in sets.items()
            for cell in [block.get(name)]
        ]
        rows.append([COEFFICIENTS[name], printed(known.get("unit")), *cells])
    edge = force.get("edge_length", "axial")
    caption = f"Cutting coefficients with 95 % intervals; the edge terms count along the {edge} edge length."
    biased = any(_biased(force, key, name) for key in sets for name in names)
    caption += " * biased by more than the interval: see below." if biased else ""
    header = ["coefficient", "unit", *(FORCE_SETS[key] for key in sets)]
    items: list[Item] = [Heading("Cutting force"), Table(header, rows, caption, [1, 0.8, *([2] * len(sets))])]
    items += drawn
    items += [Bullets([_bias(force["mean_bias"], effects)])] if biased else []
    warnings = force.get("warnings") or []
    items += [Bullets([f"{str(warning).rstrip('.')}." for warning in warnings])] if warnings else []
    speeds = force.get("spindle_rpm") or {}
    if speeds:
        about = "Spindle speed from each record by its own clock, whose error comes on top."
        if any(None in speed["ci95"] for speed in speeds.values()):
            about += " Of a cut too short to be divided, its interval is not known."
        items.append(_by_run(speeds, "spindle speed", about))
    return items


def _biased(force: JSON, key: str, name: str) -> bool:
    """Whether the effects found change a coefficient from the mean forces by more than its interval."""
    bias = ((force.get("mean_bias") or {}).get(key) or {}).get(name)
    if not bias:
        return False
    low, high = force[key][name]["ci95"]
    return bool(abs(bias["value"]) > 0.5 * (high - low))


def _bias(bias: JSON, effects: str) -> str:
    """Say how the effects found spoil the coefficients from the mean forces, and which are to be used."""
    shares = {feed: share for feed, share in bias["edge_in_cut"].items() if share is not None}
    least, most = (f"{100 * shares[feed]:.0f} %" for feed in (next(iter(shares)), next(reversed(shares))))
    shifts = [
        f"{COEFFICIENTS[name]} by {number(one['value'])} {printed(one['unit'])}"
        for name, one in (bias.get("mean") or bias["mean_all_runs"]).items()
    ]
    text = f"The mean forces take every tooth to cut. The model with {effects} says that they shift "
    text += listing(shifts)
    if least != most:
        first, *_, last = shares
        text += (
            f": the edges cut on {least} of their way through the work at {first} mm per tooth and on {most} "
            f"at {last} mm, and the line over the feed reads this change as shear"
        )
    return f"{text}. Use the coefficients from the waveform, or those less the effects found."


def _yielding(table: pd.DataFrame | None, denied: str) -> list[Item]:
    """Write the deflection feedback at the stations of a tabulated machine, and what ``denied`` it."""
    if table is None:
        return []
    items: list[Item] = [Heading("Deflection feedback")]
    items += [Paragraph(f"{denied[0].upper()}{denied[1:]}.", "warning")] if denied else []
    if "difference_n" in table:
        rows = gathered(
            [
                [str(row["run"]), *(number(row[f"plane_{entry}_n_um"]) for entry in PLANE), *_feedback(row)]
                for _, row in table[table["refused"] == ""].iterrows()
            ]
        )
        head = ["runs", "k_xx (N/µm)", "k_xy", "k_yx", "k_yy"]
        head += ["iterations", "plain scheme", "entry (N)", "last (N)"]
        caption = (
            "Stiffness of the tip in the plane of cutting (work frame, free along the spindle), and the "
            "force of the yielding tool against that of a rigid one: iterations to convergence, those of the "
            "plain fixed-point scheme, largest difference in the first and the last of six revolutions."
        )
        items.append(Table(head, rows, caption, [1.6, *([1] * 8)], numeric=list(range(1, 9)), small=True))
    refused = table[table["refused"] != ""].groupby("refused")["run"].agg(", ".join)
    items += [Bullets([f"{runs}: {reason}." for reason, runs in refused.items()])] if len(refused) else []
    return items


def _feedback(row: pd.Series) -> list[str]:
    plain = str(row["iterations_fixed_point"])
    differences = (number(row["entry_difference_n"]), number(row["difference_n"]))
    return [f"{row['iterations_newton']:.0f}", plain, *differences]


def _arm(arm: JSON) -> list[Item]:
    tables = []
    joints = arm.get("joint_stiffness") or []
    if joints:
        shown = [(str(i), q) for i, q in enumerate(joints, start=1)]
        linear = any(q and q["unit"] == "N/m" for q in joints)  # of a linear axis: units differ
        rows = [[i, quantity(q, with_unit=linear) if q else "–"] for i, q in shown]
        head = "stiffness" if linear else "stiffness (N m/rad)"
        tables.append(
            Table(["joint", head], rows, "Joint stiffness with 95 % intervals.", [1, 3], small=True)
        )
    # The force by the torques alone is in the section of the robot, and there only.
    by_torques = arm.get("tip_force_by_torques") or {}
    measured = {run: one for run, one in (arm.get("tip_force") or {}).items() if run not in by_torques}
    for key, name in RUN_BLOCKS.items():
        block = measured if key == "tip_force" else arm.get(key)
        if block and key not in OF_ROBOT:
            about = ABOUT_RUN_BLOCKS.get(key, f"{name.capitalize()}, run by run.")
            tables.append(_by_run(block, name, about, half=True))
    return [Heading("Robot"), *abreast(tables)] if tables else []


def _by_run(blocks: JSON, name: str, caption: str, *, half: bool = False) -> Table:
    """Tabulate ``{run: quantity}``, ``{run: {name: quantity}}`` or ``{run: [quantities]}``, a row per run.

    ``half``: the table has half the width of the page.
    """
    rows = {run: _flat(value, name) for run, value in blocks.items()}
    columns = list(dict.fromkeys(key for row in rows.values() for key in row))
    body = [
        [str(run), *(row.get(column, "–") for column in columns)] for run, row in list(rows.items())[:LONGEST]
    ]
    if len(columns) == 1 and len(body) > ABREAST and not half:
        return _wrapped(["run", *columns], body, caption + _more(len(rows)))
    small = half or len(columns) > 5
    widths = [0] * (1 + len(columns)) if small else [1, *([1.2] * len(columns))]
    return Table(["run", *columns], body, caption + _more(len(rows)), widths, small=small)


def _wrapped(header: list[str], body: list[list[str]], caption: str) -> Table:
    """Set a long table of two columns in several pairs of columns side by side."""
    height = -(-len(body) // ABREAST)
    filled = [*body, *([["", ""]] * (ABREAST * height - len(body)))]
    rows = [[cell for part in range(ABREAST) for cell in filled[part * height + i]] for i in range(height)]
    return Table(header * ABREAST, rows, caption, [0.7, 1.5] * ABREAST)


def _flat(value: Any, name: str) -> dict[str, str]:
    if isinstance(value, list):
        return {f"joint {i}": _text(v) for i, v in enumerate(value, start=1)}
    if isinstance(value, dict) and "value" not in value:
        return {_column(k, v): _text(v) for k, v in value.items()}
    return {_column(name, value): _text(value)}


def _column(name: str, value: Any) -> str:
    shown = printed(value.get("unit")) if isinstance(value, dict) else ""
    named = FACES.get(name, words(name))
    return f"{named} ({shown})" if shown else named


def _text(value: Any) -> str:
    if isinstance(value, dict):
        return quantity(value, with_unit=False)
    return (
        number(value)
        if isinstance(value, int | float) and not isinstance(value, bool)
        else str(value if value is not None else "–")
    )


def _more(count: int) -> str:
    return f" The first {LONGEST} of {count} are shown; identified.json has all." if count > LONGEST else ""
