import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from metro.batch.runs import design_findings, filled, recorded, run_findings
from metro.batch.tables import read_table

MANIFEST = {"tool": {"diameter_mm": 10, "teeth": 4}, "hole_diameter_mm": 16}
HEADER = (
    "run,condition,replicate,order,operation,spindle_rpm,feed_per_tooth_mm,"
    "radial_depth_mm,direction,orbit_rpm,cut_length_mm\n"
)


def table(folder, *rows):
    (folder / "runs.csv").write_text(HEADER + "\n".join(rows) + "\n")
    read, findings = read_table(folder, "runs")
    assert findings == []
    return read


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ("r1,,,2,slot,,,,,,", "column order: 2 is also in row 2"),
        ("r0,,,,slot,,,,,,", 'column run: "r0" is also in row 2'),
        (
            "r1,,,,side,,,12,up,,",
            "column radial_depth_mm: found 12, expected no more than tool.diameter_mm, 10",
        ),
        (
            "r1,,,,slot,,,5,slot,,",
            "column radial_depth_mm: found 5, expected tool.diameter_mm, 10, for a slot",
        ),
        ("r1,,,,slot,,,,up,,", 'column direction: found "up", expected slot'),
        ("r1,,,,side,,,5,slot,,", 'column direction: found "slot", expected up or down'),
        ("r1,,,,helical,,,,,,", "column orbit_rpm: is blank or zero"),
        ("r1,,,,helical,,,,,0,", "column orbit_rpm: is blank or zero"),
    ],
)
def test_a_row_against_the_others_and_the_tool(tmp_path, row, message):
    read = table(tmp_path, "r0,,,2,slot,,,,,,", row.replace("r1,,,,", "r1,,,7,"))
    found = "\n".join(map(str, run_findings(read, MANIFEST)))
    assert message in found
    assert "row 3" in found


@pytest.mark.parametrize("hole", [None, 10, 20])
def test_a_helical_run_needs_a_hole_that_the_tool_can_make(tmp_path, hole):
    read = table(tmp_path, "r1,,,,helical,,,,,12,")
    found = [str(finding) for finding in run_findings(read, {**MANIFEST, "hole_diameter_mm": hole})]
    assert len(found) == 1
    assert "hole_diameter_mm" in found[0]
    assert list(run_findings(read, MANIFEST)) == []


def test_a_tool_of_unknown_diameter_excuses_the_radial_depth(tmp_path):
    assert list(run_findings(table(tmp_path, "r1,,,,side,,,99,up,,"), {})) == []


def test_blanks_are_filled_with_what_the_contract_says(tmp_path):
    read = table(
        tmp_path, "a,,,,slot,6000,0.05,,,,", "b,,,,side,6000,0.05,3,up,,", "c,,,,slot,6000,0.05,10,slot,,"
    )
    runs = filled(read.frame, MANIFEST)
    assert runs["order"].tolist() == [1, 2, 3]
    assert runs["direction"].tolist() == ["slot", "up", "slot"]
    assert runs["radial_depth_mm"].tolist() == [10, 3, 10]
    assert runs["feed_direction_deg"].tolist() == [0, 0, 0]
    assert runs["condition"][0] == runs["condition"][2] == "slot n6000 f0.05 ae10 slot"
    assert runs["condition"][1] != runs["condition"][0]
    assert runs["replicate"].tolist() == [1, 1, 2]


def test_conditions_and_replicates_that_are_named_stand(tmp_path):
    runs = filled(table(tmp_path, "a,x,3,,slot,,,,,,", "b,,,,slot,,,,,,").frame, MANIFEST)
    assert runs["condition"][0] == "x"
    assert runs["replicate"].tolist() == [3, 1]


def test_the_length_cut_before_is_that_of_the_lower_orders(tmp_path):
    rows = ("c,,,3,slot,,,,,,70", "a,,,1,slot,,,,,,50", "b,,,2,slot,,,,,,")
    runs = filled(table(tmp_path, *rows).frame, MANIFEST).set_index("run")
    assert runs["cut_before_m"].to_dict() == {"a": 0.0, "b": pytest.approx(0.05), "c": pytest.approx(0.05)}


@settings(max_examples=30, deadline=None)
@given(st.lists(st.integers(0, 500), min_size=1, max_size=12), st.randoms())
def test_the_length_cut_before_does_not_depend_on_the_order_of_rows(tmp_path_factory, lengths, shuffle):
    rows = [f"r{i},,,{i},slot,,,,,,{length}" for i, length in enumerate(lengths)]
    shuffle.shuffle(rows)
    runs = filled(table(tmp_path_factory.mktemp("t"), *rows).frame, MANIFEST).set_index("run")
    for i in range(len(lengths)):
        assert math.isclose(runs["cut_before_m"][f"r{i}"], sum(lengths[:i]) / 1000, abs_tol=1e-12)


def test_a_row_without_role_file_or_judgement_was_not_recorded(tmp_path):
    (tmp_path / "runs.csv").write_text(
        "run,role,dynamometer,stable,pose\na,,,,p1\nb,identify,,,\nc,,d.csv,,\nd,,,no,\n"
    )
    runs = read_table(tmp_path, "runs")[0].frame
    assert recorded(runs).tolist() == [False, True, True, True]


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        (["a,x,,,slot,6000,,,,,", "b,x,,,slot,7000,,,,,"], 'condition "x" has runs of different settings'),
        (["a,x,,,slot,6000,,,,,", "b,y,,,slot,6000,,,,,"], "conditions x, y have the same settings"),
        (["a,x,,,slot,1,,,,,", "b,x,,,slot,1,,,,,", "c,y,,,slot,2,,,,,"], "were cut back to back"),
        (["a,x,,,slot,1,,,,,5", "b,y,,,slot,2,,,,,"], "column cut_length_mm: is blank in 1 of 2 rows"),
    ],
)
def test_what_the_design_of_the_session_hides_is_said(tmp_path, rows, message):
    read = table(tmp_path, *rows)
    found = list(design_findings(filled(read.frame, MANIFEST), read.file))
    assert message in "\n".join(map(str, found))
    assert all(finding.severity != "error" for finding in found)


def test_repeats_that_are_spread_over_the_session_are_not_complained_of(tmp_path):
    rows = [f"r{i},{name},,,slot,{speed},,,,," for i, (name, speed) in enumerate([("x", 1), ("y", 2)] * 2)]
    read = table(tmp_path, *rows)
    assert list(design_findings(filled(read.frame, MANIFEST), read.file)) == []


@pytest.mark.parametrize(
    ("tool", "depth", "wide", "reaches"),
    [
        ({"end": "ball"}, 0.4, 3.0, False),  # √(0.4 · 9.6) = 1.96 mm from the axis; the work begins at 2 mm
        ({"end": "ball"}, 0.4, 3.1, True),
        ({"end": "ball"}, 2.0, 0.8, False),  # √(2 · 8) = 4 mm; 4.2 mm
        ({"end": "ball"}, 5.0, 0.1, True),
        ({"corner_radius_mm": 2.0}, 0.1, 1.3, False),  # 3 + √(0.1 · 3.9) = 3.62; the work begins at 3.7 mm
        ({"corner_radius_mm": 2.0}, 0.1, 1.4, True),
        ({"corner_radius_mm": 2.0}, 2.0, 0.1, True),
        ({}, 0.4, 0.1, True),
    ],
)
def test_a_wall_that_a_rounded_end_does_not_reach_is_warned_of(tmp_path, tool, depth, wide, reaches):
    (tmp_path / "runs.csv").write_text(
        "run,operation,direction,axial_depth_mm,radial_depth_mm\n"
        f"r1,side,up,{depth},{wide}\nr2,slot,slot,{depth},10\n"
    )
    read, _ = read_table(tmp_path, "runs")
    found = list(run_findings(read, {"tool": {"diameter_mm": 10, **tool}}))
    assert [(one.severity, one.column, one.row) for one in found] == (
        [] if reaches else [("warning", "radial_depth_mm", 2)]
    )
    assert reaches or "the tool cuts nothing here" in found[0].message
