"""The arm by measured poses: its corrections, the effects that stay, errors on poses that were left out."""

from __future__ import annotations

import math
from collections.abc import Sequence

import pandas as pd

from metro.report.content import Bullets, Facts, Heading, Item, Paragraph, Picture, Section, Table
from metro.report.figures import poses as figures
from metro.report.numbers import listing, number, percent, quantity
from metro.report.results import Results
from metro.report.sections.pose_targets import corrected_targets, joint_titles
from metro.units import JSON

KINDS = {"random": "at random", "region": "by region", "time": "by time"}
STAGES = {"nominal": "nominal geometry", "geometry": "corrected geometry", "effects": "with effects"}
ABOUT_ERRORS = (
    "{what} (mm) of poses that no fit saw, for which effects were "
    "chosen anew: median with its 95 % interval, 95th percentile in brackets. At random: a fifth; by "
    "region and by time: each quarter of the workspace and of the series in turn. {frames} are always "
    "fitted."
)
MEASURED = {
    "positions": ("Distance between measured and predicted position", "Base and tool"),
    "distances": ("Absolute difference between measured and predicted distance", "Stations and tool"),
}
ABOUT_CORRECTIONS = (
    "Corrections of the Denavit-Hartenberg rows with 95 % intervals, by the scatter between poses and "
    "between regions. Those that these poses cannot separate are left at 0: {redundant}. Condition "
    "number {condition}, observability index O1 {o1} mm per correction of 5 mm or 5 mrad."
)
MOST_REPEATED, MOST_NEXT = 12, 8
LEAST_CHANCE = 1e-4
LEAST_OF_NOISE = 0.2  # adds 2 % to it
ABOUT_NEXT = (
    "Poses to measure next, in this order: they lower the standard errors of the geometry most (D-optimal, "
    "within the ranges of joints and positions so far). Left: geometric mean of the standard errors over "
    "that of now. Table pose_next has more; nobody has checked that the way to them is free."
)
ABOUT_REPEATS = (
    "Poses that were taken several times, mm, as ISO 9283 defines them: accuracy AP, from where each model "
    "expects the point by the readings; repeatability RP; variation by the direction of approach, vAP."
)
ABOUT_STATIONS = (
    "Places from which the distances were measured, mm, in the base frame of the rows, where the angle and "
    "the height about the first axis are those of the declared arm."
)
ABOUT_EFFECTS = (
    "What the effects move the measured point by (rms over the poses, less what a change of the geometry "
    "would do alike), by how much each made the squared residual of left-out regions smaller (with its "
    "standard error), and how often regions gain as much by luck (p: of 16 regions 0.00002 at least)."
)


def poses(results: Results) -> Section | None:
    """Write the calibration by measured poses; None for a batch without any."""
    block = results.identified.get("pose") or {}
    series = {run: one for run, one in block.items() if run != "not_identified"}
    items: list[Item] = []
    for at, (run, one) in enumerate(series.items()):
        items += [Heading(f"Series {run}, {one['poses']} poses")] if len(series) > 1 else []
        items += [Paragraph(said(one)), _errors_table(one)]
        items += [*([] if at == 0 else _histogram(_left_out(results, run))), *_drawn(results, run)]
        items += [*_effects(one), *_repeats(one), _corrections(one), *_stations(one)]
        items += corrected_targets(results, one)
        items += _next(results, run)
    reasons = [f"{run}: {reason}." for run, reason in (block.get("not_identified") or {}).items()]
    items += [Paragraph("Not determined:"), Bullets(reasons)] if reasons else []
    return Section("The arm by measured poses", items) if items else None


def first_poses(results: Results) -> list[Item]:
    """Give the errors on poses that were left out by region, before and after, of the first series."""
    block = results.identified.get("pose") or {}
    run = next((run for run in block if run != "not_identified"), "")
    if not run:
        return []
    errors = block[run]["errors"]["region"]
    facts = [
        (f"{words}, {run}", quantity(errors[stage]["median"]), "median distance, left out by region")
        for stage, words in STAGES.items()
    ]
    return [Facts(facts), *_histogram(_left_out(results, run))]


def said(one: JSON) -> str:
    """Say what the poses show, and what stays."""
    errors = one["errors"]["region"]
    before, corrected, after = (number(errors[stage]["median"]["value"], 2) for stage in STAGES)
    chosen = _grouped([effect["title"] for effect in one["effects"]])
    found = (
        f"Effects that stay, since they predict left-out regions better: {listing(chosen)}. "
        if chosen
        else "No effect beyond the geometry predicts left-out regions better. "
    )
    noise = (one.get("noise") or {}).get("value") or 0.0
    scatter = one["scatter"]["value"]
    beyond = " beyond that of the instrument" if noise else ""
    coordinate = "distance" if one.get("measured") == "distances" else "coordinate"
    left = (
        "What stays is no more than the noise of the instrument."
        if scatter < LEAST_OF_NOISE * noise
        else f"What stays has a standard deviation of {number(scatter, 2)} mm in a {coordinate}{beyond}."
    )
    serves = (
        " What else this batch computes with the arm uses the corrected geometry, without the effects."
        if one.get("serves")
        else ""
    )
    rounding = one.get("rounding")
    rounded = (
        f" The readings of joints {listing(list(rounding['steps']))} are rounded, which makes "
        f"{number(rounding['moves']['value'], 2)} mm of that."
        if rounding and rounding["moves"]["value"] > LEAST_OF_NOISE * scatter
        else ""
    )
    return (
        f"The median error on left-out regions falls from {before} mm with the nominal geometry to "
        f"{corrected} mm with its corrections and to {after} mm with effects. {found}{left}{rounded}{serves}"
    )


def _errors_table(one: JSON) -> Table:
    rows = [
        [
            KINDS[kind],
            str(errors["poses"]),
            *(
                f"{quantity(errors[stage]['median'], with_unit=False)} "
                f"({number(errors[stage]['p95']['value'], 2)})"
                for stage in STAGES
            ),
        ]
        for kind, errors in one["errors"].items()
    ]
    what, frames = MEASURED[one.get("measured", "positions")]
    about = ABOUT_ERRORS.format(what=what, frames=frames)
    return Table(["left out", "poses", *STAGES.values()], rows, about, [0.8, 0.6, 1.6, 1.6, 1.6])


def _effects(one: JSON) -> list[Item]:
    if not one["effects"]:
        return []
    gains = {trial["effect"]: trial for trial in one["tried"]}
    rows = []
    for effect in one["effects"]:
        trial = gains[effect["title"]]
        less = math.exp(-trial["gain"])  # the loss is the logarithm of the squared residual
        gain = f"{number(100 * (1 - less), 2)} ± {number(100 * less * trial['error'], 2)}"
        values = listing([f"{name} {quantity(value)}" for name, value in effect["parameters"].items()])
        chance = "< 0.0001" if trial["p_value"] < LEAST_CHANCE else number(trial["p_value"], 2)
        moves = quantity(effect["moves"], with_unit=False)
        rows.append([effect["title"], moves, gain, chance, values or "drawn"])
    header = ["effect", "moves, mm", "gain, %", "p", "values"]
    missed = _grouped([trial["effect"] for trial in one["tried"] if not trial["kept"]])
    items: list[Item] = [Table(header, rows, ABOUT_EFFECTS, [2.0, 1.2, 0.8, 0.7, 3.4], small=True)]
    if one.get("rivals"):
        pairs = [f"{first} or {second}" for first, second in one["rivals"]]
        items.append(Paragraph(f"As good in the place of another: {listing(pairs)}."))
    if missed:
        items.append(Paragraph(f"Tried without a gain: {listing(missed)}.", "note"))
    return items


def _repeats(one: JSON) -> list[Item]:
    entries = one.get("repeats") or []
    if not entries:
        return []
    rows = [
        [
            str(entry["target"]),
            str(entry["repeats"]),
            *(quantity(entry[f"ap_{stage}"], with_unit=False) for stage in STAGES),
            quantity(entry["rp"], with_unit=False),
            number(entry["vap"]["value"], 2),
        ]
        for entry in entries[:MOST_REPEATED]
    ]
    more = f" The first {MOST_REPEATED} of {len(entries)} poses." if len(entries) > MOST_REPEATED else ""
    header = ["pose", "repeats", *(f"AP, {words}" for words in STAGES.values()), "RP", "vAP"]
    return [Table(header, rows, ABOUT_REPEATS + more, [0.5, 0.6, 1.3, 1.3, 1.2, 1.2, 0.6], small=True)]


def _grouped(labels: Sequence[str]) -> list[str]:
    """Write an effect of several joints once: gear eccentricity (joints 1, 2 and 4)."""
    joints: dict[str, list[str]] = {}
    for label in labels:
        title, _, joint = label.partition(", joint ")
        joints.setdefault(title, []).extend([joint] if joint else [])
    return [
        f"{title} (joint{'s' if len(own) > 1 else ''} {listing(own)})" if own else title
        for title, own in joints.items()
    ]


def _by_joint(labels: Sequence[str]) -> list[str]:
    """Write the parameters of a joint together: joint 1 (offset and tilt)."""
    kinds: dict[str, list[str]] = {}
    for label in labels:
        joint, count, kind = label.split(" ", 2)
        kinds.setdefault(f"{joint} {count}", []).append(kind)
    return [f"{joint} ({listing(own)})" for joint, own in kinds.items()]


def _corrections(one: JSON) -> Table:
    rows = [[name, quantity(value)] for name, value in one["corrections"].items()]
    half = (len(rows) + 1) // 2
    pairs = [
        [*first, *(rows[half + at] if half + at < len(rows) else ["", ""])]
        for at, first in enumerate(rows[:half])
    ]
    caption = ABOUT_CORRECTIONS.format(
        redundant=listing(_by_joint(one["redundant"])) or "none",
        condition=number(one["condition"], 2),
        o1=number(one["observability"], 2),
    )
    return Table(["parameter", "correction"] * 2, pairs, caption, [1.1, 1.2] * 2, small=True)


def _stations(one: JSON) -> list[Item]:
    places = one.get("stations") or []
    rows = [
        [str(at), *(quantity(place[axis], with_unit=False) for axis in "xyz")]
        for at, place in enumerate(places, start=1)
    ]
    return [Table(["station", "x", "y", "z"], rows, ABOUT_STATIONS, small=True)] if rows else []


def _next(results: Results, run: str) -> list[Item]:
    table = results.tables.get("pose_next")
    mine = None if table is None else table[table["run"] == run]
    if mine is None or mine.empty:
        return []
    joints = [str(name) for name in mine if str(name).startswith("q") and mine[name].notna().all()]
    rows = [
        [
            str(int(row["order"])),
            *(number(float(row[name]), 4) for name in joints),
            percent(float(row["left"])),
        ]
        for _, row in mine.head(MOST_NEXT).iterrows()
    ]
    header = ["pose", *joint_titles(joints), "left"]
    return [Table(header, rows, ABOUT_NEXT, numeric=list(range(len(header))), small=True)]


def _left_out(results: Results, run: str) -> pd.DataFrame | None:
    """Return the errors of a series on poses that were left out by region; None where there are none."""
    errors = results.tables.get("pose_errors")
    return None if errors is None else errors[(errors["run"] == run) & (errors["kind"] == "region")]


def _histogram(errors: pd.DataFrame | None) -> list[Item]:
    caption = "Distances of poses left out by region, before and after."
    return [] if errors is None else [Picture(figures.distances(errors), caption, caption)]


def _drawn(results: Results, run: str) -> list[Item]:
    items: list[Item] = []
    errors, curves = _left_out(results, run), results.tables.get("pose_curves")
    if errors is not None:
        frame = "arm's base frame" if figures.by_distance(errors) else "instrument's frame"
        caption = (
            "Error over the workspace, of poses left out by region: mean of each cell, in two "
            f"planes of the {frame}, without the outermost 0.2 % of the poses. Each map has its "
            "own colours: 2 % of the cells are above them."
        )
        items.append(Picture(figures.maps(errors), caption, caption))
    if curves is not None and (mine := curves[curves["run"] == run]).size:
        caption = (
            "Curves of the readings: what each joint turns by beyond its reading, about its mean, over "
            "the angle; grey: 95 % interval. Where a joint was not, there is no curve."
        )
        items.append(Picture(figures.curves(mine), caption, caption))
    return items
