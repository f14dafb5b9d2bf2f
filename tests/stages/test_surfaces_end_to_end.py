"""Faces, traces and slopes from their files to the report: one interval in JSON, PDF and page."""

import html
import json
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pypdfium2
import pytest
import yaml
from typer.testing import CliRunner

from metro.batch.check import load
from metro.batch.findings import BatchError
from metro.cli import app
from metro.report.numbers import with_interval
from metro.stages.identify import identify
from metro.stages.ingest import ingest
from metro.stages.loop import loop
from metro.stages.predict import predict
from metro.stages.report import report
from metro.stages.verdict import verdict

ROOT = Path(__file__).resolve().parents[2]
FEET = ["x1_mm", "y1_mm", "x2_mm", "y2_mm"]


def bowl(x, y):
    """Heights in mm of a bowl that is 6 µm deep, places in mm."""
    return 4e-3 * ((x - 400) / 400) ** 2 + 2e-3 * ((y - 300) / 300) ** 2


def grid_of_slopes(seed):
    """Return readings of a level, zero 30 µrad and noise 1 µrad, on a grid of 5 × 4 stations of the bowl."""
    x, y = np.arange(0, 801, 200), np.arange(0, 601, 200)
    rows = [(a, b, a + 200, b) for b in y for a in x[:-1]] + [(a, b, a, b + 200) for a in x for b in y[:-1]]
    feet = pd.DataFrame(np.array(rows, float), columns=FEET)
    rise = bowl(feet["x2_mm"], feet["y2_mm"]) - bowl(feet["x1_mm"], feet["y1_mm"])
    noise = np.random.default_rng(seed).standard_normal(len(rows))
    return feet.assign(slope_urad=rise / 200 * 1e6 + 30 + noise)


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """Return the batch's identified quantities, the words of its PDF and those of its page."""
    root = tmp_path_factory.mktemp("surfaces")
    folder, processed, reports = root / "mixed", root / "processed", root / "reports"
    folder.mkdir()
    random = np.random.default_rng(4)
    grid_of_slopes(1).to_csv(folder / "level.csv", index=False)
    grid_of_slopes(2).head(12).to_csv(folder / "rows.csv", index=False)
    x, y = (each.ravel() for each in np.meshgrid(np.arange(0, 60, 1.0), np.arange(0, 40, 1.0)))
    z = 0.05 * ((x - 30) / 30) ** 2 + 0.01 * random.standard_normal(x.size)
    np.savetxt(folder / "face.xyz", np.column_stack([x, y, z]))
    along = np.arange(0, 6.0, 0.001)
    wave = 1e-3 * np.sin(2 * np.pi * along / 0.1) + 1e-4 * random.standard_normal(along.size)
    pd.DataFrame({"x_mm": along, "z_mm": wave}).to_csv(folder / "trace.csv", index=False)
    (folder / "runs.csv").write_text(
        "run,slopes,scan,profile\nplate,level.csv,,\nloose,rows.csv,,\nface,,face.xyz,\ntrace,,,trace.csv\n"
    )
    (folder / "batch.yaml").write_text(
        "format: 1\nbatch: mixed\nsource: measured\ncell: unknown\n"
        "instruments: {level: {sigma_urad: 1}, scanner: {sigma_mm: 0.01}, profiler: {sigma_mm: 0.0001}}\n"
    )
    settings = yaml.safe_load((ROOT / "config/config.yaml").read_text())["loop"]
    reports.mkdir()
    ingest(folder, root, processed, {}, "c0de")
    identify(processed, settings, "c0de")
    predict(processed, {}, "c0de")
    loop(processed, reports, settings, "c0de")
    verdict(processed, reports, {}, "c0de")
    report(processed, reports, {}, "c0de")
    document = pypdfium2.PdfDocument(reports / "report.pdf")
    pdf = " ".join(document[i].get_textpage().get_text_range() for i in range(len(document)))
    page = html.unescape(re.sub(r"<[^>]*>", " ", (reports / "report.html").read_text()))
    return json.loads((reports / "identified.json").read_text()), _words(pdf), _words(page)


def _words(text):
    return re.sub(r"\s+", " ", text.replace("\ufffe", "").replace("\u00a0", " "))


def test_the_level_finds_the_bowl_within_its_interval(found):
    plate = found[0]["levelling"]["plate"]
    low, high = plate["minimum_zone"]["ci95"]
    assert low < 6.0 - 2.0 / 9.0 < high  # the stations nearest the middle stand 2/9 µm above the lowest place
    assert high - low < 3.0
    # 20 heights up to a constant; the zero of a level that faces +x and +y alone is a tilt of the plate
    assert (plate["points"], plate["readings"], plate["degrees_of_freedom"]) == (20, 31, 31 - 19)


def test_readings_that_determine_no_face_are_refused_with_the_reason_in_all_three(found):
    reason = found[0]["levelling"]["not_identified"]["loose"]
    assert "the readings do not determine all heights" in reason
    assert all(reason in words for words in found[1:])


def intervals(identified):
    """Yield name and quantity of every index that has an interval."""
    for name in ("minimum_zone", "fltt", "fltp", "fltv", "fltq"):
        yield f"levelling {name}", identified["levelling"]["plate"][name]
    for name, entry in identified["faces"]["face"]["noise_corrected"].items():
        yield f"face {name}", entry
    for name, entry in identified["texture"]["trace"].items():
        if isinstance(entry, dict) and None not in entry["ci95"]:
            yield f"trace {name}", entry


def test_json_pdf_and_page_give_the_same_interval(found):
    identified, pdf, page = found
    entries = dict(intervals(identified))
    assert len(entries) > 25
    for name, entry in entries.items():
        said = with_interval(entry["value"], entry["ci95"])
        assert said in page, f"{name}: {said} is not on the page"
        assert said in pdf, f"{name}: {said} is not in the PDF"


def test_no_correction_of_noise_makes_an_index_larger(found):
    face = found[0]["faces"]["face"]
    for name, corrected in face["noise_corrected"].items():
        assert corrected["value"] <= face[name]["value"]
        assert corrected["ci95"][0] <= corrected["value"] <= corrected["ci95"][1]


def levelled(tmp_path, table, mapping=""):
    folder = tmp_path / "plate"
    folder.mkdir()
    table.to_csv(folder / "level.csv", index=False)
    (folder / "runs.csv").write_text("run,slopes\nplate,level.csv\n")
    (folder / "batch.yaml").write_text(f"format: 1\nbatch: plate\nsource: measured\ncell: unknown\n{mapping}")
    return folder


def checked(folder):
    return CliRunner().invoke(app, ["check", str(folder)])


@pytest.mark.parametrize(
    ("unit", "size"), [("arcsec", 4.84813681), ("mrad", 1e3), ("um/m", 1.0), ("mm/m", 1e3)]
)
def test_readings_in_other_units_are_the_same_by_the_mapping(tmp_path, unit, size):
    table = grid_of_slopes(1)
    other = table.assign(reading=table["slope_urad"] / size).drop(columns="slope_urad")
    mapping = f"files: {{'*.csv': {{columns: {{slope_urad: {{from: reading, unit: {unit}}}}}}}}}\n"
    folder = levelled(tmp_path, other, mapping)
    ingest(folder, tmp_path, tmp_path / "processed", {}, "c0de")
    read = pd.read_parquet(tmp_path / "processed/slopes.parquet")
    assert read["slope_urad"].to_numpy() == pytest.approx(table["slope_urad"].to_numpy(), rel=1e-8)
    assert set(read["line"]) == {0}


def test_what_cannot_be_right_of_slopes_is_an_error_with_its_place(tmp_path):
    table = grid_of_slopes(1)
    table.loc[3, "x2_mm"] = table.loc[3, "x1_mm"]
    folder = levelled(tmp_path, table)
    said = checked(folder)
    assert said.exit_code == 1
    assert "reading 4: starts and ends at the same place" in _words(said.output)
    wrong = grid_of_slopes(1)
    wrong.loc[5, "slope_urad"] = 1e6
    wrong.to_csv(folder / "level.csv", index=False)
    assert "reading 6 differs by 1e+06 µrad from the median of its line" in _words(checked(folder).output)


def test_a_batch_of_slopes_alone_passes_its_check_and_one_without_the_column_does_not(tmp_path):
    folder = levelled(tmp_path, grid_of_slopes(1))
    said = checked(folder)
    assert said.exit_code == 0
    assert "flatness by slopes" in said.output
    grid_of_slopes(1).drop(columns="y2_mm").to_csv(folder / "level.csv", index=False)
    with pytest.raises(BatchError, match="lacks the column y2_mm of slope readings"):
        load(folder)


def test_a_batch_of_slopes_alone_does_not_miss_a_scan(tmp_path):
    folder = levelled(tmp_path, grid_of_slopes(1))
    ingest(folder, tmp_path, tmp_path / "processed", {}, "c0de")
    settings = yaml.safe_load((ROOT / "config/config.yaml").read_text())["loop"]
    identify(tmp_path / "processed", settings, "c0de")
    identified = json.loads((tmp_path / "processed/identified.json").read_text())
    assert "minimum_zone" in identified["levelling"]["plate"]
    assert "flatness" not in identified["not_identified"]


def test_import_asks_for_the_unit_of_a_reading_alone(tmp_path):
    table = grid_of_slopes(1).assign(line=range(31))
    own = dict(
        zip([*FEET, "slope_urad"], ["X1 [mm]", "Y1 [mm]", "X2 [mm]", "Y2 [mm]", "Reading"], strict=True)
    )
    table.rename(columns=own).to_csv(tmp_path / "plate.csv", index=False)
    call = ["import", str(tmp_path / "plate.csv"), "--out", str(tmp_path / "plate"), "--set=title=none"]
    asked = CliRunner().invoke(app, call)
    assert asked.exit_code != 0
    assert "1 question is open" in asked.output
    assert "um/m, arcsec or mrad" in asked.output
    assert CliRunner().invoke(app, [*call, "--set=unit.slope=arcsec"]).exit_code == 0
    ingest(tmp_path / "plate", tmp_path, tmp_path / "processed", {}, "c0de")
    read = pd.read_parquet(tmp_path / "processed/slopes.parquet")
    assert list(read["line"]) == list(range(31))
    assert read["slope_urad"][0] == pytest.approx(table["slope_urad"][0] * np.pi / 648e-3, rel=1e-9)
