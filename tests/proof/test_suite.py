"""What the batches of a suite hide."""

from collections import Counter

import pytest

from proof.layout import Layout
from proof.suite import ABSORBED, FULL, SHARES, Suite, draw, make, sides

KNOWN = ["tool_runout", "tool_wear", "pitch_error", "dynamometer_rotation"]
UNKNOWN = ["chipped_tooth", "lagging_channel"]


@pytest.fixture(scope="module")
def drawn():
    return draw(200, 5, KNOWN, UNKNOWN, SHARES["b"])


def test_kinds_have_their_shares_and_effects_of_a_kind_come_equally_often(drawn):
    kinds = Counter(one.kind for one in drawn)
    assert kinds == {kind: 200 * share for kind, share in SHARES["b"].items()}
    for kind, each in (("one", 4), ("two", 3), ("outside", 2)):
        counts = Counter(one.effects for one in drawn if one.kind == kind)
        assert len(counts) == each
        assert max(counts.values()) - min(counts.values()) <= 1


def test_a_full_suite_of_the_harder_world_has_what_a_judgement_needs():
    kinds = Counter(one.kind for one in draw(FULL, 5, KNOWN, UNKNOWN, SHARES["d"]))
    assert kinds["one"] * 0.6 >= 40  # that many are visible, at least
    assert (kinds["two"], kinds["none"]) >= (20, 30)
    assert kinds["outside"] >= 30


def test_smaller_suites_keep_the_proportions():
    kinds = Counter(one.kind for one in draw(40, 5, KNOWN, UNKNOWN, SHARES["d"]))
    assert kinds == {"none": 8, "one": 18, "two": 5, "outside": 9}


def test_pairs_are_of_different_effects_that_the_base_model_does_not_absorb(drawn):
    pairs = [one.effects for one in drawn if one.kind == "two"]
    assert all(len(set(pair)) == 2 and not set(pair) & set(ABSORBED) for pair in pairs)


def test_neither_name_nor_order_nor_seed_tells_what_is_hidden(drawn):
    assert [one.name for one in drawn] == [f"blind-{i:03d}" for i in range(1, 201)]
    assert len({one.seed for one in drawn}) == 200
    other = draw(200, 6, KNOWN, UNKNOWN, SHARES["b"])
    same = sum(a.kind == b.kind for a, b in zip(drawn, other, strict=True))
    assert same < 100  # by chance 0.27 of them


def test_what_the_library_only_knows_the_likeness_of_is_outside_of_it():
    known, unknown = sides()
    assert "tool_runout" in known
    assert {"chipped_tooth", "lagging_channel"} <= set(unknown)
    assert not set(known) & set(unknown)


def test_a_suite_about_lobes_hides_effects_of_the_boundary():
    known, unknown = sides("lobes")
    assert known == ["missing_mode", "process_damping", "mode_coupling", "spindle_speed_softening"]
    assert len(unknown) >= 3
    assert "tool_runout" in unknown  # it bears that name among the forces, too, and is no effect of lobes


@pytest.mark.parametrize("observable", ["joint_force", "deformation", "waviness"])
def test_a_suite_about_an_arm_hides_what_is_seen_in_its_observable(observable):
    known, unknown = sides(observable)
    assert len(known) >= 3
    assert len(unknown) >= 3
    assert ("stiffness_hardening" in known) == (observable == "deformation")
    assert ("payload_error" in known) == (observable == "joint_force")


def test_a_suite_about_faces_hides_the_effects_of_faces_and_what_no_library_has():
    known, unknown = sides("flatness")
    assert set(known) == {
        *("spindle_tilt", "thermal_growth", "fixture_bow", "path_vibration", "entry_transient"),
        "stiffness_scale",
    }
    assert len(unknown) == 8


def test_batches_that_are_there_are_not_made_again(tmp_path):
    (tmp_path / "raw/blind-1").mkdir(parents=True)
    (tmp_path / "raw/blind-1/batch.yaml").write_text("")
    with pytest.raises(FileExistsError, match="holds batches already"):
        make(Layout(tmp_path), Suite("force", 3, 1, "a"), 1)


def test_making_seals_what_every_batch_hides_and_leaves_no_trace_of_it_with_the_batch(tmp_path):
    from proof.seal import unseal

    out = Layout(tmp_path)
    digest = make(out, Suite("force", 1, 2, "b"), 1)
    truth = unseal(out.truth, out.seal)
    assert out.seal.read_text().strip() == digest
    assert sorted(truth["batches"]) == out.batches == ["blind-1"]
    for name, hidden in truth["batches"].items():
        written = "".join(path.read_text() for path in (out.raw / name).glob("*.*"))
        assert not [effect for effect in hidden["effects"] if effect in written]
        assert hidden["kind"] not in written.split()


def test_a_suite_says_what_it_is_about(tmp_path):
    from proof.seal import unseal

    out = Layout(tmp_path)
    make(out, Suite("lobes", 1, 3, "a"), 1)
    assert unseal(out.truth, out.seal)["observable"] == "lobes"
    assert (out.raw / "blind-1/impacts.csv").is_file()


def test_an_interrupted_suite_goes_on_and_gives_the_same_batches(tmp_path):
    whole, parted = Layout(tmp_path / "whole"), Layout(tmp_path / "parted")
    suite = Suite("lobes", 2, 3, "a")
    make(whole, suite, 1)
    make(parted, suite, 1)
    parted.seal.unlink()
    parted.made("blind-2").unlink()
    kept = (parted.raw / "blind-1/runs.csv").stat().st_mtime_ns
    (parted.raw / "blind-2/batch.yaml").unlink()
    make(parted, suite, 1)
    assert (parted.raw / "blind-1/runs.csv").stat().st_mtime_ns == kept
    for name in ("blind-1", "blind-2"):
        assert (parted.raw / name / "runs.csv").read_text() == (whole.raw / name / "runs.csv").read_text()


def test_a_folder_that_another_suite_was_begun_in_is_left_alone(tmp_path):
    out = Layout(tmp_path)
    make(out, Suite("lobes", 1, 3, "a"), 1)
    out.seal.unlink()
    with pytest.raises(FileExistsError):
        make(out, Suite("lobes", 1, 4, "a"), 1)
