import pytest

from metro.batch.findings import BatchError, Finding, misspelt, shown
from metro.spelling import suggestion


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


@pytest.mark.parametrize("name", ["axis", "Axes", "aexs", "axe", "aaxes"])
def test_one_letter_makes_a_slip(name):
    assert misspelt(name, ["reads", "axes"]) == ("axes" if len(name) >= len("axes") else None)


@pytest.mark.parametrize("name", ["reader", "rates", "range_x_n", "robot", "n", "rang"])
def test_more_than_a_letter_or_a_unit_makes_another_word(name):
    assert misspelt(name, ["rate_hz", "range_n", "reads", "robot_log"]) is None


def test_a_name_without_its_unit_is_a_slip():
    assert misspelt("range", ["rate_hz", "range_n"]) == "range_n"


def test_a_long_value_is_shortened():
    assert len(shown(list(range(100)))) < 62
