"""Flatness of the faces: indices, raw and corrected for noise, filter, noise, minimum zone, maps."""

from __future__ import annotations

import math

import pandas as pd

from metro.report.content import Bullets, Item, Paragraph, Picture, Section, Table, common, gathered
from metro.report.figures import surface as figures
from metro.report.numbers import listing, number, with_interval
from metro.report.results import Results

LONGEST = 24
RAW = {"xm": "X_m", "xa": "X_a", "xg": "X_g", "percentile_range": "P0.1 … P99.9"}
ISO = {"fltt": "FLTt", "fltp": "FLTp", "fltv": "FLTv", "fltq": "FLTq", "minimum_zone": "minimum zone"}


def flatness(results: Results) -> Section | None:
    """Write the results from the scans of faces; None for a batch without any."""
    table = results.tables.get("face_indices")
    if table is None:
        return None
    predicted = {
        run: face["xm_predicted"]["value"]
        for run, face in (results.identified.get("faces") or {}).items()
        if isinstance(face, dict) and face.get("xm_predicted")
    }
    faces = {str(run): part.set_index("index_name") for run, part in table.groupby("run", sort=False)}
    contacts = results.tables.get("face_contacts")
    items: list[Item] = [
        *_indices(faces, RAW, _about_raw(), predicted),
        *_indices(faces, ISO, _about_filtered(faces)),
        *_by_noise_alone(faces),
        *_noise(faces),
        *_zones(faces, contacts),
        *_maps(results, contacts),
    ]
    return Section("Flatness", items)


def noise_of_faces(results: Results) -> list[Item]:
    """Say for which faces the noise of the scan accounts for the flatness."""
    table = results.tables.get("face_indices")
    parts = {} if table is None else dict(tuple(table.groupby("run", sort=False)))
    return _by_noise_alone({str(run): part.set_index("index_name") for run, part in parts.items()})


def _indices(
    faces: dict[str, pd.DataFrame],
    names: dict[str, str],
    about: str,
    predicted: dict[str, float] | None = None,
) -> list[Item]:
    """Tabulate indices, each raw and corrected with its interval, a row per face."""
    shown = [name for name in names if any(name in part.index for part in faces.values())]
    if not shown:
        return []
    rows = []
    for run, part in list(faces.items())[:LONGEST]:
        cells = [cell for name in shown for cell in _read_and_corrected(part, name)]
        rows.append([run, *cells, *([number(predicted.get(run))] if predicted else [])])
    header = ["run", *(title for name in shown for title in (names[name], "corrected"))]
    header += ["X_m predicted"] if predicted else []
    said = about + (f" The first {LONGEST} of {len(faces)} faces." if len(faces) > LONGEST else "")
    return [Table(header, rows, said, [0] * len(header), numeric=list(range(1, len(header))), small=True)]


def _read_and_corrected(part: pd.DataFrame, name: str) -> tuple[str, str]:
    if name not in part.index:
        return "–", "–"
    value, corrected, low, high = _numbers(part, name, "value_um", "corrected_um", "low_um", "high_um")
    if not math.isfinite(high):
        return number(value), "–"
    return number(value), with_interval(corrected, [low, high])


def _numbers(part: pd.DataFrame, name: str, *columns: str) -> list[float]:
    return [float(part[column].to_numpy(float)[list(part.index).index(name)]) for column in columns]


def _about_raw() -> str:
    return (
        "Flatness of the points as scanned, unfiltered, orthogonal to their least-squares plane (µm): as "
        "read, and of the surface under the noise with its 95 % interval. X_m is the range, X_a the "
        "mean and X_g the geometric mean of the absolute deviations."
    )


def _about_filtered(faces: dict[str, pd.DataFrame]) -> str:
    nesting = sorted(float(part["nesting_index_mm"].iloc[0]) for part in faces.values())
    known = list(dict.fromkeys(number(value, 2) for value in nesting if math.isfinite(value)))
    if not known:
        return (
            "Minimum zone of the points (µm): too few of them for an areal filter, so the parameters of "
            "ISO 12781 are not stated."
        )
    return (
        "Flatness by ISO 12781 of the surface through an areal Gaussian filter (ISO 16610-61), nesting index "
        f"{listing(known)} mm (µm): FLTt total, FLTp peak, FLTv valley, FLTq rms, about the least-squares "
        "plane; and the minimum zone, whose upper and lower bound agree."
    )


def _by_noise_alone(faces: dict[str, pd.DataFrame]) -> list[Item]:
    """Name the faces whose X_m is noise: all of it, or most of it if no filter removed some."""
    said = []
    for run, part in faces.items():
        value, bias, corrected, low, high, sigma = _numbers(
            part, "xm", "value_um", "bias_um", "corrected_um", "low_um", "high_um", "sigma_um"
        )
        unfiltered = not math.isfinite(float(part["nesting_index_mm"].iloc[0]))
        alone = low <= 0.0
        if not high > 0 or not (alone or (unfiltered and bias > value / 2)):
            continue
        face = with_interval(corrected, [low, high])
        judged = "cannot be distinguished from flat" if alone else "accounts for the remainder"
        said.append(
            f"{run}: X_m reads {number(value)} µm, but {number(bias)} µm of that is what noise of "
            f"{number(sigma, 2)} µm per point makes of {int(part['points'].iloc[0])} points. The face "
            f"itself {judged}: X_m {face} µm (95 %)."
        )
    return (
        [Paragraph("Noise, not flatness, is what X_m of these scans reads:", "warning"), Bullets(said)]
        if said
        else []
    )


def _noise(faces: dict[str, pd.DataFrame]) -> list[Item]:
    """Tabulate noise and its source, points, rejections and the crop."""
    rows = []
    for run, part in list(faces.items())[:LONGEST]:
        first = part.iloc[0]
        rows.append(
            [
                run,
                number(float(first["sigma_um"])),
                str(first["sigma_source"]),
                number(float(first["local_sigma_um"])),
                f"{int(first['points'])}",
                f"{int(first['outliers'])}",
                number(float(first["spacing_mm"])),
                f"{number(float(first['margin_mm']), 2)}{'' if first['crop_holds'] else ' *'}",
            ]
        )
    caption = (
        "Noise of a point (µm) and its source; the part that differs from point to point (local); number of "
        "points within the crop and of rejected points; pitch and crop (mm)."
    )
    if not all(part["crop_holds"].iloc[0] for part in faces.values()):
        caption += " * With one more millimetre cropped X_m changes by more than 5 %: the edge rules it."
    header, rows, same = common(
        ["run", "noise", "source", "local", "points", "rejected", "pitch", "crop"], rows
    )
    numeric = [i for i, name in enumerate(header) if name not in ("run", "source")]
    return [Table(header, gathered(rows), caption + same, numeric=numeric, small=True)]


def _zones(faces: dict[str, pd.DataFrame], contacts: pd.DataFrame | None) -> list[Item]:
    """Name the points that bound the minimum zones."""
    if contacts is None:
        return []
    rows = []
    for run in list(faces)[:LONGEST]:
        part = contacts[contacts["run"] == run]
        places = [
            "; ".join(f"({r.x_mm:.1f}, {r.y_mm:.1f})" for r in part[part["side"] == side].itertuples())
            for side in ("upper", "lower")
        ]
        rows.append([run, *places])
    caption = "Points that the two planes of the minimum zone touch: x, y (mm)."
    return [Table(["run", "upper plane", "lower plane"], rows, caption, [0.5, 2, 2], small=True)]


def _maps(results: Results, contacts: pd.DataFrame | None) -> list[Item]:
    frame = results.tables.get("face_map")
    if frame is None:
        return []
    number_of = frame["run"].nunique()
    heights, runs = frame["deviation_um"].to_numpy(float), frame["run"].to_numpy()
    low, high = int(heights.argmin()), int(heights.argmax())
    caption = (
        f"The deviations range from −{number(-heights[low])} µm ({runs[low]}) to +{number(heights[high])} µm "
        f"({runs[high]}). Deviation from the least-squares planes; + marks "
        "the highest and the lowest point (µm)"
    )
    caption += f", {figures.MAPS} of {number_of}" if number_of > figures.MAPS else ""
    caption += (
        "; triangles: where the minimum zone touches, upper plane ▲, lower ▼."
        if contacts is not None
        else "."
    )
    alt = f"Maps of the deviation of {min(number_of, figures.MAPS)} faces."
    return [Picture(figures.face_maps(frame, contacts), caption, alt)]
