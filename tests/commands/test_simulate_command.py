"""A batch of the virtual cell: the simulator is called as another program."""

import importlib.util
import json
import subprocess
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


def test_the_truth_stands_outside_the_batch_and_the_raw_root(folder, monkeypatch):
    asked = []

    def run(command, **_):
        asked.append(command[1:])
        return SimpleNamespace(returncode=0, stderr="")

    monkeypatch.setattr(subprocess, "run", run)
    effects = ("--effect", "tool_runout:radius_um=12,angle_deg=40", "--effect", "tool_wear")
    result = simulate("try-1", *effects, "--seed", "3", "--json")
    assert json.loads(result.stdout)["truth"] == "truth/try-1.truth.json"
    hidden = ["--effect", "tool_runout", "radius_um=12", "angle_deg=40", "--effect", "tool_wear"]
    start = ["-m", "virtual_cell", "force", "data/raw/try-1", "--seed", "3", "--style", "a"]
    assert asked == [[*start, *hidden, "--truth", "truth/try-1.truth.json"]]


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("Try One",), "is no name for a batch"),
        (("try", "--effect", "no_such_effect"), "no effect 'no_such_effect'"),
        (("try", "--kind", "temperature"), "invalid choice: 'temperature'"),
    ],
)
def test_a_mistake_is_told_in_one_line(folder, arguments, told):
    result = simulate(*arguments)
    assert result.exit_code == 1
    assert told in result.stderr
    assert not (folder / "data").exists()


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
