"""known: the parameters of the effects that a manifest declares, by the names that their models go by.

This package does not import the library of effects, so that a change of an effect does not make the raw files
be read again. What it needs to know of each effect is in ``schemas/known.json``, which
``scripts/reference.py`` writes from the library; effects of other packages are loaded by their entry points.
"""

from __future__ import annotations

import functools
import importlib.resources
import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from importlib.metadata import entry_points
from typing import Any, Protocol

from metro.batch.documents import Likeness, likeness, without_comma
from metro.batch.findings import Finding, Severity, shown
from metro.batch.ranges import expected_for, range_of, within
from metro.joint_columns import AXES, MOST_AXES
from metro.spelling import suggestion
from metro.units import JSON

REGISTRY = "schemas/known.json"
# The contract describes the parameters of these in words: a name of another program is no misspelt one.
UNNAMED = {"entry_transient", "flange_rotation", "spindle_speed_softening"}
JOINTS = (*AXES, "all")


class Parameter(Protocol):
    """What is asked of a parameter of an effect."""

    @property
    def name(self) -> str:
        """Name, as the manifest has it."""
        ...

    @property
    def choices(self) -> tuple[str, ...]:
        """Values, where it is a choice among words."""
        ...


class Declarable(Protocol):
    """What is asked of an effect that a manifest may declare."""

    @property
    def name(self) -> str:
        """Name, as the manifest has it."""
        ...

    @property
    def reported(self) -> tuple[Parameter, ...]:
        """Its parameters, one for each value."""
        ...

    @property
    def where(self) -> Mapping[str, int | str]:
        """What else says which form of the effect is meant: a joint."""
        ...

    @property
    def left_out(self) -> Mapping[str, Any]:
        """Values of the parameters that may be left out, by name."""
        ...

    @property
    def resembled(self) -> bool:
        """Whether it is no cause that can be known, but only what a residual may look like."""
        ...


def registry(effects: Iterable[Declarable]) -> JSON:
    """Return what can be declared of effects, by their names.

    ``forms``: for each form the names of all its parameters; ``choices``: the words that a parameter which is
    no number may be.
    """
    entries: JSON = {}
    for effect in effects:
        if effect.resembled:
            continue
        entry = entries.setdefault(effect.name, {"forms": [], "choices": {}})
        every = list(dict.fromkeys([*effect.where, *(parameter.name for parameter in effect.reported)]))
        needed = [name for name in every if name not in effect.left_out]
        for form in (needed, every):
            entry["forms"] += [form] if form not in entry["forms"] else []
        entry["choices"] |= {each.name: list(each.choices) for each in effect.reported if each.choices}
        entry["choices"] |= {name: [word] for name, word in effect.where.items() if name != "joint"}
    for entry in entries.values():
        entry["forms"].sort(key=lambda form: (len(form), form))
    return dict(sorted(entries.items()))


def declarable() -> JSON:
    """Return what can be declared of this package's effects and of those that other packages offer."""
    known: JSON = {name: dict(entry) for name, entry in _own().items()}
    loaded = [entry.load() for entry in entry_points(group="metro.effects")]
    offered = [effect for one in loaded for effect in (one if isinstance(one, tuple | list) else [one])]
    for name, entry in registry(offered).items():
        before = known.get(name, {"forms": [], "choices": {}})
        forms = [*before["forms"], *(form for form in entry["forms"] if form not in before["forms"])]
        known[name] = {"forms": forms, "choices": {**before["choices"], **entry["choices"]}}
    return known


@functools.cache
def _own() -> JSON:
    text = importlib.resources.files("metro.batch").joinpath(REGISTRY).read_text(encoding="utf-8")
    content: JSON = json.loads(text)
    return content


def known_findings(
    known: JSON, file: str, severity: Callable[[tuple[str, ...], Likeness], Severity]
) -> Iterator[Finding]:
    """Check what is declared: the names of the effects, those of their parameters, and the values.

    A name of a parameter too many is a warning, since fields may be added; one that stands where a parameter
    is missing is an error.

    Parameters
    ----------
    known : effect → parameter → value.
    file : the manifest's name in messages.
    severity : how bad an unknown key is, by the keys that lead to it and what it is to the known ones.
    """
    if not known:
        return
    can = declarable()
    strange = [name for name in known if name not in can]
    for name in strange:
        message = f"is not a known key{suggestion(name, can)}"
        how = severity(("known",), likeness(name, list(can), known))
        yield Finding(how, file, message, column=f"known.{name}")
    for effect, values in known.items():
        if effect not in strange:
            yield from _of_effect(effect, values, can[effect], file)


def _of_effect(effect: str, values: JSON, can: JSON, file: str) -> Iterator[Finding]:
    """Check what is declared of one effect, which the library has."""
    forms: list[list[str]] = can["forms"]
    names = list(dict.fromkeys(name for form in forms for name in form))
    whole = any(set(form) <= set(values) for form in forms)
    strange = [name for name in values if name not in names]
    expected = f"expected {' or '.join(', '.join(form) for form in forms)}"
    for name in strange:
        severity: Severity = "warning" if whole or effect in UNNAMED else "error"
        message = f"is not a parameter of {effect}{suggestion(name, names)}, {expected}"
        yield Finding(severity, file, message, column=f"known.{effect}.{name}")
    if not whole and (not strange or effect in UNNAMED):
        missing = ", ".join(name for name in forms[0] if name not in values)
        message = f"lacks {missing}, {expected}: without it the base model does not include this effect"
        yield Finding("warning", file, message, column=f"known.{effect}")
    for name in (name for name in names if name in values):
        if fault := _fault(name, values[name], can["choices"].get(name, [])):
            yield Finding("error", file, fault, column=f"known.{effect}.{name}")


def _fault(name: str, value: Any, choices: list[str]) -> str | None:
    """Say what is wrong with the value of a parameter."""
    if name == "joint":
        expected = (
            "" if value in JOINTS and not isinstance(value, bool) else f"a joint, 1 to {MOST_AXES}, or all"
        )
    elif choices:
        expected = "" if value in choices else " or ".join(choices)
    else:
        entries = value if isinstance(value, list) else [value]
        sound = entries and all(isinstance(e, int | float) and not isinstance(e, bool) for e in entries)
        expected = "" if sound else f"a number, or a list of them{without_comma(value)}"
        rule = range_of("known_parameter")
        outside = [each for each in entries if sound and not within(rule, each)]
        expected = expected_for(rule, outside[0]) if outside else expected
    return f"found {shown(value)}, expected {expected}" if expected else None
