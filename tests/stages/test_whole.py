"""The check and ingest are one code: what one accepts or refuses, so does the other, with the same words."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from metro.batch.findings import BatchError, Finding
from metro.cli import app
from metro.stages import data_checks
from metro.stages.ingest import ingest
from metro.stages.whole import check_whole

MANIFEST = """\
format: 1
batch: slots
source: measured
cell: bench
tool: {diameter_mm: 10, teeth: 4, helix_deg: 30}
instruments:
  dynamometer: {rate_hz: 1000}
"""
COLUMNS = "run,operation,spindle_rpm,feed_per_tooth_mm,axial_depth_mm,radial_depth_mm,direction,dynamometer"


def record(folder, run, change=lambda table: table):
    rng = np.random.default_rng(run)
    time = np.arange(400) / 1000.0
    wave = {name: 50 * np.sin(80 * time + i) + rng.normal(0, 1, 400) for i, name in enumerate("xyz")}
    table = pd.DataFrame({"t_s": time} | {f"f{axis}_n": values for axis, values in wave.items()})
    change(table).to_csv(folder / f"r{run}.csv", index=False)


@pytest.fixture
def slots(tmp_path):
    folder = tmp_path / "slots"
    folder.mkdir()
    (folder / "batch.yaml").write_text(MANIFEST)
    rows = [f"r{run},slot,6000,0.0{run},1,10,slot,r{run}.csv" for run in (1, 2, 3)]
    (folder / "runs.csv").write_text("\n".join([COLUMNS, *rows]) + "\n")
    for run in (1, 2, 3):
        record(folder, run)
    return folder


def both(folder, tmp_path):
    """Return what the check says, and what ingest refuses with."""
    report = check_whole(folder, folder)
    try:
        ingest(folder, folder, tmp_path / "out", {}, "code")
    except BatchError as error:
        return report, [str(problem) for problem in error.problems]
    return report, []


def errors_of(report):
    return [str(problem) for problem in report.problems if problem.severity == "error"]


def at_row(row, **cells):
    def change(table):
        table.loc[row, list(cells)] = list(cells.values())
        return table

    return change


def test_a_sound_batch_passes_both_and_nothing_is_written_by_the_check(slots, tmp_path):
    before = sorted(path.name for path in tmp_path.rglob("*"))
    assert check_whole(slots, slots).ok
    assert sorted(path.name for path in tmp_path.rglob("*")) == before
    assert both(slots, tmp_path)[1] == []


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (at_row(300, t_s=0.1), "r2.csv: line 302"),
        (at_row(300, fx_n=np.inf), "r2.csv: line 302"),
        (lambda table: table.assign(t_s=table["t_s"] * 1000), "r2.csv"),
    ],
    ids=["time goes back far down", "no finite force far down", "milliseconds"],
)
def test_what_is_wrong_far_down_in_a_file_is_found_by_both_in_the_same_words(slots, change, words, tmp_path):
    record(slots, 2, change)
    report, refused = both(slots, tmp_path)
    assert words in refused[0]
    assert errors_of(report) == refused
    assert check_whole(slots, slots, quick=True).ok


def test_a_copied_recording_is_found_by_both(slots, tmp_path):
    (slots / "r3.csv").write_bytes((slots / "r1.csv").read_bytes())
    report, refused = both(slots, tmp_path)
    assert "has the same content as r1.csv" in refused[0]
    assert errors_of(report) == refused


def test_what_can_be_computed_is_said_of_what_is_left_when_recordings_are_left_out(slots, tmp_path):
    record(slots, 2, lambda table: table.assign(fz_n=1.0))
    report, refused = both(slots, tmp_path)
    assert refused == []
    (force,) = [can for can in report.capabilities if can.name == "force"]
    assert force.source.startswith("2 runs with a dynamometer file")
    (warning,) = [str(problem) for problem in report.problems if "left out" in problem.message]
    assert "r2.csv" in warning


def test_where_every_recording_is_left_out_nothing_can_be_computed_and_both_say_so(slots, tmp_path):
    for run in (1, 2, 3):
        record(slots, run, lambda table: table.assign(fz_n=1.0))
    report, refused = both(slots, tmp_path)
    assert "nothing can be computed from this batch" in refused[0]
    assert errors_of(report) == refused


def test_a_check_of_the_data_as_a_whole_is_asked_by_both_with_the_tables_as_read(
    slots, tmp_path, monkeypatch
):
    def short(batch, read):
        for run in batch.runs.index:
            if len(read("force", run)) < 400:
                yield Finding("error", f"{run}.csv", "is short")

    monkeypatch.setattr(data_checks, "DATA_CHECKS", (short,))
    assert both(slots, tmp_path)[1] == []
    record(slots, 1, lambda table: table.head(390))
    report, refused = both(slots, tmp_path)
    assert errors_of(report) == refused == ["r1.csv: is short"]


def test_the_command_reads_the_files_wholly_unless_it_is_to_be_quick(slots):
    record(slots, 2, at_row(300, t_s=0.1))
    call = ["check", str(slots), "--cells", str(slots), "--json"]
    assert not json.loads(CliRunner().invoke(app, call).stdout)[0]["ok"]
    assert json.loads(CliRunner().invoke(app, [*call, "--quick"]).stdout)[0]["ok"]
    assert Path(slots / "runs.csv").exists()


def test_a_batch_whose_recordings_are_all_unfit_says_so_and_not_that_it_holds_none(slots, tmp_path):
    for run in (1, 2, 3):
        record(slots, run, lambda table: table.assign(fy_n=table["fx_n"]))
    report, refused = both(slots, tmp_path)
    (said,) = errors_of(report)
    assert refused == [said]
    assert (
        "not fit for use: r1.csv: Fx and Fy are one signal: is one cable in two inputs? (and 2 others)"
        in said
    )
    assert "holds no measurement" not in said
