"""Export of FRFs: what a batch holds comes back from the universal file, by our reader and by another."""

import json

import numpy as np
import pytest
import yaml
from typer.testing import CliRunner

from metro import cli
from metro.batch.processed import read_table
from metro.dynamics.frf import estimate_frf
from metro.dynamics.hits import Hit
from metro.formats.uff import FRF, Function, read_functions
from metro.formats.uff_writer import universal_file
from metro.stages.ingest import ingest

FREQUENCY = np.arange(1, 802) * 0.125
RATE = 2048.0


def receptance(frequency, share):
    ratio = frequency / 60.0
    return share * 1e-6 / (1 - ratio**2 + 0.06j * ratio)


def export(*arguments):
    return CliRunner().invoke(cli.app, ["frf-export", *(str(one) for one in arguments)])


def processed(tmp_path, impacts, write):
    folder, out = tmp_path / "modal", tmp_path / "processed"
    folder.mkdir()
    manifest = {"format": 1, "batch": "modal", "source": "measured", "cell": "none"}
    manifest["instruments"] = {"hammer": {"rate_hz": RATE}}
    (folder / "batch.yaml").write_text(yaml.safe_dump(manifest))
    columns = "test,position,reference,response,replicate,kind,file,response_unit\n"
    (folder / "impacts.csv").write_text(columns + impacts)
    write(folder)
    ingest(folder, tmp_path, out, {}, "c0de")
    return out


@pytest.fixture
def files(tmp_path):
    """Accelerances of three points at position 1, and one at position 2."""

    def write(folder):
        to_acceleration = -((2 * np.pi * FREQUENCY) ** 2)
        values = [to_acceleration * receptance(FREQUENCY, share) for share in (1.0, 0.5, -0.2)]
        given = [Function(FRF, "1x", f"{i + 1}x", "m/s2", FREQUENCY, v) for i, v in enumerate(values)]
        (folder / "a.uff").write_bytes(universal_file(given))
        (folder / "b.uff").write_bytes(universal_file(given[:1]))

    return processed(tmp_path, "t,1,,,,,a.uff,\nt,2,,,,,b.uff,\n", write)


def test_frf_files_come_back_as_receptances(files, tmp_path):
    out = tmp_path / "out.uff"
    result = export(files, out, "--position", "1")
    assert result.exit_code == 0
    assert "3 FRFs of position 1, m/N" in result.output.replace("\n", "")
    found = read_functions(out)
    assert [(f.reference, f.response, f.unit) for f in found] == [("1x", f"{i}x", "m") for i in (1, 2, 3)]
    for function, share in zip(found, (1.0, 0.5, -0.2), strict=True):
        np.testing.assert_array_equal(function.frequency, FREQUENCY)
        np.testing.assert_allclose(function.values, receptance(FREQUENCY, share), rtol=1e-12)


def test_programs_get_json(files, tmp_path):
    result = export(files, tmp_path / "out.uff", "--position", "2", "--json")
    content = json.loads(result.stdout)
    assert content["file"] == str(tmp_path / "out.uff")
    assert "1 FRFs of position 2" in content["told"][-1]


def test_another_program_reads_what_is_exported(files, tmp_path):
    pyuff = pytest.importorskip("pyuff", reason="pyuff is not installed (development only)")
    assert export(files, tmp_path / "out.uff", "--position", "1").exit_code == 0
    sets = [each for each in pyuff.UFF(str(tmp_path / "out.uff")).read_sets() if each["type"] == 58]
    assert [(s["ref_node"], s["rsp_node"], s["rsp_dir"], s["func_type"]) for s in sets] == [
        (1, point, 1, 4) for point in (1, 2, 3)
    ]
    for each, share in zip(sets, (1.0, 0.5, -0.2), strict=True):
        np.testing.assert_allclose(each["data"], receptance(FREQUENCY, share), rtol=1e-12)
        np.testing.assert_allclose(each["x"], FREQUENCY, rtol=1e-6)


def test_hammer_records_are_exported_as_their_estimated_receptance(tmp_path):
    time = np.arange(4096) / RATE
    force = np.where((time > 0.05) & (time < 0.056), 400 * np.sin(np.pi * (time - 0.05) / 0.006) ** 2, 0.0)
    line = np.fft.rfftfreq(4 * 4096, 1 / RATE)
    motion = np.fft.irfft(np.fft.rfft(force, 4 * 4096) * receptance(line, 1.0))[:4096]

    def write(folder):
        table = np.stack([time, force, motion], axis=1)
        np.savetxt(folder / "h.csv", table, delimiter=",", header="t_s,force_n,response", comments="")

    out = processed(tmp_path, "t,1,1x,1x,1,record,h.csv,m\n", write)
    assert export(out, tmp_path / "out.uff").exit_code == 0
    (found,) = read_functions(tmp_path / "out.uff")
    hit = read_table(out / "hit.parquet")
    estimated = estimate_frf([Hit(hit["force_n"].to_numpy(), hit["response_si"].to_numpy(), RATE)], "m")
    np.testing.assert_allclose(found.frequency, estimated.frequency, rtol=1e-12)
    np.testing.assert_allclose(found.values, estimated.h1, rtol=1e-9)


@pytest.mark.parametrize("asked", [[], ["--position", "7"]])
def test_positions_are_not_mixed_and_not_guessed(files, tmp_path, asked):
    result = export(files, tmp_path / "out.uff", *asked)
    assert result.exit_code == 1
    assert "found FRFs at position 1, 2, expected one of them: --position" in result.stderr.replace("\n", "")
    assert not (tmp_path / "out.uff").exists()


def test_a_batch_without_impacts_says_so(tmp_path):
    folder = tmp_path / "bare"
    folder.mkdir()
    manifest = {"format": 1, "batch": "bare", "source": "measured", "cell": "none"}
    (folder / "batch.yaml").write_text(yaml.safe_dump(manifest))
    header = "table,row,quantity,measured,predicted,unit"
    (folder / "published.csv").write_text(f"{header}\n1,1,mean force,100,90,N\n")
    ingest(folder, tmp_path, tmp_path / "processed", {}, "c0de")
    result = export(tmp_path / "processed", tmp_path / "out.uff")
    assert result.exit_code == 1
    assert "found no FRF and no usable hammer record" in result.stderr


def test_a_file_that_cannot_be_written_is_told_and_nothing_is_left(files, tmp_path):
    (tmp_path / "out.uff").mkdir()
    result = export(files, tmp_path / "out.uff", "--position", "1")
    assert result.exit_code == 1
    assert "something else has its name" in result.output.replace("\n", " ")
    assert list(tmp_path.glob(".out.uff.*")) == []
