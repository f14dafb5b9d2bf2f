"""What tests with a label, stable or unstable, say of the boundary, and which to make next."""

from __future__ import annotations

from collections.abc import Mapping

from metro.units import JSON
from metro.wording.candidates import Sentence
from metro.wording.names import plain


def _wrong_labels(values: JSON) -> str:
    runs = values["runs"]
    named = f": {', '.join(runs)}" if runs else ""
    return f"labels against the predicted boundary in {len(runs)} of {values['tests']} tests{named}"


def _likeness_of_labels(values: JSON) -> str:
    return f"{_perhaps(values)}a {plain(values['effect'])}, which is no effect of the library"


def _lacking(values: JSON) -> str:
    factors = ", ".join(f"{one['factor']:.2g} at {one['rpm']:.0f} rev/min" for one in values["factors"])
    cause = "a cause that the library lacks: the depth of the boundary times"
    return f"{_perhaps(values)}{cause} {factors}"


def _perhaps(values: JSON) -> str:
    return "it may be " if values["perhaps"] else ""


def _test(values: JSON) -> str:
    return f"a test at {values['rpm']:.0f} rev/min and {values['depth_mm']:.3g} mm"


def _next_test(values: JSON) -> str:
    names = " or ".join(map(plain, values["names"]))
    return (
        f"{values['test']}: its label tells most about whether it is {names} ({values['information']:.2f} "
        f"bit); the cause that leads after it is expected to have a probability of {values['leading']:.2f} "
        f"({values['leading_now']:.2f} now)"
    )


def _test_beside(values: JSON) -> str:
    return (
        f"a test beside run {values['run']}, where the prediction is least sure "
        f"(P unstable = {values['probability']:.2f})"
    )


def _surprise(values: JSON) -> str:
    return (
        f"Effects of the boundary are weighed by {values['weighed']} tests at {values['speeds']} speeds; "
        f"with probability {values['nothing']:.2g} nothing is missing. {_verified(values)}"
    )


def _surprise_alone(values: JSON) -> str:
    tests, speeds = values["tests_needed"], values["speeds_needed"]
    return (
        f"{values['weighed']} labelled tests may decide; effects of the boundary need {tests} of them that "
        f"are not held out, at {speeds} speeds or more. {_verified(values)}"
    )


def _verified(values: JSON) -> str:
    if not values["verified"]:
        return "No held-out test verifies the boundary."
    return (
        f"Labels of the {values['verified']} held-out tests drawn from the prediction would be as unlikely "
        f"as those measured with probability {values['before']:.2g} for the base model and "
        f"{values['after']:.2g} with what was found."
    )


def _verification_of_labels(values: JSON) -> str:
    right = f"{values['right']} of {values['tests']} held-out tests are on the predicted side of the boundary"
    if values["holds"]:
        return f"Verification: {right}; such labels are to be expected (chance {values['p_value']:.2g})."
    return (
        f"Verification contradicts the boundary: {right}; labels as unlikely would occur with a chance of "
        f"{values['p_value']:.2g}."
    )


SENTENCES: Mapping[str, Sentence] = {
    "wrong_labels": _wrong_labels,
    "likeness_of_labels": _likeness_of_labels,
    "lacking": _lacking,
    "test": _test,
    "next_test": _next_test,
    "any_tests": "tests with a stable or unstable label, two depths at each of three speeds, half of them "
    "held out",
    "test_beside": _test_beside,
    "verification_of_labels": _verification_of_labels,
    "surprise": _surprise,
    "surprise_alone": _surprise_alone,
}
