"""What remains of the residual, what it resembles, and the noise that it is compared with."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from metro.units import JSON, printed, printed_name
from metro.wording.candidates import Sentence
from metro.wording.names import belief, listed, plain

MOST_PLACES = 4  # that are named
LEAST_CHANCE = 1e-4  # below it, tails of the distribution are no figure to quote


def _residual(values: JSON) -> str:
    return "; ".join(values["parts"])


def _residual_and_likeness(values: JSON) -> str:
    rms = f"{values['rms']:.3g} {printed(values['unit'])} rms"
    return f"{values['residual']}; with this effect the error would be {rms}"


def _places(values: JSON) -> str:
    places = values["places"]
    parts = [
        f"{'whole record' if place['label'] == 'all' else place['label']} in {place['axis']} "
        f"({100 * place['relative']:.2g} % of the signal there)"
        for place in places[:MOST_PLACES]
    ]
    more = len(places) - MOST_PLACES
    return "; ".join(parts) + (f" and {more} more places" if more > 0 else "")


def _lowered(values: JSON) -> str:
    name = plain(values["effect"])
    whose = "residual of the held-out runs" if values.get("held_out") else "residual"
    return (
        f"{name[:1].upper()}{name[1:]} has a weight of {values['weight']:.2f} among the effects of the "
        f"library. Its probability is lower because it explains only {100 * values['explained']:.0f} % of "
        f"the {whose}; an unknown cause may have the same signature"
    )


def _traces(values: JSON) -> str:
    """Name the effects that are significant but no larger than what errors of the inputs may cause."""
    seen = sorted(values["seen"], key=lambda one: -float(one["size"]))
    named = listed([f"{plain(one['effect'])} ({100 * one['size']:.2g} % of the signal)" for one in seen])
    least = max(one["least"] for one in seen)
    verb, none = ("improves", "it is not") if len(seen) == 1 else ("each improve", "none of them is")
    return (
        f"{named[:1].upper()}{named[1:]} {verb} the fit significantly, but errors of the model's inputs or "
        f"of the instrument may cause up to {100 * least:.2g} %, so {none} claimed."
    )


def _step(values: JSON) -> str:
    return f"a step of {values['parameter']} by {100 * values['relative']:+.1f} % after run {values['after']}"


def _between(values: JSON) -> str:
    return (
        "the base parameters differ between the conditions of the identification by "
        f"{100 * values['relative']:.2g} % of the signal, which exceeds the scatter of repeats; the "
        f"difference is largest in {values['condition']}"
    )


def _restless(values: JSON) -> str:
    return (
        f"runs scatter by {100 * values['relative']:.2g} % of the signal, {values['times']:.0f} times the "
        "usual value: something changes from run to run (for example a drift or the clamping)"
    )


def _like(values: JSON) -> str:
    return f"like a {_resembled(values['effects'])}"


def _may_be(values: JSON) -> str:
    return f"alternative explanation to {plain(values['effect'])}: a {_resembled(values['others'])}"


def _resembled(effects: Sequence[JSON]) -> str:
    """Name effects that are not of the library, with their values."""
    named = [f"{plain(effect['name'])} ({', '.join(map(_value, effect['values']))})" for effect in effects]
    return f"{' and a '.join(named)}, which is not an effect of the library"


def _value(entry: JSON) -> str:
    name, unit = printed_name(entry["name"], entry["unit"]), printed(entry["unit"])
    return f"{name} {entry['value']:.3g} {unit}".rstrip()


def _unseen(values: JSON) -> str:
    return f"only in conditions that were left out of the fit: {values['places']}"


def _above_floor(values: JSON) -> str:
    return (
        "the prediction of identification conditions, each left out in turn, has "
        f"{values['ratio']:.2g} times the error that noise explains "
        f"({_chance(values['p_value'])}), the largest in {values['condition']}"
    )


def _held_out_above_floor(values: JSON) -> str:
    return (
        f"only on the held-out runs, whose error is {values['ratio']:.2g} times what noise explains "
        f"({_chance(values['p_value'])}), the largest in {values['condition']}"
    )


def _verification(values: JSON) -> str:
    """Say how the final model does on the held-out runs; no cause is decided by it."""
    runs = f"{values['runs']} held-out run{'s' if values['runs'] > 1 else ''}"
    times = f"{values['ratio']:.2g}"
    size = "as large as that" if times == "1" else f"{times} times that"
    ratio = f"{size} expected from noise and uncertain parameters"
    if values["ratio"] <= 1.0:
        words = f"Verification on {runs}: the error is {ratio}."
    elif values["holds"]:
        words = (
            f"Verification on {runs}: the error is {ratio}, which chance can explain "
            f"({_chance(values['p_value'])})."
        )
    else:
        words = (
            f"Verification on {runs} contradicts the model: the error is {ratio} "
            f"({_chance(values['p_value'])}) and largest in condition {values['condition']}."
        )
    unit = printed(values["unit"])
    if values.get("grew"):
        before, after = (f"{rms:.3g}" for rms in values["grew"])
        words += f" With the effects the error increases from {before} to {after} {unit}."
    if values["worse_runs"]:
        each = (
            f"{one['run']} ({one['before']:.2g} to {one['after']:.2g} {unit})" for one in values["worse_runs"]
        )
        words += f" With the effects the error increases in {', '.join(each)}."
    if values["without"]:
        words += f" The model cannot predict one held-out run: {values['without']}."
    return words


def _chance(p_value: float) -> str:
    return f"p = {p_value:.2g}" if p_value >= LEAST_CHANCE else f"p < {LEAST_CHANCE:g}"


def _noise(values: JSON) -> str:
    words = (
        f"The base parameters scatter by {values['scatter_percent']:.2g} % from run to run (estimated from "
        f"repeats, with a prior of {100 * values['prior']:.2g} %). Differences below "
        f"{100 * values['budget']:.2g} % of the signal are within the stated model accuracy and are not "
        "attributed to any effect."
    )
    if values["systematic"]:
        words += (
            f" The inputs of the model may cause a common error of {100 * values['systematic']:.2g} % in all "
            "runs; an effect must change the prediction by more than twice that."
        )
    return words


def _in_percent(one: JSON) -> JSON:
    """Return what is believed of a plain ratio in percent."""
    numbers = {name: 100.0 * one[name] for name in ("sd", "before", "after")}
    return {**one, **numbers, "unit": "%"} if one["unit"] == "1" else one


def _strained(values: JSON) -> str:
    """Say what the instruments would have to be off, without and with the effects."""
    effects, without, left = values["effects"], [], []
    for one in map(_in_percent, values["far"]):
        known = f"known within ±{2.0 * one['sd']:.2g} {printed(one['unit'])}"
        if abs(one["before"]) > values["limit"] * one["sd"]:
            after = f"{one['after']:.2g} {printed(one['unit'])}".rstrip()
            then = (
                f"; with {'these effects' if len(effects) > 1 else 'this effect'}: {after}" if effects else ""
            )
            without.append(
                f"{belief(one['name'])} {one['before']:.2g} {printed(one['unit'])} ({known}{then})"
            )
        else:
            left.append(f"{belief(one['name'])} {one['after']:.2g} {printed(one['unit'])} ({known})")
    words = []
    if without:
        lacking = f"Without {listed(effects)}" if effects else "By these runs"
        words.append(f"{lacking}, errors of the instruments would have to be: {'; '.join(without)}.")
    if left:
        words.append(f"With {listed(effects)} they would have to be: {'; '.join(left)}.")
    return " ".join(words)


PARTS = {
    "same": "is the same in every run",
    "feed": "grows with the feed",
    "depth": "grows with the depth",
    "speed": "grows with the spindle speed",
    "arc": "grows with the arc of engagement",
    "travel": "grows with the length cut",
}
KINDS = {
    "same": "a cause that does not depend on the chip, such as an imbalance or a wave of the sensor",
    "feed": "a cause between the chip and the sensor, such as a structure that vibrates, crosstalk, or teeth "
    "that engage elsewhere than declared",
    "depth": "a cause at the end of the tool or along its edge, such as a corner or a ball",
    "speed": "a dynamic cause, such as a resonance",
    "arc": "a cause at the entry or the exit, such as another engagement than declared",
    "travel": "a cause that grows while cutting, such as wear or heat",
}
LEAST_PART = 0.05  # of the residual, that is stated


def _ceiling(values: JSON) -> str:
    """Say how much any cause could explain, how it changes with the cut, and of which kind it is."""
    named = [
        (name, share) for name, share in values["parts"].items() if share >= LEAST_PART and name in PARTS
    ]
    if not named or values["share"] <= 0.0:
        return (
            "The part of it that a cause could explain cannot be estimated: no condition is predicted by the "
            "others."
        )
    low, high = (100 * max(end, 0.0) for end in values["ci95"])
    parts = [f"{100 * share:.0f} % {PARTS[name]}" for name, share in named]
    held = "".join(
        f", {100 * max(one['share'], 0.0):.0f} % in held-out run {one['run']} (an error of "
        f"{100 * one['of_signal']:.0f} % of the signal would remain)"
        for one in values["held_out"][:MOST_PLACES]
    )
    places = listed([f"{place['label']} in {place['axis']}" for place in values["places"]])
    # A share that may be nothing says of no kind that it is there.
    kind = (
        f"This points to {KINDS[named[0][0]]}."
        if values["ci95"][0] > 0.0
        else "That may be chance, so no kind of cause can be named."
    )
    return (
        f"Of the squared error of the base model, {listed([*parts, _alone(values)])}. The other conditions "
        f"predict {100 * values['share']:.0f} % ({low:.0f} to {high:.0f} %) of it in a left-out "
        f"condition{held}, which is as much as a cause could explain. It is largest at {places}. {kind}"
    )


def _alone(values: JSON) -> str:
    return f"{100 * values['parts']['alone']:.2g} % does not repeat"


SENTENCES: Mapping[str, Sentence] = {
    "ceiling": _ceiling,
    "residual": _residual,
    "residual_and_likeness": _residual_and_likeness,
    "places": _places,
    "lowered": _lowered,
    "traces": _traces,
    "step": _step,
    "between": _between,
    "restless": _restless,
    "like": _like,
    "may_be": _may_be,
    "unseen": _unseen,
    "above_floor": _above_floor,
    "held_out_above_floor": _held_out_above_floor,
    "verification": _verification,
    "noise": _noise,
    "strained": _strained,
    "contradiction": "not judged, because the data contradict the declaration of the batch",
}
