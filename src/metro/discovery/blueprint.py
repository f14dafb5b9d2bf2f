"""Blueprints: objects whose numbers are not known yet, which can be built, and written as code."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

Values = Mapping[str, Any]


@dataclass(frozen=True)
class Given:
    """A number that is a parameter: its name, and the size of its unit where the number is used."""

    name: str
    si: float = 1.0


@dataclass(frozen=True)
class Blueprint:
    """A call of ``kind`` with arguments by name: numbers, words, parameters, blueprints, tuples of these."""

    kind: type
    arguments: tuple[tuple[str, Any], ...]

    @classmethod
    def of(cls, kind: type, **arguments: Any) -> Blueprint:
        """Return the blueprint of a call."""
        return cls(kind, tuple(arguments.items()))


def built(plan: Any, values: Values) -> Any:
    """Return what a blueprint makes of values of its parameters."""
    if isinstance(plan, Given):
        return values[plan.name] * plan.si
    if isinstance(plan, Blueprint):
        return plan.kind(**{name: built(one, values) for name, one in plan.arguments})
    if isinstance(plan, tuple):
        return tuple(built(one, values) for one in plan)
    return plan


def written(plan: Any) -> str:
    """Return the code that makes what a blueprint makes, of a mapping that is called ``values``."""
    if isinstance(plan, Given):
        value = f'values["{plan.name}"]'
        return value if plan.si == 1.0 else f"{value} * {plan.si!r}"
    if isinstance(plan, Blueprint):
        arguments = ", ".join(f"{name}={written(one)}" for name, one in plan.arguments)
        return f"{plan.kind.__name__}({arguments})"
    if isinstance(plan, tuple):
        inner = ", ".join(written(one) for one in plan)
        return f"({inner},)" if len(plan) == 1 else f"({inner})"
    return repr(plan).replace("'", '"') if isinstance(plan, str) else repr(plan)


def kinds(plan: Any) -> Iterator[str]:
    """Go through the names of all that a blueprint calls."""
    if isinstance(plan, Blueprint):
        yield plan.kind.__name__
        for _, one in plan.arguments:
            yield from kinds(one)
    elif isinstance(plan, tuple):
        for one in plan:
            yield from kinds(one)
