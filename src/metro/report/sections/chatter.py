"""Chatter in the records: every test on the lobes, against labels and prediction, and its roughness."""

from __future__ import annotations

import numpy as np
import pandas as pd

from metro.report.content import Bullets, Heading, Item, Picture, Table, gathered
from metro.report.cuts import deepest_cut, not_drawn
from metro.report.figures import chatter as figures
from metro.report.figures.lobes import POSITIONS
from metro.report.numbers import listing, number, probability, with_interval
from metro.report.results import Results
from metro.report.sections.decisions import advised_cuts
from metro.units import JSON

LONGEST = 30
UNDECIDED = 0.5  # probability of a record that does not decide
NORMAL = 1.96
SURELY = 0.9  # probability from which a cut is said to chatter
KINDS = {
    "hopf": "Hopf",
    "flip": "flip",
    "low_frequency": "mode of the robot",
    "forced": "forced, stable",
    "unknown": "unknown",
}


def chatter_items(results: Results) -> list[Item]:
    """Write the results from the records of the test cuts; nothing if there are no records."""
    tests = _tests(results)
    if tests is None:
        return []
    items: list[Item] = [Heading("Chatter in the records")]
    boundary = results.tables.get("lobes_final")
    if boundary is None and (tests["unstable"] == 0).all() and not tests["wrong_label"].any():
        return [*items, Bullets([f"None of the {len(tests)} records that could be judged shows chatter."])]
    if boundary is not None and tests["position"].notna().any():
        caption = "Test cuts on the stability boundary, classified by their own records"
        caption += ", with the probability of chatter." if len(tests) <= figures.NUMBERED else "."
        cuts, deepest = advised_cuts(results.verdict), deepest_cut(results.batch.manifest)
        known = set(boundary["position"].astype(str).unique()[:POSITIONS])
        caption += " Star: the recommended cut." if known & set(cuts) else ""
        caption += not_drawn(boundary["depth_mm"], deepest)
        chart = figures.tests_chart(boundary, tests, advised=cuts, deepest_mm=deepest)
        items.append(Picture(chart, caption, caption))
    items += [_table(tests, results.batch.manifest), *_confusion(tests), Bullets(_words(tests))]
    return [*items, *_records(results, tests), *_roughness(tests)]


def chatter_flags(results: Results) -> list[str]:
    """Name the cuts that chattered in a batch that does not test stability; its models assume none did."""
    tests = _tests(results) if results.tables.get("lobes_final") is None else None
    if tests is None:
        return []
    loud = tests[tests["unstable"] > 0].sort_values("probability", ascending=False)
    return [_flag(row) for _, row in loud.iterrows()]


def _flag(row: pd.Series) -> str:
    """Say that a cut chatters; below a probability that counts as certain, that it may."""
    how = f"at {number(row['chatter_hz'])} Hz (probability {probability(row['probability'])})"
    if row["probability"] < SURELY:
        return f"{row['run']}: may chatter {how}; it may also be a resonance of the dynamometer"
    return f"{row['run']}: chatters {how}, and no model of the force holds there"


def _tests(results: Results) -> pd.DataFrame | None:
    """Join tests with an evaluated record to the prediction by the lobes of their modes; None without any."""
    table = results.tables.get("chatter_runs")
    if table is None or not table["probability"].notna().any():
        return None
    tests = table[table["probability"].notna()].copy()
    predicted = results.tables.get("lobe_runs")
    columns = ["position", "predicted_hz", "probability_unstable"]
    if predicted is None:
        tests[columns] = None
    else:
        own = predicted[predicted["own_modes"].astype(bool)].drop_duplicates("run")
        tests = tests.join(own.set_index("run")[columns], on="run")
    decided = tests["probability"] != UNDECIDED
    tests["unstable"] = np.where(decided, tests["probability"] > 0.5, -1).astype(int)
    tests["wrong_label"] = decided & (tests["labelled"] >= 0) & (tests["labelled"] != tests["unstable"])
    return tests.reset_index(drop=True)


def _table(tests: pd.DataFrame, manifest: JSON) -> Table:
    teeth = int(manifest["tool"]["teeth"])
    rows = [_row(row, teeth) for _, row in tests.head(LONGEST).iterrows()]
    header = [
        "run",
        "speed (rpm)",
        "depth (mm)",
        "P(chatter)",
        "kind",
        "frequency (Hz)",
        "phase",
        "predicted",
    ]
    more = f" The first {LONGEST} of {len(tests)}." if len(tests) > LONGEST else ""
    caption = (
        "Chatter identified from the records: probability, kind, frequency with its 95 % interval; phase of "
        f"the vibration from tooth to tooth (cycles), and the phase predicted at the boundary.{more}"
    )
    widths = [1.4, 1, 1, 1, 1.5, 1.4, 0.8, 0.8]
    return Table(header, gathered(rows), caption, widths, numeric=[1, 2, 3, 5, 6, 7])


def _row(row: pd.Series, teeth: int) -> list[str]:
    known = np.isfinite(row["chatter_hz"])
    half = NORMAL * float(row["chatter_sd_hz"])
    frequency = with_interval(row["chatter_hz"], [row["chatter_hz"] - half, row["chatter_hz"] + half])
    passing = teeth * row["rpm"] / 60.0
    phases = [
        f"{hz / passing % 1.0:.2f}" if known and pd.notna(hz) else "–"
        for hz in (row["chatter_hz"], row["predicted_hz"])
    ]
    place = [str(row["run"]), number(row["rpm"]), number(row["depth_mm"])]
    return [*place, probability(row["probability"]), KINDS.get(row["kind"], row["kind"]), frequency, *phases]


def _confusion(tests: pd.DataFrame) -> list[Item]:
    """Count records against labels and against the prediction."""
    decided = tests[tests["unstable"] >= 0]
    predicted = pd.Series(np.where(decided["probability_unstable"].astype(float) > 0.5, 1, 0), decided.index)
    others = {
        "label of the operator": decided["labelled"],
        "predicted boundary": predicted.where(decided["probability_unstable"].notna(), -1),
    }
    rows = []
    for name, other in others.items():
        counts = [int(((decided["unstable"] == a) & (other == b)).sum()) for a in (0, 1) for b in (0, 1)]
        if sum(counts):
            right = f"{100 * (counts[0] + counts[3]) / sum(counts):.0f} %"
            rows.append([name, *(str(count) for count in counts), right])
    if not rows:
        return []
    header = [
        "against",
        "both stable",
        "stable by the record alone",
        "chatter by the record alone",
        "both chatter",
    ]
    caption = "Records of the test cuts against their labels and against the prediction."
    return [Table([*header, "agree"], rows, caption, [1.6, 1, 1, 1, 1, 0.8], numeric=[1, 2, 3, 4, 5])]


def _words(tests: pd.DataFrame) -> list[str]:
    """Say which labels the records contradict, and which records do not decide."""
    count = int((tests["unstable"] == 1).sum())
    words = [f"{count} of {len(tests)} records hold chatter."]
    wrong = [str(run) for run in tests["run"][tests["wrong_label"]]]
    if wrong:
        words.append(f"The record contradicts the label of {listing(wrong)}; the record counts.")
    hidden = [str(run) for run in tests["run"][~tests["separable"].astype(bool)]]
    if hidden:
        words.append(
            f"Not separable at this speed: {listing(hidden)}. A line lies on an order of the spindle, where "
            "chatter and runout coincide. Repeat the test at another speed."
        )
    late = [str(run) for run in tests["run"][(tests["unstable"] < 0) & tests["separable"].astype(bool)]]
    if late:
        words.append(
            f"Chatter may begin at the end of the record of {listing(late)}. Repeat with a longer cut."
        )
    return words


def _records(results: Results, tests: pd.DataFrame) -> list[Item]:
    """Show the spectrum and the last turns of a cut that chattered and of one that did not."""
    records = results.tables.get("chatter_records")
    if records is None:
        return []
    kinds = {
        "a cut that chattered": (tests["unstable"] > 0).any(),
        "a stable cut": (tests["unstable"] == 0).any(),
    }
    cuts = " and in ".join(kind for kind, there in kinds.items() if there)
    caption = (
        f"Force in {cuts}: spectrum of the whole steady cut, and the record of its last turns. Chatter "
        "appears between the orders of the spindle."
    )
    chart = figures.records_chart(records, tests, int(results.batch.manifest["tool"]["teeth"]))
    return [Picture(chart, caption, caption)]


def _roughness(tests: pd.DataFrame) -> list[Item]:
    """Compare the roughness of stable and unstable tests."""
    rough = tests[tests["ra_um"].notna() & (tests["unstable"] >= 0)]
    if rough.empty:
        return []
    kinds = (("stable", 0), ("unstable", 1))
    medians = {name: rough["ra_um"][rough["unstable"] == kind].median() for name, kind in kinds}
    listed = ", ".join(f"{name} {number(value)} µm" for name, value in medians.items() if np.isfinite(value))
    caption = f"Roughness of stable and unstable tests; dashed: medians. Median Ra: {listed}."
    return [Picture(figures.roughness_chart(rough), caption, caption)]
