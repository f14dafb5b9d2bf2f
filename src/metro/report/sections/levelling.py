"""Flatness of faces by slopes: indices with their intervals, the closure of the loops, and the heights."""

from __future__ import annotations

from metro.report.content import Bullets, Facts, Item, Paragraph, Picture, Section, Table
from metro.report.figures import levelling as figures
from metro.report.numbers import number, quantity
from metro.report.results import Results
from metro.units import JSON

INDICES = {
    "minimum_zone": "minimum zone",
    "fltt": "FLTt",
    "fltp": "FLTp",
    "fltv": "FLTv",
    "fltq": "FLTq",
}
MOST_FACTS = 3
ABOUT = (
    "Flatness in µm of the stations' heights, which least squares over all loops give from the slopes: "
    "distance of the two closest parallel planes, and deviations from the least-squares plane (ISO 12781). "
    "The 95 % intervals contain the noise of the readings. They do not contain what lies between stations, "
    "bending of the face during the measurement, or a wrong distance of the feet, which scales all heights."
)


def levelling(results: Results) -> Section | None:
    """Write the flatness of the faces that were levelled; None for a batch without any."""
    block = results.identified.get("levelling") or {}
    faces = {run: face for run, face in block.items() if run != "not_identified"}
    items: list[Item] = []
    if faces:
        rows = [
            [run, *(quantity(face[name], with_unit=False) for name in INDICES)] for run, face in faces.items()
        ]
        items.append(
            Table(["run", *INDICES.values()], rows, ABOUT, [0.6, *([1.2] * len(INDICES))], small=True)
        )
        caption = (
            "Noise of a reading, and closure: the scatter of the residuals where loops are closed. One "
            "degree of freedom is one reading more than the heights need."
        )
        header = ["run", "readings", "lines", "stations", "degrees of freedom"]
        header += ["closure, µrad", "noise, µrad", "noise by"]
        about = [[run, *_about(face)] for run, face in faces.items()]
        items.append(Table(header, about, caption, [0.6, 0.8, 0.6, 0.8, 0.9, 0.9, 0.9, 1.8], small=True))
        said = [f"{run}: {note}." for run, face in faces.items() for note in face["notes"]]
        items += [Bullets(said)] if said else []
    reasons = [f"{run}: {reason}." for run, reason in (block.get("not_identified") or {}).items()]
    items += [Paragraph("No flatness of these readings:"), Bullets(reasons)] if reasons else []
    heights, readings = (results.tables.get(name) for name in ("level_heights", "level_readings"))
    if heights is not None and readings is not None:
        count = heights["run"].nunique()
        most = f", the first {figures.MOST} of {count} faces" if count > figures.MOST else ""
        caption = f"Heights of the stations above the least-squares plane{most}; lines: the readings."
        items.append(Picture(figures.levelled(heights, readings), caption, caption))
    return Section("Flatness by slopes", items) if items else None


def first_levelled(results: Results) -> list[Item]:
    """Give the flatness of the face that was levelled, or the minimum zones of the first of several."""
    block = results.identified.get("levelling") or {}
    faces = {run: face for run, face in block.items() if run != "not_identified"}
    if not faces:
        return []
    facts = [
        (f"minimum zone of {run}", quantity(face["minimum_zone"]), f"{face['points']} stations")
        for run, face in list(faces.items())[:MOST_FACTS]
    ]
    if len(faces) == 1:
        ((run, face),) = faces.items()
        known = face["slope_sigma"]["source"]
        noise = (
            f"noise of a reading {number(face['slope_sigma']['value'])} µrad" if known else "noise not known"
        )
        closure = f"{number(face['closure']['value'])} µrad"
        facts.append((f"FLTt of {run}", quantity(face["fltt"]), "from the least-squares plane"))
        facts.append(("closure of the loops", closure, noise))
    notes = [f"{run}: {note}." for run, face in faces.items() for note in face["notes"]]
    return [Facts(facts), *([Bullets(notes)] if notes else [])]


def _about(face: JSON) -> list[str]:
    noise = face["slope_sigma"]
    counts = [str(face[name]) for name in ("readings", "lines", "points", "degrees_of_freedom")]
    return [*counts, number(face["closure"]["value"]), number(noise["value"]), noise["source"] or "not known"]
