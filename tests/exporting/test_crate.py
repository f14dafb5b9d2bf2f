"""A run as an RO-Crate: what the profile asks for, no dangling name, and every file with its own hash."""

import hashlib
import json

import pytest
from closed_project import ROOT, closed_project
from typer.testing import CliRunner

from metro.batch.provenance import record
from metro.cli import app
from metro.exporting.crate import CrateFile, Run, metadata


@pytest.fixture(scope="module")
def crate(tmp_path_factory):
    """Return the crate of the bundled batch clean-slot, made by the command in a project folder."""
    project = closed_project(tmp_path_factory.mktemp("crate"), ROOT / "data/raw/clean-slot")
    reports = project / "reports/clean-slot"
    (reports / "report.pdf").write_bytes(b"%PDF-1.7 a report")
    written = record(project / "data/processed/clean-slot", reports, {}, "code")
    (reports / "provenance.json").write_text(json.dumps(written))
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(project)
        done = CliRunner().invoke(app, ["export", "clean-slot", "--out", "out/clean-slot.crate"])
        assert done.exit_code == 0, done.output
        assert "RO-Crate of clean-slot: 25 raw files, 4 results" in done.output
        again = CliRunner().invoke(app, ["export", "clean-slot", "--out", "out/clean-slot.crate"])
        assert (again.exit_code, "is there already" in again.stderr) == (2, True)
    return project / "out/clean-slot.crate"


@pytest.fixture(scope="module")
def entities(crate):
    content = json.loads((crate / "ro-crate-metadata.json").read_text())
    assert content["@context"][0] == "https://w3id.org/ro/crate/1.1/context"
    graph = content["@graph"]
    assert len({entity["@id"] for entity in graph}) == len(graph)
    return {entity["@id"]: entity for entity in graph}


def references(value):
    if isinstance(value, dict):
        if set(value) == {"@id"}:
            yield value["@id"]
        else:
            for inner in value.values():
                yield from references(inner)
    elif isinstance(value, list):
        for inner in value:
            yield from references(inner)


def test_every_name_that_is_referred_to_is_described_or_a_web_address(entities):
    named = {name for entity in entities.values() for name in references(entity)}
    assert {name for name in named if not name.startswith("https://")} <= set(entities)
    assert {"raw/", "#run", "#batch", "#report", "#snakemake", "#license"} <= named


def test_it_declares_the_profiles_and_the_main_workflow(entities):
    root, workflow = entities["./"], entities["Snakefile"]
    profiles = {each["@id"] for each in root["conformsTo"]}
    assert profiles == {
        "https://w3id.org/ro/wfrun/process/0.5",
        "https://w3id.org/ro/wfrun/workflow/0.5",
        "https://w3id.org/workflowhub/workflow-ro-crate/1.0",
    }
    assert root["mainEntity"] == {"@id": "Snakefile"}
    assert set(workflow["@type"]) == {"File", "SoftwareSourceCode", "ComputationalWorkflow"}
    assert entities[workflow["programmingLanguage"]["@id"]]["@type"] == "ComputerLanguage"
    for side in ("input", "output"):
        assert entities[workflow[side]["@id"]]["@type"] == "FormalParameter"


def test_the_run_takes_the_raw_files_and_gives_the_results_by_the_workflow(entities):
    run = entities["#run"]
    assert run["@type"] == "CreateAction"
    assert run["instrument"] == {"@id": "Snakefile"}
    assert entities["./"]["mentions"] == {"@id": "#run"}
    assert run["object"] == {"@id": "raw/"}
    assert {each["@id"] for each in run["result"]} == {
        f"reports/{name}" for name in ("report.pdf", "identified.json", "verdict.json", "provenance.json")
    }
    assert run["endTime"].endswith("+00:00")


def test_every_file_is_there_with_its_size_and_hash_and_no_other(crate, entities):
    files = {name: each for name, each in entities.items() if "File" in each["@type"]}
    assert {path.relative_to(crate).as_posix() for path in crate.rglob("*") if path.is_file()} == {
        *files,
        "ro-crate-metadata.json",
    }
    for name, each in files.items():
        content = (crate / name).read_bytes()
        assert each["contentSize"] == str(len(content))
        assert each["sha256"] == hashlib.sha256(content).hexdigest()
    original = (ROOT / "data/raw/clean-slot/runs.csv").read_bytes()
    assert (crate / "raw/runs.csv").read_bytes() == original
    assert files["raw/runs.csv"]["encodingFormat"] == "text/csv"


def test_who_measured_is_the_agent_and_the_author_where_somebody_says_so():
    file = CrateFile("Snakefile", 1, "00")
    run = Run("b", "B", "measured", "2026-11-24T12:00:00+00:00", "A. Smith", [], [], [file], {"numpy": "2"})
    graph = {each["@id"]: each for each in metadata(run)["@graph"]}
    assert graph["#operator"] == {"@id": "#operator", "@type": "Person", "name": "A. Smith"}
    assert graph["#run"]["agent"] == graph["./"]["author"] == {"@id": "#operator"}
    assert graph["Snakefile"]["softwareRequirements"] == "numpy 2"
