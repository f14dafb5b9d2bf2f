"""Names of files against the rows of the run table."""

import pytest

from metro.batch.file_names import name_findings, settings_in
from metro.batch.runs import filled
from metro.batch.tables import read_table

FEEDS = {300: 0.025, 600: 0.05, 900: 0.075, 1200: 0.1}  # mm/min and mm per tooth of two teeth at 6000 rpm
HEAD = "run,operation,direction,dynamometer,spindle_rpm,feed_per_tooth_mm,axial_depth_mm,radial_depth_mm"


def findings(folder, rows, teeth=2):
    lines = [f"r{i},slot,slot,{','.join(map(str, row))}" for i, row in enumerate(rows, 1)]
    (folder / "runs.csv").write_text("\n".join([HEAD, *lines]) + "\n")
    table, faults = read_table(folder, "runs")
    assert not faults
    assert len(filled(table.frame, {})) == len(rows)
    return list(name_findings(table, teeth))


def named(feed, rpm=6000, fz=None, depth=3, name="6-n6000f{}ap3ae25.csv"):
    return name.format(feed), rpm, FEEDS[feed] if fz is None else fz, depth, 25


def test_rows_that_agree_with_their_names_give_nothing(tmp_path):
    assert findings(tmp_path, [named(feed) for feed in FEEDS]) == []


def test_a_tenth_of_the_speed_is_warned_of_in_every_row(tmp_path):
    found = findings(tmp_path, [named(feed, rpm=600) for feed in FEEDS])
    assert [(one.severity, one.column, one.row) for one in found] == [
        ("warning", "spindle_rpm", row) for row in (2, 3, 4, 5)
    ]
    assert found[0].message == (
        '600 differs from "6-n6000f300ap3ae25.csv", whose name states 6000: correct the row, or exchange the '
        "files"
    )


def test_feeds_in_the_rows_of_one_another_are_warned_of(tmp_path):
    rows = [named(300, fz=0.05), named(600, fz=0.025), named(900), named(1200)]
    found = findings(tmp_path, rows)
    assert [(one.column, one.row) for one in found] == [("feed_per_tooth_mm", 2), ("feed_per_tooth_mm", 3)]
    assert "0.05 differs" in found[0].message
    assert "states 0.025" in found[0].message
    assert findings(tmp_path, rows, teeth=None) == []  # a feed in mm/min says nothing then


def test_a_blank_cell_contradicts_no_name(tmp_path):
    name, rpm, _, depth, width = named(300)
    assert (
        findings(tmp_path, [(name, rpm, "", depth, width), (name.replace("300", "600"), rpm, "", depth, "")])
        == []
    )


@pytest.mark.parametrize("name", ["n{}_ap3_ae25.csv", "s{}ap3ae25.csv", "f{}_ap3_ae25.csv"])
def test_numbers_of_records_are_no_settings(tmp_path, name):
    rows = [(name.format(i), 6000, fz, 3, 25) for i, fz in enumerate(FEEDS.values(), 1)]
    assert findings(tmp_path, rows) == []


def test_letters_that_agree_with_nothing_are_no_settings(tmp_path):
    rows = [(f"n{7000 + i}_ap{9 + i}.csv", 6000, 0.1, 3, 25) for i in range(3)]
    assert findings(tmp_path, rows) == []


def test_one_column_alone_is_too_little(tmp_path):
    assert findings(tmp_path, [("n6000.csv", 600, 0.1, 3, 25), ("n6000b.csv", 6000, 0.1, 3, 25)]) == []


def test_the_folder_of_a_file_states_nothing():
    assert settings_in("s1500-ap9/ae2.n1/n6000.tdms") == {"spindle_rpm": "6000"}


def test_a_decimal_in_a_name_may_be_a_p():
    assert settings_in("S4500_fz0p08_ap1.5-ae6.csv") == {
        "spindle_rpm": "4500",
        "feed_per_tooth_mm": "0.08",
        "axial_depth_mm": "1.5",
        "radial_depth_mm": "6",
    }
