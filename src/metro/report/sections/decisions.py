"""Decisions on tolerances and the cuts to use: a line on page one, and a section."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace

from metro.report.content import Heading, Item, Paragraph, Section, Table
from metro.report.numbers import listing, number, probability, quantity
from metro.report.results import Results
from metro.units import JSON, printed

NAMES = {
    "flatness": "flatness (minimum zone)",
    "ra": "roughness Ra",
    "rz": "roughness Rz",
    "force": "peak force",
    "wall_error": "wall error",
    "stable_depth": "lowest stable depth",
}
WORDS = {"conforms": "conforms", "does_not_conform": "does not conform", "undecided": "undecided"}
FIRST = ("does_not_conform", "undecided", "conforms")  # order of the rows
MOST = 16  # rows
LISTEN = " Begin at half the depth and listen."
WHY = {
    "tests_confirm_the_band": "The test cuts below the limit of this boundary were stable.",
    "struck_in_one_direction": (
        "Do not use these cuts: the tool was struck in one direction only, and the boundary takes it as "
        "rigid in the other. Strike it in both."
    ),
    "force_not_known": "Do not use these cuts: the interval of K_tc includes zero.",
    "no_test_below_the_band": f"No test cut confirms this boundary.{LISTEN}",
    "no_test_at_such_a_speed": f"The test cuts were made at other speeds.{LISTEN}",
    "too_few_tests": f"Too few test cuts confirm this boundary.{LISTEN}",
    "tests_chatter_below_the_band": "Do not use these cuts: test cuts below the limit chattered.",
    "verdict_unexplained": "Do not use these cuts: the tests contradict the boundary for an unknown reason.",
    "verdict_undetermined": "Do not use these cuts: the tests do not determine why the boundary is wrong.",
    "verdict_contradicted": "Do not use these cuts: the data contradict what the batch declares.",
}
ADVICE = {"use": "use", "try": "try carefully", "do_not": "do not use"}


def with_decisions(first: Section, results: Results) -> Section:
    """Return the first page with one line on the tolerances and one on the best cut, where there are any."""
    lines = [*decided(results.verdict), *best_cut(results.verdict)]
    return (
        replace(first, items=[first.items[0], *map(Paragraph, lines), *first.items[1:]]) if lines else first
    )


def decided(verdict: JSON) -> list[str]:
    """Say in one line how many results conform; nothing where the batch states no tolerance."""
    judged: Sequence[JSON] = verdict.get("decisions") or []
    if not judged:
        return []
    counts = Counter(entry["decision"] for entry in judged)
    parts = [f"{counts[name]} {WORDS[name] if counts[name] == 1 else _plural(name)}" for name in FIRST]
    shown = [part for part, name in zip(parts, FIRST, strict=True) if counts[name]]
    failed = sorted({_name(entry) for entry in judged if entry["decision"] == "does_not_conform"})
    where = f" Not conforming: {', '.join(failed)}." if failed else ""
    return [f"Conformity (ISO 14253-1): of {len(judged)} results, {', '.join(shown)}.{where}"]


def _plural(name: str) -> str:
    return {"conforms": "conform", "does_not_conform": "do not conform"}.get(name, WORDS[name])


def advised_cuts(verdict: JSON) -> dict[str, JSON]:
    """Return of each position the cut that removes most and is not advised against."""
    cuts = [cut for cut in verdict.get("recommended_cuts") or [] if cut["advice"] != "do_not"]
    return {str(cut["position"]): cut for cut in sorted(cuts, key=lambda cut: cut["removal_cm3_min"])}


def least_of(cuts: Mapping[str, JSON]) -> JSON:
    """Return the cut of the position that bears least."""
    return min(cuts.values(), key=lambda cut: cut["removal_cm3_min"])


def best_cut(verdict: JSON) -> list[str]:
    """Say the cut that removes most and is not advised against, at the position that bears least.

    A part is seldom cut at one position alone.
    """
    of_position = advised_cuts(verdict)
    if not of_position:
        return []
    best = least_of(of_position)
    most = max(of_position.values(), key=lambda cut: cut["removal_cm3_min"])
    where = f"position {best['position']}"
    if len(of_position) > 1:
        where += (
            f", which bears least of {len(of_position)}; position {most['position']} bears "
            f"{number(most['axial_depth_mm'], 2)} mm at {number(most['spindle_rpm'], 4)} rpm"
        )
    sure = probability(best["probability_stable"])
    reach = ", as deep as these runs let one judge" if best.get("at_reach") else ""
    return [
        f"Recommended cut: {number(best['spindle_rpm'], 4)} rpm, {number(best['axial_depth_mm'], 2)} mm deep"
        f"{reach} ({where}): stable with probability {sure} or more, "
        f"{number(best['removal_cm3_min'], 2)} cm³/min, {number(best['torque_nm'], 2)} N m. "
        f"{WHY[best['why']]}"
    ]


def decisions(results: Results) -> Section | None:
    """Write the section of decisions and recommended cuts; None where there are neither."""
    items = [*_conformity(results.verdict), *_cuts(results.verdict)]
    return Section("Decisions", items) if items else None


def _conformity(verdict: JSON) -> list[Item]:
    judged = sorted(
        verdict.get("decisions") or [],
        key=lambda entry: (FIRST.index(entry["decision"]), entry["probability"] or 0.0),
    )
    if not judged:
        return []
    rows = [
        [
            _name(entry),
            str(entry["where"] or "–"),
            quantity({"value": entry["value"], "ci95": entry["ci95"]}, with_unit=False),
            _limit(entry["lower"]),
            _limit(entry["upper"]),
            printed(entry["unit"]),
            WORDS[entry["decision"]],
            probability(entry["probability"]),
        ]
        for entry in judged[:MOST]
    ]
    more = f" The {len(judged) - MOST} others are in verdict.json." if len(judged) > MOST else ""
    caption = (
        "Results against their tolerances. A result conforms if its whole 95 % interval lies within the "
        "limits, and does not conform if the whole interval lies outside (ISO 14253-1, guard band U). "
        f"The last column is the probability that the quantity is within its limits.{more}"
    )
    header = ["quantity", "run", "value ± U", "lower", "upper", "unit", "decision", "probability"]
    strong = [i for i, entry in enumerate(judged[:MOST]) if entry["decision"] == "does_not_conform"]
    table = Table(
        header, rows, caption, [2, 1, 1.6, 1, 1, 0.8, 1.6, 1.2], numeric=[2, 3, 4, 7], strong=strong
    )
    return [Heading("Conformity with tolerances"), table]


def _cuts(verdict: JSON) -> list[Item]:
    cuts: Sequence[JSON] = verdict.get("recommended_cuts") or []
    if not cuts:
        return []
    bent = any(cut.get("bending_nm") is not None for cut in cuts[:MOST])
    rows = [
        [
            str(cut["position"]),
            *(_numbers(cut, names) for names in COLUMNS.values()),
            ADVICE[str(cut["advice"])],
        ]
        for cut in cuts[:MOST]
    ]
    caption = (
        "Cuts that are stable with a probability of 0.975 or more, at the lower end of the depth's band. "
        f"Torque and power are means over a revolution; {BENDING if bent else ''}chatter is the frequency "
        "that would be heard beyond the boundary."
    )
    table = Table(
        ["position", *(TORQUE if name == BENT and not bent else name for name in COLUMNS), "advice"],
        rows,
        caption,
        [1, 0.8, 0.8, 0.8, 1.2, 1.3, 0.9, 0.9, 1.3],
        numeric=list(range(1, 8)),
    )
    return [Heading("Recommended cuts"), Paragraph(_reasons(cuts)), table]


def _reasons(cuts: Sequence[JSON]) -> str:
    """Say why cuts have their advice; of which rows, where they have several."""
    given: dict[str, list[JSON]] = {}
    for cut in cuts:
        given.setdefault(WHY[str(cut["why"])].removesuffix(LISTEN), []).append(cut)
    listen = LISTEN if any(WHY[str(cut["why"])].endswith(LISTEN) for cut in cuts) else ""
    if len(given) == 1:
        return f"{next(iter(given))}{listen}"
    said = [f"Position {listing(_rows_of(of, cuts))}: {text}" for text, of in given.items()]
    return f"{' '.join(said)}{listen}"


def _rows_of(some: Sequence[JSON], cuts: Sequence[JSON]) -> list[str]:
    """Name the rows of some cuts: their positions, with the speeds where these are not all of a position."""
    rows = []
    for position in dict.fromkeys(str(cut["position"]) for cut in some):
        mine, every = (
            [number(cut["spindle_rpm"], 4) for cut in each if str(cut["position"]) == position]
            for each in (some, cuts)
        )
        rows.append(position if len(mine) == len(every) else f"{position} at {listing(mine)} rpm")
    return rows


TORQUE, BENT = "torque (N m)", "torque, bending (N m)"
BENDING = "bending is the largest moment at the holder; "
# Title of a column → the entries of a recommended cut in it, each with its digits.
COLUMNS = {
    "speed (rpm)": {"spindle_rpm": 4},
    "depth (mm)": {"axial_depth_mm": 2},
    "feed (mm)": {"feed_per_tooth_mm": 2},
    "removal (cm³/min)": {"removal_cm3_min": 2},
    BENT: {"torque_nm": 2, "bending_nm": 2},
    "power (kW)": {"power_kw": 2},
    "chatter (Hz)": {"chatter_hz": 3},
}


def _numbers(cut: Mapping[str, object], names: Mapping[str, int]) -> str:
    """Write the entries of a column of a cut, those that are known."""
    known = [number(_float(cut[name]), digits) for name, digits in names.items() if cut.get(name) is not None]
    return ", ".join(known) or "–"


def _float(value: object) -> float:
    return float(value) if isinstance(value, int | float) else float("nan")


def _name(entry: JSON) -> str:
    name = str(entry["quantity"])
    return NAMES.get(name, name)


def _limit(value: float | None) -> str:
    return "–" if value is None else f"{value:g}".replace("-", "−")
