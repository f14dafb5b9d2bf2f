"""Why an effect is not claimed, or cannot be seen."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from metro.units import JSON, SUPERSCRIPTS, printed
from metro.wording.names import plain

Sentence = str | Callable[[JSON], str]
FEW_DIGITS = 99.5  # from here on a step is written without decimals
LEAST_SHARE = 0.05  # percent, which one decimal shows as 0.0


def _not_converged(values: JSON) -> str:
    step = float(values["step"])
    by = f"{step:.2g}" if step < FEW_DIGITS else f"{step:.0f}"
    return f"the fit did not converge (next step: {by} standard deviations), so that it was not tested"


def _implausible(values: JSON) -> str:
    return f"its {values['parameter']} would exceed the plausible limit of {values['bound']:g}"


def _beside(values: JSON) -> str:
    return f"with it, {plain(values['effect'])} is no result: {values['why']}"


def _tied(values: JSON) -> str:
    return (
        f"{plain(values['effect'])} would begin at the same time in every repeat (mean cosine of the phases' "
        f"difference {values['cosine']:.2f}, {values['pairs']} pairs of runs), which no free vibration does"
    )


def _no_prediction(values: JSON) -> str:
    return f"in {values['run']} {values['why']}"


def _no_evidence(values: JSON) -> str:
    evidence = f"not significant: p = {values['p_value']:.2g} over the identification runs"
    q_value = values["q_value"]
    return evidence + (f" (q = {q_value:.2g} over all effects tried)" if q_value is not None else "")


def _immaterial(values: JSON) -> str:
    size, least = 100 * values["size"], 100 * values["least"]
    return f"immaterial: it changes the prediction by {size:.2f} %, less than {least:.2g} %"


def _small_beside_residual(values: JSON) -> str:
    return (
        f"it changes the prediction by {100 * values['size']:.2g} %, while {100 * values['missed']:.2g} % of "
        "the signal remain unexplained; an unknown cause may have the same signature"
    )


def _no_gain(values: JSON) -> str:
    gain = float(values["gain"])
    return f"no better prediction of left-out conditions: gain {gain:.1f}, {values['needed']:g} needed"


def _better_in_few(values: JSON) -> str:
    return f"it improves only {100 * values['share']:.0f} % of the left-out conditions"


def _confounded(values: JSON) -> str:
    return f"these runs do not distinguish it from {plain(' and '.join(values['effects']))}"


def _absorbed(values: JSON) -> str:
    share = 100 * values["share"]
    if share < LEAST_SHARE:
        return "the base parameters absorb its signature completely"
    return f"the base parameters absorb all but {share:.1f} % of its signature"


def _hidden_by_zeros(values: JSON) -> str:
    # Two digits of 150 are written with an exponent by .2g, but not by g; those of 7e10 have one either way.
    least = float(f"{values['least']:.2g}")
    digits, _, power = f"{least:g}".partition("e")
    exponent = f"·10{str(int(power)).translate(SUPERSCRIPTS)}" if power else ""
    size = f"{digits}{exponent} {printed(values['unit'])}".rstrip()
    return (
        "the offset and the position that are fitted in each run absorb all but "
        f"{100 * values['share']:.1f} % "
        f"of it: it can be detected from a size of {size} on"
    )


def _hidden_in_labels(values: JSON) -> str:
    least = f"{values['least']:.2g}"
    return f"no plausible value of it changes the predicted probability of a test by more than {least}"


def _improbable(values: JSON) -> str:
    probability, needed = values["probability"], values["needed"]
    return f"not significant: probability {probability:.2f} against no effect, {needed:.2f} needed"


def _no_gain_at_speeds(values: JSON) -> str:
    gain = float(values["gain"])
    return f"no better prediction of left-out speeds: gain {gain:.1f}, {values['needed']:g} needed"


def _immaterial_for_labels(values: JSON) -> str:
    size, least = f"{values['size']:.2g}", f"{values['least']:g}"
    return f"immaterial: it changes the predicted probabilities by {size} rms, less than {least}"


def _misses_half(values: JSON) -> str:
    return (
        f"even with it the model misses {100 * values['share']:.0f} % of the signal: check what the batch "
        "declares (axes, units, tool, run table) before looking for a cause"
    )


def _far_behind(values: JSON) -> str:
    return (
        f"another effect fits the same runs far better ({values['behind']:.0f} in log-likelihood): "
        "this one was not tested further"
    )


def _holds_nothing(values: JSON) -> str:
    return (
        "its interval holds no effect at all, once what the model gets wrong may be the same in all "
        f"conditions (p = {values['p_value']:.2g})"
    )


SENTENCES: Mapping[str, Sentence] = {
    "undetermined": "these runs do not determine its parameters",
    "unlike": "not an effect of the library, and it does not explain the remaining error",
    "unbelieved": "with what stays unexplained beside it, it is not likelier than not to be the cause",
    "misses_half": _misses_half,
    "holds_nothing": _holds_nothing,
    "resembled": "not an effect of the library: it only describes the remaining error",
    "beaten": "passed every test by itself, but the model that was chosen explains the runs better",
    "far_behind": _far_behind,
    "untested": "not tested: every run was used in the fit, so none is available to judge it",
    "not_converged": _not_converged,
    "implausible": _implausible,
    "beside": _beside,
    "tied": _tied,
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
