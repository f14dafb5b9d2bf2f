"""Checks of batches, as they are shown."""

import json
import shutil
from pathlib import Path

import pytest
from checkout import Checkout
from typer.testing import CliRunner

from metro.batch.template import new_batch
from metro.cli import app

ROOT = Path(__file__).parents[2]


@pytest.fixture
def check(tmp_path, monkeypatch):
    """Return a function that checks; in a folder with a sound batch, the bundled cells and no more."""
    monkeypatch.chdir(tmp_path)
    shutil.copytree(ROOT / "config", "config")
    Checkout(tmp_path).add_batch("sound")
    return lambda *given: CliRunner(env={"COLUMNS": "200"}).invoke(app, ["check", *given])


def test_a_wrong_name_is_one_line_and_no_table(check):
    result = check("soun")
    assert result.exit_code == 2
    assert result.output == 'soun: there is no such batch (did you mean "sound"?)\n'


def test_what_is_no_batch_does_not_hinder_the_check_of_the_others(check):
    Path("data/raw/notes").mkdir()
    result = check("data/raw/notes", "data/raw/sound")
    assert result.exit_code == 2
    assert result.stderr == (
        "data/raw/notes: holds no batch.yaml: not the folder of a batch; "
        "metro import FILES makes one of a lab's files\n"
    )
    assert "the batch can be run" in result.stdout
    assert [one["batch"] for one in json.loads(check("data/raw/notes", "sound", "--json").stdout)] == [
        "data/raw/sound"
    ]


def test_a_description_that_cannot_be_read_is_told_without_the_table_of_what_can_be_computed(check):
    assert "observable" in check("sound").stdout
    Path("data/raw/sound/batch.yaml").write_text("format: [1\n")
    result = check("sound")
    assert result.exit_code == 1
    assert "batch.yaml: line 2: expected" in result.stdout
    assert "observable" not in result.stdout
    assert "cannot be computed" not in result.stdout


def test_a_key_that_is_wrong_leaves_the_table(check):
    Path("data/raw/sound/batch.yaml").write_text("format: 2\n")
    assert "observable" in check("sound").stdout


def test_files_that_were_not_copied_are_one_line_and_counted_one_by_one(check):
    new_batch(Path("data/raw"), "uncopied")
    table = Path("data/raw/uncopied/runs.csv")
    header, *rows = table.read_text().splitlines()
    place = header.split(",").index("dynamometer")
    cells = [row.split(",") for row in rows]
    for number, row in enumerate(cells, 1):
        row[place] = f"force/r{number:02d}.csv"
    table.write_text("\n".join([header, *(",".join(row) for row in cells)]) + "\n")
    result = check("uncopied")
    assert result.exit_code == 1
    assert f'runs.csv: rows 2–{len(rows) + 1}: column dynamometer: "force/r01.csv" (and' in result.stdout
    assert result.stdout.count("is not there") == 1
    assert f"{len(rows)} errors" in result.stdout
    (report,) = json.loads(check("uncopied", "--json").stdout)
    assert sum(problem["severity"] == "error" for problem in report["problems"]) == len(rows)


def test_the_check_holds_out_what_the_workflow_holds_out(check):
    """The plan is that of config.yaml's settings, so that the check shows what ingest will do."""

    def held_out():
        return json.loads(check("sound", "--quick", "--json").stdout)[0]["holdout"]

    assert held_out()["seed"] == 1
    config = Path("config/config.yaml")
    config.write_text(config.read_text().replace("\n  seed: 1  ", "\n  seed: 5  ", 1))
    assert held_out()["seed"] == 5
