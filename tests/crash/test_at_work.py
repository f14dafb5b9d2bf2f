"""Who may work in a folder, and what a killed run left behind."""

import subprocess
import sys

import pytest

from metro.batch.at_work import JOBS, job_at_work, only_one_at_work, remove_leftovers
from metro.batch.writing import write_atomically


def python(code, folder, **streams):
    """Start Python with a folder as its first argument."""
    script = f"import pathlib, sys, metro.batch.at_work; folder = pathlib.Path(sys.argv[1])\n{code}"
    return subprocess.Popen([sys.executable, "-c", script, str(folder)], text=True, **streams)


WORKFLOW = "metro.batch.at_work.only_one_at_work(folder); print('in', flush=True); input()"
JOB = "with metro.batch.at_work.job_at_work(folder): print('in', flush=True); input()"
PIPES = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}


def test_a_second_process_cannot_work_in_the_same_folder(tmp_path):
    (tmp_path / ".snakemake").mkdir()
    first = python(WORKFLOW, tmp_path, **PIPES)
    assert first.stdout.readline() == "in\n"
    with pytest.raises(RuntimeError, match="another snakemake is at work"):
        only_one_at_work(tmp_path)
    first.kill()
    first.communicate()
    only_one_at_work(tmp_path)


def test_a_workflow_waits_for_the_jobs_of_one_that_was_killed_and_says_so(tmp_path):
    (tmp_path / ".snakemake").mkdir()
    killed = python(WORKFLOW, tmp_path, **PIPES)
    assert killed.stdout.readline() == "in\n"
    jobs = [python(JOB, tmp_path, **PIPES) for _ in range(2)]
    assert [job.stdout.readline() for job in jobs] == ["in\n", "in\n"]
    killed.kill()
    killed.communicate()
    following = python(WORKFLOW, tmp_path, **{**PIPES, "stdin": subprocess.DEVNULL})
    assert "jobs that a killed snakemake left at work" in following.stderr.readline()
    jobs[0].communicate("\n")
    assert following.poll() is None
    jobs[1].kill()
    jobs[1].communicate()
    assert following.stdout.readline() == "in\n"
    following.communicate()


def test_a_job_where_no_workflow_ever_ran_leaves_no_trace(tmp_path):
    with job_at_work(tmp_path):
        assert not list(tmp_path.iterdir())
        (tmp_path / ".snakemake").mkdir()
    only_one_at_work(tmp_path)
    with job_at_work(tmp_path):
        assert (tmp_path / JOBS).exists()


def test_leftovers_of_killed_jobs_go_and_everything_else_stays(tmp_path):
    def killed(stream):
        stream.write(b"half")
        raise KeyboardInterrupt

    (tmp_path / "a/.scan.k2x_8dq0").mkdir(parents=True)
    (tmp_path / "a/.force.parquet.abcd1234").write_text("")
    for name in (".gitkeep", "a/force.parquet", "a/.hidden.txt", "a/x.abcdefgh"):
        (tmp_path / name).write_text("")
    with pytest.raises(KeyboardInterrupt):
        write_atomically(tmp_path / "a/new.json", killed)
    remove_leftovers(tmp_path, tmp_path / "not-there")
    left = sorted(str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*") if path.is_file())
    assert left == [".gitkeep", "a/.hidden.txt", "a/force.parquet", "a/x.abcdefgh"]
    assert not (tmp_path / "a/.scan.k2x_8dq0").exists()
