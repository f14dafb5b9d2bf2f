"""The protocol: which commit is judged, by which seed, and that the log only ever grows."""

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest

from proof.protocol import board, log
from proof.protocol.commit import UncommittedError, seed_of, unchanged, under_test
from proof.protocol.judge import LOG, PAGE
from proof.protocol.row import row
from proof.score import Score
from proof.statistics import calibration_error, uniform

ROOT = Path(__file__).parents[2]


def git(folder, *arguments):
    identity = ("-c", "user.name=a", "-c", "user.email=a@b")
    done = subprocess.run(
        ["git", *identity, *arguments], cwd=folder, check=True, capture_output=True, text=True
    )
    return done.stdout.strip()


@pytest.fixture
def checkout(tmp_path):
    for name in ("src", "virtual_cell", "proof", "config", "docs"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "file.py").write_text("1\n")
    git(tmp_path, "init", "-q")
    git(tmp_path, "add", ".")
    git(tmp_path, "commit", "-qm", "first")
    return tmp_path


def test_the_seed_is_that_of_anybody_who_knows_the_commit():
    commit = "55ff3d1b4c4e4be0a3a1d8c3c6d1e8f2a9b0c1d2"
    asked = subprocess.run(["sha256sum"], input=f"{commit} force", capture_output=True, text=True, check=True)
    assert seed_of(commit, "force") == int(asked.stdout[:8], 16)
    assert len({seed_of(commit, name) for name in ("force", "waviness", "lobes")}) == 3
    assert seed_of(commit.replace("5", "6"), "force") != seed_of(commit, "force")


def test_the_commit_under_test_is_the_one_checked_out(checkout):
    assert under_test(checkout) == git(checkout, "rev-parse", "HEAD")
    (checkout / "docs/file.py").write_text("what is written about it\n")
    under_test(checkout)


@pytest.mark.parametrize("folder", ["src", "virtual_cell", "proof", "config"])
@pytest.mark.parametrize("name", ["file.py", "new.py"])
def test_what_is_not_committed_is_not_judged(checkout, folder, name):
    (checkout / folder / name).write_text("2\n")
    with pytest.raises(UncommittedError, match=f"{folder}/{name}"):
        under_test(checkout)
    git(checkout, "add", ".")
    with pytest.raises(UncommittedError):
        under_test(checkout)


def test_code_that_is_changed_while_it_is_judged_is_not_what_was_judged(checkout):
    commit = under_test(checkout)
    (checkout / "docs/file.py").write_text("2\n")
    git(checkout, "commit", "-qam", "a line of the log")
    unchanged(checkout, commit)
    (checkout / "src/file.py").write_text("2\n")
    with pytest.raises(UncommittedError):
        unchanged(checkout, commit)
    git(checkout, "commit", "-qam", "other code")
    with pytest.raises(UncommittedError, match="src/file"):
        unchanged(checkout, commit)


def test_a_row_is_added_at_the_end_and_nothing_before_it_changes(tmp_path):
    file = tmp_path / "log.jsonl"
    before = '{"observable": "force",   "program": "metro", "by": "hand"}\n'
    file.write_text(before)
    log.append(file, {"observable": "force", "program": "metro", "n": 2})
    log.append(file, {"observable": "lobes", "program": "base", "n": 3})
    assert file.read_text().startswith(before)
    assert [one.get("n") for one in log.rows(file)] == [None, 2, 3]
    assert log.newest(file)["force"]["metro"]["n"] == 2


def test_the_log_of_the_repository_starts_with_that_of_the_last_commit():
    asked = ["git", "show", f"HEAD:{LOG}"]
    held = subprocess.run(asked, cwd=ROOT, capture_output=True, text=True, check=False)
    if held.returncode:
        pytest.skip("no commit holds a log")
    assert (ROOT / LOG).read_text().startswith(held.stdout)
    assert all(json.loads(line)["format"] == 1 for line in (ROOT / LOG).read_text().splitlines())


def test_the_board_of_the_repository_is_that_of_its_log():
    assert (ROOT / PAGE).read_text() == board.text(log.newest(ROOT / LOG), log.rows(ROOT / LOG))


HEAD = {
    "commit": "55ff3d1b4c4e4be0a3a1d8c3c6d1e8f2a9b0c1d2",
    "date": "2026-01-31",
    "observable": "force",
    "style": "d",
    "batches": 5,
    "seed": 1,
    "seal": "ab",
    "limit_s": 60.0,
}


def scores(wrong=False):
    """Nothing hidden three times, of which ``wrong`` adds one; a single that is found, one too small."""
    none = [Score(f"n{i}", "none", (), {}, "clean", {}, p_value=p) for i, p in enumerate((0.2, 0.5, 0.9))]
    if wrong:
        named = {"tool_wear": 0.95}
        none[0] = Score("n0", "none", (), {}, "explained", named, claimed=True, stated=((0.95, False),))
    seen = Score(
        "s",
        "one",
        ("tool_runout",),
        {"tool_runout": 4.0},
        "explained",
        {"tool_runout": 0.9},
        claimed=True,
        after=2.0,
        floor=1.6,
        stated=((0.9, True),),
        rejected=((0.02, False),),
    )
    small = Score("b", "one", ("tool_wear",), {"tool_wear": 0.3}, "clean", {})
    return [*none, seen, small]


def test_a_row_holds_every_figure_with_its_count_and_interval():
    found = row("metro", scores(wrong=True), HEAD)
    figures = {one["label"]: one for one in found["figures"]}
    added = figures["nothing hidden: an effect is added"]
    assert (added["value"], added["count"], added["met"]) == (pytest.approx(1 / 3), 3, False)
    # Wilson's interval by its closed form
    z, n, p = 1.959964, 3, 1 / 3
    half = z * np.sqrt(p * (1 - p) / n + z**2 / (4 * n**2)) / (1 + z**2 / n)
    middle = (p + z**2 / (2 * n)) / (1 + z**2 / n)
    assert added["ci95"] == pytest.approx([middle - half, middle + half])
    assert found["counts"]["one"] == {"batches": 2, "seen": 1}
    assert found["over_floor"]["median"] == pytest.approx(1.25)
    assert figures["two effects: both named"]["value"] is None
    assert json.loads(json.dumps(found, allow_nan=False)) == found


def test_the_reliability_of_a_row_is_that_of_its_probabilities():
    tried = row("metro", scores(wrong=True), HEAD)["tried"]
    assert [(one["from"], one["count"], one["came_true"]) for one in tried["bins"]] == [
        (0.0, 1, 0.0),
        (0.9, 1, 1.0),
        (0.95, 1, 0.0),
    ]
    assert tried["calibration_error"] == pytest.approx((0.02 + 0.1 + 0.95) / 3)


def test_the_calibration_error_of_what_is_calibrated_is_zero_and_of_what_is_sure_and_wrong_one():
    assert calibration_error([(0.5, True), (0.5, False)]) == pytest.approx(0.0)
    assert calibration_error([(1.0, False)] * 4) == pytest.approx(1.0)
    assert np.isnan(calibration_error([]))


def test_the_row_and_the_board_say_why_a_batch_failed(tmp_path):
    late = "it took more than 60 s of processor time"
    reasons = {"a": late, "b": None}
    failed = [Score(name, "none", (), {}, "failed", {}, failure=why) for name, why in reasons.items()]
    found = row("metro", [*scores(), *failed], HEAD)
    assert found["failures"] == reasons
    file, page = tmp_path / "log.jsonl", tmp_path / "board.md"
    log.append(file, found)
    board.write(file, page)
    assert f"- a failed: {late}.\n- b failed: the reason is not known.\n" in page.read_text()


def test_uniform_p_values_have_no_distance_and_those_of_a_blind_program_do():
    even = (np.arange(40) + 0.5) / 40
    assert uniform(even)[0] == pytest.approx(0.0125)
    distance, p_value = uniform(even**3)
    assert distance == pytest.approx(max(abs(even - even**3)), abs=0.03)
    assert p_value < 0.01


def test_the_board_shows_the_newest_row_and_the_course_of_all(tmp_path):
    file, page = tmp_path / "log.jsonl", tmp_path / "board.md"
    old = {**HEAD, "commit": "0" * 40, "date": "2026-01-01"}
    log.append(file, row("metro", scores(wrong=True), old))
    log.append(file, row("metro", scores(), HEAD))
    log.append(file, row("base", scores(), {**HEAD, "seal": "cd"}))
    board.write(file, page)
    text = page.read_text()
    added = next(line for line in text.splitlines() if line.startswith("| nothing hidden: an effect is add"))
    assert added.split(" | ")[2].startswith("0.0 % (0.0–56.1; 3)")
    assert "base (suite of `55ff3d1b4c4e`)" in text  # answered about other batches
    course = text.split("### All judgements")[1]
    assert course.index("`55ff3d1b4c4e`") < course.index("`000000000000`")
    assert "**33.3 %** (6.1–79.2; 3)" in course
    assert (tmp_path / "figures/protocol-force.svg").read_text().count("<svg") == 1
