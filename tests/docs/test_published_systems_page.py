"""The page on what a publication shows: nothing of it is left out, and the tests that it names exist."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs/published-systems-k.md").read_text(encoding="utf-8")
NUMBERED = {"Equations": 18, "Tables": 8, "Figures": 16}


def rows(heading):
    part = PAGE.partition(f"## {heading}\n")[2].partition("\n## ")[0]
    return [line.strip("| ").split(" | ") for line in part.splitlines() if line.startswith("|")][2:]


@pytest.mark.parametrize("heading", NUMBERED)
def test_every_numbered_item_has_its_row_with_a_place_or_a_reason(heading):
    found = rows(heading)
    numbers = [int(n) for row in found for n in re.match(r"\d+(, \d+)*", row[0])[0].split(", ")]
    assert sorted(numbers) == list(range(1, NUMBERED[heading] + 1))
    assert all(len(row) == 4 and len(row[2]) > 4 for row in found)


def test_every_test_that_is_named_exists():
    named = set(re.findall(r"`(\w+/test_\w+)`", PAGE))
    assert len(named) > 10
    assert [name for name in sorted(named) if not (ROOT / "tests" / f"{name}.py").exists()] == []
