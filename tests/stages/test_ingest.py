"""Ingest of small batches made here, and of the real ones."""

import hashlib
import json
import os
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
import yaml

from metro.batch.findings import BatchError
from metro.batch.processed import COLUMNS, read_batch, read_table
from metro.batch.provenance import made_by
from metro.joint_columns import Axes
from metro.stages.ingest import ingest

REAL = Path(os.environ.get("METRO_REAL_DATA", Path(__file__).parents[2] / "../shared/real")) / "batches"
real = pytest.mark.skipif(not REAL.is_dir(), reason="the real data (METRO_REAL_DATA) are not there")

TIME = np.arange(100) * 1e-3
TO_WORK = [[0.0, -1.0, 0.0, 5.0], [1.0, 0.0, 0.0, 6.0], [0.0, 0.0, 1.0, 7.0], [0.0, 0.0, 0.0, 1.0]]
MANIFEST = {
    "format": 1,
    "batch": "small",
    "source": "simulated",
    "cell": "none",
    "work": {"size_mm": [100, 60, 30]},
    "instruments": {
        "dynamometer": {"rate_hz": 1000, "axes": {"x": "y", "y": "-x", "z": "z"}, "range_n": 5000},
        "robot_log": {"period_ms": 1},
        "scanner": {"to_work": TO_WORK},
        "hammer": {"rate_hz": 1000},
    },
}
CLOUD = np.random.default_rng(0).uniform([0.0, 0.0, 29.9], [60.0, 100.0, 30.0], size=(50, 3))


def batch(root):
    """Write a batch with one file of every kind."""
    folder = root / "small"
    folder.mkdir()
    wave = np.sin(0.3 * np.arange(100))
    force = pd.DataFrame({"t_s": 8.0 + TIME, "fx_n": 10 + wave, "fy_n": 20 + wave, "fz_n": 30 + wave})
    force.assign(spindle_deg=np.arange(100.0)).to_csv(folder / "force.csv", index=False)
    six = Axes((False,) * 6)
    columns = enumerate([*six.commanded, *six.positions, *six.torques], 2)
    robot = pd.DataFrame({name: 40.0 + wave * i for i, name in columns})
    robot.assign(t_s=8.05 + TIME).to_csv(folder / "cut.csv", index=False)
    robot.assign(t_s=3.0 + TIME).to_csv(folder / "idle.csv", index=False)
    pd.DataFrame({"point": [1, 2], "pass": [1, 1], "x_mm": [0, 9], "y_mm": 0, "z_mm": 0}).to_csv(
        folder / "path.csv"
    )
    pd.DataFrame({"x_mm": TIME, "z_mm": wave}).to_csv(folder / "profile.csv", index=False)
    np.savetxt(folder / "scan.xyz", CLOUD)
    pd.DataFrame({"t_s": TIME, "force_n": wave, "response": wave}).to_csv(folder / "hit.csv", index=False)
    frequency = np.arange(20.0)
    mobility = np.full(20, 2e-4 + 0.0j)
    np.savez(folder / "h.npz", freq_hz=frequency, frf=mobility)
    (folder / "runs.csv").write_text(
        "run,dynamometer,robot_log,idle_log,path,scan,profile\na,force.csv,cut.csv,idle.csv,path.csv,scan.xyz,profile.csv\n"
    )
    (folder / "impacts.csv").write_text(
        "test,position,reference,response,kind,file,response_unit\nt,1,1x,1x,record,hit.csv,g\nt,1,1x,1x,frf,h.npz,m/s\n"
    )
    describe(folder, MANIFEST)
    return folder


def describe(folder, manifest):
    (folder / "batch.yaml").write_text(yaml.safe_dump(manifest))


def ingested(folder, tmp_path):
    out = tmp_path / "processed" / folder.name
    ingest(folder, tmp_path, out, {}, "c0de")
    return {name: read_table(out / f"{name}.parquet") for name in COLUMNS}


@pytest.fixture
def folder(tmp_path):
    return batch(tmp_path)


def failure(folder, tmp_path):
    with pytest.raises(BatchError) as caught:
        ingested(folder, tmp_path)
    assert [path.name for path in tmp_path.iterdir() if path.name != "processed"] == ["small"]
    assert list((tmp_path / "processed").glob("**/*")) == []
    return [str(problem) for problem in caught.value.problems]


def test_every_table_is_there_with_its_columns(folder, tmp_path):
    tables = ingested(folder, tmp_path)
    assert {name: list(table) for name, table in tables.items()} == {k: list(v) for k, v in COLUMNS.items()}
    rows = {"force": 100, "robot": 200, "path": 2, "scan": 50, "profile": 100, "hit": 100, "frf": 19}
    assert {name: len(tables[name]) for name in rows} == rows
    assert [len(tables[name]) for name in ("loads", "mass", "stations", "published")] == [0] * 4
    assert (tables["qc"]["message"] != "").all()
    found = read_batch(tmp_path / "processed/small")
    assert found.runs.index.tolist() == ["a"]
    assert found.manifest["work"] == {"size_mm": [100, 60, 30]}


def test_forces_are_those_on_the_tool_in_the_work_frame_from_time_zero(folder, tmp_path):
    force = ingested(folder, tmp_path)["force"]
    # sensor x along work +y, y along work −x, and it reads the work: (10, 20, 30) is (20, −10, −30)
    wave = np.sin(0.3 * np.arange(100))
    np.testing.assert_allclose(
        force[["fx_n", "fy_n", "fz_n"]], np.outer(np.ones(100), [20, -10, -30]) + np.outer(wave, [1, -1, -1])
    )
    np.testing.assert_allclose(force["t_s"], TIME, atol=1e-12)
    np.testing.assert_array_equal(force["spindle_deg"], np.arange(100.0))


def test_the_log_of_the_cut_keeps_its_offset_to_the_dynamometer_and_the_idle_log_starts_at_zero(
    folder, tmp_path
):
    robot = ingested(folder, tmp_path)["robot"]
    assert robot[robot["log"] == "cut"]["t_s"].iloc[0] == pytest.approx(0.05)
    assert robot[robot["log"] == "idle"]["t_s"].iloc[0] == 0.0


def test_without_a_dynamometer_the_log_of_the_cut_starts_at_zero(folder, tmp_path):
    (folder / "runs.csv").write_text("run,operation,robot_log\na,side,cut.csv\n")
    assert ingested(folder, tmp_path)["robot"]["t_s"].iloc[0] == 0.0


def test_the_only_log_of_a_row_that_describes_no_cut_is_a_joint_log_too(folder, tmp_path):
    (folder / "runs.csv").write_text("run,robot_log\na,cut.csv\n")
    tables = ingested(folder, tmp_path)
    assert len(tables["robot"]) == len(tables["joint"])
    assert set(tables["joint"]["run"]) == {"a"}
    assert tables["joint"][["q6_deg", "q6_set_deg", "tau6_nm"]].notna().all(axis=None)
    assert tables["joint"][["q7_deg", "current1_a"]].isna().all(axis=None)


def test_clouds_are_moved_to_the_work_frame(folder, tmp_path):
    scan = ingested(folder, tmp_path)["scan"]
    np.testing.assert_allclose(scan["x_mm"], 5.0 - CLOUD[:, 1])
    np.testing.assert_allclose(scan["y_mm"], 6.0 + CLOUD[:, 0])
    np.testing.assert_allclose(scan["z_mm"], 7.0 + CLOUD[:, 2])


def test_hammer_records_are_in_si(folder, tmp_path):
    hit = ingested(folder, tmp_path)["hit"]
    np.testing.assert_allclose(hit["response_si"], 9.80665 * hit["force_n"])
    assert set(hit["response_unit"]) == {"m/s2"}
    assert set(hit["replicate"]) == {1}


def test_a_mobility_becomes_a_receptance_without_its_0_hz_line(folder, tmp_path):
    frf = ingested(folder, tmp_path)["frf"]
    assert frf["frequency_hz"].tolist() == list(range(1, 20))
    np.testing.assert_allclose(frf["imag_m_n"], -2e-4 / (2.0 * np.pi * np.arange(1, 20)))
    np.testing.assert_allclose(frf["real_m_n"], 0.0, atol=1e-15)


def test_a_conjugated_driving_point_is_reported(folder, tmp_path):
    np.savez(folder / "h.npz", freq_hz=np.arange(20.0), frf=np.full(20, -2e-4 + 0.0j))
    qc = ingested(folder, tmp_path)["qc"]
    row = qc[qc["check"] == "FRF convention"].iloc[0]
    assert not row["ok"]
    assert "conjugated" in row["message"]


def test_quality_is_judged_on_the_sensor_s_own_channels(folder, tmp_path):
    describe(folder, {**MANIFEST, "instruments": {"dynamometer": {"rotation_deg": 30, "rate_hz": 500}}})
    force = pd.read_csv(folder / "force.csv")
    force.assign(fx_n=np.minimum(force["fx_n"], 10.5)).to_csv(folder / "force.csv", index=False)
    qc = ingested(folder, tmp_path)["qc"]
    failed = qc[(qc["file"] == "force.csv") & ~qc["ok"]]
    assert failed["check"].tolist() == ["sampling rate", "clipping"]
    assert failed["message"].iloc[1].startswith("Fx stays at 10.5")
    assert failed["run"].tolist() == ["a", "a"]


def test_what_the_check_warns_of_stands_in_the_quality_table(folder, tmp_path):
    describe(folder, {**MANIFEST, "weather": "fine"})
    qc = ingested(folder, tmp_path)["qc"]
    assert "weather" in qc[(qc["check"] == "contract") & ~qc["ok"]]["message"].iloc[0]


def test_provenance_names_each_source_with_its_hash(folder, tmp_path):
    ingested(folder, tmp_path)
    metadata = pq.read_schema(tmp_path / "processed/small/force.parquet").metadata
    digest = hashlib.sha256((folder / "force.csv").read_bytes()).hexdigest()
    assert json.loads(metadata[b"metro.sources"]) == {"force.csv": digest}
    assert made_by(tmp_path / "processed/small", "ingest")["code"] == "c0de"
    everything = json.loads(
        pq.read_schema(tmp_path / "processed/small/runs.parquet").metadata[b"metro.sources"]
    )
    assert {"batch.yaml", "runs.csv", "impacts.csv", "scan.xyz", "h.npz"} <= set(everything)


def test_all_faulty_files_are_named_and_nothing_is_written(folder, tmp_path):
    # past the first rows, which the check reads
    (folder / "force.csv").write_text((folder / "force.csv").read_text() + "9,1,x,1,0\n")
    (folder / "profile.csv").write_text((folder / "profile.csv").read_text() + "9,\n")
    messages = failure(folder, tmp_path)
    assert len(messages) == 2
    assert messages[0].startswith("force.csv: line 102, column fy_n: found 'x'")
    assert messages[1].startswith("profile.csv: line 102, column z_mm: found nothing")


def test_a_cloud_in_metres_is_refused(folder, tmp_path):
    np.savetxt(folder / "scan.xyz", CLOUD / 1000.0)
    assert "in metres, expected millimetres" in failure(folder, tmp_path)[0]


def test_a_breach_of_the_contract_stops_the_stage(folder, tmp_path):
    (folder / "runs.csv").write_text("run,dynamometer\na,none.csv\n")
    with pytest.raises(BatchError, match=r"none\.csv"):
        ingested(folder, tmp_path)


def test_a_failure_leaves_the_tables_of_an_earlier_run_untouched(folder, tmp_path):
    ingested(folder, tmp_path)
    before = {file: file.stat().st_mtime_ns for file in (tmp_path / "processed/small").iterdir()}
    (folder / "force.csv").write_text((folder / "force.csv").read_text() + "9,1,x,1,0\n")
    with pytest.raises(BatchError):
        ingested(folder, tmp_path)
    assert {file: file.stat().st_mtime_ns for file in (tmp_path / "processed/small").iterdir()} == before
    assert [path.name for path in (tmp_path / "processed").iterdir()] == ["small"]


def test_the_hold_out_settings_reach_the_plan(folder, tmp_path):
    ingest(folder, tmp_path, tmp_path / "out", {"holdout": {"share": 0.5, "seed": 77}}, "")
    assert read_batch(tmp_path / "out").plan["seed"] == 77


@real
def test_real_slots_have_the_signs_of_the_mechanics_and_the_published_means(tmp_path):
    tables = ingested(REAL / "slotting-d25", tmp_path)
    means = tables["force"].groupby("run")[["fx_n", "fy_n", "fz_n"]].mean()
    assert (means["fx_n"] < 0).all()
    assert (means["fy_n"] > 0).all()
    assert (means["fz_n"] > 0).all()
    published = [
        [63.02, -39.80, 55.72],
        [107.14, -60.05, 70.91],
        [137.67, -71.60, 82.57],
        [171.27, -76.75, 85.23],
        [210.74, -78.49, 83.50],
    ]
    # dynamometer Fx, Fy, Fz along −y, −x, −z, reading the force on the work
    np.testing.assert_allclose(means[["fy_n", "fx_n", "fz_n"]], published, atol=0.006)
    assert tables["qc"]["ok"].all()


@real
def test_the_real_hammer_test_is_read_whole(tmp_path):
    tables = ingested(REAL / "tool-impact", tmp_path)
    assert len(tables["hit"]) == 51200
    assert tables["hit"]["force_n"].max() == pytest.approx(250.0, rel=2e-3)
    assert tables["frf"].groupby("reference").size().to_dict() == {f"{point}x": 3001 for point in range(1, 6)}
    peak = tables["frf"].query("reference == '1x' and 900 < frequency_hz < 1200")["imag_m_n"].min()
    assert peak == pytest.approx(-0.6433e-6, rel=0.02)  # read off by hand
    convention = tables["qc"].query("check == 'FRF convention'")
    assert convention["file"].tolist() == ["impacts/frf-p1.csv"]
    assert convention["ok"].all()
