"""The modes, the responses they were identified from, and the diagram they were found in."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd

from metro.report.content import Heading, Item, Picture, Table
from metro.report.figures import modal as figures
from metro.report.numbers import percent, quantity
from metro.report.sections.measured import count_of
from metro.units import JSON

LONGEST = 30
KEYS = (
    ("frequency", "frequency (Hz)"),
    ("damping", "damping ratio"),
    ("stiffness", "stiffness (N/m)"),
    ("mass", "mass (kg)"),
)


def modes(found: list[JSON], tables: Mapping[str, pd.DataFrame]) -> list[Item]:
    """Write the block ``modes`` of ``identified.json``, and figures of ``frf_used`` and ``stabilisation``."""
    if not found:
        return []
    header = ["position", "direction", *(name for _, name in KEYS)]
    caption = "Modes with 95 % intervals; the frequency is the undamped one."
    if any(not mode.get("resolved", True) for mode in found):
        caption += " * not resolved: the data tell damping or stiffness no better than to a third."
    if len(found) > LONGEST:
        caption += f" The first {LONGEST} of {len(found)} are shown; identified.json has all."
    rows = [_row(mode) for mode in found[:LONGEST]]
    items: list[Item] = [Heading("Modes"), Table(header, rows, caption, [0.7, 0.8, 1.3, 1.5, 1.8, 1.4])]
    drawn = _magnitudes(tables.get("frf_used"))
    if drawn is None:
        return items
    alt = f"Measured frequency responses ({len(drawn)} lines) with the modal model over them."
    caption = "Measured frequency responses and what the modes reconstruct"
    if "error" in drawn:
        most = percent(float(drawn["error"].max()))
        caption = f"The modes leave at most {most} of a response. {caption} (in brackets: what they leave)"
    items.append(Picture(figures.responses(drawn), f"{caption}.", alt))
    diagram = tables.get("stabilisation")
    if diagram is not None:
        poles = int(diagram["recurs"].sum())
        caption = (
            f"{poles} of {len(diagram)} poles recur and make {count_of(len(found), 'mode')}. Stabilisation "
            "diagram: the poles of every model order; one that recurs at a quarter of them, "
            "with like frequency, damping and shape starts a mode of the maximum-likelihood fit."
        )
        alt = f"Poles of {diagram['order'].nunique()} model orders over frequency."
        items.append(Picture(figures.stabilisation(diagram, drawn), caption, alt))
    return items


def _row(mode: JSON) -> list[str]:
    mark = "" if mode.get("resolved", True) else " *"
    values = [quantity(mode[key], with_unit=False) if mode.get(key) else "–" for key, _ in KEYS]
    return [f"{mode.get('position', '–')}{mark}", str(mode.get("direction", "–")), *values]


def _magnitudes(frf: pd.DataFrame | None) -> pd.DataFrame | None:
    """Magnitudes of measured and reconstructed receptance, where the table has both."""
    pairs = {"measured_m_n": ("real_m_n", "imag_m_n"), "modal_m_n": ("modal_real_m_n", "modal_imag_m_n")}
    if frf is None or not {c for pair in pairs.values() for c in pair} <= set(frf.columns):
        return None
    return frf.assign(**{name: (frf[re] ** 2 + frf[im] ** 2) ** 0.5 for name, (re, im) in pairs.items()})
