"""A batch of the virtual cell: the simulator is called as another program."""

import importlib.util
import json
import subprocess
from pathlib import Path
from types import SimpleNamespace

import pytest
from typer.testing import CliRunner

from metro.cli import app


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def simulate(*arguments):
    return CliRunner().invoke(app, ["simulate", *arguments])


def test_a_kind_that_is_none_is_refused_with_those_that_there_are(folder):
    result = simulate("try-1", "--kind", "nonsense")
    assert result.exit_code == 1
    assert "found 'nonsense', expected one of: force, joint_force, deformation" in result.stderr
    assert not (folder / "data/raw/try-1").exists()


class Simulator:
    """Stands for the simulator: notes what it is asked, and fills the folder."""

    def __init__(self, folder):
        self.folder, self.asked, self.there = folder, [], None

    def __call__(self, command, **_):
        self.asked.append(command[1:])
        self.there = [path.name for path in (self.folder / "data/raw").glob("[!.]*")]
        (self.folder / command[4] / "batch.yaml").write_text("format: 1\n")
        Path(command[command.index("--truth") + 1]).write_text("{}")
        return SimpleNamespace(returncode=0, stderr="")


def test_the_truth_stands_outside_the_batch_and_the_raw_root(folder, monkeypatch):
    simulator = Simulator(folder)
    monkeypatch.setattr(subprocess, "run", simulator)
    effects = ("--effect", "tool_runout:radius_um=12,angle_deg=40", "--effect", "tool_wear")
    result = simulate("try-1", *effects, "--seed", "3", "--json")
    assert json.loads(result.stdout)["truth"] == "truth/try-1.truth.json"
    assert [path.name for path in (folder / "truth").iterdir()] == ["try-1.truth.json"]
    assert [str(path.relative_to(folder)) for path in (folder / "data").rglob("*") if path.is_file()] == [
        "data/raw/try-1/batch.yaml"
    ]
    (asked,) = simulator.asked
    assert asked[:3] == ["-m", "virtual_cell", "force"]
    hidden = ["--effect", "tool_runout", "radius_um=12", "angle_deg=40", "--effect", "tool_wear"]
    assert asked[4:8] + asked[10:] == ["--seed", "3", "--style", "a", *hidden]


def test_a_batch_has_its_name_when_it_is_whole(folder, monkeypatch):
    simulator = Simulator(folder)
    monkeypatch.setattr(subprocess, "run", simulator)
    simulate("try-1")
    assert simulator.there == []
    assert (folder / "data/raw/try-1/batch.yaml").exists()


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("Try One",), "is no name for a batch"),
        (("try", "--effect", "no_such_effect"), "no effect 'no_such_effect'"),
        (("try", "--kind", "temperature"), "found 'temperature', expected one of"),
    ],
)
def test_a_mistake_is_told_in_one_line(folder, arguments, told):
    result = simulate(*arguments)
    assert result.exit_code == 1
    assert told in result.stderr
    assert [path for root in ("data/raw", "truth") for path in (folder / root).rglob("*")] == []


def test_a_batch_that_is_there_is_not_overwritten(folder):
    (folder / "data/raw/mine").mkdir(parents=True)
    result = simulate("mine")
    assert result.exit_code == 1
    assert "is there already" in result.stderr


def test_without_the_simulator_it_says_what_to_install(monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: None)
    result = simulate("try")
    assert result.exit_code == 1
    assert "metro-machining" in result.stderr
