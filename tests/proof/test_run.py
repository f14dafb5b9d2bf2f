"""Each batch runs in a process of its own: one that dies does not take the others along."""

import math
import os
import signal
from dataclasses import replace
from pathlib import Path

from proof.limit import bounded, ended
from proof.run import FAILED, Job, alone


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


def swallows(job):
    """Use up the time in code that catches every exception, as what compiled code calls may do."""
    with bounded(job.limit, ended(job.reason, FAILED)):
        while True:
            try:
                math.factorial(2000)
            except BaseException:
                continue


def test_a_batch_that_takes_too_long_ends_whatever_it_does_and_says_where_it_was(tmp_path):
    assert alone(swallows, replace(job(tmp_path), limit=0.2)) == "blind-01"
    reason = (tmp_path / "reports" / "failed.txt").read_text()
    assert "swallows" in reason
    assert reason.endswith("it took more than 0.2 s of processor time\n")
