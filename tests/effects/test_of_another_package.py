"""Effects that another package brings: declared, followed over a campaign and shown as those of this one."""

import sys
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import yaml
from typer.testing import CliRunner

from metro.batch.batch import Batch
from metro.batch.known import declarable
from metro.cli import app
from metro.codehash import code_hash
from metro.cutting.cutter import Cutter, evenly_pitched
from metro.cutting.law import EdgeLaw
from metro.effects.library import described, library, with_declared
from metro.memory.history import Record, histories
from metro.observables.force.model import ForceModel
from metro.observables.problem import Problem
from metro.report.results import Results
from metro.report.sections.verdict import verdict_words
from virtual_cell.recipes.force import make

CODE = '''
"""Effects of a shop of its own."""

from dataclasses import replace

from metro.effects.effect import Effect, EffectParameter


def gained(model, values):
    factor = [1.0 + percent / 100.0 for percent in values["error_percent"]]
    rows = tuple(tuple(f * x for x in row) for f, row in zip(factor, model.sensor.axes, strict=True))
    return replace(model, sensor=replace(model.sensor, axes=rows))


def turned(model, values):
    side = 1.0 if values["side"] == 0 else -1.0
    helix = model.cutter.helix + side * values["angle_mrad"] * 1e-3
    return replace(model, cutter=replace(model.cutter, helix=helix))


def effect(name, apply, parameters, **more):
    return Effect(name, ("force",), parameters, apply, "seen", "a paper", "an experiment", **more)


GAIN = EffectParameter("error_percent", "%", -10.0, 10.0, 1.0, starts=(-2.0, 2.0))
EFFECTS = (
    effect("sensor_gain", gained, (GAIN,) * 3, belongs_to=("instrument",), per="axis"),
    effect(
        "helix_error",
        turned,
        (
            EffectParameter("angle_mrad", "mrad", -100.0, 100.0, 10.0, starts=(-30.0, 30.0)),
            EffectParameter("side", "", 0.0, 1.0, 1.0, starts=(0.0, 1.0), choices=("left", "right")),
        ),
        belongs_to=("tool", "work"),
    ),
    effect(
        "odd_tooth",
        lambda model, values: model,
        (EffectParameter("share", "1", -1.0, 1.0, 0.1, starts=(0.1,)),),
        belongs_to=("tool",),
        comparable=False,
    ),
)
'''
KNOWN = {
    "sensor_gain": {"error_percent": [1.0, -2.0, 0.5]},
    "helix_error": {"angle_mrad": 30.0, "side": "right"},
}


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """A package on the path with what pip writes beside it."""
    folder = tmp_path / "packages"
    info = folder / "shop_gains-1.0.dist-info"
    info.mkdir(parents=True)
    (folder / "shop_gains.py").write_text(CODE)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: shop-gains\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[metro.effects]\nshop = shop_gains:EFFECTS\n")
    monkeypatch.syspath_prepend(folder)
    yield "shop_gains"
    sys.modules.pop("shop_gains", None)


def checked(folder, known):
    """Let ``metro check`` look at a batch that declares something; its exit code, and what it says."""
    batch = folder / "blind-test"
    if not batch.exists():
        make(batch, {}, 3)
    manifest = batch / "batch.yaml"
    content = yaml.safe_load(manifest.read_text(encoding="utf-8"))
    manifest.write_text(yaml.safe_dump({**content, "known": known}), encoding="utf-8")
    result = CliRunner().invoke(app, ["check", str(batch), "--cells", str(folder), "--json"])
    (report,) = yaml.safe_load(result.stdout)
    return result.exit_code, [(one["severity"], one["column"], one["message"]) for one in report["problems"]]


def of_known(problems):
    return [problem for problem in problems if problem[1].startswith("known")]


def test_without_the_package_its_names_are_not_known(tmp_path):
    assert not {"sensor_gain", "helix_error"} & set(declarable())
    code, problems = checked(tmp_path, KNOWN)
    assert code == 0
    assert {(severity, column) for severity, column, _ in of_known(problems)} == {
        ("warning", "known.sensor_gain"),
        ("warning", "known.helix_error"),
    }


@pytest.mark.usefixtures("installed")
def test_the_check_of_a_batch_knows_its_names_its_parameters_and_their_words(tmp_path):
    code, problems = checked(tmp_path, KNOWN)
    assert (code, of_known(problems)) == (0, [])
    code, problems = checked(tmp_path, {"sensor_gain": {"error": 1.0}})
    ((severity, column, message),) = of_known(problems)
    assert (code, severity, column) == (1, "error", "known.sensor_gain.error")
    assert message == (
        'is not a parameter of sensor_gain (did you mean "error_percent"?), expected error_percent'
    )
    _, problems = checked(tmp_path, {"helix_error": {"angle_mrad": 3.0, "side": "up"}})
    assert [message for _, _, message in of_known(problems)] == ['found "up", expected left or right']
    code, problems = checked(tmp_path, {"sensor_gian": {"error_percent": 1.0}})
    assert (code, of_known(problems)[0][2]) == (1, 'is not a known key (did you mean "sensor_gain"?)')


@pytest.mark.usefixtures("installed")
def test_the_base_model_is_told_of_it():
    base = ForceModel(Cutter(6e-3, 0.6, evenly_pitched(4)), EdgeLaw())
    runs = (SimpleNamespace(role="identify", condition="1", setting=SimpleNamespace(helix=None)),)
    told = with_declared(Problem("force", "N", 1.0, base, runs, np.full(6, 0.01)), KNOWN)
    assert told.base.cutter.helix == pytest.approx(0.57)
    assert np.diag(told.base.sensor.axes) == pytest.approx([1.01, 0.98, 1.005])
    assert told.notes == (
        "The base model includes sensor gain, as declared in batch.yaml under known.",
        "The base model includes helix error, as declared in batch.yaml under known.",
    )


def test_with_the_package_the_raw_files_are_checked_again(request):
    before = {stage: code_hash(stage) for stage in ("ingest", "loop")}
    request.getfixturevalue("installed")
    assert all(code_hash(stage) != known for stage, known in before.items())


def estimated(effect, value):
    one = {"parameter": "angle_mrad", "index": 0, "value": value, "sd": 1.0, "unit": "mrad"}
    one |= {"signed": True, "inside": True, "angle": False, "less_neutral": value}
    tried = {"effect": effect, "verdict": "rejected", "size": 0.01, "chosen_among": 1, "where": {}}
    return {**tried, "estimates": [one]}


@pytest.mark.usefixtures("installed")
def test_a_campaign_follows_what_can_be_compared_by_what_it_belongs_to():
    names = ["helix_error", "odd_tooth", "sensor_gain", "thermal_growth"]
    told = {"observables": {"force": {"candidates": [estimated(name, 1.0) for name in names]}}}
    manifest = {"cell": "c", "tool": {"teeth": 3}, "work": {"material": "AA6061"}}
    verdict = {"observables": {"force": {"status": "clean", "effects": []}}}
    records = [Record(f"b-{i}", manifest, None, verdict, told | {"effects": described()}, {}) for i in "12"]
    assert {one.effect: one.owner for one in histories(records)} == {
        "helix_error": "c, tool 3 teeth, AA6061",
        "sensor_gain": "c",
        "thermal_growth": "c",
    }


@pytest.mark.usefixtures("installed")
def test_the_report_names_it_with_its_values_axis_by_axis():
    def found(value):
        return {"value": value, "ci95": [value - 0.1, value + 0.1], "unit": "%"}

    effect = {"effect": "sensor_gain", "parameters": {"error_percent": [found(v) for v in (1.0, -2.0, 0.5)]}}
    verdict = {"observables": {"force": {"status": "explained", "unit": "N", "effects": [effect]}}}
    batch = Batch("b", {}, {}, pd.DataFrame(), {})
    results = Results(batch, {}, {}, verdict, {"effects": described()})
    said = verdict_words("force", results.verdicts()["force"])
    assert "sensor gain (error percent x 1.00 ± 0.10, y −2.00 ± 0.10, z 0.50 ± 0.10 %)" in said


@pytest.mark.usefixtures("installed")
def test_the_forms_of_an_effect_agree_in_what_it_belongs_to():
    """Else what a campaign reads of it would depend on the form that comes first."""
    for name, facts in described().items():
        forms = [effect for effect in library() if effect.name == name]
        assert {(effect.belongs_to, effect.comparable) for effect in forms} == {
            (tuple(facts["belongs_to"]), facts["comparable"])
        }
        assert set(facts["per"]) == {effect.per for effect in forms} - {""}
