"""The modes, the responses from which they were identified, and the stabilisation diagram."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd

from metro.report.content import Bullets, Heading, Item, Picture, Table
from metro.report.figures import modal as figures
from metro.report.numbers import number, percent, quantity
from metro.report.phrases import sentence
from metro.report.sections.measured import count_of
from metro.report.sections.mode_positions import over_positions, reconstruction
from metro.units import JSON

LONGEST = 30
FEWEST_POINTS = 3  # that make a shape
ALIKE = 0.9  # MAC from which on two shapes count as the same
KEYS = (
    ("frequency", "frequency (Hz)"),
    ("damping", "damping ratio"),
    ("stiffness", "stiffness (N/m)"),
    ("mass", "mass (kg)"),
)


def modes(identified: list[JSON], tables: Mapping[str, pd.DataFrame]) -> list[Item]:
    """Write the block ``modes`` of ``identified.json``, and figures of ``frf_used`` and ``stabilisation``."""
    if not identified:
        return []
    positions = list(dict.fromkeys(str(mode.get("position")) for mode in identified))
    shown = [mode for mode in identified if len(positions) == 1 or str(mode.get("position")) == positions[0]]
    header = ["position", "direction", *(name for _, name in KEYS)]
    caption = "Modes with 95 % intervals; the frequency is the undamped one."
    if any(not mode.get("resolved", True) for mode in shown):
        caption += " * not resolved: damping or stiffness is known no better than to a third."
    rows = [_row(mode) for mode in shown[:LONGEST]]
    if len(rows) < len(identified):
        caption += f" The first {len(rows)} of {len(identified)} are shown; identified.json has all."
    items: list[Item] = [Heading("Modes"), Table(header, rows, caption, [0.7, 0.8, 1.3, 1.5, 1.8, 1.4])]
    notes = tables.get("mode_notes")
    if notes is not None and len(notes):
        items.append(Bullets([sentence(str(note)) for note in notes["note"]]))
    drawn, diagram = _magnitudes(tables.get("frf_used")), tables.get("stabilisation")
    if drawn is not None:
        diagrams = [] if diagram is None else [_diagram(_of(diagram, positions), drawn, len(shown))]
        items += [_responses(drawn), *diagrams]
    residues, alike = tables.get("mode_shapes"), tables.get("mode_mac")
    if residues is not None and alike is not None:
        items += _shapes(_of(residues, positions), _of(alike, positions))
    return [*items, *reconstruction(tables), *over_positions(tables)]


def _of(table: pd.DataFrame, positions: list[str]) -> pd.DataFrame:
    """Return the rows of the first of several positions: of the others, figures follow that have them all."""
    return table if len(positions) == 1 else table[table["position"].astype(str) == positions[0]]


def _responses(drawn: pd.DataFrame) -> Picture:
    alt = f"Measured frequency responses ({len(drawn)} lines) with the modal model over them."
    caption = "Measured frequency responses and the modal model"
    if "error" in drawn:
        most = percent(float(drawn["error"].max()))
        caption = (
            f"The error of the modal model is at most {most} of a response. {caption} (error in brackets)"
        )
    return Picture(figures.responses(drawn), f"{caption}.", alt)


def _diagram(diagram: pd.DataFrame, drawn: pd.DataFrame, mode_count: int) -> Picture:
    poles = int(diagram["recurs"].sum())
    caption = (
        f"{poles} of {len(diagram)} poles recur and make {count_of(mode_count, 'mode')}. Stabilisation "
        "diagram: the poles of every model order; one that recurs at a quarter of them, "
        "with like frequency, damping and shape starts a mode of the maximum-likelihood fit."
    )
    alt = f"Poles of {diagram['order'].nunique()} model orders over frequency."
    return Picture(figures.stabilisation(diagram, drawn), caption, alt)


def largest_response(tables: Mapping[str, pd.DataFrame]) -> list[Item]:
    """Draw the response with the highest peak, of the driving points if there are any; else nothing."""
    drawn = _magnitudes(tables.get("frf_used"))
    if drawn is None:
        return []
    pair = ["position", "reference", "response"]
    driving = (drawn["reference"] == drawn["response"]) & _accepted(tables.get("modes"))
    drawn = drawn[driving] if driving.any() else drawn
    highest = drawn.loc[drawn.groupby(pair)["measured_m_n"].idxmax()].nlargest(1, "measured_m_n").iloc[0]
    part = drawn[(drawn[pair] == highest[pair]).all(axis=1)]
    what = "response of a driving point" if driving.any() else "response"
    about = (
        f"The highest {what}, {number(highest['measured_m_n'])} m/N at "
        f"{number(highest['frequency_hz'], 4)} Hz. Measured response and modal model."
    )
    return [Picture(figures.responses(part), about, about)]


def _accepted(modes: pd.DataFrame | None) -> bool:
    """Return whether a driving point was taken for one: then a mode has a stiffness."""
    return modes is None or bool(modes["stiffness_n_m"].notna().any())


def _shapes(residues: pd.DataFrame, alike: pd.DataFrame) -> list[Item]:
    """Draw the shapes of the modes of each direction with hits or responses at several points."""
    items: list[Item] = []
    by = ["position", "direction"]
    of_direction = dict(tuple(alike.groupby(by)))
    for key, of_pairs in residues.groupby(by, sort=False):
        part = _along_one(of_pairs)
        if len(part["point"].unique()) < FEWEST_POINTS:
            continue
        close = of_direction[key]
        above = close[(close["first_hz"] < close["second_hz"]) & (close["mac"] > ALIKE)]
        total = part["frequency_hz"].nunique()
        pairs = total * (total - 1) // 2
        close_ones = ": more points would distinguish them" if len(above) else ""
        about = (
            f"Like shapes (MAC over {ALIKE:g}) have {len(above) or 'none'} of {pairs} pairs of modes at the "
            f"{part['point'].nunique()} points of position {key[0]}, direction {key[1]}{close_ones}. "
            "Shapes of the modes, and the modal assurance criterion of every two."
        )
        items.append(Picture(figures.shapes(part, close), about, about))
    return items


def _along_one(residues: pd.DataFrame) -> pd.DataFrame:
    """Return the residues by ``point``, of the hits at most points or of the responses at most points.

    Where both rove, the shape is that along the one with more points, seen from the point of the other one
    that has most of them.
    """
    roving, fixed = "response", "reference"
    if residues[roving].nunique() < residues[fixed].nunique():
        roving, fixed = fixed, roving
    seen_from = residues.groupby(fixed, sort=False)[roving].nunique().idxmax()
    part = residues[residues[fixed] == seen_from]
    return part.assign(point=part[roving])


def _row(mode: JSON) -> list[str]:
    mark = "" if mode.get("resolved", True) else " *"
    values = [quantity(mode[key], with_unit=False) if mode.get(key) else "–" for key, _ in KEYS]
    return [f"{mode.get('position', '–')}{mark}", str(mode.get("direction", "–")), *values]


def _magnitudes(frf: pd.DataFrame | None) -> pd.DataFrame | None:
    """Magnitudes of measured and reconstructed receptance, if the table has both."""
    pairs = {"measured_m_n": ("real_m_n", "imag_m_n"), "modal_m_n": ("modal_real_m_n", "modal_imag_m_n")}
    if frf is None or not {c for pair in pairs.values() for c in pair} <= set(frf.columns):
        return None
    return frf.assign(**{name: (frf[re] ** 2 + frf[im] ** 2) ** 0.5 for name, (re, im) in pairs.items()})
