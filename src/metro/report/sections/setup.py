"""The set-up of a batch: declared tool, work and instruments, and the cutting conditions."""

from __future__ import annotations

import math
from collections.abc import Iterator

import pandas as pd

from metro.report.content import Heading, Item, Paragraph, Section, Table
from metro.report.cuts import NAMES, NUMBERS
from metro.report.numbers import listing, words
from metro.report.results import Results
from metro.report.sections.measured import count_of, is_cut
from metro.units import JSON, printed

LONGEST, MOST_RUNS = 40, 8
# end of a key → its unit; the longest matching end is used
ENDINGS = {
    "_deg": "deg",
    "_hz": "Hz",
    "_kg": "kg",
    "_m": "m",
    "_mm": "mm",
    "_ms": "ms",
    "_n": "N",
    "_n_mm": "N/mm",
    "_n_mm2": "N/mm2",
    "_nm": "N m",
    "_rpm": "rpm",
    "_s": "s",
    "_um": "um",
}
CONDITIONS = {
    "operation": "operation",
    **{column: setting.title for column, setting in NUMBERS.items()},
    "direction": "direction",
    "orbit_rpm": "orbit (rpm)",
    "feed_direction_deg": "feed direction (°)",
    **{name: name for name in NAMES[2:]},
}


def setup(results: Results) -> Section | None:
    """Write the declared tool, work and instruments, and the conditions with their runs; None without any."""
    runs = results.batch.runs
    free = pd.Series(False, runs.index)
    if "joint_log" in runs:  # a log of a free motion is no cut, and no model is judged by it
        free = (runs["joint_log"] != "") & (runs["operation"] == "")
    items = [
        *_declared(results.batch.manifest),
        *_arm(results.batch.cell, results.batch.manifest),
        *_conditions(results.batch.runs[~free]),
    ]
    plan = [] if len(free) and free.all() else _plan(results)
    return Section("What was measured", [*items, *plan]) if items else None


def _declared(manifest: JSON) -> list[Item]:
    parts: JSON = {name: manifest.get(name) or {} for name in ("tool", "work")}
    parts |= {words(name): value or {} for name, value in (manifest.get("instruments") or {}).items()}
    known = {f"known: {words(k)}": v or {} for k, v in (manifest.get("known") or {}).items()}
    rows = [[name, "; ".join(_values(values))] for name, values in (parts | known).items() if values]
    if not rows:
        return []
    caption = "Tool, work and instruments as batch.yaml declares them; nothing of this was inferred."
    return [Heading("Tool and instruments"), Table(["what", "declared"], rows, caption, [1, 5], small=True)]


def _arm(cell: JSON, manifest: JSON) -> list[Item]:
    """Tabulate the arm's Denavit–Hartenberg parameters, as in [K] table 1; nothing where there is no arm."""
    arm = cell.get("arm") or {}
    dh = arm.get("dh")
    if not dh:
        return _chain(arm, cell)
    names = ("θ₀ (°)", "α (°)", "d (mm)", "a (mm)")
    rows = [[name, *(f"{float(row[i]):g}".replace("-", "−") for row in dh)] for i, name in enumerate(names)]
    caption = (
        f"Denavit–Hartenberg parameters of the arm {cell.get('cell', '')}, "
        f"{'modified (proximal)' if arm.get('convention') == 'modified' else 'standard (distal)'} convention."
    )
    kinds = arm.get("joints")
    if kinds:
        rows.append(["joint", *kinds])
    if tip := manifest.get("tool_in_flange_mm"):
        place = ", ".join(f"{float(value):g}" for value in tip).replace("-", "−")
        caption += f" Tool tip in the flange frame: {place} mm."
    numeric = list(range(1, len(dh) + 1))
    header = ["", *(f"joint {i}" for i in numeric)]
    return [Table(header, rows, caption, [1.2, *([1.0] * len(dh))], numeric=numeric, small=True)]


def _chain(arm: JSON, cell: JSON) -> list[Item]:
    """Tabulate the joints of a URDF file; nothing where there is no arm."""
    if not arm.get("chain"):
        return []
    rows = []
    for joint in arm["chain"]:
        origin = [1e3 * row[3] for row in joint["origin"][:3]]
        place = ", ".join(f"{value:.6g}" for value in origin).replace("-", "−")
        axis = "–" if joint["kind"] == "fixed" else ", ".join(f"{value:.4g}" for value in joint["axis"])
        rows.append([str(joint["name"]), str(joint["kind"]), place, axis.replace("-", "−")])
    caption = (
        f"Joints of the arm {cell.get('cell', '')} as {arm.get('urdf')} describes them: origins in the frame "
        "before, axes in their own."
    )
    header = ["joint", "kind", "origin (mm)", "axis"]
    return [Table(header, rows, caption, [1.6, 1, 2, 1.4], small=True)]


def _values(values: JSON) -> Iterator[str]:
    """Write each value of a mapping with its name and unit; matrices are left to the manifest."""
    for key, value in values.items():
        ending = max((end for end in ENDINGS if key.endswith(end)), key=len, default="")
        name, shown = words(key.removesuffix(ending)), printed(ENDINGS.get(ending))
        after = f"{'' if shown == '°' else ' '}{shown}" if shown else ""
        if isinstance(value, dict):
            yield f"{name} {', '.join(f'{k}: {v}' for k, v in value.items())}"
        elif isinstance(value, list) and value and all(isinstance(v, int | float) for v in value):
            yield f"{name} {', '.join(f'{v:g}' for v in value)}{after}"
        elif isinstance(value, int | float | str):
            yield f"{name} {f'{value:g}' if isinstance(value, float) else value}{after}"


def _conditions(runs: pd.DataFrame) -> list[Item]:
    """Tabulate the settings that differ, runs of one condition together; name shared settings once."""
    columns = [name for name in CONDITIONS if name in runs and _given(runs[name]).any()]
    if not is_cut(runs).any() and columns == ["feed_direction_deg"]:  # which runs.csv need not state
        return []
    if runs.empty or not columns:
        return []
    shared = [name for name in columns if runs[name].nunique(dropna=False) == 1]
    differing = [name for name in columns if name not in shared]
    by = [runs[name].map(_cell) for name in differing]
    groups = list(runs.groupby(by, sort=False)) if by else [((), runs)]
    rows = [
        [
            *map(str, key if isinstance(key, tuple) else (key,)),
            *(_named(part, r) for r in ("identify", "validate")),
        ]
        for key, part in groups
    ]
    same = listing([f"{CONDITIONS[name]} {_cell(runs[name].iloc[0])}" for name in shared])
    caption = "Conditions of the cuts, and the runs that identify and that judge the models."
    caption += f" All runs: {same}." if same else ""
    caption += f" The first {LONGEST} of {len(rows)}; runs.csv has all." if len(rows) > LONGEST else ""
    header = [*(CONDITIONS[name] for name in differing), "identification", "held out"]
    widths = [*([1.0] * len(differing)), 2.2, 2.2]
    table = Table(header, rows[:LONGEST], caption, widths, small=True)
    return [Heading("Conditions"), table]


def _plan(results: Results) -> list[Item]:
    """Say how, and from which plan, runs were held out."""
    plan = results.batch.plan
    if not plan.get("identify") and not plan.get("validate"):
        reason = str(plan.get("how") or "no run was recorded").rstrip(".")
        elsewhere = "; which printed rows were held out is said below" if results.verdicts() else ""
        return [Heading("Hold-out plan"), Paragraph(f"No run was held out: {reason}{elsewhere}.")]
    how = f"Made from the manifest before any signal was read: {plan.get('how', 'not stated')}"
    stated = plan.get("seed") is None or f"seed {plan['seed']}" in how
    seed = "" if stated else f" Seed {plan['seed']}."
    used, held = (count_of(len(plan.get(role) or []), "run") for role in ("identify", "validate"))
    text = f"{how.rstrip('.')}.{seed} To identify on: {used}; held out: {held}."
    return [Heading("Hold-out plan"), Paragraph(text)]


def _given(column: pd.Series) -> pd.Series:
    return column.notna() & (column.astype(str) != "")


def _cell(value: object) -> str:
    if isinstance(value, float):
        return "–" if math.isnan(value) else f"{value:g}"
    return str(value or "–")


def _named(part: pd.DataFrame, role: str) -> str:
    """Name the runs of a role; of many runs, the first ones and the number of the others."""
    names = [str(run) for run in part.index[part["role"] == role]]
    more = f" and {len(names) - MOST_RUNS} more" if len(names) > MOST_RUNS else ""
    return ", ".join(names[:MOST_RUNS]) + more or "–"
