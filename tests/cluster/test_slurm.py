"""The workflow on a Slurm of two nodes: a local run's bytes, though a node is lost and a job is cancelled."""

import re
import shutil
import subprocess

import pytest
from checkout import Checkout
from outputs import bytes_lost, leftovers, torn
from slurm import missing, slurm

pytest.importorskip("snakemake_executor_plugin_slurm", reason="metro-machining[slurm] is not installed")
pytestmark = [
    pytest.mark.workflow,
    pytest.mark.xdist_group("workflow"),
    pytest.mark.skipif(bool(missing()), reason=missing() or "-"),
]
# What a Slurm without accounts, and tests that would rather not wait, need beside the profile.
HERE = ("--workflow-profile", "slurm", "--slurm-no-account", "--slurm-status-command", "squeue")
SOON = ("--slurm-init-seconds-before-status-checks", "1", "--seconds-between-status-checks", "1")
SHORT = (*HERE, *SOON, "--latency-wait", "5")


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    with slurm(tmp_path_factory.mktemp("slurm")) as running:
        yield running


@pytest.fixture
def submitted(cluster, unrun, tmp_path):
    """Start the workflow on the cluster; both batches are at work on a node each."""
    shutil.copytree(unrun.folder, tmp_path / "checkout")
    checkout = Checkout(tmp_path / "checkout")
    environment = checkout.environment | cluster.environment
    command = checkout.command(*SHORT)
    with (checkout / "said").open("wb") as said:
        head = subprocess.Popen(command, cwd=checkout.folder, env=environment, stdout=said, stderr=said)
    logs = [checkout / f"logs/ingest/{name}.log" for name in ("alpha", "beta")]
    cluster.wait(lambda: head.poll() is not None or all(log.exists() for log in logs), "both batches", 900)
    assert head.poll() is None, (checkout / "said").read_text()
    yield checkout, head
    head.kill()
    head.wait()


def finished(checkout, head, reference):
    """Wait for the end of the run; its outputs must be those of a local one."""
    assert head.wait(timeout=1800) == 0, (checkout / "said").read_text()
    assert bytes_lost(checkout.folder, reference) == []
    assert leftovers(checkout.folder) == []


def restarts(cluster, job):
    """Tell how often Slurm began a job anew."""
    return int(re.search(r"Restarts=(\d+)", cluster.ask("scontrol", "show", "job", job))[1])


def test_a_cancelled_job_is_tried_again_and_no_other(cluster, submitted, reference):
    checkout, head = submitted
    (cancelled,), (other,) = cluster.jobs("n1"), cluster.jobs("n2")
    cluster.ask("scancel", cancelled)
    finished(checkout, head, reference)
    assert "JobState=CANCELLED" in cluster.ask("scontrol", "show", "job", cancelled)
    assert "JobState=COMPLETED" in cluster.ask("scontrol", "show", "job", other)
    # two batches, the one that was cancelled again, and the summary
    assert (checkout / "said").read_text().count("has been submitted with SLURM jobid") == 4


def test_a_node_that_dies_loses_its_own_jobs_only(cluster, submitted, reference):
    checkout, head = submitted
    (lost,), (other,) = cluster.jobs("n1"), cluster.jobs("n2")
    cluster.lose_node("n1")
    assert torn(checkout.folder, reference) == []
    cluster.wait(lambda: "down" in cluster.states()["n1"], "the loss of a node")
    finished(checkout, head, reference)
    assert (restarts(cluster, lost), restarts(cluster, other)) == (1, 0)
    assert "NodeList=n2\n" in cluster.ask("scontrol", "show", "job", lost)
