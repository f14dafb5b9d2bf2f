"""The notebooks of the documentation run, and end as they say."""

import json
from pathlib import Path

import nbformat
import pytest
from notebook import executed

NOTEBOOKS = sorted((Path(__file__).parents[2] / "docs/notebooks").glob("*.ipynb"))


def test_there_are_two():
    assert [path.stem for path in NOTEBOOKS] == ["effect", "results"]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_it_is_a_valid_notebook_without_outputs(path):
    content = json.loads(path.read_text(encoding="utf-8"))
    nbformat.validate(content)
    assert all(not cell.get("outputs") for cell in content["cells"])


@pytest.fixture
def here(project, monkeypatch):
    import matplotlib as mpl

    mpl.use("agg")
    monkeypatch.chdir(project)


def test_the_results_are_read_and_a_new_cut_is_predicted(here):
    left = executed(NOTEBOOKS[1])
    ratio = left["force"].peak_n / left["batch"].force(run="r07").peak_n
    assert 1.5 < ratio < 2.0  # 3 mm instead of 2 mm, and a thicker chip
    assert len(left["left"].lines) == len(left["right"].lines) == 3
    assert left["right"].get_ylabel() == "force (N)"


def test_the_effect_is_fitted_and_the_helix_confirmed(here, capsys):
    left = executed(NOTEBOOKS[0])
    assert "The stated helix is confirmed." in capsys.readouterr().out
    assert left["angle"]["hi"] - left["angle"]["lo"] < 1.0
    assert left["with_helix"].held_out_rms == pytest.approx(left["plain"].held_out_rms, rel=0.05)
