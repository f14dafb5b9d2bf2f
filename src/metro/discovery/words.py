"""The sentences of ``metro propose``."""

from __future__ import annotations

from metro.units import JSON, PRINTED

SHOWN = 3  # terms that are named where nothing is proposed
HALF = 0.5


def in_words(batch: str, entry: JSON) -> list[str]:
    """Say what was searched, what is proposed or how far the foremost terms come, and what to do."""
    if entry["status"] == "explained":
        return [
            f"{batch}: the force has no unexplained residual. Nothing is proposed.",
        ]
    lines = [f"{batch}: the verdict on the force is {entry['verdict'].replace('_', ' ')}.", _limits(entry)]
    chosen = entry["proposal"]
    terms = {one["name"]: one for one in entry["terms"]}
    if chosen:
        lines += ["", *_proposed(terms[chosen["name"]], chosen, terms)]
    else:
        lines += ["", *_nothing(entry)]
    return lines


def _limits(entry: JSON) -> str:
    words = f"The batch admits {entry['admitted']} terms; {len(entry['terms'])} of them were fitted."
    known = entry["ceiling"]
    if known is None:
        return words + " How much any cause could explain is not known."
    low, high = known["ci95"]
    if low <= 0.0:
        return (
            f"{words} What the waveforms of other conditions predict of the residual may be chance "
            f"({_percent(known['share'])}, 95 %: {_percent(low)} to {_percent(high)}). A term has to explain "
            f"half of the {_percent(entry['explainable'])} that are not noise."
        )
    return (
        f"{words} Any cause could explain at most {_percent(known['share'])} of the residual of a condition "
        f"that was left out (95 %: {_percent(low)} to {_percent(high)})."
    )


def _proposed(term: JSON, chosen: JSON, terms: dict[str, JSON]) -> list[str]:
    lines = [
        f"Proposed: {term['name'].replace('_', ' ')}.",
        term["words"],
        f"  {term['formula']}",
        *parameter_lines(term),
        _evidence(term),
    ]
    verified = chosen["verification"]
    if verified:
        lines.append(
            f"On the {len(verified['runs'])} verification runs, which no fit has seen, the rms error "
            f"{_changes(verified['before'], verified['after'])} from {verified['before']:.3g} "
            f"{verified['unit']} to {verified['after']:.3g} {verified['unit']}. "
            f"Noise alone makes {verified['noise']:.3g} {verified['unit']}."
        )
    if chosen["as_good"]:
        others = "; ".join(f"{terms[name]['formula']}" for name in chosen["as_good"])
        lines.append(f"These runs do not distinguish it from: {others}.")
    if chosen["test"]:
        test = chosen["test"]
        repeats = "once" if test["repeats"] == 1 else f"{test['repeats']} times"
        lines.append(
            f"To test it, measure {repeats}: {test['words']}. "
            f"These runs decide with a probability of {_percent(test['probability'])}."
        )
    return lines


def parameter_lines(term: JSON) -> list[str]:
    """Return a line for each parameter of a term: its value, its interval and its unit."""
    lines = []
    for name, one in term["parameters"].items():
        low, high = one["ci95"]
        unit = PRINTED.get(one["unit"], one["unit"])
        interval = "not determined" if low is None else f"95 %: {low:.3g} to {high:.3g}"
        lines.append(f"  {name} = {one['value']:.3g}{' ' + unit if unit else ''} ({interval})")
    return lines


def _evidence(term: JSON) -> str:
    return (
        f"Conditions that were left out gain {term['gain']:.1f} in log-likelihood, the number of terms "
        f"discounted; {_percent(term['better_share'])} of those it touches are predicted better. "
        f"It explains {_percent(term['share'])} of their residual (q = {term['q_value']:.2g})."
    )


def _nothing(entry: JSON) -> list[str]:
    """Say that nothing is proposed, and how far the foremost terms come."""
    lines = ["Nothing is proposed."]
    for term in entry["terms"][:SHOWN]:
        far = f"explains {_percent(term['share'])} of the residual of left-out conditions"
        if term["why_not"]:
            why = f"it did not pass: {term['why_not']}"
        else:
            why = f"that is less than half of the {_percent(entry['explainable'])} that are explainable"
        reached = far if term["gain"] is not None else "was not put to left-out conditions"
        lines.append(f"  {term['formula']}: {reached}; {why}.")
    if not entry["terms"]:
        lines.append("  No term predicts conditions that are left out better than the model does.")
    return lines


def _changes(before: float, after: float) -> str:
    return "falls" if after < before else "rises"


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %"
