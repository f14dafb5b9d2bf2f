"""What batches can be compared by: the quantities that each identified, as data for the page."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence

from metro.batch.batch import Batch
from metro.observables.catalogue import title
from metro.report.numbers import quantity
from metro.report.page.curves import HELP
from metro.report.page.frame import section
from metro.report.page.markup import Html, embedded, tag
from metro.report.page.packing import decimals
from metro.report.results import Results
from metro.report.sections.key_results import COEFFICIENTS, FORCE_SETS, receptance_peak
from metro.units import JSON, printed

TITLE = "Compare two batches"
TRENDS = "Trends over batches"
ORDER = "The batches are in the order in which their first runs began; those that do not say it come last."
Quantity = tuple[str, JSON]


def compare_section(batches: Sequence[tuple[Batch, list[JSON]]]) -> list[tuple[str, Html]]:
    """Write the sections, with their titles, that compare batches: two of them, and all by each quantity.

    Nothing where fewer than two have quantities, and no trend where no quantity is that of two.
    """
    dated = sorted(batches, key=lambda pair: (_began(pair[0]), pair[0].name))
    known = {batch.name: rows for batch, rows in dated if rows}
    if len(known) < 2:
        return []
    data = tag("script", embedded(known), type="application/json", class_="compared")
    sections = [(TITLE, section(TITLE, tag("div", class_="compare"), data))]
    if max(Counter(row["name"] for rows in known.values() for row in rows).values()) > 1:
        trend = tag("div", class_="trends", data_help=HELP, data_note=ORDER)
        sections.append((TRENDS, section(TRENDS, trend)))
    return sections


def _began(batch: Batch) -> float:
    started = batch.started
    return math.inf if started is None else started


def quantities(results: Results) -> list[JSON]:
    """Return name, text, value and half of the 95 % interval (or None) of what was identified of a batch."""
    found = [
        *_coefficients(results.identified.get("force") or {}),
        *_softest(results.identified.get("modes") or []),
        *_boundary(results.identified.get("lobes") or []),
        *_joints(results.identified.get("arm") or {}),
        *_faces(results.identified.get("faces") or {}),
        *_errors(results),
    ]
    return [_entry(name, entry) for name, entry in found if entry.get("value") is not None]


def _entry(name: str, entry: JSON) -> JSON:
    low, high = entry.get("ci95") or (None, None)
    half = None if low is None or high is None else 0.5 * (float(high) - float(low))
    value = float(entry["value"])
    unit, digits = printed(entry.get("unit")), decimals(half if half is not None else math.nan, abs(value))
    return {
        "name": name, "text": quantity(entry), "value": value, "half": half, "unit": unit, "decimals": digits
    }  # fmt: skip


def _coefficients(force: JSON) -> Iterator[Quantity]:
    block: JSON = next((force[name] for name in FORCE_SETS if force.get(name)), {})
    for symbols in COEFFICIENTS.values():
        yield from ((symbol, block[key]) for key, symbol in symbols.items() if key in block)


def _softest(modes: list[JSON]) -> Iterator[Quantity]:
    mode: JSON = max(modes, key=receptance_peak, default={})
    for part in ("frequency", "damping", "stiffness"):
        if entry := mode.get(part):
            yield f"most flexible mode: {part}", entry


def _boundary(lobes: list[JSON]) -> Iterator[Quantity]:
    depths = [block["lowest_mm"] for block in lobes if isinstance(block.get("lowest_mm"), dict)]
    known = [depth for depth in depths if depth.get("value") is not None]
    if known:
        yield "lowest stable depth", min(known, key=lambda depth: float(depth["value"]))


def _joints(arm: JSON) -> Iterator[Quantity]:
    for i, entry in enumerate(arm.get("joint_stiffness") or [], 1):
        if isinstance(entry, dict):
            yield f"stiffness of joint {i}", entry


def _faces(faces: JSON) -> Iterator[Quantity]:
    known = [face for face in faces.values() if isinstance(face, dict) and face.get("xm")]
    key, name = ("fltt", "FLTt") if known and all(face.get("fltt") for face in known) else ("xm", "X_m")
    values = sorted((face[key] for face in known), key=lambda entry: float(entry["value"]))
    if values:
        yield f"{name} of the flattest face", values[0]
        yield f"{name} of the least flat face", values[-1]


def _errors(results: Results) -> Iterator[Quantity]:
    for observable, entry in results.verdicts().items():
        error = entry.get("after") or {}
        unit = printed(entry.get("unit"))
        yield (
            f"error on held-out runs: {title(observable)}",
            {"value": error.get("rms"), "ci95": error.get("ci95"), "unit": unit or "1"},
        )
