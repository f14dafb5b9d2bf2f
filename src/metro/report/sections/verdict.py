"""The verdict in an engineer's words."""

from __future__ import annotations

import math

from metro.report.figures.verdicts import Change
from metro.report.numbers import listing, percent, with_interval, words
from metro.report.parameters import effect_words, of_joint
from metro.report.phrases import plain, residual_words
from metro.report.results import Results, heading
from metro.report.sections.trust import HOLDS, SURE
from metro.units import JSON, printed

NOTHING_SEEN = 0.9  # error over signal, above which the model predicts next to nothing of it
STATUS = {
    "clean": "clean",
    "explained": "explained",
    "partly_explained": "partly explained",
    "undetermined": "undetermined",
    "unexplained": "unexplained",
    "insufficient": "insufficient data",
}


def verdict_words(observable: str, entry: JSON, left: str = "") -> str:
    """Say the verdict on an observable in a few sentences, with its numbers; ``left`` is the residual."""
    start, status = heading(observable), str(entry.get("status"))
    if entry.get("words"):
        return f"{start}: {STATUS[status]}. {entry['words']} {_residual(entry, left)}".strip()
    whole, part = _attribution(entry, "the difference"), _attribution(entry, "part of the difference")
    verified = (entry.get("verification") or {}).get("words", "")
    # Of a probability the count of tests on the right side says more than the rms.
    tested = " ".join([verified, _fall(entry)] if _dimensionless(entry) else [_fall(entry), verified])
    says = {
        "clean": f"{start}: {_clean(entry)} {tested}",
        "explained": f"{start}: {whole} {tested}{_within_floor(entry)} {entry.get('traces', '')}",
        "partly_explained": f"{start}: {part} {tested} A significant residual remains. "
        f"{_residual(entry, left)}",
        "undetermined": f"{start}: {_undetermined(entry)} {_rivals(entry)}{tested}",
        "unexplained": f"{start}: {_unexplained(entry)} {tested}{_unconfirmed(entry)} "
        f"{_residual(entry, left)}",
        "insufficient": f"{start}: there are too few identification runs to decide whether an effect is "
        f"missing. {tested}",
    }
    if entry.get("contradicted"):
        return (
            f"{start}: the data contradict the declaration of the batch, so no cause was sought. "
            f"{_fall(entry)}"
        )
    return says.get(status, f"{start}: {words(status)}.").strip()


def _clean(entry: JSON) -> str:
    """Say that nothing is missing; or that nothing was there which the model could have been tested by."""
    share = (entry.get("before") or {}).get("nrmse")
    if share is not None and share > NOTHING_SEEN and not _dimensionless(entry):
        return "what was measured is no larger than the noise, so that it does not test the base model."
    if entry.get("traces"):
        return (
            f"the base model explains the identification runs; no larger effect is missing. {entry['traces']}"
        )
    return "the base model explains the identification runs; no effect is missing."


def _unexplained(entry: JSON) -> str:
    """Say which runs have an error that nothing explains."""
    if _held_out_only(entry):
        return (
            "the base model explains the identification runs, but the held-out runs contradict it. No cause "
            "is sought in held-out runs."
        )
    return (
        "over the identification runs the base model has a significant error that no effect of the library "
        "explains."
    )


def _held_out_only(entry: JSON) -> bool:
    return bool((entry.get("unexplained") or {}).get("held_out_only"))


def _unconfirmed(entry: JSON) -> str:
    """Say that the held-out runs do not show what the identification runs leave unexplained, if so."""
    verification = entry.get("verification") or {}
    within = verification.get("holds") and (verification.get("ratio") or math.inf) <= 1.0
    return " The held-out runs do not show it." if within else ""


def _undetermined(entry: JSON) -> str:
    """Say what is identified all the same, and that the rest is not."""
    proven = [one for one in entry.get("effects") or [] if (one.get("probability") or 0.0) >= SURE]
    if not proven:
        return "the base model lacks an effect, but these runs do not determine which one."
    known = _attribution({**entry, "effects": proven}, "part of the difference")
    return f"{known} The base model lacks a further effect, but these runs do not determine which one."


def _attribution(entry: JSON, what: str) -> str:
    """Say to which causes ``what`` is traced, and which ones are only the likeliest of the library."""
    effects = entry.get("effects") or []
    identified = [one for one in effects if (one.get("probability") or 0.0) >= SURE]
    sure = [effect_words(one) for one in identified]
    meanings = dict.fromkeys(str(one["meaning"]) for one in identified if one.get("meaning"))
    possible = [effect_words(one) for one in effects if (one.get("probability") or 0.0) < SURE]
    traced = f"{what} from the base model is traced to {listing(sure)}." if sure else ""
    traced = " ".join([traced, *meanings])
    if not possible:
        return traced
    so_much = "a further part of it" if sure else f"{what} from the base model"
    article = "A" if traced else "a"
    return f"{traced} {article} possible cause of {so_much} is {listing(possible)}.".strip()


def _within_floor(entry: JSON) -> str:
    """Say where the held-out runs by themselves would not have asked for an effect."""
    before, floor = (entry.get("before") or {}).get("rms"), entry.get("noise_floor")
    if before is None or floor is None or before > floor:
        return ""
    return (
        " The error of the base model is within the noise floor there; the effect was identified from the "
        "other runs."
    )


def error_text(error: JSON | None, unit_name: str | None) -> str:
    """Write an error of the verdict: rms with its interval, if it has one, and unit."""
    if not error or error.get("rms") is None:
        return "–"
    text = with_interval(error["rms"], known_interval(error))
    shown = printed(unit_name)
    return f"{text} {shown}" if shown else text


def known_interval(error: JSON) -> list[float | None] | None:
    """Return the interval of an error; None if there is one condition only, which has no scatter."""
    low, high = error.get("ci95") or (None, None)
    return [low, high] if low is not None and high is not None and high > low else None


def change(label: str, entry: JSON) -> Change | None:
    """Errors relative to the signal (%), before and after, for the figures; None if they are not known."""
    before, after = entry.get("before") or {}, entry.get("after") or {}
    if (
        before.get("nrmse") is None
        or after.get("nrmse") is None
        or _dimensionless(entry)
        or "held_out" in entry
    ):
        return None
    scale = 100 * before["nrmse"] / before["rms"] if before.get("rms") else None
    floor = entry.get("noise_floor")
    return Change(
        label,
        100 * before["nrmse"],
        100 * after["nrmse"],
        _scaled(before),
        _scaled(after),
        floor * scale if floor is not None and scale is not None else None,
    )


def _scaled(error: JSON) -> tuple[float, float] | None:
    ci95, rms = known_interval(error), error.get("rms")
    if not ci95 or not rms:
        return None
    scale = 100 * error["nrmse"] / rms
    return scale * ci95[0], scale * ci95[1]


def _dimensionless(entry: JSON) -> bool:
    """Whether the value is a probability, whose error has no signal as a reference."""
    return entry.get("unit") == "1"


def unit_after(entry: JSON) -> str:
    """Write the unit of a verdict behind a number; empty if it has none."""
    shown = printed(entry.get("unit"))
    return f" {shown}" if shown else ""


def _fall(entry: JSON) -> str:
    before, after = entry.get("before") or {}, entry.get("after") or {}
    if before.get("rms") is None or after.get("rms") is None:
        return ""
    runs = entry.get("held_out_runs") or []
    where = (
        f"On held-out {'run' if len(runs) == 1 else 'runs'} {listing([str(r) for r in runs])}"
        if 0 < len(runs) <= 6
        else (f"On {len(runs)} held-out runs" if runs else "On held-out runs")
    )
    old, new = error_text(before, entry.get("unit")), error_text(after, entry.get("unit"))
    share_before, share_after = percent(before.get("nrmse")), percent(after.get("nrmse"))
    what = "the error"
    if _dimensionless(entry):
        what = "the error of the predicted probability of chatter (rms, against the outcomes 0 and 1)"
    if before["rms"] == after["rms"]:
        share = "" if _dimensionless(entry) else f" ({share_before} of the signal)"
        return f"{where} {what} is {old}{share}."
    if share_before == share_after and not _dimensionless(entry):
        shown = " The identification runs alone show what was found." if entry.get("effects") else ""
        return (
            f"{where} the error does not change: {old} before and {new} after ({share_after} of the signal)."
            f"{shown}"
        )
    share = "" if _dimensionless(entry) else f" ({share_before} to {share_after} of the signal)"
    if not entry.get("effects"):  # the boundary is predicted with the effects of the force
        share += " with the effects found in other observables"
    verb = "falls" if after["rms"] < before["rms"] else "rises"
    return f"{where} {what} {verb} from {old} to {new}{share}."


def _residual(entry: JSON, left: str) -> str:
    unexplained = entry.get("unexplained") or {}
    if not unexplained.get("signature"):
        return ""
    if _held_out_only(entry):
        return f"Remaining error: {plain(str(unexplained['signature']))}."
    return f"Remaining error of the identification runs: {left or plain(str(unexplained['signature']))}."


def left_words(results: Results, observable: str) -> str:
    """Describe an observable's residual after the loop in an engineer's words; empty if not known."""
    teeth = int((results.batch.manifest.get("tool") or {}).get("teeth") or 0)
    return residual_words(results.loop_record(observable).get("signature") or [], teeth)


def _rivals(entry: JSON) -> str:
    groups = [
        " or ".join(words(str(name)) for name in group) for group in entry.get("indistinguishable") or []
    ]
    paired = {
        str(name).partition(" (")[0] for group in entry.get("indistinguishable") or [] for name in group
    }
    alone = [
        effect_words(one)
        for one in entry.get("effects") or []
        if str(one["effect"]) not in paired and (one.get("probability") or 0.0) < SURE
    ]
    further = f"Beside these, a possible cause is {listing(alone)}. " if alone and groups else ""
    return f"Possible causes: {'; or '.join(groups)}. {further}" if groups else ""


def remedies(entry: JSON) -> list[str]:
    """Say of each identified cause what to do about it, where the library has that."""
    sure = [one for one in entry.get("effects") or [] if (one.get("probability") or 0.0) >= SURE]
    return [
        f"{of_joint(str(one['effect']), (one.get('parameters') or {}).get('joint'))}: {one['remedy']}"
        for one in sure
        if one.get("remedy")
    ]


def next_words(entry: JSON) -> str:
    """Say what to measure next, and whether the verdict does not need it; empty if there is nothing."""
    text = plain(str(entry.get("next_experiment") or "")).rstrip(".")
    needless = entry.get("status") in HOLDS
    return f"{text} (optional: the verdict does not depend on it)" if text and needless else text
