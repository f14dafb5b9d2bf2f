"""A proposal as files: a package of its own with the effect, and tests that it may fail."""

from __future__ import annotations

import textwrap

from metro.discovery.blueprint import Blueprint, kinds, written
from metro.discovery.entry import LITERATURE, Entry
from metro.discovery.example import Workshop
from metro.discovery.words import parameter_lines
from metro.effects.effect import EffectParameter
from metro.observables.force.shapes import CIRCUMSTANCES
from metro.units import JSON

WIDTH = 100
REVIEW = (
    "Nobody has explained it yet: find the cause behind it, give the effect its name and its "
    "literature, and correct its bounds."
)


def files(batch: str, version: str, entry: Entry, said: JSON, shop: Workshop) -> dict[str, str]:
    """Return the text of each file of a draft, by its name.

    ``said``: the record of the proposal. ``shop``: settings of the batch, for the tests.
    """
    module = entry.name
    term = next(one for one in said["terms"] if one["name"] == entry.name)
    drafted = f"Drafted by metro {version} from the force of {batch}. {REVIEW}"
    return {
        "pyproject.toml": _project(module),
        f"{module}.py": _effect(drafted, entry, said, term),
        f"test_{module}.py": _tests(batch, entry, _values(term), shop),
    }


def _project(module: str) -> str:
    name = module.replace("_", "-")
    return f"""[project]
name = "{name}"
version = "0.1"
dependencies = ["metro-machining"]

[build-system]
requires = ["setuptools"]
build-backend = "setuptools.build_meta"

[tool.setuptools]
py-modules = ["{module}"]

[project.entry-points."metro.effects"]
{module} = "{module}:EFFECT"
"""


def _effect(drafted: str, entry: Entry, said: JSON, term: JSON) -> str:
    values = _values(term)
    called = sorted(set(kinds(entry.plan)) - {"Shape"})
    shapes = "from metro.observables.force.shapes import Shape\n" if "Shape" in kinds(entry.plan) else ""
    needed = [name for name in entry.variables if name in CIRCUMSTANCES]
    adapt = f"    adapt=varying({', '.join(map(repr, needed))}),\n".replace("'", '"') if needed else ""
    varying = "from metro.effects.varying import varying\n" if needed else ""
    parameters = "".join(f"        {_parameter(one, values[one.name])},\n" for one in entry.parameters)
    return f'''"""{entry.words}

    {entry.formula}

{_wrapped(drafted)}

{chr(10).join(_evidence(said, term))}
"""

from metro.effects.effect import Effect, EffectParameter
{varying}{shapes}from metro.observables.force.terms import {", ".join(called)}


def apply(model, values):
    """Return the force model with the term on top of what it has; a size of zero changes nothing."""
    term = {_call(entry.plan)}
    return model.with_term(term)


EFFECT = Effect(
    name="{entry.name}",
    observables=("force",),
    parameters=(
{parameters}    ),
    apply=apply,
{adapt}    signature="{entry.words}",
    literature="{LITERATURE}",
    experiment="{_experiment(said)}",
)
'''


def _call(plan: Blueprint) -> str:
    """Return the code of a call with an argument in each line."""
    arguments = "".join(f"        {name}={written(one)},\n" for name, one in plan.arguments)
    return f"{plan.kind.__name__}(\n{arguments}    )"


def _values(term: JSON) -> dict[str, float]:
    return {name: one["value"] for name, one in term["parameters"].items()}


def _evidence(said: JSON, term: JSON) -> list[str]:
    """Return what speaks for the proposal, for the head of the file."""
    lines = [line.strip() for line in parameter_lines(term)]
    lines.append(f"gain on left-out conditions: {term['gain']:.1f} in log-likelihood")
    verified = (said["proposal"] or {}).get("verification")
    if verified:
        lines.append(
            f"rms error on verification runs: {verified['before']:.3g} {verified['unit']} before, "
            f"{verified['after']:.3g} {verified['unit']} after"
        )
    return lines


def _experiment(said: JSON) -> str:
    test = (said["proposal"] or {}).get("test")
    return test["words"].replace('"', "'") if test else ""


def _parameter(one: EffectParameter, value: float) -> str:
    """Return the code of a parameter that begins where it was found, and, if it may, with the other sign."""
    short = float(f"{value:.4g}")
    starts = (short, -short) if one.lower == -one.upper and short else (short,)
    neutral = f", neutral={one.neutral!r}" if one.neutral else ""
    limits = [name for name in ("nothing_below", "nothing_above") if getattr(one, name)]
    bound = "".join(f", {name}=True" for name in limits)
    return (
        f'EffectParameter("{one.name}", "{one.unit}", {_short(one.lower)}, {_short(one.upper)}, '
        f"{_short(one.scale)}, starts={starts!r}{neutral}{bound})"
    )


def _short(value: float) -> str:
    return repr(float(f"{value:.4g}"))


def _tests(batch: str, entry: Entry, values: dict[str, float], shop: Workshop) -> str:
    rows = "".join(f"        {row!r},\n".replace("'", '"') for row in shop.rows)
    kept = {name: float(f"{value:.4g}") for name, value in values.items()}
    first = entry.sizes[0].name
    return f'''"""The draft on runs that are made with it and without it, at the settings of {batch}."""

import numpy as np
from {entry.name} import EFFECT

from metro.discovery.example import Workshop, estimated

VALUES = {str(kept).replace("'", '"')}
SHOP = Workshop(
    radius={shop.radius!r},
    helix={shop.helix!r},
    tooth_angles={shop.tooth_angles!r},
    coefficients={shop.coefficients!r},
    rows=(
{rows}    ),
)
WITHIN = 4.0  # standard deviations


def test_it_is_found_with_its_size_in_runs_that_have_it():
    fitted, deviations = estimated(EFFECT, SHOP, VALUES, seed=1)
    found = EFFECT.values(fitted.theta)["{first}"]
    assert abs(found - VALUES["{first}"]) < WITHIN * deviations[0]
    assert abs(VALUES["{first}"]) > WITHIN * deviations[0]


def test_it_is_not_found_in_runs_that_lack_it():
    fitted, deviations = estimated(EFFECT, SHOP, None, seed=2)
    assert not abs(fitted.theta[0]) > WITHIN * deviations[0]
    assert np.isfinite(fitted.total)
'''


def _wrapped(text: str) -> str:
    return textwrap.fill(text, WIDTH)
