"""The robot: sensorless and measured force, deformation, stiffness, waviness, path error."""

from __future__ import annotations

import math

import numpy as np

from metro.report.content import Heading, Item, Picture, Section, Table
from metro.report.figures import robot as figures
from metro.report.numbers import listing, number, quantity
from metro.report.results import Results
from metro.report.sections.friction import friction
from metro.report.sections.joint_logs import joint_logs
from metro.report.sections.joint_torques import joint_torques
from metro.report.sections.loads import load_points
from metro.report.sections.stiffness import LONGEST, arm_stiffness, band, more, stations
from metro.report.sections.tracking import tracking
from metro.units import JSON

SETTLED = 0.9  # share of the median deformation of a wall, from which on it counts as steady
LONGEST_WAVE_MM = 8.0  # that is compared where batch.yaml states no instruments.profiler.cutoff_mm
_WAVES = ("wa", "wq", "wt")


def robot(results: Results) -> Section | None:
    """Write the results on the machine of a batch; None if there are none."""
    items = [
        *joint_torques(results),
        *friction(results),
        *joint_logs(results),
        *_deformation(results),
        *load_points(results),
        *arm_stiffness(results),
        *stations(results),
        *_waviness(results),
        *tracking(results),
    ]
    return (
        Section("The machine" if "end_stations" in results.tables else "The robot", items) if items else None
    )


def _deformation(results: Results) -> list[Item]:
    """Tabulate the steady deformation of held-out walls, as in [K] table 8, and the flange's share of it."""
    compared = results.compared("deformation")
    if compared is None:
        return []
    walls: JSON = (results.identified.get("arm") or {}).get("walls") or {}
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
                _flange_percent(walls.get(str(run))),
            ]
        )
    if not rows:
        return []
    caption = (
        "Steady deformation of held-out walls: mean where the wall is beyond nine tenths of its median; the "
        "interval is that of the measured mean. Last: how much of the predicted tip's deflection is left "
        "where the rotation of the flange is neglected ([K] eq. 17 in place of eq. 18)."
    )
    errors = ("error of base (%)", "with effects (%)", "flange (%)")
    header = ["run", "measured (mm)", "base model", "with effects", *errors]
    return [
        Heading("Deformation, steady value"),
        Table(header, rows, caption, [0.8, 1.4, 1, 1, 1.1, 1.1, 0.8], numeric=[1, 2, 3, 4, 5, 6]),
    ]


def _flange_percent(wall: JSON | None) -> str:
    """Write the deflection of the flange along a wall's normal as a share of the tip's."""
    if not wall or not wall.get("with_flange_rotation"):
        return "–"
    return number(100.0 * wall["without_flange_rotation"] / wall["with_flange_rotation"], 2)


def _waviness(results: Results) -> list[Item]:
    blocks: JSON = (results.identified.get("arm") or {}).get("waviness") or {}
    items: list[Item] = [Heading("Waviness of the walls")]
    if blocks:
        traces = results.tables.get("profile_parameters")
        longer = traces is not None and bool((traces["profile"] == "W").any())
        items.append(_waves(blocks, waves_band(results), longer=longer))
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


def waves_band(results: Results) -> str:
    """Say between which lengths the waves of walls are compared with those of the tip; empty if not known."""
    runs = results.tables.get("waviness_runs")
    if runs is None:
        return ""
    longest = float(results.batch.instrument("profiler").get("cutoff_mm", LONGEST_WAVE_MM))
    return f"{runs['shortest_mm'].max():.2g} to {longest:g} mm"


def _waves(blocks: JSON, band: str, *, longer: bool) -> Table:
    """Tabulate the waves in a band; ``longer``: the section on texture has the longer ones, too."""
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
    names = [f"{wave.capitalize()} {kind}" for wave in shown for kind in ("wall", "predicted")]
    within = f" from waves of {band}" if band else ""
    caption = f"Waviness of the wall{within}, measured and predicted (µm), with 95 % intervals where known."
    if longer:
        caption += (
            " The W parameters of the section “Surface texture” are larger: they include the longer waves, "
            "up to the length of the wall."
        )
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
    count = shares.shape[1]
    header = ["", *(f"joint {i + 1}" for i in range(count))]
    widths, numeric = [0.7, *([1.0] * count)], list(range(1, count + 1))
    return [Table(header, rows, caption, widths, numeric=numeric, small=True)]


def _whole_percent(share: float) -> str:
    return f"{100.0 * share:.0f} %".replace("-0 %", "0 %").replace("-", "−")
