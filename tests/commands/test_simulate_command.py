"""A batch of the virtual cell: the simulator is called as another program."""

import importlib.util
import json
import subprocess
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from typer.testing import CliRunner

from metro.cli import app
from metro.commands.hidden import Style, hidden, parameters, simulated
from virtual_cell.arm_effects import ARM_EFFECTS, SHOWN
from virtual_cell.blind import KINDS
from virtual_cell.face_effects import FACE_EFFECTS
from virtual_cell.hidden import BOUNDARY_EFFECTS
from virtual_cell.hidden import EFFECTS as FORCE_EFFECTS
from virtual_cell.recipes import arm_draws, boundary_draws, faces_draws, force


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    simulated()  # asks the simulator once, so that a test may replace it
    monkeypatch.chdir(tmp_path)
    return tmp_path


def simulate(*arguments):
    return CliRunner().invoke(app, ["simulate", *arguments])


def test_a_kind_that_is_none_is_refused_with_those_that_there_are(folder):
    result = simulate("try-1", "--kind", "nonsense")
    assert result.exit_code == 2
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
        return SimpleNamespace(returncode=0, stdout="", stderr="")


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
        (("try", "--kind", "forces"), "found 'forces' (did you mean \"force\"?)"),
        (
            ("try", "--effect", "tool_runot"),
            "no effect 'tool_runot' in a batch of --kind force (did you mean",
        ),
        (("try", "--effect", "missing_mode"), "it is one of --kind lobes"),
        (("try", "--effect", "tool_runout:radius_um=abc"), 'radius_um: found "abc", expected a number'),
        (("try", "--effect", "tool_runout:radius_um=NaN,angle_deg=1"), "expected a number"),
        (("try", "--effect", "tool_runout:radius=12"), 'no parameter of it (did you mean "radius_um"?)'),
        (("try", "--effect", "tool_runout:radius_um=12"), "angle_deg: missing"),
        (("try", "--effect", "tool_runout:12"), 'found "12", expected PARAMETER=VALUE'),
        (("try", "--effect", "charge_drift:slope_n_s=[1,2]"), 'found "[1,2]", expected 3 numbers'),
        (("try", "--kind", "joint_force", "--effect", "joint_delay:joint=9,delay_ms=1"), "one of: 1, 2, 3"),
    ],
)
def test_a_mistake_is_told_in_one_line(folder, arguments, told):
    result = simulate(*arguments)
    assert result.exit_code == 2
    assert told in result.stderr
    assert result.stderr.count("\n") == 1
    assert [path for root in ("data/raw", "truth") for path in (folder / root).rglob("*")] == []


def test_a_style_that_is_none_is_refused_before_the_simulator_is_called(folder):
    result = simulate("try", "--style", "e")
    assert result.exit_code == 2
    assert "'e' is not one of 'a', 'b', 'c'" in result.stderr


@pytest.mark.parametrize(
    ("kind", "words", "given"),
    [
        ("force", "tool_wear", ["tool_wear"]),
        ("force", "pitch_error:pitch_deg=[0.5, -0.5]", ["pitch_error", "pitch_deg=[0.5, -0.5]"]),
        ("force", "charge_drift:time_constant_s=[1,2,3]", ["charge_drift", "time_constant_s=[1, 2, 3]"]),
        ("deformation", "stiffness_scale:factor=0.8", ["stiffness_scale", "factor=0.8"]),
        (
            "deformation",
            "stiffness_scale:factor=0.8,joint=all",
            ["stiffness_scale", "factor=0.8", 'joint="all"'],
        ),
        ("joint_force", "joint_delay:joint=3,delay_ms=40", ["joint_delay", "joint=3", "delay_ms=40"]),
    ],
)
def test_an_effect_is_passed_on_as_the_simulator_reads_it(kind, words, given):
    assert hidden(words, kind) == given


def test_the_effects_and_their_parameters_are_those_of_the_simulator():
    rng = np.random.default_rng(1)
    arm = {effect: (ARM_EFFECTS[effect], arm_draws.drawn(rng, "a")[0]) for effect in ARM_EFFECTS}
    known = {
        "force": {effect: (one, force._drawn({}, 0, "a").session) for effect, one in FORCE_EFFECTS.items()},
        "lobes": {
            effect: (one, boundary_draws.drawn_machine(rng)) for effect, one in BOUNDARY_EFFECTS.items()
        },
        "flatness": {effect: (one, faces_draws.drawn(rng, "a")) for effect, one in FACE_EFFECTS.items()},
        "study": {effect: (one, faces_draws.drawn(rng, "a")) for effect, one in FACE_EFFECTS.items()},
        **dict.fromkeys(SHOWN, arm),
    }
    assert simulated() == {kind: recipe.effects for kind, recipe in KINDS.items()}
    for kind, effects in simulated().items():
        for effect in effects:
            one, subject = known[kind][effect]
            drawn, declared = one.draw(rng, subject), dict(parameters(effect, kind))
            assert set(drawn) <= set(declared), (kind, effect)
            assert {p for p, shape in declared.items() if not shape.endswith("?")} <= set(drawn)
            words = [f"{p}={json.dumps(value)}" for p, value in drawn.items()]
            assert len(hidden(f"{effect}:{','.join(words)}", kind)) == 1 + len(drawn)


def test_the_styles_are_those_of_the_simulator():
    assert tuple(Style) == force.STYLES


@pytest.mark.parametrize(
    ("line", "offered"),
    [
        ("simulate try --effect tool_", ["tool_runout", "tool_wear", "tool_deflection"]),
        ("simulate try --kind lobes --effect mi", ["missing_mode"]),
    ],
)
def test_the_tab_key_offers_the_effects_of_the_kind(line, offered):
    words = ["metro", *line.split()]
    asked = {"COMP_WORDS": " ".join(words), "COMP_CWORD": str(len(words) - 1)}
    result = CliRunner(env={"_METRO_COMPLETE": "complete_bash", **asked}).invoke(app, [], prog_name="metro")
    assert result.stdout.split() == offered


def test_a_batch_that_is_there_is_not_overwritten(folder):
    (folder / "data/raw/mine").mkdir(parents=True)
    result = simulate("mine")
    assert result.exit_code == 1
    assert "is there already" in result.stderr


def test_without_the_simulator_it_says_what_to_install(monkeypatch):
    simulated.cache_clear()
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: None)
    result = simulate("try")
    assert result.exit_code == 1
    assert "metro-machining" in result.stderr


def test_a_simulator_that_fails_is_quoted(monkeypatch):
    simulated.cache_clear()
    failed = SimpleNamespace(returncode=1, stderr="Traceback\nMemoryError: 3 GB")
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: failed)
    result = simulate("try")
    assert result.exit_code == 1
    assert "could not say what it can hide: MemoryError: 3 GB" in result.stderr
