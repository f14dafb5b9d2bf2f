"""What tests with a label, stable or unstable, say of the boundary, and which to make next."""

from __future__ import annotations

from collections.abc import Mapping

from metro.units import JSON
from metro.wording.candidates import Sentence
from metro.wording.names import plain


def _wrong_labels(values: JSON, kind: str = "tests") -> str:
    runs = values["runs"]
    named = f": {', '.join(runs)}" if runs else ""
    return f"{len(runs)} of {values['tests']} {kind} contradict the predicted boundary{named}"


def _wrong_held_out(values: JSON) -> str:
    return _wrong_labels(values, "held-out tests")


def _likeness_of_labels(values: JSON) -> str:
    return f"{_perhaps(values)}a {plain(values['effect'])}, which is not an effect of the library"


def _lacking(values: JSON) -> str:
    factors = ", ".join(f"{one['factor']:.2g} at {one['rpm']:.0f} rev/min" for one in values["factors"])
    cause = "a cause outside the library, which multiplies the stable depth by"
    return f"{_perhaps(values)}{cause} {factors}"


def _perhaps(values: JSON) -> str:
    return "it may be " if values["perhaps"] else ""


def _test(values: JSON) -> str:
    return f"a test at {values['rpm']:.0f} rev/min and {values['depth_mm']:.3g} mm"


def _next_test(values: JSON) -> str:
    names = " or ".join(map(plain, values["names"]))
    now, then = f"{values['leading_now']:.2f}", f"{values['leading']:.2f}"
    promise = (
        f"The probability of the most probable cause is expected to rise from {now} to {then}"
        if now != then
        else f"One test changes little: the most probable cause has a probability of {now}, now and after it"
    )
    directly = "".join(map(_directly, values.get("directly", [])))
    return f"{values['test']}: its result best distinguishes {names}. {promise}{directly}"


def _directly(values: JSON) -> str:
    """Say what shows an effect without a further cut."""
    at = f" at about {values['near_hz']:.3g} Hz" if "near_hz" in values else ""
    return f". What shows {plain(values['effect'])}{at} directly: {values['experiment']}"


def _test_beside(values: JSON) -> str:
    return (
        f"a test near the settings of run {values['run']}, where the prediction is least certain "
        f"(P unstable = {values['probability']:.2f})"
    )


def _any_tests(values: JSON) -> str:
    if values["enough"]:
        return (
            f"no new cut: {values['held_out']} labelled tests are held out; in runs.csv give about half of "
            "them, at three speeds or more, the role identify"
        )
    return "tests with a stable or unstable label, two depths at each of three speeds, half of them held out"


def _surprise(values: JSON) -> str:
    return (
        f"{values['weighed']} tests at {values['speeds']} speeds were used to compare causes; with a "
        f"probability of {values['nothing']:.2g} no effect is missing. {_verified(values)}"
    )


def _surprise_alone(values: JSON) -> str:
    tests, speeds = values["tests_needed"], values["speeds_needed"]
    return (
        f"{values['weighed'] or 'No'} labelled tests have the role identify; to compare causes, at least "
        f"{tests} at {speeds} speeds are needed that are not held out. {_verified(values)}"
    )


def _verified(values: JSON) -> str:
    if not values["verified"]:
        return "No held-out test verifies the boundary."
    return (
        f"If the prediction is right, {values['verified']} held-out results as unlikely as those observed "
        f"occur with a probability of {values['before']:.2g} for the base model and {values['after']:.2g} "
        "with the effects found."
    )


def _verification_of_labels(values: JSON) -> str:
    right = f"{values['right']} of {values['tests']} held-out tests are on the predicted side of the boundary"
    if values["holds"]:
        return f"Verification: {right}, which agrees with the prediction (p = {values['p_value']:.2g})."
    return f"Verification contradicts the boundary: {right} (p = {values['p_value']:.2g})."


SENTENCES: Mapping[str, Sentence] = {
    "wrong_labels": _wrong_labels,
    "wrong_held_out": _wrong_held_out,
    "likeness_of_labels": _likeness_of_labels,
    "lacking": _lacking,
    "test": _test,
    "next_test": _next_test,
    "any_tests": _any_tests,
    "test_beside": _test_beside,
    "verification_of_labels": _verification_of_labels,
    "surprise": _surprise,
    "surprise_alone": _surprise_alone,
}
