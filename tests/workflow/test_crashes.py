"""Runs that are killed or meet a full disk or one another: the next call gives an undisturbed run's bytes."""

import os
import re
import shutil
import signal
import subprocess
import time

import pytest
from checkout import Checkout
from outputs import bytes_lost, leftovers, outputs, torn

pytestmark = [pytest.mark.workflow, pytest.mark.xdist_group("workflow")]


@pytest.fixture(scope="module")
def reference(finished):
    return outputs(finished.folder)


def begun(checkout, *arguments):
    """Start snakemake in a session of its own."""
    return subprocess.Popen(
        checkout.command(*arguments),
        cwd=checkout.folder,
        env=checkout.environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )


def report_is_being_made(checkout, head):
    """Wait until the report stage is at work."""
    log = checkout / "logs/report/alpha.log"
    while not log.exists() and head.poll() is None:
        time.sleep(0.01)
    assert head.poll() is None, head.communicate()[0]


def without_report(checkout, but=None):
    for path in {"reports/alpha/report.pdf", "reports/summary.pdf", "logs/report/alpha.log"} - {but}:
        (checkout / path).unlink()
    shutil.rmtree(checkout / "data/processed/alpha/.kept/report")  # it is to be made, not put back


def completes(checkout, reference):
    assert torn(checkout.folder, reference) == []
    checkout.call()
    assert bytes_lost(checkout.folder, reference) == []
    assert leftovers(checkout.folder) == []


def test_snakemake_is_killed_and_its_job_goes_on(checkout, reference):
    without_report(checkout)
    head = begun(checkout)
    report_is_being_made(checkout, head)
    head.kill()
    head.wait()
    completes(checkout, reference)


def test_two_at_once(checkout, reference):
    without_report(checkout)
    both = [begun(checkout), begun(checkout)]
    said = {one.communicate()[0]: one.returncode for one in both}
    refused = [text for text, code in said.items() if code]
    assert len(refused) <= 1  # none, where one came after the other's end
    # Where one looks while the other removes old outputs, snakemake itself refuses before our lock is asked.
    refusals = ("another snakemake is at work in", "Write-protected output files", "a concurrent process")
    for text in refused:
        assert any(refusal in text for refusal in refusals), text
    completes(checkout, reference)


def test_a_full_disk_is_told_and_room_is_all_that_it_needs(finished, reference, tmp_path):
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=8m", "tmpfs", disk]
    if subprocess.run(mount, check=False, capture_output=True).returncode:
        pytest.skip("mounting a disk is not allowed here")
    try:
        shutil.copytree(finished.folder, disk / "work", ignore=shutil.ignore_patterns("src"))
        checkout = Checkout(disk / "work")
        checkout.environment = finished.environment
        # The summary stays: its job runs beside that of the report, and removes pages that leave room.
        without_report(checkout, but="reports/summary.pdf")
        free = os.statvfs(disk).f_bavail * os.statvfs(disk).f_frsize
        (disk / "filler").write_bytes(bytes(free - 20_000))
        printed = checkout.call(succeeds=False)
        told = r"reports/alpha/(report\.pdf|provenance\.json): cannot be written: No space left .*; make room"
        assert re.search(told, printed)
        (disk / "filler").unlink()
        checkout.call()  # the summary said meanwhile that the report failed
        assert bytes_lost(checkout.folder, reference) == []
        assert leftovers(checkout.folder) == []
    finally:
        subprocess.run(["umount", disk], check=True)


@pytest.mark.slow
def test_the_lock_that_snakemake_leaves_when_it_is_called_without_the_profile(checkout, reference):
    without = ("--workflow-profile", "none", "--cores", "1")
    without_report(checkout)
    head = begun(checkout, *without)
    report_is_being_made(checkout, head)
    os.killpg(head.pid, signal.SIGKILL)
    head.wait()
    assert "--unlock" in checkout.call(*without, succeeds=False)
    checkout.call("--unlock")
    completes(checkout, reference)
