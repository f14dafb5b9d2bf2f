"""What snakemake's conventions promise: places of files, catalog, module, report, smallest project."""

import html
import json
import re
import shutil
import zipfile
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[2]
MODULE = """\
configfile: "config/config.yaml"


module metro:
    snakefile:
        "{snakefile}"
    config:
        config


use rule * from metro
"""

pytestmark = [pytest.mark.workflow, pytest.mark.xdist_group("workflow")]


@pytest.fixture
def lab(finished, tmp_path):
    """Return a folder with one raw batch and nothing else."""
    shutil.copytree(finished / "data/raw/alpha", tmp_path / "lab/data/raw/alpha")
    return tmp_path / "lab"


def test_the_snakefile_in_the_folder_workflow_is_the_same_workflow(finished):
    named = ("--snakefile", "workflow/Snakefile")
    assert "Nothing to be done" in finished.call(*named, "--dry-run")
    assert "good condition" in finished.call(*named, "--lint")


def test_it_finds_settings_and_cells_from_a_folder_that_has_none(finished, lab):
    named = ("--snakefile", str(finished / "workflow/Snakefile"), "--directory", str(lab))
    for targets in ((), ("reports/alpha/report.pdf",)):
        assert finished.planned(*named, "--cores", "1", *targets)["ingest"] == {"alpha"}


def test_it_is_what_a_deployment_imports_as_a_module(finished, lab):
    shutil.copytree(ROOT / "config", lab / "config")
    (lab / "workflow").mkdir()
    (lab / "workflow/Snakefile").write_text(MODULE.format(snakefile=finished / "workflow/Snakefile"))
    printed = finished.call("--dry-run", "--cores", "1", cwd=lab)
    assert "alpha: writing the report" in printed
    assert "writing the summary of all batches" in printed
    assert "all reports are up to date" in printed


def test_the_smallest_project_is_one_bundled_batch_with_the_settings_of_the_workflow(finished, tmp_path):
    shutil.copytree(
        ROOT / ".test", tmp_path / "test", ignore=shutil.ignore_patterns(".snakemake", "processed", "reports")
    )
    bundled = {path.name for path in (ROOT / "data/raw").iterdir()}
    named = ("--snakefile", str(ROOT / "workflow/Snakefile"), "--directory", str(tmp_path / "test"))
    planned = finished.planned(*named, "--cores", "1")
    assert len(planned["ingest"]) == 1
    assert planned["ingest"] <= bundled
    assert planned["report"] == planned["ingest"]
    settings = [(folder / "config/config.yaml").read_bytes() for folder in (ROOT, tmp_path / "test")]
    assert settings[0] == settings[1]


def test_the_report_of_snakemake_holds_every_batch_and_the_summary(finished, tmp_path):
    finished.call("--report", str(tmp_path / "report.zip"))
    with zipfile.ZipFile(tmp_path / "report.zip") as packed:
        packed.extractall(tmp_path)
    page = (tmp_path / "report/report.html").read_text(encoding="utf-8")
    results, categories = (_variable(page, name) for name in ("results", "categories"))
    kinds = ("report.pdf", "report.html", "identified.json", "verdict.json")
    batches = {batch: {f"reports/{batch}/{kind}" for kind in kinds} for batch in ("alpha", "beta")}
    assert {batch: set(paths) for batch, paths in categories["Batches"].items()} == batches
    (summary,) = categories["All batches"].values()
    assert set(summary) == {"reports/summary.pdf", "reports/summary.html"}
    assert set(results) == {*batches["alpha"], *batches["beta"], *summary}
    for path, result in results.items():
        assert (tmp_path / "report" / result["data_uri"]).read_bytes() == (finished / path).read_bytes()
        assert set(result["labels"]) == {"content", "format"}
    captions = {path: html.unescape(result["caption"]) for path, result in results.items()}
    assert "the batch alpha." in captions["reports/alpha/report.html"]
    assert "Summary of 2 batches" in captions["reports/summary.pdf"]
    assert "All batches has the summary" in re.sub(r"<[^>]+>", "", _variable(page, "workflow_desc"))


def _variable(page, name):
    """Return a variable that the report's page defines as JSON."""
    (begin,) = re.finditer(rf'\bvar {name} = (?=[{{"])', page)
    return json.JSONDecoder().raw_decode(page, begin.end())[0]


def test_the_catalog_finds_what_standardised_usage_asks_for():
    usage = yaml.safe_load((ROOT / ".snakemake-workflow-catalog.yml").read_text())["usage"]
    assert set(usage) == {"mandatory-flags", "software-stack-deployment", "report"}
    assert set(usage["mandatory-flags"]) == {"desc", "flags"}
    deployment = usage["software-stack-deployment"]
    assert set(deployment) == {"conda", "apptainer", "apptainer+conda"}
    assert all(isinstance(works, bool) for works in (*deployment.values(), usage["report"]))
    marked = [path for path in (ROOT / "workflow/rules").glob("*.smk") if "report(" in path.read_text()]
    assert usage["report"] == bool(marked)
    for path in ("workflow/Snakefile", "config/README.md", "config/config.yaml", "LICENSE"):
        assert (ROOT / path).is_file()
    # The catalog searches README files for these words.
    assert {"snakemake", "workflow"} <= set(re.findall(r"\w+", (ROOT / "README.md").read_text()))


def test_every_caption_is_used_and_there():
    rules = [ROOT / "Snakefile", *(ROOT / "workflow/rules").glob("*.smk")]
    used = {name for path in rules for name in re.findall(r"report/(\w+\.rst)", path.read_text())}
    assert used == {path.name for path in (ROOT / "workflow/report").iterdir()}
