"""The page on bad input: its messages are those of the check, its table has every case."""

import csv
from pathlib import Path

import corpus_all
import corpus_batches
import pytest

from metro.batch.check import check

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs/bad-input.md").read_text(encoding="utf-8")
# Slip → file, what is there, what is written in its place.
SLIPS = {
    "decimal comma": ("runs.csv", ",0.04,", ',"0,04",'),
    "semicolons": ("runs.csv", ",", ";"),
    "a key without its unit": ("batch.yaml", "diameter_mm: 10", "diameter: 10"),
    "a number as a word": ("batch.yaml", "teeth: 4", "teeth: four"),
    "metres for millimetres": ("runs.csv", ",1,5,down", ",0.001,5,down"),
    "a file that is not there": ("runs.csv", "dynamometer/r2.csv", "dynamometer/r2.csv"),
    "a column without its unit": ("dynamometer/r2.csv", "fx_n", "Fx"),
    "two runs of one name": ("runs.csv", "r2,", "r1,"),
    "axes of the sensor": ("batch.yaml", "{x: x, y: y, z: z}", "{x: y, y: x, z: z}"),
    "the folder was renamed": ("batch.yaml", "batch: specimen", "batch: other"),
}


def test_the_page_shows_each_slip_once():
    rows = [line.split(" | ")[0][2:] for line in PAGE.splitlines() if line.count("`") >= 2 and line[0] == "|"]
    assert rows == list(SLIPS)


@pytest.mark.parametrize("slip", SLIPS)
def test_the_message_of_a_slip_is_the_one_on_the_page(slip, tmp_path):
    file, there, instead = SLIPS[slip]
    folder = tmp_path / "specimen"
    corpus_batches.write(folder, "dynamometer")
    text = (folder / file).read_text(encoding="utf-8")
    assert there in text
    (folder / file).write_text(text.replace(there, instead), encoding="utf-8")
    if "not there" in slip:
        (folder / there).unlink()
    message = next(line for line in PAGE.splitlines() if line.startswith(f"| {slip} |")).split(" | ")[1]
    assert any(message.strip("`") in str(problem) for problem in check(folder, folder).problems)


def test_the_table_beside_the_page_has_every_fault_of_every_kind_and_no_other():
    with (ROOT / "docs/bad-input.csv").open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert {(row["kind"], row["fault"]) for row in rows} == {(c.kind, c.fault) for c in corpus_all.cases()}
    assert {row["outcome"] for row in rows} == {"refused", "flagged", "read"}
    assert f"{len(corpus_all.cases())} cases" in PAGE
