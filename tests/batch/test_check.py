import io
import os
import shutil
from pathlib import Path

import pytest
from conftest import edit
from rich.console import Console

from metro.batch.check import check, load
from metro.batch.findings import BatchError
from metro.batch.processed import COLUMNS, read_batch, write_batch
from metro.batch.show import render
from metro.observables.catalogue import capabilities
from metro.workflow import Plan

ROOT = Path(__file__).parents[2]
REAL = Path(os.environ.get("METRO_REAL_DATA", ROOT / "../shared/real")) / "batches"
BUNDLED = sorted(path.parent for path in ROOT.glob("data/raw/*/batch.yaml"))


def printed(report):
    console = Console(width=200, record=True, file=io.StringIO())
    console.print(render(report))
    return console.export_text()


@pytest.mark.parametrize("name", ["slotting-d25", "tool-impact"])
def test_a_real_batch_is_clean(name):
    if not (REAL / name).is_dir():
        pytest.skip(f"the real batches are not at {REAL}")
    assert check(REAL / name, ROOT / "config/cells").problems == ()


@pytest.mark.parametrize("folder", BUNDLED, ids=[folder.name for folder in BUNDLED])
def test_a_bundled_batch_follows_the_contract(folder):
    problems = check(folder, ROOT / "config/cells").problems
    assert [str(problem) for problem in problems if problem.severity != "note"] == []


def test_one_load_test_of_the_wrong_sign_is_left_out_and_the_batch_can_be_run(tmp_path):
    folder = shutil.copytree(ROOT / "data/raw/irb6640-setup", tmp_path / "irb6640-setup")
    sound = len(load(folder, ROOT / "config/cells").loads)
    edit(folder / "loads.csv", "A,P1,25,10,0,150,0,0,0.084", "A,P1,25,10,0,150,0,0,-0.084")
    report = check(folder, ROOT / "config/cells")
    assert report.ok
    said = [str(problem) for problem in report.problems if problem.severity == "warning"]
    assert len(said) == 1
    assert said[0].startswith("loads.csv: row 2 (A): column dx_mm: the tip moves against its load")
    assert len(load(folder, ROOT / "config/cells").loads) == sound - 1


def test_a_batch_is_loaded_with_defaults_and_roles(batch):
    loaded = load(batch, batch)
    assert loaded.batch.name == "trial"
    assert loaded.batch.cell == {"cell": "bench"}
    assert loaded.batch.instrument("dynamometer")["axes"] == {"x": "x", "y": "y", "z": "z"}
    assert loaded.batch.plan["validate"] == list(
        loaded.batch.runs.index[loaded.batch.runs["role"] == "validate"]
    )
    assert set(loaded.batch.runs["role"]) == {"identify", "validate"}
    assert loaded.batch.runs["cut_before_m"].tolist() == pytest.approx([0, 0.05, 0.1, 0.15])


def test_tables_that_are_not_there_have_the_canonical_columns(batch):
    loaded = load(batch, batch)
    for name in ("loads", "mass", "published", "stations"):
        assert tuple(getattr(loaded, name).columns) == COLUMNS[name]
        assert getattr(loaded, name).empty


def test_a_loaded_batch_can_be_written_and_read_again(batch, tmp_path):
    loaded = load(batch, batch).batch
    write_batch(tmp_path / "out", loaded, {})
    again = read_batch(tmp_path / "out")
    assert (again.manifest, again.cell, again.plan) == (loaded.manifest, loaded.cell, loaded.plan)
    assert again.runs.equals(loaded.runs)


def test_a_batch_with_errors_is_not_loaded_and_all_of_them_are_named(batch):
    edit(batch / "batch.yaml", "teeth: 4", "teeth: four")
    edit(batch / "runs.csv", "r2,slot,6000", "r2,slot,fast")
    edit(batch / "runs.csv", "dyno/r3.csv", "dyno/r9.csv")
    (batch / "mass.csv").write_text("pose,mxx,mxy,mxz,myy,myz,mzz\np,1,2,0,1,0,1\n")
    with pytest.raises(BatchError) as caught:
        load(batch, batch)
    places = [(problem.file, problem.row, problem.column) for problem in caught.value.problems]
    assert places == [
        ("batch.yaml", None, "tool.teeth"),
        ("runs.csv", 3, "spindle_rpm"),
        ("mass.csv", 2, "mxx"),
        ("runs.csv", 4, "dynamometer"),
    ]


def test_a_fault_of_the_tool_does_not_bring_forth_others(batch):
    edit(batch / "batch.yaml", "diameter_mm: 10", "diameter_mm: small")
    assert [problem.column for problem in check(batch, batch).problems if problem.severity == "error"] == [
        "tool.diameter_mm"
    ]


@pytest.mark.parametrize(
    ("old", "new", "column"),
    [("hole_diameter_mm: 16", "hole_diameter_mm: 16,5", "hole_diameter_mm"), ("cell: bench", "cell: [", "")],
)
def test_a_manifest_that_cannot_be_read_does_not_bring_forth_others(batch, old, new, column):
    orbit = (batch / "runs.csv").read_text().replace(",slot,6000", ",helical,6000").replace("\nr", "\n90,r")
    (batch / "runs.csv").write_text(f"orbit_rpm,{orbit}")
    edit(batch / "batch.yaml", old, new)
    found = [problem for problem in check(batch, batch).problems if problem.severity != "note"]
    assert [(problem.file, problem.column) for problem in found] == [("batch.yaml", column)]


def test_a_helical_run_needs_the_hole_that_nobody_states(batch):
    edit(batch / "batch.yaml", "hole_diameter_mm: 16\n", "")
    edit(batch / "runs.csv", "r2,slot,6000", "r2,helical,6000")
    assert "helical needs hole_diameter_mm" in printed(check(batch, batch))


def test_a_dynamometer_that_is_not_declared_is_assumed_and_said_to_be(batch):
    edit(batch / "batch.yaml", "instruments:\n  dynamometer: {rate_hz: 1000}\n", "")
    assert any(problem.column == "instruments.dynamometer" for problem in check(batch, batch).problems)
    assert load(batch, batch).batch.instrument("dynamometer")["reads"] == "work"


def test_a_check_warns_of_files_whose_names_state_another_feed(batch):
    for i, feed in enumerate((480, 960, 1440, 1920), 1):  # mm/min of four teeth at 6000 rpm
        named = f"dyno/n6000f{feed}ap1ae10.csv"
        (batch / f"dyno/r{i}.csv").rename(batch / named)
        edit(batch / "runs.csv", f"dyno/r{i}.csv", named)
    assert not [one for one in check(batch, batch).problems if one.column == "feed_per_tooth_mm"]
    edit(batch / "runs.csv", "r1,slot,6000,0.02", "r1,slot,6000,0.04")
    (found,) = [one for one in check(batch, batch).problems if one.column == "feed_per_tooth_mm"]
    assert (found.severity, found.row) == ("warning", 2)
    assert load(batch, batch).batch.runs.loc["r1", "feed_per_tooth_mm"] == 0.04


def test_a_batch_without_runs_is_read_but_nothing_can_be_computed(batch):
    (batch / "runs.csv").unlink()
    assert load(batch, batch).batch.runs.empty
    problems = check(batch, batch, able=capabilities).problems
    (problem,) = [each for each in problems if each.severity == "error"]
    assert "nothing can be computed from this batch: it holds no measurement" in problem.message


def test_what_is_measured_and_cannot_be_used_is_named_with_what_it_lacks(batch):
    edit(batch / "batch.yaml", ", helix_deg: 30", "")
    (problem,) = [each for each in check(batch, batch, able=capabilities).problems if each.severity != "note"]
    assert "nothing can be computed from this batch: force lacks tool.helix_deg" in problem.message
    assert "flatness" not in problem.message


def test_the_stations_of_the_cell_are_read_from_beside_it(batch, tmp_path):
    cells = tmp_path / "cells"
    cells.mkdir()
    (cells / "bench.yaml").write_text("cell: bench\nstations: table.csv\n")
    (finding,) = [problem for problem in check(batch, cells).problems if problem.severity == "error"]
    assert (
        str(finding) == 'bench.yaml: stations: "table.csv" is not there, expected a table beside bench.yaml'
    )
    (cells / "table.csv").write_text("position,x_mm,y_mm,z_mm,kx_n_um,ky_n_um,kz_n_um\n1,0,0,0,10,20,30\n")
    assert load(batch, cells).stations["ky_n_um"].tolist() == [20.0]


def test_a_folder_of_cells_that_is_not_there_stops_the_batch(batch):
    (finding,) = [problem for problem in check(batch, batch / "nope").problems if problem.severity == "error"]
    assert str(finding) == f"{batch / 'nope'}: is not a folder, expected that of the shared cells"


def test_check_and_the_workflow_take_the_same_cell_in_a_folder_without_cells(batch, monkeypatch):
    edit(batch / "batch.yaml", "cell: bench", "cell: kr160")
    monkeypatch.chdir(batch.parent)
    plan = Plan.read(ROOT, {"raw_roots": ["."]})
    assert plan.discovered["trial"].cell_file == ROOT / "config/cells/kr160.yaml"
    assert not [problem for problem in check(batch).problems if problem.column == "cell"]
    assert load(batch).batch.cell == load(batch, Path(plan.cells)).batch.cell
    assert "arm" in load(batch).batch.cell
    with pytest.raises(BatchError, match="nope: is not a folder, expected that of the shared cells"):
        Plan.read(ROOT, {"raw_roots": ["."], "cells": "nope"})


def test_an_frf_without_a_unit_is_a_receptance(batch):
    (batch / "frf.csv").write_text("frequency_hz,real,imag\n" + "".join(f"{i},1,0\n" for i in range(20)))
    (batch / "impacts.csv").write_text("test,position,reference,response,kind,file\nt,1,1x,1x,frf,frf.csv\n")
    assert load(batch, batch).impacts["response_unit"].tolist() == ["m"]


def test_the_share_that_is_held_out_is_that_of_the_configuration(batch):
    assert len(load(batch, batch, {"share": 0.5, "seed": 1}).batch.plan["validate"]) == 2


def test_a_folder_that_is_no_batch_is_an_error(tmp_path):
    assert not check(tmp_path / "none", tmp_path).ok


def test_what_is_printed_holds_every_problem_and_the_verdict(batch):
    edit(batch / "runs.csv", "r2,slot,6000", "r2,slot,fast")
    text = printed(check(batch, batch))
    assert (
        'runs.csv: row 3 (r2): column spindle_rpm: found "fast", expected a number, 1 to 500000 rpm' in text
    )
    assert "1 error, 1 note: the batch cannot be run until the errors are mended" in text
    assert "4 rows in runs.csv" in text


def test_brackets_in_a_message_are_printed_as_they_are(batch):
    edit(batch / "runs.csv", "r2,slot,6000", "r2,slot,[red]6")
    assert "[red]6" in printed(check(batch, batch))
