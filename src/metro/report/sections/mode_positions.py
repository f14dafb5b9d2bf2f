"""Modes over the positions of a machine, and how much of each pickup point's response they reconstruct."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from metro.report.content import Bullets, Heading, Item, Picture, Table
from metro.report.figures import mode_positions as figures
from metro.report.numbers import listing, number, percent
from metro.units import N_UM, Array

NORMAL = 1.96
# Property of a mode: its column, that of its standard deviation, name, and factor to the unit of the name.
PROPERTIES = (
    ("frequency_hz", "frequency_sd_hz", "frequency (Hz)", 1.0),
    ("damping", "damping_sd", "damping (%)", 100.0),
    ("stiffness_n_m", "stiffness_sd", "stiffness (N/µm)", 1.0 / N_UM),
)


def over_positions(tables: Mapping[str, pd.DataFrame]) -> list[Item]:
    """Tabulate and draw how each mode changes with the position; nothing for a single position."""
    modes, tracks = tables.get("modes"), tables.get("mode_tracks")
    if modes is None or tracks is None or modes["position"].nunique() < 2:
        return []
    names = list(dict.fromkeys(modes["mode"]))
    count = modes["position"].nunique()
    rows = []
    for name in names:
        part, followed = modes[modes["mode"] == name], tracks[tracks["mode"] == name]
        ranges = [_range(factor * part[column].to_numpy(float)) for column, _, _, factor in PROPERTIES]
        rows.append([str(name), f"{len(part)} of {count}", *ranges, number(followed["mac"].min())])
    caption = (
        "Modes over the positions, least and greatest of each. A mode is followed from each position to its "
        "nearest neighbours by its frequency and its shape; the least modal assurance criterion of "
        "the steps is in the last column."
    )
    header = ["mode", "found at", *(name for _, _, name, _ in PROPERTIES), "least MAC"]
    about = (
        f"{_dependence(modes, names)} Change of each mode from its mean over the positions; 95 % intervals."
    )
    return [
        Heading("Modes over the positions"),
        Table(header, rows, caption, [0.6, 0.8, 1.3, 1.3, 1.3, 0.8], numeric=[5]),
        Picture(figures.over_positions(modes, PROPERTIES), about, about),
    ]


def _range(values: Array) -> str:
    return f"{number(float(values.min()))} … {number(float(values.max()))}"


def _dependence(modes: pd.DataFrame, names: list[str]) -> str:
    """Say by how much each property depends on the position, and of how many modes beyond its intervals."""
    said = []
    for column, sd, label, _ in PROPERTIES:
        spread, beyond = {}, 0
        for name in names:
            part = modes[modes["mode"] == name]
            value, error = part[column].to_numpy(float), part[sd].to_numpy(float)
            if len(part) < 2 or not np.isfinite(value).all():
                continue
            spread[name] = float(value.max() / value.min() - 1.0)
            low, high = value.argmin(), value.argmax()
            beyond += bool(value[high] - value[low] > NORMAL * np.hypot(error[low], error[high]))
        if spread:
            most = max(spread, key=lambda name: spread[name])
            word = label.split(" (")[0]
            said.append(f"{word} by up to {percent(spread[most])} ({most}; {beyond} of {len(spread)} modes)")
    return f"From position to position, beyond what the hits scatter, change {listing(said)}." if said else ""


def reconstruction(tables: Mapping[str, pd.DataFrame]) -> list[Item]:
    """Tabulate and draw what the modes leave of each response by its distance from the blow."""
    table, cross = tables.get("mode_pickups"), tables.get("mode_cross")
    items: list[Item] = []
    known = None if table is None else table[table["distance_mm"].notna()]
    if known is not None and known["distance_mm"].nunique() > 1:
        rows = []
        for distance, part in known.groupby("distance_mm"):
            level = _between(part["level"])
            errors = [_between(part[name]) for name in ("error", "noise")]
            rows.append([number(float(str(distance))), str(len(part)), level, *errors])
        caption = (
            "Error of the modal model, rms over rms of the response, by distance from the hit: least, median "
            "and greatest, with the scatter of repeated hits. Level: the response relative to that of the "
            "driving point."
        )
        header = [
            "distance (mm)",
            "responses",
            "level (%)",
            "error of the modes (%)",
            "scatter of the hits (%)",
        ]
        about = f"{_by_distance(known)} Error of reconstruction of every response over its distance."
        items += [
            Table(header, rows, caption, [0.9, 0.8, 1.4, 1.6, 1.6], numeric=[0, 1]),
            Picture(figures.by_distance(known), about, about),
        ]
    if cross is not None:
        least, most = (percent(float(x)) for x in (cross["share"].min(), cross["share"].max()))
        share = most if least == most else f"{least} to {most}"
        said = f"A response across the blow is {share} of that along it, over {len(cross)} pairs"
        items.append(Bullets([f"{said}; the modes of both directions are taken as uncoupled."]))
    return items


def _between(values: pd.Series) -> str:
    """Write least, median and greatest in percent."""
    low, middle, high = (number(100.0 * float(x), 2) for x in (values.min(), values.median(), values.max()))
    return middle if low == high else f"{low} … {middle} … {high}"


def _by_distance(known: pd.DataFrame) -> str:
    near = known[known["distance_mm"] == known["distance_mm"].min()]
    far = known[known["distance_mm"] == known["distance_mm"].max()]
    least, most = (f"{number(float(part['distance_mm'].iloc[0]))} mm" for part in (near, far))
    low, high = (percent(float(x)) for x in (near["error"].min(), near["error"].max()))
    return (
        f"At {least} from the hit the error of the modes is {low} to {high} of a response, at {most} "
        f"{percent(float(far['error'].median()))} in the median."
    )
