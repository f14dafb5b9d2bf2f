"""What a change re-runs: the jobs that depend on it, and no others."""

import os

import pytest
import yaml

pytestmark = [pytest.mark.workflow, pytest.mark.xdist_group("workflow")]

STAGES = ("ingest", "identify", "predict", "loop", "verdict", "report")
BOTH = {"alpha", "beta"}


def from_stage(first, batches):
    """Return the jobs of these batches from one stage on, and the summary's."""
    jobs = {stage: set(batches) for stage in STAGES[STAGES.index(first) :]}
    return {**jobs, "campaign": {"all"}} if first != "report" else jobs


def test_a_second_call_has_nothing_to_do(finished):
    assert "Nothing to be done" in finished.call()


def test_a_new_folder_is_a_new_batch_and_runs_alone(checkout):
    checkout.add_batch("gamma")
    assert checkout.planned() == from_stage("ingest", {"gamma"})


def test_a_batch_that_vanished_leaves_the_summary_to_be_written(checkout):
    for file in (checkout / "data/raw/beta").iterdir():
        file.unlink()
    assert checkout.planned() == {"campaign": {"all"}}
    assert "1 of" in checkout.call()


def test_a_root_given_on_the_command_line_adds_its_batches(checkout, tmp_path):
    checkout.add_batch("delta", root=tmp_path / "elsewhere")
    roots = f'raw_roots=["data/raw","{tmp_path / "elsewhere"}"]'
    assert checkout.planned("--config", roots) == from_stage("ingest", {"delta"})


def test_a_touched_file_re_runs_nothing(checkout):
    os.utime(checkout / "data/raw/alpha/published.csv")
    assert checkout.planned() == {}


@pytest.mark.parametrize("file", ["published.csv", "batch.yaml"])
def test_a_changed_raw_file_re_runs_its_batch(checkout, file):
    with (checkout / "data/raw/alpha" / file).open("a") as stream:
        stream.write("\n")
    assert checkout.planned() == from_stage("ingest", {"alpha"})


def test_a_new_file_in_a_batch_re_runs_it(checkout):
    (checkout / "data/raw/beta/notes").mkdir()
    (checkout / "data/raw/beta/notes/operator.txt").write_text("coolant off")
    assert checkout.planned() == from_stage("ingest", {"beta"})


def test_a_changed_cell_re_runs_the_batches_that_use_it(checkout):
    (checkout / "data/raw/beta/cell.yaml").write_text("cell: kr160\n")
    checkout.call()
    with (checkout / "config/cells/kr160.yaml").open("a") as stream:
        stream.write("# measured again\n")
    assert checkout.planned() == from_stage("ingest", {"alpha"})


def leaves(section, path=()):
    """Return the paths of all values of a configuration."""
    if not isinstance(section, dict):
        return [path]
    return [leaf for key, value in section.items() for leaf in leaves(value, (*path, key))]


def test_every_value_of_the_configuration_re_runs_the_stage_that_reads_it(checkout):
    readers = {("holdout",): "ingest", ("loop",): "loop", ("loop", "model_form_budget"): "identify"}
    file = checkout / "config/config.yaml"
    before = yaml.safe_load(file.read_text())
    for section, *keys in leaves(before):
        if section in ("raw_roots", "cells"):
            continue
        config = yaml.safe_load(yaml.safe_dump(before))
        *above, last = [section, *keys]
        place = config
        for key in above:
            place = place[key]
        place[last] = place[last] + 1 if isinstance(place[last], int) else place[last] * 0.9
        file.write_text(yaml.safe_dump(config))
        first = readers.get((section, *keys)) or readers[section,]
        assert checkout.planned() == from_stage(first, BOTH), (section, keys)


def test_another_folder_of_cells_re_runs_what_reads_it(checkout):
    (checkout / "config/cells").rename(checkout / "cells")
    checkout.edit("config/config.yaml", "cells: config/cells", "cells: cells")
    assert checkout.planned() == from_stage("ingest", BOTH)


def test_an_edited_docstring_or_comment_re_runs_nothing(checkout):
    file = checkout / "src/metro/stages/loop.py"
    code = file.read_text().replace('"""', '"""In other words: ', 1)
    file.write_text(f"# A comment.\n{code}\n# Another one.\n")
    assert checkout.planned() == {}


def test_edited_code_re_runs_the_stages_that_use_it(checkout):
    with (checkout / "src/metro/stages/loop.py").open("a") as stream:
        stream.write("\n\ndef added() -> int:\n    return 1\n")
    assert checkout.planned() == from_stage("loop", BOTH)


def test_an_edited_sentence_of_a_verdict_re_runs_no_fit(checkout):
    checkout.edit(
        "src/metro/wording/candidates.py", "passed every test by itself", "passed all tests by itself"
    )
    assert checkout.planned() == from_stage("verdict", BOTH)


def test_an_effect_of_ones_own_re_runs_what_searches_the_library(checkout):
    (checkout / "src/metro/effects/brand_new.py").write_text("X = 1\n")
    planned = checkout.planned()
    assert planned["loop"] == BOTH
    assert "ingest" not in planned


# Stage → a module that it alone runs
OWN = {"ingest": "formats/ply.py", "predict": "stages/predict.py", "verdict": "wording/candidates.py"}


@pytest.mark.parametrize("stage", OWN)
def test_a_stage_that_came_to_the_same_results_re_runs_nothing_after_it(checkout, stage):
    with (checkout / "src/metro" / OWN[stage]).open("a") as stream:
        stream.write("\n\ndef added() -> int:\n    return 1\n")
    checkout.call("--until", stage)
    assert checkout.planned() == {}
