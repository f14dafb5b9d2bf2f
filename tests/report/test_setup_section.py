"""What a batch was measured with and at, as its manifest and its table of runs say."""

from dataclasses import replace

import pandas as pd
import synthetic_results as synthetic

from metro.report.sections.setup import setup


def tables(manifest, **columns):
    results = synthetic.results()
    runs = pd.DataFrame(columns, index=["r1", "r2", "r3"])
    section = setup(replace(results, batch=replace(results.batch, manifest=manifest, runs=runs)))
    return section and [item for item in section.items if hasattr(item, "rows")]


def test_keys_of_the_manifest_become_names_and_units():
    instruments = {"dynamometer": {"rate_hz": 4096, "range_n": 5000, "axes": {"x": "-y"}}, "scanner": None}
    manifest = {"tool": {"diameter_mm": 16, "pitch_deg": [120, 240]}, "instruments": instruments}
    (table,) = tables(manifest, role=["identify"] * 3)
    assert table.rows == [
        ["tool", "diameter 16 mm; pitch 120, 240°"],
        ["dynamometer", "rate 4096 Hz; range 5000 N; axes x: -y"],
    ]


def test_runs_of_one_condition_stand_together_and_what_all_share_is_told_once():
    roles = ["identify", "validate", "identify"]
    (table,) = tables({}, role=roles, spindle_rpm=4000.0, axial_depth_mm=[0.5, 0.5, 2.0])
    assert table.header == ["axial depth (mm)", "identification", "held out"]
    assert table.rows == [["0.5", "r1", "r2"], ["2", "r3", "–"]]
    assert "All runs: spindle speed (rpm) 4000." in table.caption


def test_a_setting_that_a_run_does_not_have_is_a_dash():
    (table,) = tables({}, role=["identify"] * 3, operation="slot", orbit_rpm=[20.0, float("nan"), 30.0])
    assert [row[0] for row in table.rows] == ["20", "–", "30"]


def test_it_is_said_how_runs_were_held_out():
    section = setup(synthetic.results())
    assert section is not None
    told = " ".join(getattr(item, "text", "") for item in section.items)
    assert "before any signal was read: from the column role of runs.csv. Seed 1." in told
    assert "To identify on: 6 runs; held out: 4 runs." in told


def test_a_batch_that_declares_nothing_has_no_such_section():
    assert tables({}, role=["identify"] * 3) is None


def test_the_arm_of_a_batch_is_tabulated_joint_by_joint():
    """Table 1 of [K], with the tip of its section 3.2."""
    dh = [[0, 90, 500, 250], [90, 0, 0, 610], [-180, -90, 0, 70], [0, 90, 710, 0], [0, -90, 0, 0]]
    batch = replace(synthetic.results().batch, cell={"cell": "kr160", "arm": {"dh": [*dh, [0, 0, 215, 0]]}})
    batch = replace(batch, manifest={"tool_in_flange_mm": [212.5, 0.0, 279.91]})
    section = setup(replace(synthetic.results(), batch=batch))
    [table] = [item for item in section.items if "Denavit" in getattr(item, "caption", "")]
    assert [row[3] for row in table.rows] == ["−180", "−90", "0", "70"]
    assert [row[-1] for row in table.rows] == ["0", "0", "215", "0"]
    assert "arm kr160" in table.caption
    assert "212.5, 0, 279.91 mm" in table.caption
