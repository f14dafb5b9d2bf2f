"""The simulator is written with no number of the models, but for those that are explained one by one.

A simulator that draws its noise from the very number that the loop believes proves nothing (an inverse
crime). Every number that says something and that both sides have is in ``shared_constants.csv``: its value in
SI, the simulator's file, the names that it has there, what kind of thing it is, and why it is there on both
sides. Which numbers say something is argued in :mod:`literals`.
"""

import csv
from fnmatch import fnmatch
from pathlib import Path

import pytest
from literals import Literal, literals, shared

ROOT = Path(__file__).parents[2]
LISTED = Path(__file__).with_name("shared_constants.csv")
# The rooms that hold models and beliefs about data. The others hold formats, pages, limits of memory.
ROOMS = ("cutting", "dynamics", "robot", "surface", "signals", "observables", "effects", "loop")
MODULES = ("structure.py", "kriging.py")
KINDS = {"unit", "contract", "published", "coincidence", "inverse crime"}
WORLD = ("virtual_cell/world/*", "virtual_cell/recipes/*_world*.py")  # what styles c and d are made from


def rows():
    with LISTED.open(newline="", encoding="utf-8") as stream:
        return [*csv.DictReader(stream)]


@pytest.fixture(scope="module")
def found():
    top = ROOT / "src/metro"
    models = [path for room in ROOMS for path in sorted(top.glob(f"{room}/**/*.py"))]
    models += [top / name for name in MODULES]
    simulator = sorted(ROOT.glob("virtual_cell/**/*.py"))
    return shared(
        [one for path in simulator for one in literals(path, ROOT)],
        [one for path in models for one in literals(path, ROOT)],
    )


def told(value, ours, theirs):
    """Say where a number stands on both sides."""
    here, there = (
        ", ".join(sorted({f"{one.file}:{one.line} {one.name}".strip() for one in side}))
        for side in (ours, theirs)
    )
    return f"{value:.6g}: {here} | {there}"


def test_every_shared_number_is_explained(found):
    listed = {(float(row["value"]), row["file"]) for row in rows()}
    missing = []
    for value, (ours, theirs) in found.items():
        new = [one for one in ours if (value, one.file) not in listed]
        missing += [told(value, new, theirs)] if new else []
    assert not missing, "take another number, or explain it in shared_constants.csv:\n" + "\n".join(missing)


def test_what_is_explained_is_still_shared(found):
    there = {(value, one.file) for value, (ours, _) in found.items() for one in ours}
    assert [row for row in rows() if (float(row["value"]), row["file"]) not in there] == []


def test_explanations_are_complete_and_each_number_of_a_file_has_one():
    for row in rows():
        assert row["kind"] in KINDS
        assert row["reason"]
    keys = [(row["value"], row["file"]) for row in rows()]
    assert len(set(keys)) == len(keys)


def test_the_harder_world_commits_no_inverse_crime():
    crimes = [row["file"] for row in rows() if row["kind"] == "inverse crime"]
    assert [file for file in crimes if any(fnmatch(file, pattern) for pattern in WORLD)] == []


def test_a_number_of_a_model_in_the_simulator_is_found(tmp_path):
    (tmp_path / "cell.py").write_text(
        "BLUR = 7.0 * UM\nx = [1, 2, 60.0, 0.5, 0.3]\ny = math.tanh(v / 3e-4)\n"
    )
    (tmp_path / "model.py").write_text(
        "@dataclass\nclass A:\n    sd: float = 7e-6\n    n: int = 2\nTURNING = 0.0003\nz = 0.3 + 60.0\n"
    )
    both = shared(*(literals(tmp_path / name, tmp_path) for name in ("cell.py", "model.py")))
    assert set(both) == {7e-6, 3e-4}
    assert both[7e-6][0] == [Literal(7e-6, "cell.py", 1, "BLUR")]


@pytest.mark.parametrize(
    ("number", "name", "says"),
    [
        (0.0137, "", True),
        (137.0, "", True),
        (0.03, "SD", True),
        (0.03, "", False),  # of one digit
        (0.25, "", False),  # half of one
        (0.25, "SHARE", True),
        (9.0, "COUNT", False),
        (2048.0, "RATE", False),
        (360.0, "TURN", False),
    ],
)
def test_a_number_says_something_where_it_is_named_or_is_no_round_one(number, name, says):
    assert Literal(number, "a.py", 1, name).says_nothing is not says
