"""The example of the page on effects: installed as pip leaves it, it finds what it is for and no more."""

import re
import subprocess
import sys
import tomllib
from dataclasses import fields, replace
from math import radians
from pathlib import Path

import pytest
import yaml

from metro.batch.processed import Processed, read_batch
from metro.cutting.cutter import Cutter, evenly_pitched
from metro.cutting.law import EdgeLaw
from metro.dynamics.stability_model import StabilityModel
from metro.effects.library import library
from metro.loop.fitting.held_out import comparison, held_out
from metro.loop.search.search import search
from metro.loop.search.trial import Gates
from metro.loop.verdict.verdict import judge
from metro.observables.deformation.model import DeformationModel
from metro.observables.flatness.model import FlatnessModel
from metro.observables.force import observable as force
from metro.observables.force.model import ForceModel
from metro.observables.joint_force.model import JointForceModel
from metro.observables.waviness.model import WavinessModel
from metro.stages.ingest import ingest
from virtual_cell.recipes.force import make

PAGE = (Path(__file__).parents[2] / "docs/effects.md").read_text(encoding="utf-8")
GATES = Gates(model_form_budget=0.007, materiality=0.004, false_additions=0.05, held_out_gain=3.0, seed=1)
MODELS = {
    "force": ForceModel,
    "joint_force": JointForceModel,
    "deformation": DeformationModel,
    "waviness": WavinessModel,
    "flatness": FlatnessModel,
    "lobes": StabilityModel,
}
NEAR = {"tool_runout", "tool_wear", "helix_error"}  # of the library; the whole of it is slow


def boxes(language):
    return re.findall(rf"^```{language}\n(.*?)^```$", PAGE, re.DOTALL | re.MULTILINE)


@pytest.fixture
def package(tmp_path):
    """The two files of the page, as its reader has them."""
    (setup,), (code,) = boxes("toml"), boxes("python")
    folder = tmp_path / "shop-effects"
    folder.mkdir()
    (folder / "pyproject.toml").write_text(setup, encoding="utf-8")
    (module,) = tomllib.loads(setup)["tool"]["setuptools"]["py-modules"]
    (folder / f"{module}.py").write_text(code, encoding="utf-8")
    return folder


@pytest.fixture
def installed(package, monkeypatch):
    """The package on the path with what pip writes beside it; the name of its effect."""
    setup = tomllib.loads((package / "pyproject.toml").read_text(encoding="utf-8"))
    ((name, target),) = setup["project"]["entry-points"]["metro.effects"].items()
    info = package / "shop_effects-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: shop-effects\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[metro.effects]\n{name} = {target}\n")
    monkeypatch.syspath_prepend(package)
    yield name
    sys.modules.pop(target.split(":")[0], None)


def closed(folder, hidden, declared_helix=None):
    """Make a batch, let ``batch.yaml`` state another helix, and judge its force with the effects nearby."""
    make(folder / "shop", hidden, 3)
    manifest = folder / "shop/batch.yaml"
    content = yaml.safe_load(manifest.read_text(encoding="utf-8"))
    true = content["tool"]["helix_deg"]
    content["tool"]["helix_deg"] = declared_helix or true
    manifest.write_text(yaml.safe_dump(content), encoding="utf-8")
    ingest(folder / "shop", folder, folder / "out", {}, "test")
    batch = read_batch(folder / "out")
    task = force.problem(batch, force.observe(batch, Processed(folder / "out"), {}), {})
    outcome = search(task, tuple(e for e in library("force") if e.name in NEAR), GATES)
    rows = comparison(task, held_out(task, outcome.base), held_out(task, outcome.final))
    return judge(task, outcome, rows, GATES), true


def test_the_example_is_found_as_the_page_says_and_the_library_has_none_of_its_name(installed):
    assert installed in {effect.name for effect in library("force")}
    assert len(library()) == len({effect.key for effect in library()})
    assert re.search(rf"… '{installed}', '(\w+)', …", PAGE)[1] == next(
        after.name for effect, after in zip(library("force"), library("force")[1:], strict=False)
        if effect.name == installed
    )  # fmt: skip


def test_without_the_package_it_is_not_there():
    assert "helix_error" not in {effect.name for effect in library()}


def test_it_adds_to_what_other_effects_have_made_and_touches_nothing_else(installed):
    effect = next(effect for effect in library("force") if effect.name == installed)
    model = ForceModel(Cutter(6e-3, 0.5, evenly_pitched(2), runout_radius=9e-6), EdgeLaw(edge_growth=0.1))
    twice = effect.apply(effect.apply(model, {"angle_deg": 2.0}), {"angle_deg": 3.0})
    assert twice.cutter.helix == pytest.approx(0.5 + radians(5.0))
    assert replace(twice, cutter=replace(twice.cutter, helix=0.5)) == model
    assert effect.apply(model, {"angle_deg": 0.0}) == model


def test_it_finds_the_helix_that_batch_yaml_has_wrong_in_a_simulated_batch(installed, tmp_path):
    verdict, true = closed(tmp_path, {}, declared_helix=32.0)
    (found,) = verdict["effects"]
    assert (verdict["status"], found["effect"]) == ("explained", installed)
    low, high = found["parameters"]["angle_deg"]["ci95"]
    assert low < true - 32.0 < high
    assert high - low < 1.0
    told = re.search(r"whose tool has (\d+)° and whose `batch.yaml` says (\d+)°", PAGE)
    assert [float(each) for each in told.groups()] == [true, 32.0]


def test_beside_it_runout_is_named_as_it_is_without_it(installed, tmp_path):
    verdict, _ = closed(tmp_path, {"tool_runout": {"radius_um": 9.0, "angle_deg": 40.0}})
    assert verdict["status"] == "explained"
    assert [effect["effect"] for effect in verdict["effects"]] == ["tool_runout"]
    low, high = verdict["effects"][0]["parameters"]["radius_um"]["ci95"]
    assert low < 9.0 < high
    assert verdict["indistinguishable"] == []


def test_the_table_of_what_may_be_changed_is_that_of_the_models():
    """Every field of the page is one of the observable's model, and every part of a model is on the page."""
    table = PAGE.partition("## What it may change")[2].partition("\n## ")[0]
    observable, named = "", {name: set() for name in MODELS}
    for row in re.findall(r"^\|(?! observable| ---)(.*)\|$", table, re.MULTILINE):
        first, model, parts, _ = (cell.strip() for cell in row.split("|"))
        observable = first.strip("`") or observable
        if first:
            assert model.strip("`") == MODELS[observable].__name__
        named[observable] |= set(re.findall(r"`(\w+)`", parts))
    for name, model in MODELS.items():
        own = {field.name for field in fields(model)}
        given = {
            "true_path",
            "bottom_edges",
            "end_declared",
            "fields",
            "joints",
            "placed",
            "ringing",
            "beside",
            "origin",
            "touched",
            "forces",
            "springs",
            "loaded",
            "waves",
        }  # by the batch and its load tests, or by the fit: no cause changes them
        assert named[name] == own - given, name


@pytest.mark.workflow
def test_pip_installs_it_as_the_page_says(package, tmp_path):
    command = [sys.executable, "-m", "pip", "install", "--no-deps", "--no-build-isolation", "--no-index"]
    done = subprocess.run(
        [*command, "--target", tmp_path / "there", package], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    seen = "from metro.effects.library import library; print([e.name for e in library('force')])"
    assert seen in PAGE
    names = subprocess.run(
        [sys.executable, "-c", seen],
        capture_output=True,
        text=True,
        check=True,
        env={"PYTHONPATH": f"{tmp_path / 'there'}:{Path(__file__).parents[2] / 'src'}"},
    )
    assert "'helix_error'" in names.stdout
