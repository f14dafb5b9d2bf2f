"""Each batch runs in a process of its own: one that dies does not take the others along."""

import os
import signal
from pathlib import Path

from proof.run import Job, alone


def job(folder):
    return Job(Path("blind-01"), folder, folder / "processed", folder / "reports", {}, {}, keep=True)


def dies(_job):
    os.kill(os.getpid(), signal.SIGSEGV)


def fails(job):
    return job.folder.name


def passes(_job):
    return None


def test_a_process_that_dies_is_a_batch_that_failed_and_says_so(tmp_path):
    assert alone(dies, job(tmp_path)) == "blind-01"
    assert str(-signal.SIGSEGV) in (tmp_path / "reports" / "failed.txt").read_text()


def test_a_batch_that_failed_keeps_its_reason_and_one_that_ran_through_has_none(tmp_path):
    assert alone(fails, job(tmp_path)) == "blind-01"
    assert alone(passes, job(tmp_path)) is None
    assert not (tmp_path / "reports").exists()
