"""The page of the models: each model is held to the bound that its figure states, and its figure is shown."""

import re
import runpy
from dataclasses import replace
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
validation = runpy.run_path(str(ROOT / "scripts/validation.py"))


@pytest.mark.parametrize("name", sorted(validation["CHECKS"]))
def test_a_model_is_as_near_its_closed_form_as_the_figure_says(name):
    check = validation["CHECKS"][name]()
    assert set(check.points) == set(check.lines)
    assert check.worst < check.bound
    moved = {key: (x, 1.1 * y) for key, (x, y) in check.points.items()}
    assert replace(check, points=moved).worst > check.bound


def test_every_figure_is_on_the_page_and_states_its_bound():
    page = (ROOT / "docs/models.md").read_text(encoding="utf-8")
    shown = re.findall(r"!\[[^]]{20,}\]\((figures/model-\w+\.svg)\)", page)
    assert sorted(shown) == sorted(f"figures/model-{name}.svg" for name in validation["CHECKS"])
    for figure in shown:
        assert (ROOT / "docs" / figure).read_bytes().startswith(b"<?xml")
