"""What remains of the residual, what it resembles, and the noise that it is compared with."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from metro.units import JSON, printed, printed_name
from metro.wording.candidates import Sentence
from metro.wording.names import listed, plain

MOST_PLACES = 4  # that are named
LEAST_CHANCE = 1e-4  # below it, tails of the distribution are no figure to quote


def _residual(values: JSON) -> str:
    return "; ".join(values["parts"])


def _residual_and_likeness(values: JSON) -> str:
    rms = f"{values['rms']:.3g} {printed(values['unit'])} rms"
    return f"{values['residual']}; with that the error would be {rms}"


def _places(values: JSON) -> str:
    places = values["places"]
    parts = [
        f"{'all along' if place['label'] == 'all' else place['label']} in {place['axis']} "
        f"({100 * place['relative']:.2g} % of the signal there)"
        for place in places[:MOST_PLACES]
    ]
    more = len(places) - MOST_PLACES
    return "; ".join(parts) + (f" and {more} more places" if more > 0 else "")


def _lowered(values: JSON) -> str:
    name = plain(values["effect"])
    return (
        f"{name[:1].upper()}{name[1:]} has {values['weight']:.2f} against the other effects; its probability "
        f"is lower because {100 * values['explained']:.0f} % of the residual is explained and the rest may "
        "look like it"
    )


def _step(values: JSON) -> str:
    return f"a step of {values['parameter']} by {100 * values['relative']:+.1f} % after run {values['after']}"


def _between(values: JSON) -> str:
    return (
        f"the base parameters differ between conditions by {100 * values['relative']:.2g} % of the signal, "
        f"more than repeats scatter, most in {values['condition']}"
    )


def _restless(values: JSON) -> str:
    return (
        f"runs scatter by {100 * values['relative']:.2g} % of the signal, {values['times']:.0f} times what "
        "is usual: something changes from run to run (a drift, another clamping)"
    )


def _like(values: JSON) -> str:
    return f"like a {_resembled(values['effects'])}"


def _may_be(values: JSON) -> str:
    return f"it may be no {plain(values['effect'])} but a {_resembled(values['others'])}"


def _resembled(effects: Sequence[JSON]) -> str:
    """Name effects that are not of the library, with their values."""
    named = [f"{plain(effect['name'])} ({', '.join(map(_value, effect['values']))})" for effect in effects]
    return f"{' and a '.join(named)}, which is no effect of the library"


def _value(entry: JSON) -> str:
    name, unit = printed_name(entry["name"], entry["unit"]), printed(entry["unit"])
    return f"{name} {entry['value']:.3g} {unit}".rstrip()


def _unseen(values: JSON) -> str:
    return f"only where a condition is left out of the fit: {values['places']}"


def _above_floor(values: JSON) -> str:
    return (
        f"a condition that is left out of the fit is predicted with {values['ratio']:.2g} times the error "
        f"that the noise explains (chance {_chance(values['p_value'])}), the largest in {values['condition']}"
    )


def _verification(values: JSON) -> str:
    """Say how the final model does on the held-out runs; nothing is decided by it."""
    runs = f"{values['runs']} held-out run{'s' if values['runs'] > 1 else ''}"
    ratio = f"{values['ratio']:.2g} times the noise floor"
    if values["ratio"] <= 1.0:
        words = f"Verification on {runs}: the error is {ratio}."
    elif values["holds"]:
        words = (
            f"Verification on {runs}: the error is {ratio}; by noise alone it would be as large with a "
            f"chance of {_chance(values['p_value'])}."
        )
    else:
        words = (
            f"Verification on {runs} contradicts the model: the error is {ratio} (chance by noise alone "
            f"{_chance(values['p_value'])}), most in condition {values['condition']}."
        )
    if values["worse_runs"]:
        unit = printed(values["unit"])
        each = (
            f"{one['run']} ({one['before']:.2g} to {one['after']:.2g} {unit})" for one in values["worse_runs"]
        )
        words += f" With the effects the error grows in {', '.join(each)}."
    if values["without"]:
        words += f" A held-out run is beyond the model: {values['without']}."
    return words


def _chance(p_value: float) -> str:
    return f"{p_value:.2g}" if p_value >= LEAST_CHANCE else f"below {LEAST_CHANCE:g}"


def _noise(values: JSON) -> str:
    words = (
        f"From run to run the base parameters scatter by {values['scatter_percent']:.2g} % (from repeats, "
        f"drawn towards {100 * values['prior']:.2g} %); differences below {100 * values['budget']:.2g} % of "
        "the signal are the declared model-form budget and nobody's effect."
    )
    if values["systematic"]:
        words += (
            f" All runs may share an error of {100 * values['systematic']:.2g} % that the inputs of the "
            "model have; an effect must change the prediction by more than twice that."
        )
    return words


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
LEAST_PART = 0.05  # of the residual, that is told


def _ceiling(values: JSON) -> str:
    """Say how much any cause could explain, how it changes with the cut, and of which kind it is."""
    told = [(name, share) for name, share in values["parts"].items() if share >= LEAST_PART and name in PARTS]
    if not told or values["share"] <= 0.0:
        return (
            "How much of that any cause could explain cannot be seen from these runs: none is predicted by "
            "the others."
        )
    low, high = (100 * max(end, 0.0) for end in values["ci95"])
    parts = [f"{100 * share:.0f} % {PARTS[name]}" for name, share in told]
    held = "".join(
        f", {100 * max(one['share'], 0.0):.0f} % in held-out run {one['run']} (which leaves "
        f"{100 * one['of_signal']:.0f} % of its signal)"
        for one in values["held_out"][:MOST_PLACES]
    )
    places = listed([f"{place['label']} in {place['axis']}" for place in values["places"]])
    # A share that may be nothing says of no kind that it is there.
    kind = (
        f"This points to {KINDS[told[0][0]]}."
        if values["ci95"][0] > 0.0
        else "That may be chance: it points to no kind of cause."
    )
    return (
        f"Of what the base model leaves, {listed([*parts, _alone(values)])}. Whatever the cause, the other "
        f"conditions predict {100 * values['share']:.0f} % ({low:.0f} to {high:.0f} %) of it in one that is "
        f"left out{held}. It is largest at {places}. {kind}"
    )


def _alone(values: JSON) -> str:
    return f"{100 * values['parts']['alone']:.2g} % does not repeat"


SENTENCES: Mapping[str, Sentence] = {
    "ceiling": _ceiling,
    "residual": _residual,
    "residual_and_likeness": _residual_and_likeness,
    "places": _places,
    "lowered": _lowered,
    "step": _step,
    "between": _between,
    "restless": _restless,
    "like": _like,
    "may_be": _may_be,
    "unseen": _unseen,
    "above_floor": _above_floor,
    "verification": _verification,
    "noise": _noise,
    "contradiction": "not judged: the data contradict what the batch declares",
}
