"""When something is said of a file, and what of one that is not as it should be."""

import json
import re
import time

import pandas as pd
import pytest

from metro.batch.findings import ContractError
from metro.watch.arrivals import PATIENCE_S, being_written
from metro.watch.journal import Journal
from virtual_cell.recipes.slot import PLANS

SLOT = next(plan for plan in PLANS if plan.condition == "slot-0.11")
LIMIT_S = 3.0  # from the last byte of a file to the judgement on it
PAUSE_S = 1.2  # longer than a file of which nobody is known to write has to rest


def looked_at(watcher, seconds):
    """Look four times a second for so long; return what is said, and when."""
    said, end = [], time.monotonic() + seconds
    while time.monotonic() < end:
        said += [(each, time.monotonic()) for each in watcher.look()]
        time.sleep(0.25)
    return said


def real_watcher(place):
    """Watch with the clock on the wall."""
    place.clock = None
    watcher = place.watcher()
    watcher._arrivals._clock = time.monotonic
    return watcher


@pytest.mark.parametrize("closed", [False, True], ids=["kept open", "closed after each piece"])
def test_nothing_is_said_before_the_last_byte_and_all_is_within_three_seconds_after_it(place, closed):
    """A copy that pauses: also one that shuts the file meanwhile, so that nobody has it open to write."""
    place.plan("r90", SLOT, file="force/r90.csv")
    content = place.record("r90", SLOT).to_csv(index=False).encode()
    watcher = real_watcher(place)
    path = place.raw / "force/r90.csv"
    size = len(content) // 4 + 1
    pieces = [content[start : start + size] for start in range(0, len(content), size)]
    stream = path.open("wb")
    for piece in pieces[:-1]:
        stream.write(piece)
        stream.flush()
        if closed:
            stream.close()
        assert looked_at(watcher, PAUSE_S) == []
        stream = path.open("ab") if closed else stream
    stream.write(pieces[-1])
    stream.close()
    last_byte = time.monotonic()
    ((said, at),) = looked_at(watcher, LIMIT_S + 1.0)
    assert said.status == "as predicted"
    assert at - last_byte < LIMIT_S


def test_a_file_that_is_open_to_write_is_seen_to_be(tmp_path):
    path = tmp_path / "record.csv"
    with path.open("w") as stream:
        stream.write("t_s\n")
        stream.flush()
        written = being_written(path)
    if written is None:
        pytest.skip("this file system says nothing of who writes")
    assert written
    assert being_written(path) is False
    assert being_written(tmp_path / "none") is None


def test_a_file_that_is_no_record_is_named_with_what_to_do_after_some_patience(place):
    place.plan("r90", SLOT, file="force/r90.csv")
    watcher = place.watcher()
    place.later(watcher)
    (place.raw / "force/r90.csv").write_text("lunch, at noon\n")
    assert place.later(watcher, PATIENCE_S / 3) == []
    (said,) = place.later(watcher, PATIENCE_S / 2)
    assert (said.status, said.run) == ("error", "r90")
    assert "found the columns lunch, at noon, expected t_s, fx_n, fy_n, fz_n" in said.headline
    assert said.advice.startswith("Export or copy the file again")


def test_a_file_that_was_no_record_is_judged_once_it_is_one(place):
    place.plan("r90", SLOT)
    watcher = place.watcher()
    (place.raw / "force/r90.parquet").write_bytes(b"PAR1")
    (said,) = place.later(watcher, PATIENCE_S)
    assert said.status == "error"
    place.drop("r90", place.record("r90", SLOT))
    (said,) = place.later(watcher)
    assert said.status == "as predicted"


def test_a_record_that_ends_early_is_named_with_what_is_missing(place):
    place.plan("r90", SLOT)
    place.drop("r90", place.record("r90", SLOT).iloc[:6000])
    (said,) = place.later(place.watcher(), PATIENCE_S)
    assert said.status == "error"
    assert re.search(r"holds 0\.\d+ s of steady cut, expected at least 0\.4", said.headline)
    assert "the end of the record is missing; export or copy it again" in said.headline


def test_a_copy_of_a_record_of_the_batch_is_refused(place):
    place.plan("r90", SLOT)
    (place.raw / "force/r90.parquet").write_bytes((place.raw / "force/r07.parquet").read_bytes())
    (said,) = place.later(place.watcher(), PATIENCE_S)
    assert "has the same content as force/r07.parquet" in said.headline


def test_a_file_that_no_row_names_is_judged_when_one_does(place):
    watcher = place.watcher()
    place.drop("r90", place.record("r90", SLOT))
    (place.raw / "force/.r91.parquet.part").write_bytes(b"")  # of a program that copies: not a file yet
    (said,) = place.later(watcher, PATIENCE_S)
    assert (said.status, said.file) == ("error", "force/r90.parquet")
    assert said.advice.startswith("Append a row with its settings to runs.csv")
    place.plan("r90", SLOT)
    (said,) = place.later(watcher)
    assert (said.status, said.run) == ("as predicted", "r90")


def test_a_row_with_a_fault_is_named_with_its_column(place):
    place.plan("r90", SLOT, radial_depth_mm=40.0)
    place.drop("r90", place.record("r90", SLOT))
    watcher = place.watcher()
    (said,) = place.later(watcher, PATIENCE_S)
    assert said.status == "error"
    assert "column radial_depth_mm: found 40" in said.headline
    assert list(watcher.look()) == []


def test_a_table_that_cannot_be_read_is_named_and_ends_nothing(place):
    good = (place.raw / "runs.csv").read_text()
    (place.raw / "runs.csv").write_text("")
    watcher = place.watcher()
    (said,) = place.later(watcher, PATIENCE_S)
    assert (said.status, said.file) == ("error", "runs.csv")
    (place.raw / "runs.csv").write_text(good)
    place.plan("r90", SLOT)
    place.drop("r90", place.record("r90", SLOT))
    (said,) = place.later(watcher)
    assert said.status == "as predicted"


def test_a_file_outside_of_the_batch_is_not_read(place):
    place.plan("r90", SLOT, file="../r90.parquet")
    place.record("r90", SLOT).to_parquet(place.raw.parent / "r90.parquet")
    (said,) = place.later(place.watcher(), PATIENCE_S)
    assert "outside the batch's folder" in said.headline


def test_a_file_of_another_kind_is_checked_and_it_is_said_that_this_is_all(place):
    place.plan("r90", SLOT, dynamometer="", profile="profile/r90.csv")
    table = pd.read_csv(place.raw / "runs.csv")
    table.loc[table["run"] == "r90", "dynamometer"] = None
    table.to_csv(place.raw / "runs.csv", index=False)
    (place.raw / "profile").mkdir()
    x = [0.05 * i for i in range(1200)]
    rows = "\n".join(f"{each:.3f},{0.001 * ((i * 7) % 13):.4f}" for i, each in enumerate(x))
    (place.raw / "profile/r90.csv").write_text(f"x_mm,z_mm\n{rows}\n")
    (said,) = place.later(place.watcher(), PATIENCE_S)
    assert said.status == "checked"
    assert said.headline.startswith("checked, not compared: a profile is not compared here")


def test_a_judgement_is_kept_before_it_is_shown_and_never_made_twice(place):
    place.plan("r90", SLOT)
    place.drop("r90", place.record("r90", SLOT))
    watcher = place.watcher()
    for _ in range(3):
        list(zip(watcher.look(), (), strict=False))  # nothing is taken: as if it were killed there
        place.clock += 2.0
    next(watcher.look(), None)
    kept = Journal(place.reports / "watch.json", "clean-slot").judgements
    assert [each.run for each in kept] == ["r90"]
    assert place.later(place.watcher(), PATIENCE_S) == []
    (place.raw / "force/r90.parquet").touch()
    assert place.later(place.watcher(), PATIENCE_S) == []


def test_the_journal_is_json_that_a_program_can_read(place):
    place.plan("r90", SLOT)
    place.drop("r90", place.record("r90", SLOT))
    (said,) = place.later(place.watcher())
    content = json.loads((place.reports / "watch.json").read_text())
    assert (content["format"], content["batch"]) == (1, "clean-slot")
    assert content["judged"][0]["headline"] == said.headline
    (place.reports / "watch.json").write_text("{}")
    with pytest.raises(ContractError, match="is no journal of metro watch"):
        place.watcher()
