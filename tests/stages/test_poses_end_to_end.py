"""Measured poses from their files to the report: mappings, refusals, one median in JSON, PDF and page."""

import html
import json
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pypdfium2
import pytest
import yaml
from simulated_poses import ROWS, drawn, measured
from typer.testing import CliRunner

from metro.cli import app
from metro.report.numbers import with_interval
from metro.stages.identify import identify
from metro.stages.ingest import ingest
from metro.stages.loop import loop
from metro.stages.predict import predict
from metro.stages.report import report
from metro.stages.verdict import verdict

ROOT = Path(__file__).resolve().parents[2]
JOINTS = [f"arm_joint_{i}" for i in range(1, 7)]
MAPPING = """files:
  "tracker*.csv":
    columns:
"""
COLUMNS = [f"      q{i}_deg: {{from: {name}, unit: rad}}" for i, name in enumerate(JOINTS, start=1)]
COLUMNS += [f"      {axis}_mm: {{from: Leica {axis}, unit: m}}" for axis in "xyz"]


def series(count=260):
    """Return a table of an arm whose link 2 is 0.8 mm longer, in radians and metres."""
    errors = np.zeros((6, 4))
    errors[1, 3] = 8e-4
    q = drawn(count, seed=3)
    at = measured(q, errors, sigma=3e-5, seed=4)
    return pd.DataFrame(np.column_stack([q, at]), columns=[*JOINTS, *(f"Leica {axis}" for axis in "xyz")])


def batch(root, table, cell=True):
    folder = root / "poses"
    folder.mkdir()
    table.to_csv(folder / "tracker.csv", index=False, sep=";", decimal=",")
    (folder / "runs.csv").write_text("run,poses\nr01,tracker.csv\n")
    (folder / "batch.yaml").write_text(
        "format: 1\nbatch: poses\nsource: measured\ncell: arm\n" + MAPPING + "\n".join(COLUMNS) + "\n"
    )
    rows = (ROWS * (1, 1, 1e3, 1e3)).tolist()
    (folder / "cell.yaml").write_text(
        yaml.safe_dump({"cell": "arm", **({"arm": {"dh": rows}} if cell else {})})
    )
    return folder


def checked(folder):
    return CliRunner().invoke(app, ["check", str(folder)])


def _words(text):
    return " ".join(re.sub(r"[│┃╭╮╰╯─━]", " ", text).split())


def closed(root, folder):
    """Return what is identified, the words of the PDF and those of the page, and where the tables are."""
    processed, reports = root / "processed", root / "reports"
    settings = yaml.safe_load((ROOT / "config/config.yaml").read_text())["loop"]
    ingest(folder, root, processed, {}, "c0de")
    identify(processed, settings, "c0de")
    predict(processed, {}, "c0de")
    loop(processed, reports, settings, "c0de")
    verdict(processed, reports, {}, "c0de")
    report(processed, reports, {}, "c0de")
    pdf = pypdfium2.PdfDocument(reports / "report.pdf")
    text = " ".join(page.get_textpage().get_text_range() for page in pdf)
    page = html.unescape(re.sub(r"<[^>]+>", " ", (reports / "report.html").read_text()))
    identified = json.loads((reports / "identified.json").read_text())
    return identified, " ".join(text.split()), " ".join(page.split()), processed


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    root = tmp_path_factory.mktemp("poses")
    return closed(root, batch(root, series()))


@pytest.fixture(scope="module")
def judged(found):
    return json.loads((found[3].parent / "reports/verdict.json").read_text())["observables"]["pose"]


def test_joints_and_positions_are_read_with_decimal_commas_in_radians_and_metres(found):
    read = pd.read_parquet(found[3] / "poses.parquet")
    table = series()
    assert read["q4_deg"].to_numpy() == pytest.approx(np.rad2deg(table["arm_joint_4"]), rel=1e-9)
    assert read["z_mm"].to_numpy() == pytest.approx(table["Leica z"] * 1e3, rel=1e-9)
    assert read["q7_deg"].isna().all()


def test_the_longer_link_is_found_and_errors_fall_to_the_noise(found):
    block = found[0]["pose"]["r01"]
    length = block["corrections"]["joint 2 length"]
    assert length["ci95"][0] < 0.8 < length["ci95"][1]
    assert length["ci95"][1] - length["ci95"][0] < 0.05
    assert block["effects"] == []
    for errors in block["errors"].values():
        assert errors["geometry"]["median"]["value"] < 0.08
        assert errors["nominal"]["median"]["value"] > 0.2


def test_the_report_and_the_page_print_the_medians_that_the_results_have(found):
    identified, text, page, _ = found
    errors = identified["pose"]["r01"]["errors"]
    for kind in ("random", "region", "time"):
        median = errors[kind]["geometry"]["median"]
        printed = with_interval(median["value"], median["ci95"])
        assert printed in text
        assert printed in page
    assert "No effect beyond the geometry predicts left-out regions better" in text


def test_the_verdict_names_the_longer_link_with_errors_on_poses_left_out(found, judged):
    assert judged["status"] == "explained"
    assert (judged["unit"], judged["held_out"]) == (
        "mm",
        {"poses": 260, "by": "region", "of": "coordinate"},
    )
    for when in ("before", "after"):
        low, high = judged[when]["ci95"]
        assert low < judged[when]["rms"] < high
    assert judged["before"]["rms"] > 5 * judged["after"]["rms"]
    assert judged["after"]["rms"] == pytest.approx(0.03, rel=0.15)
    (effect,) = judged["effects"]
    assert (effect["effect"], effect["parameters"]["joint"]) == ("kinematic_error", 2)
    assert effect["probability"] > 0.999
    assert effect["parameters"]["length_mm"] == found[0]["pose"]["r01"]["corrections"]["joint 2 length"]
    assert judged["unexplained"] is None
    assert judged["noise_floor"] is None
    assert "to know how much of the residual is noise" in judged["next_experiment"]
    assert {one["effect"] for one in judged["candidates"]} >= {"gear_eccentricity", "gravity_elasticity"}


def test_the_comparison_has_each_coordinate_of_each_pose_that_was_left_out(found, judged):
    rows = pd.read_parquet(found[3] / "comparison.parquet")
    assert set(rows["observable"]) == {"pose"}
    assert rows.groupby("axis").size().to_dict() == {"x": 260, "y": 260, "z": 260}
    for when in ("before", "after"):
        rms = np.sqrt(np.mean((rows["measured"] - rows[when]) ** 2))
        assert rms == pytest.approx(judged[when]["rms"])
    assert sorted(rows["measured"][rows["axis"] == "z"]) == pytest.approx(sorted(series()["Leica z"] * 1e3))


def test_page_one_says_the_verdict_and_what_it_is_worth(found):
    for text in found[1:2]:
        assert "The arm by measured poses: explained. Of poses left out by region the median error is" in text
        assert "Found: kinematic error (joint 2)." in text
        assert "the predictions of poses among those that were measured are accurate to" in text


def test_the_next_poses_are_a_table_in_the_contracts_columns_and_on_the_report(found):
    table = pd.read_parquet(found[3] / "pose_next.parquet")
    assert list(table.filter(like="_deg")) == [f"q{i}_deg" for i in range(1, 7)]
    assert len(table) == 20
    assert "Poses to measure next" in found[1]


def test_the_check_names_what_poses_give_and_what_they_lack(tmp_path):
    folder = batch(tmp_path, series(50))
    assert "1 run with measured poses" in _words(checked(folder).output)
    (folder / "cell.yaml").write_text("cell: arm\n")
    said = checked(folder)
    assert said.exit_code == 1
    assert "the arm by measured poses lacks arm.dh in cell.yaml" in _words(said.output)


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda t: t.rename(columns={"Leica y": "other"}), 'found no "Leica y" in tracker.csv'),
        (
            lambda t: t.assign(arm_joint_2=t["arm_joint_2"].where(t.index < 4)),
            "line 6, column q2_deg: found nothing",
        ),
        (lambda t: t * np.where(t.columns.str.startswith("arm"), np.pi / 180, 1), "seem to be in radians"),
        (lambda t: t * np.where(t.columns.str.startswith("Leica"), 1e-3, 1), "they seem to be in metres"),
    ],
)
def test_what_cannot_be_poses_is_refused_with_its_place(tmp_path, spoil, words):
    folder = batch(tmp_path, spoil(series(50)))
    said = checked(folder)
    assert said.exit_code == 1
    assert words in _words(said.output)
    assert "tracker.csv" in said.output


def test_a_word_among_the_numbers_is_named_with_its_line_and_column(tmp_path):
    folder = batch(tmp_path, series(50))
    lines = (folder / "tracker.csv").read_text().split("\n")
    cells = lines[5].split(";")
    lines[5] = ";".join([cells[0], "lost", *cells[2:]])
    (folder / "tracker.csv").write_text("\n".join(lines))
    assert "line 6" in (said := _words(checked(folder).output))
    assert "(arm_joint_2): found 'lost', expected a number" in said


def test_more_joints_than_the_arm_has_are_refused(tmp_path):
    folder = batch(tmp_path, series(50))
    text = yaml.safe_load((folder / "cell.yaml").read_text())
    text["arm"]["dh"] = text["arm"]["dh"][:5]
    (folder / "cell.yaml").write_text(yaml.safe_dump(text))
    assert "has q1_deg to q6_deg, expected q1_deg to q5_deg" in _words(checked(folder).output)


def test_too_few_poses_are_named_as_the_reason(tmp_path):
    folder = batch(tmp_path, series(30))
    ingest(folder, tmp_path, tmp_path / "processed", {}, "c0de")
    settings = yaml.safe_load((ROOT / "config/config.yaml").read_text())["loop"]
    identify(tmp_path / "processed", settings, "c0de")
    block = json.loads((tmp_path / "processed/identified.json").read_text())["pose"]
    assert block == {"not_identified": {"r01": "found 30 poses, expected at least 40"}}


def test_import_recognises_poses_and_asks_for_units_and_the_robot(tmp_path):
    names = ["shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "wrist_2_joint"]
    table = series(50)
    table.columns = [*names, "wrist_3_joint", *(f"measurement_{axis}" for axis in "xyz")]
    table.assign(measurement_temperature=21.5).to_csv(tmp_path / "log.csv", index=False, sep=";", decimal=",")
    call = ["import", str(tmp_path / "log.csv"), "--out", str(tmp_path / "made"), "--set=title=none"]
    asked = CliRunner().invoke(app, call)
    assert "3 questions are open" in asked.output
    answers = ["--set=unit.angle=rad", "--set=unit.length=m", "--set=cell=ur10"]
    assert CliRunner().invoke(app, [*call, *answers]).exit_code == 0
    ingest(tmp_path / "made", ROOT / "config/cells", tmp_path / "processed", {}, "c0de")
    read = pd.read_parquet(tmp_path / "processed/poses.parquet")
    assert read["q6_deg"].to_numpy() == pytest.approx(np.rad2deg(table["wrist_3_joint"]), rel=1e-9)
    assert set(read["temperature_c"]) == {21.5}


STATIONS = np.array([[3.6, -2.4, 0.2], [3.9, -0.1, 0.5], [1.8, 0.6, 0.8]])  # m, in the tracker's frame


def wires(count=120, sigma=3e-5):
    """Return the lengths of three wires at poses of the same arm, a row each."""
    errors = np.zeros((6, 4))
    errors[1, 3] = 8e-4
    q = np.repeat(drawn(count, seed=5), 3, axis=0)
    noise = sigma * np.random.default_rng(6).standard_normal(3 * count)
    apart = measured(q[::3], errors).repeat(3, axis=0) - np.tile(STATIONS, (count, 1))
    table = pd.DataFrame(np.rad2deg(q), columns=[f"q{i}_deg" for i in range(1, 7)])
    length = 1e3 * (np.linalg.norm(apart, axis=1) + noise)
    return table.assign(distance_mm=length, station=np.tile([1, 2, 3], count), sigma_mm=1e3 * sigma)


def of_wires(root, table):
    folder = batch(root, series(50))
    table.to_csv(folder / "wires.csv", index=False)
    (folder / "batch.yaml").write_text("format: 1\nbatch: poses\nsource: measured\ncell: arm\n")
    (folder / "runs.csv").write_text("run,poses,targets\nr01,wires.csv,targets.csv\n")
    table.filter(like="q").head(3).to_csv(folder / "targets.csv", index=False)
    return folder


def test_wires_from_three_stations_find_the_longer_link_and_say_what_they_do_not_show(tmp_path):
    identified, text, page, processed = closed(tmp_path, of_wires(tmp_path, wires()))
    block = identified["pose"]["r01"]
    assert (block["poses"], block["rows"], block["measured"]) == (120, 360, "distances")
    length = block["corrections"]["joint 2 length"]
    assert length["ci95"][0] < 0.8 < length["ci95"][1]
    assert length["ci95"][1] - length["ci95"][0] < 0.06
    at = np.array([[one[axis]["value"] for axis in "xyz"] for one in block["stations"]])
    apart = np.linalg.norm(at[0] - at[2])
    assert apart == pytest.approx(1e3 * np.linalg.norm(STATIONS[0] - STATIONS[2]), abs=0.1)
    assert "do not show where the arm's base is" in identified["pose"]["not_identified"]["targets of r01"]
    verdict = json.loads((processed.parent / "reports/verdict.json").read_text())["observables"]["pose"]
    assert verdict["held_out"] == {"poses": 120, "by": "region", "of": "distance"}
    assert verdict["status"] == "explained"
    assert verdict["after"]["rms"] == pytest.approx(0.03, rel=0.2)
    rows = pd.read_parquet(processed / "comparison.parquet")
    assert rows.groupby("axis").size().to_dict() == {"distance": 360}
    for words in (text, page):
        assert "Absolute difference between measured and predicted distance" in words
        assert "rms in a distance" in words


def test_neither_positions_nor_distances_are_named(tmp_path):
    folder = of_wires(tmp_path, wires().drop(columns="distance_mm"))
    said = _words(checked(folder).output)
    assert "lacks the column x_mm, y_mm, z_mm of measured poses" in said
    assert "expected x_mm, y_mm, z_mm (or distance_mm in their place)" in said


def test_distances_in_metres_are_refused(tmp_path):
    folder = of_wires(tmp_path, wires().assign(distance_mm=lambda t: t["distance_mm"] * 1e-3))
    assert "columns distance_mm: the poses are within" in _words(checked(folder).output)
