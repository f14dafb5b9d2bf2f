import re

import pytest
import yaml

from metro.batch.check import check
from metro.batch.columns import RUNS
from metro.batch.documents import schema
from metro.batch.findings import BatchError
from metro.batch.template import new_batch
from metro.observables.catalogue import capabilities


def test_the_template_lacks_nothing_but_a_measurement_and_says_what_to_fill_in(tmp_path):
    report = check(new_batch(tmp_path, "my-cut"), tmp_path, able=capabilities)
    (problem,) = [problem for problem in report.problems if problem.severity != "note"]
    assert "it holds no measurement" in problem.message
    missing = [entry for can in report.capabilities for entry in can.missing]
    assert "dynamometer files in runs.csv" in missing
    assert "tool.diameter_mm in batch.yaml" in missing


def test_every_key_of_the_contract_stands_in_the_template_and_is_valid_when_uncommented(tmp_path):
    folder = new_batch(tmp_path, "my-cut")
    text = (folder / "batch.yaml").read_text()
    for key in schema("batch")["properties"]:
        assert re.search(rf"^(# )?{key}:", text, re.MULTILINE), key
    section = re.search(r"^# files:\n((?:#  .*\n)+)", text, re.MULTILINE)
    for key in schema("batch")["properties"]["instruments"]["properties"]:
        assert re.search(rf"^#   {key}:", text, re.MULTILINE), key
    options = re.findall(r"^# ((?:  (?:# )?)?[a-z_]+: ?.*)$", text, re.MULTILINE)
    plain = [line for line in text.splitlines() if line and not line.startswith("#")]
    options = [line for line in options if line.strip() not in ("files:", *map(str.strip, _bare(section[1])))]
    options += ["files:", *_bare(section[1])]
    (folder / "batch.yaml").write_text("\n".join([*plain, *options]))
    assert set(yaml.safe_load("\n".join([*plain, *options]))) == set(schema("batch")["properties"])
    assert [str(problem) for problem in check(folder, tmp_path).problems if problem.severity != "note"] == []


def _bare(text):
    """Return commented lines without their mark."""
    return [line.removeprefix("# ") for line in text.splitlines()]


def test_the_examples_of_the_other_files_follow_the_contract(tmp_path):
    folder = new_batch(tmp_path, "my-cut")
    text = (folder / "README.md").read_text()
    examples = dict(re.findall(r"^## An example of (\S+)\n\n```\n(.*?)```$", text, re.MULTILINE | re.DOTALL))
    assert list(examples) == ["impacts.csv", "loads.csv", "cell.yaml"]
    for name, content in examples.items():
        (folder / name).write_text(content)
    (folder / "hammer").mkdir()
    for record in ("tip-x-1", "tip-x-2"):
        rows = "".join(f"{i / 1000},{i % 7},{i % 5}\n" for i in range(50))
        (folder / f"hammer/{record}.csv").write_text(f"t_s,force_n,response\n{rows}")
    rows = "".join(f"{i},1,0\n" for i in range(20))
    (folder / "hammer/tip-y.csv").write_text(f"frequency_hz,real,imag\n{rows}")
    report = check(folder, tmp_path, able=capabilities)
    assert [str(problem) for problem in report.problems if problem.severity != "note"] == []
    assert {"3 rows in impacts.csv", "4 rows in loads.csv"} <= set(report.there)


def test_the_run_table_has_every_column_and_repeats_spread_at_random(tmp_path):
    lines = (new_batch(tmp_path, "my-cut") / "runs.csv").read_text().splitlines()
    assert lines[0].split(",") == [column.name for column in RUNS]
    conditions = [line.split(",")[2] for line in lines[1:]]
    assert sorted(conditions[:4]) == sorted(conditions[4:])
    assert len(set(conditions)) == 4
    orders = {
        tuple((new_batch(tmp_path, f"b{i}") / "runs.csv").read_text().splitlines()[1:]) for i in range(10)
    }
    assert len(orders) > 5


@pytest.mark.parametrize("name", ["My Cut", "../out", ""])
def test_a_name_that_is_not_allowed_is_an_error(tmp_path, name):
    with pytest.raises(BatchError, match="lower-case letters"):
        new_batch(tmp_path, name)


def test_a_folder_that_is_there_is_left_alone(tmp_path):
    (tmp_path / "b").mkdir()
    with pytest.raises(BatchError, match="is there already"):
        new_batch(tmp_path, "b")
    assert list((tmp_path / "b").iterdir()) == []
