"""The findings of a batch in words: the contents of verdict.json and loop.json."""

from __future__ import annotations

from metro.units import JSON, printed
from metro.wording.causes import cause_in_words, split_in_words
from metro.wording.names import SURE, listed, plain
from metro.wording.statements import worded

BRIEF = (
    "cause",
    "where",
    "status",
    "probability",
    "parameters",
    "seen_in",
)  # what verdict.json has of a cause
STATUSES = {
    "clean": "The identification runs show no effect beyond the base model; nothing was added.",
    "explained": "The residual is explained by {effects}.",
    "partly_explained": "Part of the residual is explained by {effects}. "
    "A significant residual remains that no effect of the library explains.",
    "undetermined": "Several effects explain the residual equally well with these data: {rivals}.",
    "unexplained": "There is a significant residual that no effect of the library explains; nothing was "
    "added.",
    "contradicted": "The data contradict the declaration of the batch; no cause was sought.",
    "insufficient": "There are too few identification runs to decide whether the residual is significant.",
}


def verdict_of(findings: JSON) -> JSON:
    """Return the content of verdict.json.

    Parameters
    ----------
    findings : content of findings.json.
    """
    head = {name: findings[name] for name in ("format", "batch", "metro")}
    observables = {name: worded(one["verdict"]) for name, one in findings["observables"].items()}
    causes = [{name: cause[name] for name in BRIEF} for cause in worded(findings["causes"])]
    slips = [{**slip, "words": slip_in_words(slip)} for slip in findings.get("slips") or []]
    return {
        **head,
        **({"contradictions": slips} if slips else {}),
        "observables": observables,
        "causes": causes,
    }


def slip_in_words(slip: JSON) -> str:
    """Say a contradiction between data and declaration, and what mistake explains it."""
    text = ". ".join(filter(None, [slip["found"], slip["remedy"]]))
    return f"{text[:1].upper()}{text[1:]}."


def story_of(findings: JSON) -> JSON:
    """Return the content of loop.json: all that was tried."""
    observables = {
        name: {**worded(one["story"]), "words": verdict_in_words(worded(one["verdict"]))}
        for name, one in findings["observables"].items()
    }
    causes = [{**cause, "words": cause_in_words(cause)} for cause in worded(findings["causes"])]
    chain = {name: {**split, "words": split_in_words(split)} for name, split in findings["chain"].items()}
    head = {name: findings[name] for name in ("format", "batch")}
    effects = findings["effects"]
    return {**head, "observables": observables, "effects": effects, "causes": causes, "chain": chain}


def _named(effect: JSON) -> str:
    """Name an effect, as a possible one where it is not proven."""
    return str(effect["effect"]) if effect["probability"] >= SURE else f"{effect['effect']} (possible)"


def verdict_in_words(verdict: JSON) -> str:
    """Say the verdict on an observable as an engineer would, without what remains unexplained.

    Parameters
    ----------
    verdict : its entry of verdict.json.
    """
    if verdict.get("words"):
        return str(verdict["words"])
    effects = listed([_named(entry) for entry in verdict["effects"]] or [""])
    rivals = "; ".join(plain(" or ".join(pair)) for pair in verdict["indistinguishable"])
    status = "contradicted" if verdict.get("contradicted") else verdict["status"]
    sentence = STATUSES[status].format(effects=effects, rivals=rivals)
    proven = [str(one["effect"]) for one in verdict["effects"] if one["probability"] >= SURE]
    if status == "undetermined" and proven:
        sentence = f"Part of the residual is explained by {listed(proven)}. {sentence}"
    sentence += "".join(f" {one['lowered']}." for one in verdict["effects"] if one.get("lowered"))
    sentence += f" {verdict['traces']}" if verdict.get("traces") else ""
    before, after = verdict["before"], verdict["after"]
    if before and after:
        unit = f" {printed(verdict['unit'])}".rstrip()
        sentence += f" On held-out runs the error is {before['rms']:.3g}{unit} rms before"
        sentence += f" and {after['rms']:.3g}{unit} after."
    if verdict.get("verification"):
        sentence += f" {verdict['verification']['words']}"
    return sentence
