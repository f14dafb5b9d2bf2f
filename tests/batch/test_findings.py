import pytest

from metro.batch.findings import BatchError, Finding, shown, suggestion


def test_a_finding_in_a_table_names_file_row_run_and_column():
    finding = Finding("error", "runs.csv", 'found "2,5", expected a number > 0', 3, "r03", "axial_depth_mm")
    assert str(finding) == 'runs.csv: row 3 (r03): column axial_depth_mm: found "2,5", expected a number > 0'


def test_a_finding_in_a_yaml_file_names_the_key_and_the_line():
    assert str(Finding("error", "batch.yaml", "bad", column="tool.teeth")) == "batch.yaml: tool.teeth: bad"
    assert str(Finding("error", "batch.yaml", "bad", row=4)) == "batch.yaml: line 4: bad"


def test_an_error_shows_every_problem():
    error = BatchError([Finding("error", "a", "one"), Finding("error", "b", "two")])
    assert str(error).splitlines() == ["a: one", "b: two"]


@pytest.mark.parametrize(("name", "near"), [("theeth", "teeth"), ("Teeth", "teeth"), ("zzz", None)])
def test_a_misspelt_name_is_answered_with_the_nearest(name, near):
    assert suggestion(name, ["teeth", "helix_deg"]) == (f' (did you mean "{near}"?)' if near else "")


def test_a_long_value_is_shortened():
    assert len(shown(list(range(100)))) < 62
