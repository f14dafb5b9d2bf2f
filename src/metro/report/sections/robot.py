"""The robot: sensorless and measured force, deformation, stiffness, waviness, path error."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from metro.report.content import Bullets, Heading, Item, Picture, Section, Table
from metro.report.figures import robot as figures
from metro.report.numbers import listing, number, probability, quantity
from metro.report.results import Results
from metro.report.sections.friction import friction
from metro.report.sections.stiffness import LONGEST, arm_stiffness, band, more, stations
from metro.units import JSON

SETTLED = 0.9  # share of the median deformation of a wall, from which on it counts as steady
WHITE = 0.05
_WAVES = ("wa", "wq", "wt")


def robot(results: Results) -> Section | None:
    """Write the results on the machine of a batch; None if there are none."""
    items = [
        *_force(results),
        *friction(results),
        *_deformation(results.compared("deformation")),
        *arm_stiffness(results),
        *stations(results),
        *_waviness(results),
        *_spectra(results),
    ]
    return (
        Section("The machine" if "end_stations" in results.tables else "The robot", items) if items else None
    )


def _force(results: Results) -> list[Item]:
    means, refused = results.tables.get("robot_means"), results.tables.get("robot_refused")
    items: list[Item] = [Heading("Force from the joints' torques")]
    if means is not None:
        items.append(_means(means))
    if (joints := results.tables.get("robot_joints")) is not None:
        items += _joints(joints)
    if means is not None:
        items += _course(results, means)
    if refused is not None:
        groups = refused.groupby("reason", sort=False)["run"]
        items.append(Bullets([f"{listing(list(runs))}: {reason}." for reason, runs in groups]))
    return items if len(items) > 1 else []


def _means(means: pd.DataFrame) -> Table:
    """Tabulate the steady means run by run, as in [K] table 7, with the dynamometer's if there is one."""
    beside = means[means["dynamometer_n"].notna()]
    rows = [
        [
            _starred(part.iloc[0]),
            *(cell for _, r in part.sort_values("axis").iterrows() for cell in _mean(r, bool(len(beside)))),
        ]
        for _, part in means.groupby("run", sort=False)
    ]
    about = (
        "Mean force of the steady cut by the torques of the joints (N), with its 95 % interval (noise of the "
        "torques, slow noise as in the idle runs, and friction repeatable to a tenth of the noise)"
    )
    if len(beside):
        error = float((beside["sensorless_n"] - beside["dynamometer_n"]).abs().mean())
        about += (
            ", beside the dynamometer's, and the error in percent of that. Mean of the absolute errors: "
            f"{number(error, 2)} N"
        )
    star = "" if means["by_index"].all() else " * Too few joints pass the index of 2: of all joints."
    header = ["run"]
    for axis in sorted(means["axis"].unique()):
        header += [f"{axis}, measured", "by torques", "%"] if len(beside) else [f"{axis} (N)"]
    widths = [0.7, *([1.0, 1.4, 0.6] if len(beside) else [1.0]) * means["axis"].nunique()]
    numeric = list(range(1, len(header)))
    caption = f"{about}.{star}{more(len(rows))}"
    return Table(header, rows[:LONGEST], caption, widths, numeric=numeric, small=bool(len(beside)))


def _mean(row: pd.Series, beside: bool) -> list[str]:
    text = band(row["sensorless_n"], row["sensorless_sd_n"])
    measured = float(row["dynamometer_n"])
    if not beside:
        return [text]
    error = number(100 * (row["sensorless_n"] / measured - 1), 2) if measured else "–"
    return [number(measured), text, error if math.isfinite(measured) else "–"]


def _starred(row: pd.Series) -> str:
    return str(row["run"]) + ("" if row["by_index"] else " *")


def _course(results: Results, means: pd.DataFrame) -> list[Item]:
    force = results.tables.get("robot_force")
    if force is None:
        return []
    beside = means.loc[means["dynamometer_n"].notna(), "run"].drop_duplicates()
    runs = [str(r) for r in dict.fromkeys([*beside, *force["run"].drop_duplicates()])][: figures.RUNS]
    off = (means["sensorless_n"] - means["dynamometer_n"]).abs() if len(beside) else None
    finding = "" if off is None else f"The steady means are {number(off.max(), 2)} N off at most. "
    caption = (
        f"{finding}Force on the tool along the wall from the torques of the joints, smoothed, with the "
        f"95 % band of each place; cut-in and cut-out shaded. Runs {listing(runs)} of "
        f"{force['run'].nunique()}."
    )
    return [Picture(figures.courses(force, means, runs), caption, caption)]


def _joints(joints: pd.DataFrame) -> list[Item]:
    """Observability and use per joint, runs side by side, and whether the innovations are white."""
    rows = []
    for run, part in joints.sort_values("joint", kind="stable").groupby("run", sort=False):
        cells = [
            f"{number(i, 2)}{'' if u else ' –'}{' †' if p < WHITE else ''}"
            for i, u, p in zip(part["index"], part["used"], part["whiteness"], strict=True)
        ]
        rows.append([str(run), *cells])
    coloured = joints[joints["whiteness"] < WHITE]
    caption = (
        "Observability index of the joints: mean torque of the steady cut over the range of the idle run. "
        "– not used for the force. † Innovations of the filter are not white (Ljung–Box, p below "
        f"{WHITE:g}): {len(coloured)} of {len(joints)}; there the torque does not wander as a random "
        f"walk does "
        "(it steps where the tool enters and leaves), and the band is no more than its estimate."
    )
    caption += (
        " Below: the random walk behind the filter, medians over the runs; noise from the idle run, drift by "
        "maximum likelihood."
    )
    walk = joints.groupby("joint")[["noise_nm", "drift_nm"]].median()
    foot = [
        [name, *(number(value, 2) for value in walk[column])]
        for name, column in (("noise of a bin (N m)", "noise_nm"), ("drift, bin to bin (N m)", "drift_nm"))
    ]
    header = ["run", *(f"joint {i}" for i in range(1, 7))]
    body = rows[:LONGEST] + foot
    items: list[Item] = [Table(header, body, caption + more(len(rows)), [1.6, *([1.0] * 6)], small=True)]
    said = joints[joints["remark"] != ""].drop_duplicates(["run", "remark"])
    groups = said.groupby("remark", sort=False)["run"]
    if len(said):
        items.append(Bullets([f"{listing(list(runs))}: {remark}." for remark, runs in groups]))
    return items


def _deformation(compared: pd.DataFrame | None) -> list[Item]:
    """Tabulate the steady deformation of held-out walls, as in [K] table 8."""
    if compared is None:
        return []
    rows = []
    for run, part in compared.sort_values("s_mm").groupby("run"):
        measured, predicted = (part[name].to_numpy(float) for name in ("measured", "after"))
        middle = float(np.median(measured))
        steady = np.abs(measured) >= SETTLED * abs(middle)
        if steady.sum() < 2:
            continue
        m, p = float(measured[steady].mean()), float(predicted[steady].mean())
        base = float(part["before"].to_numpy(float)[steady].mean())
        sd = float(part["sigma"].to_numpy(float)[steady].mean()) / math.sqrt(int(steady.sum()))
        rows.append(
            [
                str(run),
                band(m, sd),
                number(base),
                number(p),
                number(100 * (base / m - 1), 2),
                number(100 * (p / m - 1), 2),
            ]
        )
    if not rows:
        return []
    caption = (
        "Steady deformation of held-out walls: mean where the wall is beyond nine tenths of its median; the "
        "interval is that of the measured mean."
    )
    header = ["run", "measured (mm)", "base model", "with effects", "error of base (%)", "with effects (%)"]
    return [
        Heading("Deformation, steady value"),
        Table(header, rows, caption, [0.8, 1.4, 1, 1, 1.1, 1.1], numeric=[1, 2, 3, 4, 5]),
    ]


def _waviness(results: Results) -> list[Item]:
    blocks: JSON = (results.identified.get("arm") or {}).get("waviness") or {}
    items: list[Item] = [Heading("Waviness of the walls")]
    if blocks:
        items.append(_waves(blocks))
        items += _shares(blocks)
    points = results.tables.get("robot_waves")
    if points is not None:
        held = results.batch.runs.index[results.batch.runs["role"] == "validate"]
        known = list(points["run"].drop_duplicates())
        runs = [str(r) for r in [*(r for r in held if r in known), *(r for r in known if r not in held)]]
        shown = runs[: figures.RUNS]
        caption = (
            f"{_alike(blocks)}Waves of the wall beside those of the tip's tracking error in the cut and in "
            "the idle run, all through the profile's filter; the encoders' noise is in the latter two. "
            f"Runs {listing(shown)} of {len(runs)}."
        )
        items.append(Picture(figures.waviness(points, shown), caption, caption))
    return items if len(items) > 1 else []


def _alike(blocks: JSON) -> str:
    """Say the correlation of the wall's waves with those of the tip's error; empty if it is not known."""
    known = [block["correlation"] for block in blocks.values() if block.get("correlation") is not None]
    values = [float(c["value"]) if isinstance(c, dict) else float(c) for c in known]
    if not values:
        return ""
    return f"Wall and tip error correlate with {number(min(values), 2)} to {number(max(values), 2)}. "


def _waves(blocks: JSON) -> Table:
    shown = [wave for wave in _WAVES if any(f"{wave}_measured" in block for block in blocks.values())]
    rows = []
    for run, block in list(blocks.items())[:LONGEST]:
        cells = [
            "–" if (q := block.get(f"{wave}_{kind}")) is None else quantity(q, with_unit=False)
            for wave in shown
            for kind in ("measured", "predicted")
        ]
        alike = block.get("correlation")
        text = quantity(alike, with_unit=False) if isinstance(alike, dict) else number(alike, 2)
        rows.append([str(run), *cells, text])
    names = [f"{wave.capitalize()} {kind}" for wave in shown for kind in ("wall", "told")]
    caption = "Waviness (µm) of the wall and as told by the model, with 95 % intervals where known."
    header = ["run", *names, "correlation"]
    return Table(header, rows, caption + more(len(blocks)), [0] * len(header), small=True)


def _shares(blocks: JSON) -> list[Item]:
    known = [block["joint_share"] for block in blocks.values() if block.get("joint_share")]
    if not known:
        return []
    shares = np.array(known, dtype=float)
    by_statistic = {
        "least": shares.min(axis=0),
        "median": np.median(shares, axis=0),
        "greatest": shares.max(axis=0),
    }
    rows = [[name, *(_whole_percent(share) for share in values)] for name, values in by_statistic.items()]
    caption = (
        f"Share of each joint in the variance of the tip's waves, over {len(known)} runs; below zero: it "
        "works against the others."
    )
    header = ["", *(f"joint {i}" for i in range(1, 7))]
    widths, numeric = [0.7, *([1.0] * 6)], [1, 2, 3, 4, 5, 6]
    return [Table(header, rows, caption, widths, numeric=numeric, small=True)]


def _whole_percent(share: float) -> str:
    return f"{100.0 * share:.0f} %".replace("-0 %", "0 %").replace("-", "−")


def _spectra(results: Results) -> list[Item]:
    table, lines = results.tables.get("robot_spectra"), results.tables.get("robot_lines")
    if table is None:
        return []
    finding = "No line stands" if lines is None else f"{len(lines)} lines stand"
    caption = (
        f"{finding} out of the noise at a chance of one in a hundred per spectrum. Spectra of the tip's path "
        "error by the encoders (multitaper), all runs: over time and along the path. Marks: such lines."
    )
    items: list[Item] = [
        Heading("Spectra of the path error"),
        Picture(figures.spectra(table, lines), caption, caption),
    ]
    if lines is None:
        return items
    strongest = lines.sort_values("amplitude_um", ascending=False).head(LONGEST // 2)
    rows = [
        [
            str(r["run"]),
            str(r["axis"]),
            f"{band(r['frequency'], r['frequency_sd'])} {'Hz' if r['domain'] == 'time' else '1/mm'}",
            band(r["amplitude_um"], r["amplitude_sd_um"]),
            probability(r["probability"]),
        ]
        for _, r in strongest.iterrows()
    ]
    about = (
        "Lines in the path error with 95 % intervals, and the chance of one as significant in noise "
        "(Thomson's F "
        f"test, all frequencies together). The strongest {len(rows)} of {len(lines)}."
    )
    header = ["run", "axis", "frequency", "amplitude (µm)", "chance"]
    return [*items, Table(header, rows, about, [0.8, 0.5, 1.6, 1.2, 1])]
