"""``metro import``: files of other programs become a batch that passes its check; the unknown is asked."""

import hashlib
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import scipy.io
import yaml
from typer.testing import CliRunner

from metro.batch.check import check, load
from metro.batch.file_names import settings_in
from metro.batch.sources import source
from metro.cli import app
from metro.formats.registry import read, read_frfs
from metro.formats.uff import FRF, Function
from metro.formats.uff_writer import universal_file
from metro.importing.look import copies, look, sparkline
from metro.importing.propose import propose

FIELD = Path(os.environ.get("METRO_REAL_DATA", Path(__file__).parents[2] / "../shared/real")).parent / "field"
field = pytest.mark.skipif(not FIELD.is_dir(), reason="the field files are not there")
RANDOM = np.random.default_rng(1)
CUTS = {
    "unit.force": "kN",
    "rate_hz": "2000",
    "tool.diameter_mm": "16",
    "tool.teeth": "2",
    "tool.helix_deg": "25",
    "dynamometer.reads": "work",
    "dynamometer.axes": "none",
    "operation": "slot",
    "direction": "slot",
    "spindle_rpm": "800",
    "feed_per_tooth_mm": "0.1",
    "axial_depth_mm": "{record}",
    "radial_depth_mm": "16",
}


def called(folder, *files, **answers):
    given = [f"--set={key}={value}" for key, value in answers.items()]
    return CliRunner().invoke(app, ["import", *map(str, files), f"--out={folder}", *given])


def records(tmp_path):
    forces = {f"F{axis}_cut_{k}": RANDOM.normal(size=4000) / 10 for axis in "xyz" for k in (1, 2, 3)}
    scipy.io.savemat(tmp_path / "cuts.mat", forces)
    return tmp_path / "cuts.mat", forces


def test_several_records_in_one_file_become_runs_and_give_the_numbers_of_the_file(tmp_path):
    path, forces = records(tmp_path)
    result = called(tmp_path / "cuts", path, **CUTS)
    assert result.exit_code == 0, result.output
    assert "guessed from the name Fx_cut_1" in (tmp_path / "cuts/batch.yaml").read_text()
    batch = load(tmp_path / "cuts").batch
    assert batch.runs["axial_depth_mm"].tolist() == [1, 2, 3]
    one = source(tmp_path / "cuts", batch.runs["dynamometer"].iloc[1], batch.manifest["files"])
    table = read(one, "force")
    np.testing.assert_array_equal(table["fy_n"], forces["Fy_cut_2"] * 1e3)
    np.testing.assert_array_equal(table["t_s"], np.arange(4000) / 2000)


def test_what_nobody_answers_is_listed_and_nothing_is_written(tmp_path):
    path, _ = records(tmp_path)
    result = called(tmp_path / "cuts", path, **{key: CUTS[key] for key in CUTS if key != "unit.force"})
    assert result.exit_code == 2
    assert "1 question is open" in result.output
    assert "--set unit.force=…" in result.output
    assert not (tmp_path / "cuts").exists()


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"unit.forces": "N"}, 'did you mean "unit.force"'),
        ({"operation": "slotting"}, "slot or side"),
        ({"axial_depth_mm": "1,2"}, "found 2 values, expected one, or 3"),
        ({"unit.force": "V"}, "--set sensitivity.force=…"),
    ],
)
def test_an_answer_that_does_not_fit_is_refused(tmp_path, change, says):
    path, _ = records(tmp_path)
    result = called(tmp_path / "cuts", path, **(CUTS | change))
    assert result.exit_code == 2
    assert says in result.output
    assert not (tmp_path / "cuts").exists()


def test_files_of_a_hammer_and_a_sensor_become_one_record(tmp_path):
    hit = np.concatenate([np.hanning(16) * 300, np.zeros(2032)])
    for point in (3, 8):
        ring = np.cumsum(RANDOM.normal(size=2048))
        for name, values in ((f"impact_p{point}.txt", hit + 1e-3 * ring), (f"accel_p{point}.txt", ring)):
            text = "".join(f"{k / 4000:.3g}\t{value!r}\n" for k, value in enumerate(values.tolist()))
            (tmp_path / name).write_text(text)
    answers = {"unit.force": "N", "unit.response": "V", "sensitivity.response": "10 mV/g", "rate_hz": "4000"}
    points = {"reference": "{number}z", "response": "1z"}
    result = called(tmp_path / "plate", *sorted(tmp_path.glob("*.txt")), **answers, **points)
    assert result.exit_code == 0, result.output
    impacts = load(tmp_path / "plate").impacts
    assert impacts["reference"].tolist() == ["3z", "8z"]
    assert set(impacts["response_unit"]) == {"g"}
    files = yaml.safe_load((tmp_path / "plate/batch.yaml").read_text())["files"]
    found = read(source(tmp_path / "plate", impacts["file"].iloc[1], files), "record")
    np.testing.assert_allclose(found["response"], ring / 0.01, rtol=1e-12)


def test_two_files_with_the_same_numbers_in_other_digits_are_refused(tmp_path):
    values = RANDOM.normal(size=40).round(3)
    for name, form in (("a.csv", "{:.3f}"), ("b.csv", "{:.5e}")):
        rows = "".join(f"{k},{form.format(value)}\n" for k, value in enumerate(values))
        (tmp_path / name).write_text(rows)
    result = called(tmp_path / "c", tmp_path / "a.csv", tmp_path / "b.csv")
    assert result.exit_code == 1
    assert "hold the same numbers, bit for bit" in result.output


def test_files_that_are_none_of_what_can_be_used_are_named_with_what_they_have(tmp_path):
    pd.DataFrame(RANDOM.normal(size=(20, 2)), columns=["shoulder", "elbow"]).to_csv(
        tmp_path / "a.csv", index=False
    )
    result = called(tmp_path / "c", tmp_path / "a.csv")
    assert result.exit_code == 1
    assert "not used: a.csv: 2 columns, named shoulder, elbow" in result.output


def test_a_name_says_what_it_says_and_no_more():
    assert settings_in("6-n6000f300ap3ae25.csv") == {
        "spindle_rpm": "6000",
        "axial_depth_mm": "3",
        "radial_depth_mm": "25",
    }
    assert settings_in("wrapping2.csv") == {}


def test_a_sparkline_rises_with_its_values():
    assert sparkline(np.arange(8.0)) == "▁▂▃▄▅▆▇█"


@field
@pytest.mark.parametrize(
    ("name", "answers"),
    [
        ("force-ball-d16", {**CUTS, "unit.force": "N", "rate_hz": "10000"}),
        ("scan-numbered-points", {"unit.length": "mm", "work.size_mm": "none"}),
        ("modal-poles-unv", {"citation": "GVT"}),
        ("profile-square", {}),
        ("scan-gocator", {"work.size_mm": "none"}),
    ],
)
def test_files_as_recorded_become_batches_that_pass_their_check(tmp_path, name, answers):
    result = called(tmp_path / name, *(FIELD / name).iterdir(), **answers)
    assert result.exit_code == 0, result.output
    assert check(tmp_path / name).ok


@field
def test_the_duplicated_channel_of_the_plate_is_found():
    files = [look(path) for path in sorted((FIELD / "modal-duplicated-channel").iterdir())]
    ((one, _, other, _),) = copies(files)
    assert (one.path.name, other.path.name) == ("accel-pt18.txt", "accel-pt8.txt")


def test_a_person_who_answers_wrongly_is_asked_again_and_the_batch_passes_its_check(tmp_path):
    path, _ = records(tmp_path)
    said = {
        **CUTS,
        "unit.force": ["mm", "kN"],
        "tool.diameter_mm": ["12,5", "16"],
        "operation": ["mill", "slot"],
    }
    said |= {"dynamometer.axes": ["up", "none"], "axial_depth_mm": ["deep", "{record}"]}
    lines = ["", *(line for one in said.values() for line in ([one] if isinstance(one, str) else one))]
    screen, terminal = os.openpty()
    call = [Path(sys.executable).parent / "metro", "import", path, "--out", tmp_path / "cuts"]
    with subprocess.Popen(call, stdin=terminal, stdout=subprocess.PIPE, text=True) as asking:
        os.close(terminal)
        os.write(screen, ("\n".join(lines) + "\n").encode())
        printed = asking.communicate(timeout=60)[0]
    assert asking.returncode == 0, printed
    for wrong in ("mm", "12,5", "mill", "up", "deep"):
        assert f'found "{wrong}", expected' in printed
    assert check(tmp_path / "cuts").ok


def test_a_clock_without_a_name_is_the_time_and_no_rate_is_asked(tmp_path):
    """A rate that was asked beside the file's own times gave modes at a tenth of their frequency."""
    time = np.arange(4000) / 4000
    for name in ("impact_1.txt", "accel_1.txt"):
        np.savetxt(tmp_path / name, np.column_stack([time, RANDOM.normal(size=4000)]), fmt="%.6f")
    files = [tmp_path / "impact_1.txt", tmp_path / "accel_1.txt"]
    asked = called(tmp_path / "hits", *files)
    assert "unit.time" in asked.output
    assert "rate_hz" not in asked.output
    places = {"reference": "{number}x", "response": "7x"}
    units = {"unit.force": "N", "unit.response": "g", "unit.time": "ms"}
    called(tmp_path / "hits", *files, **units, **places)
    mapping = yaml.safe_load((tmp_path / "hits/batch.yaml").read_text())["files"]["impact_*.txt"]
    assert mapping["columns"]["t_s"] == {"from": 1, "unit": "ms"}
    assert "rate_hz" not in mapping


def test_the_csv_of_a_data_logger_has_its_time_and_units_behind_its_names(tmp_path):
    time, forces = np.arange(400) / 5000, RANDOM.normal(size=(400, 3)).round(4)
    path = tmp_path / "slot1.csv"
    rows = "\n".join(f"{t:.4f},{x},{y},{z}" for t, (x, y, z) in zip(time, forces, strict=True))
    head = '"Test title","切削"\n"Number of channels","3"\n"Sampling frequency (Hz)","5000"\n'
    path.write_text(f"{head}Time(sec),Fx(kN),Fy(kN),Fz(kN)\n{rows}\n", encoding="cp932")
    answers = CUTS | {"axial_depth_mm": "1"}
    given = {key: answers[key] for key in answers if key not in ("rate_hz", "unit.force")}
    result = called(tmp_path / "slot", path, batch="slot", **given)
    assert result.exit_code == 0, result.output
    batch = load(tmp_path / "slot").batch
    table = read(
        source(tmp_path / "slot", batch.runs["dynamometer"].iloc[0], batch.manifest["files"]), "force"
    )
    np.testing.assert_allclose(table["t_s"], time)
    np.testing.assert_allclose(table["fz_n"], forces[:, 2] * 1e3)


def test_a_place_that_is_left_out_or_is_none_is_refused_before_anything_is_written(tmp_path):
    time = np.arange(400) / 4000
    for name in ("impact_1.txt", "accel_1.txt"):
        np.savetxt(tmp_path / name, np.column_stack([time, RANDOM.normal(size=400)]))
    for place in ("none", "unknown", "7"):
        answers = {
            "unit.force": "N",
            "unit.response": "g",
            "unit.time": "s",
            "reference": "1x",
            "response": place,
        }
        result = called(tmp_path / "hits", tmp_path / "impact_1.txt", tmp_path / "accel_1.txt", **answers)
        assert result.exit_code == 2, result.output
        assert f'response: found "{place}", expected a' in result.output
    assert not (tmp_path / "hits").exists()


def two_columns(path, seed):
    values = np.random.default_rng(seed).normal(size=64)
    path.write_text("".join(f"{k / 1000:.4f} {value:.12f}\n" for k, value in enumerate(values)))


def test_of_a_record_with_the_columns_of_the_contract_the_unit_of_the_response_is_asked(tmp_path):
    """It was not, and the batch that was written could not be run."""
    hit = np.exp(-(((np.arange(2000) - 100) / 8.0) ** 2))
    ring = np.exp(-np.arange(2000) / 300.0) * np.sin(np.arange(2000) / 5.0)
    table = pd.DataFrame({"t_s": np.arange(2000) / 4000.0, "force_n": 200.0 * hit, "response": ring})
    table.to_csv(tmp_path / "hit.csv", index=False)
    places = {"reference": "1x", "response": "1x"}
    without = called(tmp_path / "without", tmp_path / "hit.csv", **places)
    assert without.exit_code != 0
    assert "unit.response" in without.output
    assert not (tmp_path / "without").exists()
    done = called(tmp_path / "with", tmp_path / "hit.csv", **places, **{"unit.response": "g"})
    assert done.exit_code == 0, done.output
    assert pd.read_csv(tmp_path / "with/impacts.csv")["response_unit"].tolist() == ["g"]
    assert check(tmp_path / "with").ok


def test_a_hammer_record_without_its_sensor_is_named_with_both_counts(tmp_path):
    names = ["impact_p3.txt", "impact_p8.txt", "impact_p9.txt", "accel_p3.txt"]
    for seed, name in enumerate(names):
        two_columns(tmp_path / name, seed)
    proposals, unknown = propose([look(tmp_path / name) for name in names])
    assert [row for row, _ in proposals[0].rows] == ["impact_p3.txt#3"]
    (line,) = unknown
    assert line.startswith("impact_p8.txt, impact_p9.txt: found 3 files of a hammer (impact_p3.txt, ")
    assert "and 1 file of a sensor (accel_p3.txt)" in line
    assert "Rename the files" in line


def test_hammer_and_sensor_with_other_numbers_are_no_pair(tmp_path):
    for seed, name in enumerate(["impact_p3.txt", "accel_p4.txt"]):
        two_columns(tmp_path / name, seed)
    proposals, (line,) = propose([look(tmp_path / "impact_p3.txt"), look(tmp_path / "accel_p4.txt")])
    assert proposals == []
    assert line.startswith("impact_p3.txt, accel_p4.txt: found 1 file of a hammer")


@field
def test_the_origin_of_a_universal_file_is_kept_and_cited(tmp_path):
    (file,) = (FIELD / "modal-poles-unv").iterdir()
    result = called(tmp_path / "modes", file, citation="GVT")
    assert result.exit_code == 0, result.output
    cited = yaml.safe_load((tmp_path / "modes/batch.yaml").read_text())["citation"]
    assert cited.startswith(f"GVT; read from {file.name} (SHA-256 ")
    assert hashlib.sha256(file.read_bytes()).hexdigest()[:12] in cited
    assert "written by LMS Test.Lab Rev project-15A; on 25-Oct-19 14:45:06" in cited
    assert "11 × 55 (data at nodes, as mode shapes)" in cited
    assert (tmp_path / "modes" / file.name).read_bytes() == file.read_bytes()


def test_a_universal_file_of_many_pairs_states_its_points_and_nothing_is_asked(tmp_path):
    frequency = np.arange(1.0, 101.0)
    values = 1e-6 / (1 - (frequency / 40.0) ** 2 + 0.04j * frequency / 40.0)
    pairs = [Function(FRF, "1x", f"{point}x", "m", frequency, values / point) for point in (1, 2, 3)]
    (tmp_path / "test.unv").write_bytes(universal_file(pairs))
    result = called(tmp_path / "modal", tmp_path / "test.unv")
    assert result.exit_code == 0, result.output
    assert "read from test.unv (SHA-256 " in (tmp_path / "modal/batch.yaml").read_text()
    impacts = load(tmp_path / "modal").impacts
    assert impacts[["reference", "response"]].to_numpy().tolist() == [["", ""]]
    assert [frf.response for frf in read_frfs(tmp_path / "modal" / impacts["file"].iloc[0])] == [
        "1x",
        "2x",
        "3x",
    ]
