"""The path error of flange and tip by the encoders: its size, the joint that makes it, its spectra."""

from __future__ import annotations

import pandas as pd

from metro.report.content import Heading, Item, Picture, Table
from metro.report.figures import tracking as figures
from metro.report.numbers import number, probability
from metro.report.results import Results
from metro.report.sections.stiffness import LONGEST, band, more


def tracking(results: Results) -> list[Item]:
    """Write the path error by the encoders and its spectra; nothing without a robot's log."""
    course, sizes = results.tables.get("robot_tracking"), results.tables.get("robot_tracking_size")
    items: list[Item] = []
    if course is not None and sizes is not None:
        run = _shown(results, sizes)
        joint = int(sizes.loc[sizes["run"] == run, "joint"].iloc[0])
        idle = " and in the idle run" if "tip_idle_um" in sizes else ""
        caption = (
            f"{_finding(sizes)}Path error across the feed by the encoders, run {run}, means over bins: of "
            f"flange and tip, in the cut{idle}; at the tip, of all joints and of joint {joint} alone; error "
            f"and torque of joint {joint}. Dotted: the joint turns round."
        )
        picture = Picture(figures.tracking(course[course["run"] == run], joint), caption, caption)
        items += [Heading("Path error of flange and tip"), picture, _sizes(sizes)]
    return [*items, *_spectra(results)]


def _shown(results: Results, sizes: pd.DataFrame) -> str:
    """Return the first held-out run with an error, else the first run."""
    runs = results.batch.runs
    held = set(runs.index[runs["role"] == "validate"]) if "role" in runs else set()
    known = [str(run) for run in sizes["run"]]
    return next((run for run in known if run in held), known[0])


def _finding(sizes: pd.DataFrame) -> str:
    """Say how much more the tip strays than the flange, and which joint makes it."""
    factor = (sizes["tip_cut_um"] / sizes["flange_cut_um"]).median()
    count = sizes["joint"].value_counts()
    return (
        f"The tip strays {number(float(factor), 2)} times as far as the flange (median of the runs); in "
        f"{int(count.iloc[0])} of {len(sizes)} runs joint {int(count.index[0])} makes most of it. "
    )


def _sizes(sizes: pd.DataFrame) -> Table:
    names = ("flange_cut_um", "flange_idle_um", "tip_cut_um", "tip_idle_um")
    rows = [
        [
            str(r["run"]),
            *(number(r[name], 2) if name in sizes else "–" for name in names),
            str(int(r["joint"])),
            number(r["joint_um"], 2),
            f"{100 * r['share']:.0f}",
            number(r["correlation"], 2),
        ]
        for _, r in sizes.iterrows()
    ]
    caption = (
        "Amplitude of the path error across the feed (µm), half of its range; the joint with the largest "
        "share in the variance of the tip's error (over 100 %: others work against it), its amplitude at the "
        "tip alone, and the correlation of its error with its torque."
    )
    header = [
        *("run", "flange, cut", "idle", "tip, cut", "idle"),
        *("joint", "alone", "share (%)", "with torque"),
    ]
    widths = [0.6, *([1.0] * 8)]
    return Table(
        header, rows[:LONGEST], caption + more(len(rows)), widths, numeric=list(range(1, 9)), small=True
    )


def _spectra(results: Results) -> list[Item]:
    table, lines = results.tables.get("robot_spectra"), results.tables.get("robot_lines")
    if table is None:
        return []
    finding = "No line is" if lines is None else f"{len(lines)} lines are"
    caption = (
        f"{finding} significant at the 1 % level per spectrum. Multitaper spectra of the tip's path error "
        "from "
        "the encoders, all runs, over time and along the path. Markers show significant lines."
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
