"""What `judge` does in which order; making and running are stood in for."""

import json
import subprocess

import pytest

from proof import seal
from proof.protocol import judge as room
from proof.protocol import log
from proof.protocol.commit import UncommittedError, seed_of
from proof.protocol.judge import LOG, PAGE, judge
from proof.score import Score


def git(folder, *arguments):
    identity = ("-c", "user.name=a", "-c", "user.email=a@b")
    subprocess.run(["git", *identity, *arguments], cwd=folder, check=True, capture_output=True)


@pytest.fixture
def checkout(tmp_path):
    for name in ("src", "virtual_cell", "proof", "config", "docs"):
        (tmp_path / "c" / name).mkdir(parents=True)
        (tmp_path / "c" / name / "file.py").write_text("1\n")
    git(tmp_path / "c", "init", "-q")
    git(tmp_path / "c", "add", ".")
    git(tmp_path / "c", "commit", "-qm", "first")
    return tmp_path / "c"


@pytest.fixture
def done(monkeypatch):
    """What was called, in order; a suite of two batches that hide nothing."""
    calls = []

    def make(out, suite, _jobs):
        calls.append(("make", suite.seed, suite.style, suite.batches))
        truths = {f"b{i}": {"batch": f"b{i}", "kind": "none", "effects": {}} for i in range(suite.batches)}
        content = {"observable": suite.observable, "seed": suite.seed, "style": suite.style}
        seal.close({**content, "commit": suite.commit, "batches": truths}, out.truth, out.seal)

    def run(_out, _jobs, **options):
        calls.append(("run", options["through"], options["limit"]))

    def opened(_out, _jobs, _limit):
        calls.append(("open",))
        return [Score(f"b{i}", "none", (), {}, "clean", {}, p_value=0.5) for i in range(2)]

    for name, stand_in in {"make": make, "run": run, "opened": opened}.items():
        monkeypatch.setattr(room, name, stand_in)
    return calls


def test_a_commit_is_judged_by_its_own_batches_and_written_down_once(checkout, tmp_path, done):
    judge(tmp_path / "out", "force", 2, 1, checkout=checkout)
    (row,) = log.rows(checkout / LOG)
    head = subprocess.run(
        ["git", "rev-parse", "HEAD"], cwd=checkout, capture_output=True, text=True, check=True
    )
    assert row["commit"] == head.stdout.strip()
    assert done == [
        ("make", seed_of(row["commit"], "force"), "d", 2),
        ("run", "force", room.LIMIT),
        ("open",),
    ]
    assert row["counts"]["none"] == {"batches": 2, "seen": 0}
    assert row["seal"] in (checkout / PAGE).read_text()
    judge(tmp_path / "out", "force", 2, 1, checkout=checkout)  # make proof, called again
    assert len(log.rows(checkout / LOG)) == 1
    assert len(done) == 3


def test_a_judgement_that_was_stopped_goes_on_without_other_batches(checkout, tmp_path, done, monkeypatch):
    def stopped(*_, **__):
        raise KeyboardInterrupt

    going = room.run
    monkeypatch.setattr(room, "run", stopped)
    with pytest.raises(KeyboardInterrupt):
        judge(tmp_path / "out", "force", 2, 1, checkout=checkout)
    assert log.rows(checkout / LOG) == []
    monkeypatch.setattr(room, "run", going)
    judge(tmp_path / "out", "force", 2, 1, checkout=checkout)
    assert [call[0] for call in done] == ["make", "run", "open"]


def test_nothing_is_written_down_where_the_code_is_not_that_of_a_commit(
    checkout, tmp_path, done, monkeypatch
):
    (checkout / "src/file.py").write_text("2\n")
    with pytest.raises(UncommittedError):
        judge(tmp_path / "out", "force", 2, 1, checkout=checkout)
    assert done == []
    git(checkout, "checkout", "src")

    def edited(*_, **__):
        (checkout / "proof/file.py").write_text("2\n")

    monkeypatch.setattr(room, "run", edited)
    with pytest.raises(UncommittedError):
        judge(tmp_path / "out", "force", 2, 1, checkout=checkout)
    assert not (checkout / LOG).exists()


def test_a_row_is_one_line(checkout, tmp_path, done):
    judge(tmp_path / "out", "lobes", 2, 1, checkout=checkout)
    (line,) = (checkout / LOG).read_text().splitlines()
    labels = {one["label"] for one in json.loads(line)["figures"]}
    assert "nothing hidden: clean" in labels  # what only labels have
