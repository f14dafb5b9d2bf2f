"""The reliability of a batch's results: accuracy, tested cuts, and identified or only possible causes."""

from __future__ import annotations

import math

import pandas as pd

from metro.report.cuts import NAMES, NUMBERS
from metro.report.numbers import listing, number, percent, probability, words
from metro.report.results import Results, heading
from metro.units import JSON, printed

HOLDS = ("clean", "explained")
SURE = 0.95  # probability from which on a cause counts as identified
UNTESTED = "No prediction was tested here."
IDENTIFIED = (
    f"{UNTESTED} The identified values are valid within their intervals for the declared set-up. How well "
    "they predict a cut is not known."
)
PRINTED = (
    f"{UNTESTED} The values are as they were printed. Where no interval was printed, there is none here, nor "
    "of what was computed from them. How well they predict a cut is not known."
)
MEASURED = (
    f"{UNTESTED} The values describe the measured part of the surface only. Their intervals include the "
    "contributions that are stated with them."
)
LOWERED = (
    "Much of the error remains unexplained. An unknown cause may have the same signature, which lowers the "
    "probability of the causes named."
)
POSED = (
    "The identified arm model was tested on poses that were not used in the fit; their errors are given in "
    "the report. How well it predicts a cut is not known."
)
OF_SURFACES = ("faces", "levelling", "texture", "areal")
ABOUT = ("format", "batch", "metro", "not_identified")


def trust(results: Results) -> list[str]:
    """Say for each verdict the accuracy of the prediction, the certainty of its causes, and the tested cuts.

    Verdicts that were tested on cuts with the same settings share a paragraph.
    """
    alike: dict[str, list[str]] = {}
    for name, entry in results.verdicts().items():
        said = " ".join(filter(None, [_reach(name, entry), _causes(entry)]))
        alike.setdefault(_tested(results, entry), []).append(said)
    return [f"{' '.join(said)} {tested}".rstrip() for tested, said in alike.items()] or [
        untested(results.identified, printed=results.batch.manifest.get("source") == "published")
    ]


def untested(identified: JSON, *, printed: bool = False) -> str:
    """Say what figures are worth that no prediction was tested with: identified, printed, or of a surface."""
    found = {name for name, block in identified.items() if name not in ABOUT and _has_values(block)}
    if not found:
        return UNTESTED
    if found == {"pose"}:
        return POSED
    if found <= set(OF_SURFACES):
        return MEASURED
    return PRINTED if printed else IDENTIFIED


def _has_values(block: JSON) -> bool:
    """Whether a block of ``identified.json`` holds more than reasons why it is empty."""
    return bool(set(block) - {"not_identified"}) if isinstance(block, dict) else bool(block)


def static_deflection(results: Results) -> list[str]:
    """Say with its figures that a static deflection of the machine has no meaning; nothing where it has."""
    found = (results.identified.get("force") or {}).get("static_deflection") or {}
    if not found.get("reason"):
        return []
    figures = [f"gain of its iteration {number(found['iteration_gain'])}"]
    if "moves" in found:
        low, high = (number(end) for end in found["modes_hz"])
        figures.append(f"teeth at {number(found['tooth_hz'])} Hz, modes at {low} to {high} Hz")
    runs = f"{len(found['runs'])} run{'s' if len(found['runs']) > 1 else ''}"
    return [
        f"Do not use a static deflection of the machine for {runs}: the tooth passing excites its modes "
        f"({'; '.join(figures)})."
    ]


def trust_in(results: Results, observable: str) -> str:
    """Say for one verdict what :func:`trust` says for all."""
    entry = results.verdicts()[observable]
    return " ".join(filter(None, [_reach(observable, entry), _causes(entry), _tested(results, entry)]))


def _reach(observable: str, entry: JSON) -> str:
    """Say the error of predictions on held-out runs, at the upper end of its interval."""
    name, status = heading(observable), str(entry.get("status"))
    verification = entry.get("verification") or {}
    if status == "insufficient":
        return f"{name}: {_undecided(verification)}."
    size = _size(entry)
    if "held_out" in entry:
        return f"{name}: the predictions of poses among those that were measured are accurate to {size}."
    if not (warning := do_not_use(entry)):
        model = "predictions with the effects found" if entry.get("effects") else "predictions"
        return f"{name}: the {model} are accurate to {size}."
    return f"{name}: {warning}"


def do_not_use(entry: JSON) -> str:
    """Say that the predictions of a verdict are not to be used, and how far off they are; "" where they are.

    Parameters
    ----------
    entry : of the observable in ``verdict.json``; empty: there is no verdict.
    """
    status, verification, size = str(entry.get("status")), entry.get("verification") or {}, _size(entry)
    if not entry.get("status") or (status in HOLDS and verification.get("holds", True)):
        return ""
    if status == "insufficient":
        return "" if verification.get("holds") else f"{_undecided(verification)}."
    after, floor = (entry.get("after") or {}).get("rms"), entry.get("noise_floor")
    within = verification.get("holds") and (verification.get("ratio") or math.inf) <= 1.0
    if within and status in ("unexplained", "partly_explained"):
        return (
            f"on the held-out runs the predictions are accurate to {size}, but the identification runs have "
            "an error that is not explained: do not use the predictions for other cuts than those."
        )
    times = f", {number(after / floor, 2)} times the noise floor" if after and floor and after > floor else ""
    return (
        f"do not use the predictions, which have an error of up to {size}{times}. The measured values are "
        "usable."
    )


def _undecided(verification: JSON) -> str:
    """Say what can be trusted where there are too few runs to decide whether something is missing."""
    if not verification:
        return "no prediction was tested, so none can be relied on"
    if verification["holds"]:
        return (
            "the held-out tests agree with the prediction. Too few tests have the role identify to decide "
            "whether an effect is missing"
        )
    return (
        "do not use the predictions, which the held-out tests contradict. The measured values are usable. "
        "Too few tests have the role identify to look for a cause"
    )


def _size(entry: JSON) -> str:
    """Write the upper end of the 95 % interval of the error after the loop, in its unit and of the signal."""
    after, unit = entry.get("after") or {}, printed(entry.get("unit"))
    rms = after.get("rms")
    if rms is None:
        return "an unknown error"
    ends = [x for x in after.get("ci95") or [] if x is not None and math.isfinite(x)]
    high, alone = max([rms, *ends]), "" if ends else "; one condition: no interval"
    if unit == "1" or not unit:
        return f"{number(high, 2)} rms of the probability"
    if "held_out" in entry:
        return f"{number(high, 2)} {unit} rms in a {entry['held_out'].get('of', 'coordinate')}"
    share = after.get("nrmse")
    of_signal = f" rms ({percent(share * high / rms)} of the signal{alone})" if share and rms else " rms"
    return f"{number(high, 2)} {unit}{of_signal}"


def _tested(results: Results, entry: JSON) -> str:
    """Name the settings of the cuts that tested a prediction, and those with only one level."""
    runs = results.batch.runs
    judged = runs[runs.index.isin([str(run) for run in entry.get("held_out_runs") or []])]
    if judged.empty:
        return ""
    names = [text for column in NAMES if column in judged and (text := _levels(column, judged[column]))]
    known = [(one, sorted(judged[c].dropna().unique())) for c, one in NUMBERS.items() if c in judged]
    ranges = [f"{one.name} {_range(values)} {one.unit}" for one, values in known if len(values) > 1]
    single = [text for column in NAMES[1:] if column in runs and (text := _but_one(column, runs, judged))]
    single += [f"{one.name} ({values[0]:g} {one.unit})" for one, values in known if len(values) == 1]
    tested = f"Tested on {listing([*names, *ranges])}" if names or ranges else "Tested"
    return f"{tested}{f', at one {listing(single)} only' if single else ''}."


def _levels(column: str, values: pd.Series) -> str:
    # A slot is cut by up milling and down milling at once.
    levels = sorted({str(v) for v in values.dropna()} - {"", "slot" if column == "direction" else ""})
    if not levels or (len(levels) == 1 and column != "operation"):
        return ""
    listed = listing(levels)
    return f"{listed} cuts" if column == "operation" else f"{column} {listed}"


def _but_one(column: str, runs: pd.DataFrame, judged: pd.DataFrame) -> str:
    """Name the only tested level of a setting of which the batch has others; empty otherwise."""
    tested, all_levels = ({str(v) for v in part[column].dropna()} - {""} for part in (judged, runs))
    return f"{column} ({min(tested)})" if len(tested) == 1 and len(all_levels) > 1 else ""


def _range(values: list[float]) -> str:
    ends = f"{values[0]:g}", f"{values[-1]:g}"
    return " and ".join(ends) if len(values) == 2 else " to ".join(ends)


def _causes(entry: JSON) -> str:
    """Distinguish the causes that are almost certain from those that are only the likeliest."""
    certain: dict[bool, dict[str, list[str]]] = {True: {}, False: {}}
    for (name, sure), effects in _alike(entry.get("effects") or []).items():
        chances = [effect.get("probability") for effect in effects]
        least = min((chance for chance in chances if chance is not None), default=None)
        certain[sure].setdefault(probability(least), []).append(words(name))
    finding, lead = _named("Identified", certain[True]), _named("Possible", certain[False])
    lowered = LOWERED if any(effect.get("lowered") for effect in entry.get("effects") or []) else ""
    return " ".join(filter(None, [finding, lead, lowered]))


def _named(how: str, causes: dict[str, list[str]]) -> str:
    """Name causes by their probability in words, which is stated once for those that share it."""
    if not causes:
        return ""
    parts = [
        f"{listing(names)} ({'each with ' if len(names) > 1 else ''}probability {chance})"
        for chance, names in causes.items()
    ]
    return f"{how} cause{'s' if sum(map(len, causes.values())) > 1 else ''}: {'; '.join(parts)}."


def _alike(effects: list[JSON]) -> dict[tuple[str, bool], list[JSON]]:
    """Gather effects of one name, those of several joints, by whether they count as identified."""
    found: dict[tuple[str, bool], list[JSON]] = {}
    for effect in effects:
        chance = effect.get("probability")
        found.setdefault((str(effect["effect"]), chance is not None and chance >= SURE), []).append(effect)
    return found
