"""All eight configurations of a milling arm, repeated: how predicted faces come up to the scanned ones.

Not blind: the arm yields more in the cut than in its load tests and its spindle is tilted. Half of the
configurations are held out; the similarity of the X_m of their predicted faces to that of the scans is given
before and after the loop.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass

import pandas as pd

from metro.report.sections.face_pairing import by_face
from metro.units import JSON
from proof.layout import Layout
from proof.run import run
from proof.statistics import Demand, Figure, median
from proof.tables import Table, tabulated
from virtual_cell.recipes.faces import make_eight_cases

BATCH = "eight-cases"
HIDDEN: dict[str, JSON] = {
    "stiffness_scale": {"factor": 0.72},
    "spindle_tilt": {"about_x_mrad": 2.6, "about_y_mrad": -1.9},
}
DEMAND = Demand(0.95)  # of the median similarity; the published faces have 0.57 to 0.97


@dataclass(frozen=True)
class Likeness:
    """A held-out face: its case, X_m as measured (mm), and the similarity before and after the loop."""

    run: str
    case: str
    measured: float
    before: float
    after: float


def likenesses(comparison: pd.DataFrame, runs: pd.DataFrame) -> list[Likeness]:
    """Return the similarity of every held-out face, as the report states it.

    Parameters
    ----------
    comparison : rows of comparison.parquet. runs : runs.csv, by run.
    """
    faces = by_face(comparison[comparison["observable"] == "flatness"])
    figures = faces[["measured", "similar_before", "similar_after"]].to_numpy(dtype=float) / [
        1.0,
        100.0,
        100.0,
    ]
    return [
        Likeness(str(run), str(runs.loc[run, "condition"]), *row)
        for run, row in zip(faces["run"], figures.tolist(), strict=True)
    ]


def eight_cases(out: Layout, seed: int, replicates: int) -> tuple[list[Likeness], JSON]:
    """Make the batch, run the pipeline on it; return the similarity of the held-out faces, and the verdict.

    Raises
    ------
    RuntimeError
        The pipeline failed; the reason is in the batch's ``failed.txt``.
    """
    make_eight_cases(out.raw / BATCH, HIDDEN, seed, replicates)
    if run(out, 1, keep=False, pdf=False):
        raise RuntimeError(f"the pipeline failed: see {out.reports / BATCH / 'failed.txt'}")
    runs = pd.read_csv(out.raw / BATCH / "runs.csv").set_index("run")
    comparison = pd.read_parquet(out.processed / BATCH / "comparison.parquet")
    verdict = json.loads((out.reports / BATCH / "verdict.json").read_text())["observables"]["flatness"]
    return likenesses(comparison, runs), verdict


def figures(held_out: Sequence[Likeness]) -> list[Figure]:
    """Return the median similarity before and after the loop, and what is demanded of it."""
    return [
        median("similarity of X_m, base model", [one.before for one in held_out], unit="%"),
        median("similarity of X_m, with what the loop found", [one.after for one in held_out], DEMAND, "%"),
    ]


def tables(held_out: Sequence[Likeness], verdict: JSON) -> list[Table]:
    """Return the figures, and a table of the held-out faces."""
    named = ", ".join(str(one["effect"]) for one in verdict["effects"]) or "nothing"
    note = f"Hidden: {', '.join(HIDDEN)}. Verdict: {verdict['status']}; found: {named}."
    rows = [
        (one.run, one.case, f"{one.measured:.3f}", f"{100 * one.before:.1f} %", f"{100 * one.after:.1f} %")
        for one in sorted(held_out, key=lambda one: one.case)
    ]
    header = ("run", "case", "X_m measured, mm", "similar before", "similar after")
    return [tabulated("Faces of eight cases", figures(held_out), note), Table("Held-out faces", header, rows)]
