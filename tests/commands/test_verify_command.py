"""A report is compared with the files it was made from, one by one."""

import json
import shutil

import pytest
from typer.testing import CliRunner

from metro.batch.processed import COLUMNS, write_json, write_table
from metro.batch.provenance import STAGES, compare, record, write_made
from metro.batch.tables import read_table
from metro.cli import app
from metro.codehash import code_hash


@pytest.fixture(autouse=True)
def same_code(monkeypatch):
    """Let the code be that of the report: to hash all of it takes a second."""
    monkeypatch.setattr("metro.commands.verify.code_hash", lambda _: "c0de")


def verify(*options):
    return CliRunner().invoke(app, ["verify", "reports/late", *options])


def differences(*options):
    result = verify("--json", *options)
    content = json.loads(result.stdout)
    assert content["unchanged"] == (result.exit_code == 0)
    files = ("raw", "cell", "processed", "result")
    return result.exit_code, [
        (d["kind"], d["change"], d["name"]) for d in content["differences"] if d["kind"] in files
    ]


def append(path, text="\n"):
    with path.open("a") as stream:
        stream.write(text)


def test_nothing_changed(own_campaign):
    assert json.loads(verify("--json").stdout)["differences"] == []
    assert "the files are those it was made of: 2 raw" in verify().stdout


@pytest.mark.parametrize(
    ("file", "difference"),
    [
        ("data/raw/late/force/r1.csv", ("raw", "changed", "force/r1.csv")),
        ("data/raw/late/batch.yaml", ("raw", "changed", "batch.yaml")),
        ("data/processed/late/grown.parquet", ("processed", "changed", "grown.parquet")),
        ("data/processed/late/loop.json", ("processed", "changed", "loop.json")),
        ("reports/late/verdict.json", ("result", "changed", "verdict.json")),
        ("reports/late/identified.json", ("result", "changed", "identified.json")),
        ("reports/late/report.pdf", ("result", "changed", "report.pdf")),
    ],
)
def test_one_byte_more_is_seen_in_every_kind_of_file(own_campaign, file, difference):
    append(own_campaign / file)
    assert differences() == (1, [difference])
    printed = verify().stdout
    assert difference[2] in printed
    assert "files changed since the report was made" in printed


@pytest.mark.parametrize(
    "file", ["data/raw/late/force/r1.csv", "data/processed/late/grown.parquet", "reports/late/report.pdf"]
)
def test_a_file_that_is_gone_is_missing(own_campaign, file):
    (own_campaign / file).unlink()
    code, ((_, change, name),) = differences()
    assert (code, change) == (1, "missing")
    assert file.endswith(name)


def test_a_table_that_would_be_read_now_is_told_and_a_note_beside_it_is_not(own_campaign):
    (own_campaign / "data/raw/late/operator.txt").write_text("coolant off")
    assert differences() == (0, [])
    (own_campaign / "data/raw/late/loads.csv").write_text("pose\n")
    assert differences() == (1, [("raw", "added", "loads.csv")])


def test_a_shared_cell_that_came_later_is_told(own_campaign):
    cells = own_campaign / "config/cells"
    cells.mkdir(parents=True)
    (cells / "bench.yaml").write_text("cell: bench\n")
    assert differences() == (0, [])
    (cells / "bench.yaml").write_text("cell: bench\njoint_stiffness_nm_rad: [1, 2, 3, 4, 5, 6]\n")
    assert differences() == (1, [("cell", "changed", "bench")])


def test_other_code_and_packages_are_told_and_leave_the_report_valid(own_campaign, monkeypatch):
    monkeypatch.setattr("metro.commands.verify.code_hash", code_hash)
    path = own_campaign / "reports/late/provenance.json"
    made = json.loads(path.read_text())
    made["packages"]["numpy"] = "0.1"
    write_json(path, made)
    result = verify("--json")
    told = {(d["kind"], d["name"]): d for d in json.loads(result.stdout)["differences"]}
    assert result.exit_code == 0
    assert told["package", "numpy"]["was"] == "0.1"
    assert told["code", "ingest"]["was"] == "c0de"
    assert told["code", "ingest"]["now"] == code_hash("ingest")


def test_other_settings_are_told(own_campaign):
    (own_campaign / "config").mkdir()
    text = (
        "raw_roots: [data/raw]\ncells: config/cells\nholdout: {share: 0.5, seed: 1}\n"
        "loop: {model_form_budget: 0.007, materiality: 0.004, false_additions: 0.05, "
        "held_out_gain: 3.0, seed: 1}\n"
    )
    (own_campaign / "config/config.yaml").write_text(text)
    found = json.loads(verify("--json").stdout)["differences"]
    assert {d["name"] for d in found if d["kind"] == "settings"} == {"ingest", "identify", "loop"}


def test_the_digest_of_the_provenance_is_printed_to_be_kept_elsewhere(own_campaign):
    import hashlib

    digest = hashlib.sha256((own_campaign / "reports/late/provenance.json").read_bytes()).hexdigest()
    assert digest in verify().stdout


def test_folders_elsewhere_can_be_named(own_campaign):
    shutil.move(own_campaign / "data", own_campaign / "archive")
    assert verify().exit_code == 1
    assert "--raw" in verify().stderr
    assert differences("--raw", "archive/raw/late", "--processed", "archive/processed/late") == (0, [])


def test_a_report_without_provenance_says_what_to_do(own_campaign):
    (own_campaign / "reports/late/provenance.json").unlink()
    result = verify()
    assert result.exit_code == 1
    assert "call metro run" in result.stderr


@pytest.mark.parametrize("content", ["", '{"raw": {', "[]", "7", '{"raw": {}}', "\x00\ud83d"])
def test_a_damaged_provenance_says_what_to_do(own_campaign, content):
    file = own_campaign / "reports/late/provenance.json"
    file.write_bytes(content.encode(errors="surrogatepass"))
    result = verify()
    assert result.exit_code == 1
    assert "provenance.json: is damaged" in result.output


def test_the_record_names_code_and_settings_of_every_stage(own_campaign):
    made = json.loads((own_campaign / "reports/late/provenance.json").read_text())
    assert list(made["stages"]) == ["ingest", "identify", "predict", "loop", "verdict", "report"]
    assert all(stage == {"code": "c0de", "settings": {}} for stage in made["stages"].values())
    assert made["packages"]["numpy"]
    assert len(made["raw"]["force/r1.csv"]) == 64


def test_a_stage_that_ran_again_to_the_same_results_is_no_difference(own_campaign, monkeypatch):
    monkeypatch.setattr("metro.commands.verify.code_hash", lambda stage: f"new {stage}")
    write_made(own_campaign / "data/processed/late", "ingest", {}, "new ingest")
    differences = json.loads(verify("--json").stdout)["differences"]
    assert {d["name"] for d in differences} == {*STAGES, "report"} - {"ingest"}


def test_a_stage_that_has_not_run_is_left_out(own_campaign):
    folder = own_campaign / "data/processed/late"
    for stage in ("predict", "identify"):
        (folder / f"{stage}.made.json").unlink()
    assert list(record(folder, own_campaign / "reports/late", {}, "c")["stages"]) == [
        "ingest",
        "loop",
        "verdict",
        "report",
    ]


@pytest.mark.parametrize("named", ["late", "data/raw/late", "data/processed/late", "reports/late/"])
def test_a_batch_is_named_by_its_name_or_any_of_its_folders(own_campaign, named):
    result = CliRunner().invoke(app, ["verify", named, "--json"])
    assert json.loads(result.stdout)["batch"] == "late"


def test_several_batches_are_verified_each_and_without_a_name_all(own_campaign):
    append(own_campaign / "reports/early/report.pdf")
    for named in (["late", "early"], []):
        result = CliRunner().invoke(app, ["verify", *named, "--json"])
        assert result.exit_code == 1
        unchanged = {one["batch"]: one["unchanged"] for one in json.loads(result.stdout)}
        assert unchanged == {"late": True, "early": False}
    printed = CliRunner().invoke(app, ["verify"]).stdout
    assert "reports/early: files changed" in printed
    assert "reports/late: the files are those" in printed


def test_what_hinders_one_batch_is_told_among_the_others(own_campaign):
    (own_campaign / "reports/early/provenance.json").unlink()
    result = CliRunner().invoke(app, ["verify"])
    assert result.exit_code == 1
    assert "reports/early/provenance.json: is not there" in result.stdout
    assert "reports/late: the files are those" in result.stdout


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["lates"], 'lates: there is no such batch (did you mean "late"?)'),
        (["late", "early", "--raw", "x"], "--raw: is the folder of one batch: name that batch"),
        (["--processed", "x"], "--processed: is the folder of one batch: name that batch"),
    ],
)
def test_a_wrong_call_is_told_in_one_line(own_campaign, arguments, told):
    result = CliRunner().invoke(app, ["verify", *arguments])
    assert (result.exit_code, result.stderr) == (2, f"{told}\n")


def test_raw_files_are_looked_for_where_the_settings_say(own_campaign):
    shutil.move(own_campaign / "data/raw", own_campaign / "lab")
    (own_campaign / "config").mkdir()
    (own_campaign / "config/config.yaml").write_text(
        "raw_roots: [lab]\ncells: config/cells\nholdout: {share: 0.34, seed: 1}\n"
        "loop: {model_form_budget: 0.007, materiality: 0.004, false_additions: 0.05, "
        "held_out_gain: 3.0, seed: 1}\n"
    )
    assert differences() == (0, [])


def test_sets_of_hashes_are_compared_by_name():
    found = compare("raw", {"a": "1", "b": "2", "c": "3"}, {"a": "1", "b": "9", "d": "4"})
    assert [(d.name, d.change, d.was, d.now) for d in found] == [
        ("b", "changed", "2", "9"),
        ("c", "missing", "3", ""),
        ("d", "added", "", "4"),
    ]


def test_stations_are_compared_with_those_that_were_read(own_campaign):
    cells, folder = own_campaign / "config/cells", own_campaign / "data/processed/late"
    cells.mkdir(parents=True)
    (cells / "bench.yaml").write_text("cell: bench\nstations: places.csv\n")
    header = ",".join(COLUMNS["stations"])
    (cells / "places.csv").write_text(f"{header}\n1,0,0,0,10,11.5,12\n")
    table, _ = read_table(cells, "stations", "places")
    write_table(folder / "stations.parquet", table.frame, {})
    description = json.loads((folder / "batch.json").read_text())
    write_json(folder / "batch.json", {**description, "cell": {"cell": "bench", "stations": "places.csv"}})
    reports = own_campaign / "reports/late"
    write_json(reports / "provenance.json", record(folder, reports, {}, "c0de"))
    assert differences() == (0, [])
    (cells / "places.csv").write_text(f"{header}\n1,0,0,0,10,11.6,12\n")
    assert differences() == (1, [("cell", "changed", "places.csv")])
