"""The reference of the effects, from the library: what each is, what tells it, and its parameters."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import groupby

from metro.effects.effect import Effect
from metro.effects.library import library
from metro.units import printed

HEAD = """\
The loop tries these effects where a base model has a residual ([reading a verdict](verdict.md)). Each effect
is a file of `src/metro/effects`; [adding an effect](effects.md) says how to make another. Signs and zeros:
[data contract](data-contract.md#signs-frames-and-zeros). `metro simulate` hides effects in batches to try.

An **effect** is named in a verdict, and the model is corrected for it. An **alternative explanation** is
tried in the same way, so that it is not mistaken for an effect, but the model is never corrected for it: it
describes the remaining error in the verdict.

A parameter is searched for between the two bounds; several effects move them to what a batch can show.
*Per joint* means that each of the joints of an arm is tried by itself, and the verdict names the joint. [K]
is one of the [three publications](errata.md#the-publications).
"""
EFFECTS, LIKENESSES = "## Effects", "## Alternative explanations"


def effects_page(note: str, meanings: Mapping[str, str]) -> str:
    """Return the page; ``meanings`` of the parameters, by ``effect.parameter``.

    Raises
    ------
    ValueError
        A parameter has no meaning, or a meaning has no parameter.
    """
    effects = [effect for effect in library() if effect.apply.__module__.startswith("metro.")]
    named = {f"{effect.name}.{name}" for effect in effects for name in effect.names}
    if named != set(meanings):
        raise ValueError(f"reference.yaml, effects: differ in {sorted(named ^ set(meanings))}")
    causes = [list(forms) for _, forms in groupby(effects, key=lambda effect: effect.name)]
    lines = ["# Reference: the effects\n", note, HEAD]
    for title, alike in ((EFFECTS, False), (LIKENESSES, True)):
        chosen = [forms for forms in causes if forms[0].resembled is alike]
        lines += [title, "", row(["name", "observables", "what it is"]), row(["---"] * 3)]
        lines += [row([f"[{f[0].name}](#{f[0].name})", _observables(f), _what(*f)]) for f in chosen]
        lines += ["", *(line for forms in chosen for line in _cause(forms, meanings))]
    return "\n".join(lines)


def row(cells: Sequence[str]) -> str:
    """Write a row of a table."""
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _cause(forms: list[Effect], meanings: Mapping[str, str]) -> list[str]:
    """Return the section of a cause: forms with the same description share a table."""
    lines = [f"### {forms[0].name}\n", f"{_what(*forms)}\n"]
    for effects in _alike(forms):
        first = effects[0]
        label = _label(effects)
        lines += [f"{f'*{label[:1].upper()}{label[1:]}*, of' if label else 'Of'} {_observables(effects)}:\n"]
        lines += [row(["parameter", "unit", "sought between", "meaning"]), row(["---"] * 4)]
        lines += [_parameter(first, name, meanings[f"{first.name}.{name}"]) for name in first.names]
        lines += ["", f"- *Seen:* {first.signature}", f"- *Measure:* {first.experiment}."]
        lines += [f"- *Remedy:* {first.remedy}."] if first.remedy else []
        lines += [f"- *Belongs to:* {_owners(first)}.", f"- *Source:* {first.literature}.", ""]
    return lines


def _owners(effect: Effect) -> str:
    """Say what the parameters are a property of, and where a campaign does not follow them."""
    named = " and ".join(f"the {owner}" for owner in effect.belongs_to)
    return named if effect.comparable else f"{named}; batches cannot be compared by it"


def _parameter(effect: Effect, name: str, meaning: str) -> str:
    """Return the row of the parameter of a name, or of the list of those that have it."""
    first, *more = (parameter for parameter in effect.reported if parameter.name == name)
    numbers = f"{first.lower:g} and {first.upper:g}".replace("-", "−")
    listed = f"; a list of {1 + len(more)}" if more else ""
    cells = [f"`{name}`", printed(first.unit) or "–", " or ".join(first.choices) or numbers, meaning + listed]
    return row(cells)


def _alike(forms: Iterable[Effect]) -> list[list[Effect]]:
    """Group the forms with the same description, whatever the joint."""
    groups: dict[tuple[object, ...], list[Effect]] = {}
    for effect in forms:
        joint = effect.where.get("joint") not in {None, "all"}
        told = (effect.signature, effect.experiment, effect.observables, joint, joint or effect.form)
        groups.setdefault(told, []).append(effect)
    return list(groups.values())


def _label(effects: list[Effect]) -> str:
    """Say which forms these are: joint by joint, or the one that has a name."""
    return "per joint" if len(effects) > 1 else effects[0].form


def _observables(effects: Iterable[Effect]) -> str:
    return ", ".join(dict.fromkeys(f"`{name}`" for effect in effects for name in effect.observables))


def _what(*forms: Effect) -> str:
    """Say what effects are, each sentence once."""
    return " ".join(dict.fromkeys(effect.meaning for effect in forms))
