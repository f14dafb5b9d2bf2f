"""Why an effect is not claimed, or cannot be seen."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from metro.units import JSON, printed
from metro.wording.names import plain

Sentence = str | Callable[[JSON], str]
FEW_DIGITS = 99.5  # from here on a step is written without decimals


def _not_converged(values: JSON) -> str:
    step = float(values["step"])
    by = f"{step:.2g}" if step < FEW_DIGITS else f"{step:.0f}"
    return f"its fit did not converge: a step more would move a parameter by {by} of its sd"


def _implausible(values: JSON) -> str:
    return f"its {values['parameter']} would be beyond {values['bound']:g}, which is not plausible"


def _no_prediction(values: JSON) -> str:
    return f"in {values['run']} {values['why']}"


def _no_evidence(values: JSON) -> str:
    evidence, q_value = (
        f"no evidence: p = {values['p_value']:.2g} over the runs of the fit",
        values["q_value"],
    )
    by_chance = f", which one of so many reaches by chance (q = {q_value:.2g})" if q_value is not None else ""
    return evidence + by_chance


def _immaterial(values: JSON) -> str:
    size, least = 100 * values["size"], 100 * values["least"]
    return f"changes the prediction by {size:.2f} %: below {least:.2g} %, immaterial"


def _small_beside_residual(values: JSON) -> str:
    return (
        f"changes the prediction by {100 * values['size']:.2g} %, where {100 * values['missed']:.2g} % "
        "stay unexplained: what is missing may look like it"
    )


def _no_gain(values: JSON) -> str:
    gain = float(values["gain"])
    return f"predicts left-out conditions no better: gain {gain:.1f}, {values['needed']:g} needed"


def _better_in_few(values: JSON) -> str:
    return f"better in {100 * values['share']:.0f} % of the left-out conditions only"


def _confounded(values: JSON) -> str:
    return f"these runs do not tell it from {plain(' and '.join(values['effects']))}"


def _absorbed(values: JSON) -> str:
    return f"the base parameters imitate all but {100 * values['share']:.1f} % of its signature"


def _hidden_by_zeros(values: JSON) -> str:
    least = f"{float(values['least']):.2g} {printed(values['unit'])}".rstrip()
    return (
        f"the zeros of each run (its offset, its place) take all but {100 * values['share']:.1f} % of it: "
        f"it shows from {least} on"
    )


def _hidden_in_labels(values: JSON) -> str:
    least = f"{values['least']:.2g}"
    return (
        f"no value of it that is plausible changes the predicted probability of a test by more than {least}"
    )


def _improbable(values: JSON) -> str:
    probability, needed = values["probability"], values["needed"]
    return f"no evidence: probability {probability:.2f} against nothing, {needed:.2f} needed"


def _no_gain_at_speeds(values: JSON) -> str:
    gain = float(values["gain"])
    return f"predicts left-out speeds no better: gain {gain:.1f}, {values['needed']:g} needed"


def _immaterial_for_labels(values: JSON) -> str:
    size, least = f"{values['size']:.2g}", f"{values['least']:g}"
    return f"changes the predicted probabilities by {size} rms: below {least}, immaterial"


def _misses_half(values: JSON) -> str:
    return (
        f"even with it the model misses {100 * values['share']:.0f} % of the signal: check what the batch "
        "declares (axes, units, tool, run table) before any cause is sought"
    )


SENTENCES: Mapping[str, Sentence] = {
    "undetermined": "these runs do not determine its parameters",
    "unlike": "no effect of the library, and it does not explain the rest either",
    "unbelieved": "more stays unexplained with it than it explains",
    "misses_half": _misses_half,
    "resembled": "no effect of the library: it is only said what the rest is like",
    "beaten": "passed every gate, but what was added explains the runs better",
    "untested": "not tested: there is no run to judge it by that the fit has not seen",
    "not_converged": _not_converged,
    "implausible": _implausible,
    "no_prediction": _no_prediction,
    "no_evidence": _no_evidence,
    "immaterial": _immaterial,
    "small_beside_residual": _small_beside_residual,
    "no_gain": _no_gain,
    "better_in_few": _better_in_few,
    "confounded": _confounded,
    "absorbed": _absorbed,
    "hidden_by_zeros": _hidden_by_zeros,
    "hidden_in_labels": _hidden_in_labels,
    "improbable": _improbable,
    "no_gain_at_speeds": _no_gain_at_speeds,
    "immaterial_for_labels": _immaterial_for_labels,
}
