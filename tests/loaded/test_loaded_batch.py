"""What ``metro.load`` opens: names and paths, tables, quantities, verdicts, fits; and what it refuses."""

import json
import shutil
import subprocess
import sys

import numpy as np
import pytest
from closed_project import ROOT, closed_project

import metro
from metro.batch.findings import ContractError


def test_importing_metro_imports_nothing_heavy():
    seen = "import sys, metro, json; dir(metro); print(json.dumps(sorted(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", seen], capture_output=True, text=True, check=True, cwd=ROOT)
    loaded = set(json.loads(done.stdout))
    assert not loaded & {"numpy", "pandas", "matplotlib", "typer", "metro.loaded", "metro.effects"}


def test_every_public_name_is_there_and_no_other():
    assert set(metro.__all__) <= set(dir(metro))
    assert all(getattr(metro, name) for name in metro.__all__)
    with pytest.raises(AttributeError, match="no attribute"):
        metro.__getattr__("laod")


@pytest.mark.parametrize("folder", ["data/raw", "data/processed", "reports"])
def test_a_batch_is_opened_by_any_of_its_folders(project, folder):
    batch = metro.load(project / folder / "clean-slot")
    assert (batch.name, batch.reports) == ("clean-slot", project / "reports/clean-slot")


def test_a_batch_is_opened_by_its_name_in_the_project(project, monkeypatch):
    monkeypatch.chdir(project)
    assert str(metro.load("clean-slot")) == "clean-slot: force clean"


@pytest.mark.parametrize(
    ("name", "words"),
    [("clean-slit", 'did you mean "?clean-slot'), ("/no/such/folder", "there is no such folder")],
)
def test_what_is_no_batch_is_refused_with_what_was_meant(project, name, words):
    with pytest.raises(ContractError, match=words):
        metro.load(name, project)


def test_a_folder_of_something_else_is_refused(tmp_path):
    with pytest.raises(ContractError, match="is no folder of a batch"):
        metro.load(tmp_path)


def test_a_batch_without_a_verdict_is_refused(project, tmp_path):
    (tmp_path / "data").mkdir()
    (tmp_path / "data/processed").symlink_to(project / "data/processed")
    with pytest.raises(ContractError, match="has no verdict yet"):
        metro.load("clean-slot", tmp_path)


def test_tables_have_rows_and_a_missing_one_is_named(loaded):
    assert {"force", "orders", "spindle", "comparison", "runs"} <= set(loaded.table_names)
    assert "scan" not in loaded.table_names  # there, without rows
    assert set(loaded.table("force", "r07")["run"]) == {"r07"}
    with pytest.raises(ContractError, match=r"did you mean .spindle"):
        loaded.table("spindel")


def test_quantities_are_those_of_identified_json(loaded):
    written = json.loads((loaded.reports / "identified.json").read_text())["force"]["waveform"]["krc"]
    quantity = loaded.quantity("force.waveform.krc")
    assert [quantity.value, [quantity.low, quantity.high], quantity.unit] == [*written.values()]
    assert quantity.low < 317.0 < quantity.high  # of the simulator
    assert str(quantity).endswith("N/mm²")
    assert "±" in str(quantity)
    assert quantity.standard_uncertainty == pytest.approx(quantity.half_width / 1.96, rel=1e-4)
    with pytest.raises(ContractError, match="no such quantity"):
        loaded.quantity("force.waveform.kxc")


def test_verdicts_are_those_of_verdict_json(loaded):
    written = json.loads((loaded.reports / "verdict.json").read_text())["observables"]["force"]
    row = loaded.verdicts.loc["force"]
    assert (row["status"], row["after_rms"]) == (written["status"], written["after"]["rms"])
    assert len(loaded.candidates) == len(written["candidates"])
    assert loaded.effects.empty


def test_a_figure_is_drawn_on_the_axes_that_are_given(loaded):
    from matplotlib.figure import Figure

    axes = Figure().add_subplot()
    assert loaded.plot("force", run="r07", axis="x", axes=axes) is axes
    measured = axes.lines[0].get_ydata()
    rows = loaded.comparison
    rows = rows[(rows["run"] == "r07") & (rows["axis"] == "x")]
    first = rows[rows["t_s"] == rows["t_s"].iloc[0]].sort_values("angle_deg")
    assert np.array_equal(measured, first["measured"])
    with pytest.raises(ContractError, match="is not compared"):
        loaded.plot("flatness")


def test_a_fit_finds_the_helix_that_batch_yaml_has_wrong(loaded, tmp_path):
    """The same effect as in the notebook, where the tool is stated with 3° less than it has."""
    from notebook import executed

    raw = tmp_path / "data/raw/wrong-helix"
    shutil.copytree(ROOT / "data/raw/clean-slot", raw)
    text = (raw / "batch.yaml").read_text().replace("clean-slot", "wrong-helix")
    (raw / "batch.yaml").write_text(text.replace("helix_deg: 30", "helix_deg: 27"))
    closed_project(tmp_path, raw, closing=False)
    batch = metro.LoadedBatch("wrong-helix", tmp_path / "data/processed/wrong-helix", tmp_path)
    source = ROOT / "docs/notebooks/effect.ipynb"
    cells = json.loads(source.read_text())["cells"]
    only = tmp_path / "effect.ipynb"
    only.write_text(json.dumps({"cells": [{"cell_type": "code", "source": "import metro"}, cells[3]]}))
    effect = executed(only)["helix_error"]
    plain, fitted = batch.fit("force"), batch.fit("force", [effect])
    angle = fitted.parameters.set_index("name").loc["helix_error.angle_deg"]
    assert angle["lo"] < 3.0 < angle["hi"]
    assert angle["hi"] - angle["lo"] < 1.0
    right = loaded.fit("force").held_out_rms  # of the tool as it is
    assert fitted.held_out_rms == pytest.approx(right, rel=0.02)
    assert plain.held_out_rms > 1.1 * right
    assert fitted.converged
    assert "helix_error" in str(fitted)


def test_an_effect_on_another_observable_is_refused(loaded):
    from metro.effects.library import library

    flat = next(effect for effect in library("flatness") if "force" not in effect.observables)
    with pytest.raises(ContractError, match="is an effect on flatness"):
        loaded.fit("force", [flat])
    with pytest.raises(ContractError, match="has no model that could be fitted"):
        loaded.fit("deformation")
