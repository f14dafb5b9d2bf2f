"""Tables without rows or columns that say the same again and again."""

from metro.report.content import common, gathered


def test_rows_that_differ_in_their_name_alone_share_a_row_at_the_place_of_the_first():
    rows = [["r1", "a", "1"], ["r2", "b", "1"], ["r3", "a", "1"]]
    assert gathered(rows) == [["r1, r3", "a", "1"], ["r2", "b", "1"]]


def test_a_column_with_one_value_becomes_a_sentence():
    header, rows, said = common(["run", "noise", "points"], [["r1", "19", "5"], ["r2", "19", "6"]])
    assert (header, rows) == (["run", "points"], [["r1", "5"], ["r2", "6"]])
    assert said == " All rows: noise 19."


def test_the_names_of_rows_and_a_table_of_one_row_stay_as_they_are():
    assert common(["run", "noise"], [["r1", "19"]]) == (["run", "noise"], [["r1", "19"]], "")
    assert common(["run", "noise"], [["r1", "1"], ["r1", "2"]])[0] == ["run", "noise"]
