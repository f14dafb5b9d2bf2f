"""The page of the constants that decide verdicts: each is on it with the value that the code has."""

from __future__ import annotations

import ast
import importlib
import re
from collections import Counter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
import yaml

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs/constants.md"
SOURCE = ROOT / "src/metro"
FOLDERS = ("checks", "search", "verdict", "causes", "labels")
SINGLE = (
    "loop/fitting/noise.py",
    "loop/fitting/expectation.py",
    "loop/fitting/fit.py",
    "loop/fitting/end.py",
    "loop/fitting/reestimate.py",
    "loop/fitting/covariance.py",
    "loop/ceiling.py",
    "loop/measured_poses.py",
    "signals/steady.py",
    "observables/force/observable.py",
    "observables/force/blocks.py",
    "observables/joint_force/friction.py",
    "observables/joint_force/observable.py",
    "observables/flatness/beliefs.py",
    "observables/flatness/beside.py",
    "observables/flatness/held.py",
    "observables/flatness/blocks.py",
    "observables/flatness/dynamics.py",
    "observables/flatness/observable.py",
    "observables/arm/idle_runs.py",
    "observables/deformation/blocks.py",
    "observables/deformation/gear_waves.py",
    "observables/deformation/observable.py",
    "observables/waviness/blocks.py",
    "observables/waviness/observable.py",
    "observables/arm/tip_force.py",
    "robot/stribeck.py",
    "effects/joint_backlash.py",
    "effects/tool_offset_error.py",
    "robot/kinematics.py",
    "observables/stability/boundary.py",
    "observables/stability/errors.py",
    "robot/drive_torques.py",
    "robot/presliding.py",
)
KINDS = ("derived", "calibrated", "chosen", "numerical")
ROW = re.compile(r"\| `([^`]+)`, `([^`]+)` \| `([^`]+)` \| (.+?) \| \*\*(\w+)\*\*(.*) \|")
COUNT = re.compile(
    r"It has (\d+) constants: (\d+) are derived, (\d+) (?:is|are) calibrated, (\d+) are chosen, "
    r"and (\d+) are numerical .*? Of the chosen ones, (\d+) are levels"
)

Key = tuple[str, str]  # module below src/metro, or the configuration; name


class Row(NamedTuple):
    """A row of the page."""

    key: Key
    value: str
    kind: str
    why: str


def numeric(value: Any) -> bool:
    """Whether a value is a number, an array, or made of nothing but numbers."""
    if isinstance(value, dict):
        return bool(value) and all(map(numeric, value.values()))
    if isinstance(value, (tuple, list, set, frozenset)):
        return bool(value) and all(map(numeric, value))
    return isinstance(value, (int, float, np.ndarray)) and not isinstance(value, bool)


def assigned(source: str) -> dict[str, str]:
    """Names that a module assigns at its top, with the expressions: of tuples, each its own."""
    found = {}
    for node in ast.parse(source).body:
        if isinstance(node, ast.Assign):
            targets, value = node.targets, node.value
        elif isinstance(node, ast.AnnAssign) and node.value is not None:
            targets, value = [node.target], node.value
        else:
            continue
        for target in targets:
            names, values = [target], [value]
            if isinstance(target, ast.Tuple):
                assert isinstance(value, ast.Tuple), ast.unparse(node)
                names, values = target.elts, value.elts
            found |= {ast.unparse(n): ast.unparse(v) for n, v in zip(names, values, strict=True)}
    return found


def modules() -> list[str]:
    """Modules that decide verdicts, below src/metro."""
    folders = [path for name in FOLDERS for path in sorted((SOURCE / "loop" / name).glob("*.py"))]
    return [path.relative_to(SOURCE).as_posix() for path in folders] + list(SINGLE)


def in_code() -> dict[Key, str]:
    """Numeric constants of the modules, and the thresholds of the configuration, as expressions."""
    found: dict[Key, str] = {}
    for module in modules():
        name = "metro." + module.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
        values = vars(importlib.import_module(name))
        for constant, expression in assigned((SOURCE / module).read_text("utf-8")).items():
            if numeric(values[constant]):
                found[module, constant] = expression
    settings = yaml.safe_load((ROOT / "config/config.yaml").read_text("utf-8"))["loop"]
    return found | {("config/config.yaml", f"loop.{key}"): repr(value) for key, value in settings.items()}


def on_page() -> list[Row]:
    """Rows of all tables of the page; each line of a table that is no head must be one."""
    rows = []
    for line in PAGE.read_text("utf-8").splitlines():
        if line.startswith("|") and not line.startswith(("| constant |", "| --- |")):
            row = ROW.fullmatch(line)
            assert row, line
            name, module, value, _, kind, why = row.groups()
            rows.append(Row((module, name), value, kind, why))
    return rows


def normal(expression: str) -> str:
    """An expression in the one way in which Python writes it."""
    return ast.unparse(ast.parse(expression, mode="eval"))


def test_the_page_has_every_constant_once_and_no_other():
    listed = Counter(row.key for row in on_page())
    assert listed == Counter(in_code().keys())


def test_the_page_has_the_values_of_the_code():
    code = in_code()
    assert {row.key: normal(row.value) for row in on_page() if row.key in code} == {
        key: normal(value) for key, value in code.items()
    }


def test_the_first_paragraph_counts_what_the_tables_hold():
    rows = on_page()
    kinds = Counter(row.kind for row in rows)
    levels = sum(row.kind == "chosen" and row.why.startswith(", a level") for row in rows)
    assert set(kinds) == set(KINDS)
    stated = COUNT.search(PAGE.read_text("utf-8").split("\n\n")[1])
    assert stated
    assert [int(one) for one in stated.groups()] == [len(rows), *(kinds[kind] for kind in KINDS), levels]


def test_what_is_derived_or_calibrated_says_from_what():
    bare = [row.key for row in on_page() if row.kind in ("derived", "calibrated") and len(row.why) < 20]
    assert bare == []


def test_numerical_ones_are_in_the_last_group_and_nowhere_else():
    last = PAGE.read_text("utf-8").rpartition("\n## ")[2]
    kinds = re.findall(r"\*\*(\w+)\*\*", last)
    assert set(kinds) == {"numerical"}
    assert len(kinds) == sum(row.kind == "numerical" for row in on_page())


@pytest.mark.parametrize(
    ("source", "found"),
    [
        ("A = 1.0", {"A": "1.0"}),
        ("A, B = 1, (2, 3)", {"A": "1", "B": "(2, 3)"}),
        ("A: float = 2 * B", {"A": "2 * B"}),
        ("def f():\n    A = 1", {}),
    ],
)
def test_assignments_are_found(source, found):
    assert assigned(source) == found


@pytest.mark.parametrize(
    ("value", "is_one"),
    [
        (1, True),
        (0.5, True),
        ({0: 0.6}, True),
        (np.zeros(2), True),
        ((1, 2.0), True),
        (True, False),
        ("0.5", False),
        ((1, "a"), False),
        ((), False),
    ],
)
def test_numbers_are_known_from_other_values(value, is_one):
    assert numeric(value) is is_one
