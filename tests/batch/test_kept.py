"""What a stage keeps: put back where all that it takes is as it was, made anew where anything differs."""

import json
import os
from pathlib import Path

import pytest
from typer.testing import CliRunner

from metro.batch.kept import FRESH, Job, keep, put_back
from metro.cli import app
from metro.codehash import code_hash

MADE_WITH = {"code": "c", "settings": {"seed": 1}}


@pytest.fixture
def job(tmp_path):
    """Return a job that has ended: it took one file and gave two."""
    (tmp_path / "force.parquet").write_bytes(b"forces")
    for name in ("orders.parquet", "identified.json"):
        (tmp_path / name).write_bytes(name.encode())
    gives = (tmp_path / "orders.parquet", tmp_path / "identified.json")
    job = Job("identify", (tmp_path / "force.parquet",), gives, MADE_WITH, tmp_path)
    keep(job, job.digest())
    return job


def deleted(job):
    """Return the job as snakemake starts it: its results are gone."""
    for path in job.gives:
        path.unlink()
    return job


def test_results_are_put_back_where_nothing_changed(job):
    assert put_back(deleted(job), job.digest())
    assert [path.read_bytes() for path in job.gives] == [b"orders.parquet", b"identified.json"]


def test_what_is_put_back_is_newer_than_what_it_is_made_from(job):
    os.utime(job.takes[0])
    assert put_back(deleted(job), job.digest())
    assert all(path.stat().st_mtime_ns >= job.takes[0].stat().st_mtime_ns for path in job.gives)


@pytest.mark.parametrize("other", [{"code": "d"}, {"settings": {"seed": 2}}])
def test_nothing_is_put_back_after_an_edit_of_code_or_settings(job, other):
    changed = Job(job.stage, job.takes, job.gives, MADE_WITH | other, job.home)
    assert not put_back(deleted(changed), changed.digest())


def test_nothing_is_put_back_where_an_input_differs(job):
    job.takes[0].write_bytes(b"other forces")
    assert not put_back(deleted(job), job.digest())


def test_nothing_is_put_back_where_a_package_has_another_version(job, monkeypatch):
    monkeypatch.setattr("metro.batch.kept.packages", lambda: {"numpy": "99.0"})
    assert not put_back(deleted(job), job.digest())


def test_nothing_is_put_back_where_a_person_edited_a_result_in_place(job):
    with job.gives[1].open("ab") as stream:
        stream.write(b"edited")
    assert not put_back(deleted(job), job.digest())


def test_nothing_is_put_back_where_the_stage_gives_other_files_now(job):
    more = Job(job.stage, job.takes, (*job.gives, job.home / "new.parquet"), MADE_WITH, job.home)
    assert not put_back(more, more.digest())


def test_a_file_system_without_hard_links_keeps_nothing(job, monkeypatch):
    def refuse(*_):
        raise OSError("no hard links here")

    monkeypatch.setattr(os, "link", refuse)
    keep(job, job.digest())
    assert not put_back(deleted(job), job.digest())
    assert not list((job.home / ".kept").iterdir())


def test_a_stage_runs_once_and_then_puts_back_what_it_gave_unless_results_are_wanted_anew(
    tmp_path, monkeypatch
):
    ran = []
    monkeypatch.setattr("metro.stages.verdict.verdict", lambda **_: ran.append(_write(tmp_path)))
    monkeypatch.chdir(tmp_path)
    (tmp_path / "findings.json").write_text("{}")
    files = json.dumps({"takes": [str(tmp_path / "findings.json")], "gives": [str(tmp_path / "loop.json")]})
    call = ["verdict", "--processed", str(tmp_path), "--reports", str(tmp_path), "--settings", "{}"]
    call += ["--code", code_hash("verdict"), "--files", files]
    for environment, times in (({}, 1), ({}, 1), ({FRESH: "yes"}, 2)):
        (tmp_path / "loop.json").unlink(missing_ok=True)
        result = CliRunner().invoke(app, call, env=environment)
        assert result.exit_code == 0, result.output
        assert len(ran) == times
        assert (tmp_path / "loop.json").read_text() == "written"


def _write(folder: Path):
    (folder / "loop.json").write_text("written")
