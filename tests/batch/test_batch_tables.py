import math

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from metro.batch.columns import TABLES
from metro.batch.tables import read_table

HEADER = "run,operation,spindle_rpm,axial_depth_mm,replicate,stable,started_at,dynamometer\n"
ROW = "r1,slot,6000,2.5,1,yes,2024-05-01T08:00:00Z,dyno/r1.csv\n"


def read(folder, text, name="runs"):
    (folder / f"{name}.csv").write_bytes(text.encode() if isinstance(text, str) else text)
    return read_table(folder, name)


def faults(folder, text, name="runs"):
    return [str(finding) for finding in read(folder, text, name)[1]]


def test_a_table_that_is_not_there_has_its_columns_and_no_rows(tmp_path):
    for name, columns in TABLES.items():
        table, findings = read_table(tmp_path, name)
        assert findings == []
        assert table.frame.empty
        assert list(table.frame.columns) == [column.name for column in columns]


def test_blanks_are_nan_or_empty_text(tmp_path):
    table, findings = read(tmp_path, HEADER + ROW)
    row = table.frame.iloc[0]
    assert findings == []
    assert (row["run"], row["spindle_rpm"], row["wrist"]) == ("r1", 6000.0, "")
    assert math.isnan(row["orbit_rpm"])


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "2.5",
            '"2,5"',
            'column axial_depth_mm: found "2,5", expected a number, 1e-5 to 2000 mm (a decimal takes a point',
        ),
        ("2.5", "0", 'column axial_depth_mm: found "0", expected 1e-5 to 2000 mm: from ultra'),
        ("2.5", "deep", 'column axial_depth_mm: found "deep", expected a number, 1e-5'),
        ("2.5", "1_0", 'found "1_0", expected a number, 1e-5'),
        ("2.5", "inf", 'found "inf", expected a number, 1e-5'),
        ("2.5", "1e999", 'found "1e999", expected a number, 1e-5'),
        ("6000", "-6000", 'column spindle_rpm: found "-6000", expected 1 to 500000 rpm: from'),
        (",1,", ",1.5,", 'column replicate: found "1.5", expected an integer, 1 to 1000000'),
        (",1,", ",0,", 'column replicate: found "0", expected 1 to 1000000'),
        (
            "slot",
            "slott",
            'column operation: found "slott", expected slot or side or face or helical, or blank (did',
        ),
        ("yes", "maybe", 'column stable: found "maybe", expected yes or no, or blank'),
        (
            "2024-05-01T08:00:00Z",
            "1.5.2024",
            'column started_at: found "1.5.2024", expected a time as ISO 8601',
        ),
        ("r1,", ",", "row 3: column run: is blank, expected text"),
        ("2.5", "2,5", "found 9 values, expected 8 (a decimal takes a point, not a comma)"),
        ("r1,", '"r1,', "cannot be read as CSV"),
    ],
)
def test_a_cell_that_is_not_what_it_should_be_is_named_with_row_and_column(tmp_path, old, new, message):
    found = "\n".join(faults(tmp_path, HEADER + "r0,slot,,,,,,\n" + ROW.replace(old, new)))
    assert message in found
    assert "runs.csv: row 3" in found


def test_all_faults_are_found_at_once(tmp_path):
    assert (
        len(faults(tmp_path, HEADER + ROW.replace("2.5", "x").replace("yes", "x") + ROW.replace("6000", "x")))
        == 3
    )


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "runs.csv: is empty, expected a header and rows"),
        ("\n \n", "runs.csv: is empty"),
        ("run;operation\nr1;slot\n", "its columns are separated by semicolons, expected commas"),
        ("run\toperation\nr1\tslot\n", "its columns are separated by tabs, expected commas"),
        ("run,run\nr1,r1\n", "column run: appears twice"),
        ("operation\nslot\n", "column run: is missing, expected text"),
        ("run\n", "has a header but no rows"),
        (
            "run,spindel_rpm\nr1,5\n",
            'column spindel_rpm: is not a known column and is not read (did you mean "spindle_rpm"?)',
        ),
        ("run,operation\nr1\n", "row 2 (r1): found 1 values, expected 2: missing values are taken as blank"),
        ("run,note\nr1,Ø\n".encode("latin-1"), "is not UTF-8 text"),
        ("run\nr1\n".encode("utf-16"), "is not UTF-8 text (byte 1)"),
    ],
)
def test_a_table_of_another_shape_is_said_to_be(tmp_path, text, message):
    assert message in "\n".join(faults(tmp_path, text))


@pytest.mark.parametrize(
    "text",
    [
        "\ufeffrun,operation\nr1,slot\nr2,side\n",
        "run,operation\r\nr1,slot\r\nr2,side\r\n",
        "\n\nrun,operation\n\nr1,slot\n , \nr2,side\n\n",
        " run , operation \n r1 ,slot \nr2, side",
        'run,operation\n"r1","slot"\n"r2", "side"\n',
        "run,operation,,\nr1,slot,,\nr2,side,,\n",
    ],
)
def test_the_ways_in_which_programs_write_a_table_all_read_the_same(tmp_path, text):
    table, findings = read(tmp_path, text)
    assert findings == []
    assert table.frame[["run", "operation"]].values.tolist() == [["r1", "slot"], ["r2", "side"]]


def test_rows_are_counted_as_a_spreadsheet_counts_them(tmp_path):
    assert "row 4 (r2)" in faults(tmp_path, "run,replicate\n\nr1,1\nr2,x\n")[0]


def test_quoted_text_may_hold_a_comma(tmp_path):
    text = 'table,row,quantity,unit,measured,note\n4,1,Ktc,N/mm2,3,"printed twice, see p. 5"\n'
    table, findings = read(tmp_path, text, "published")
    assert findings == []
    assert table.frame["note"][0] == "printed twice, see p. 5"


@pytest.mark.parametrize("blank", ["", "NaN", "nan", "NA"])
def test_what_other_programs_write_for_no_number_is_blank(tmp_path, blank):
    table, findings = read(tmp_path, f"run,orbit_rpm\nr1,{blank}\n")
    assert findings == []
    assert math.isnan(table.frame["orbit_rpm"][0])


def test_a_table_in_parquet_is_the_same_table(tmp_path):
    frame = pd.DataFrame(
        {
            "run": [1, 2],
            "operation": ["slot", None],
            "feed_per_tooth_mm": [0.1 + 0.2, math.nan],
            "order": [2.0, 1.0],
            "stable": [True, False],
            "started_at": pd.to_datetime(["2024-05-01T08:00", "2024-05-01T09:00"]),
        }
    )
    frame.to_parquet(tmp_path / "runs.parquet")
    table, findings = read_table(tmp_path, "runs")
    assert findings == []
    assert table.frame["run"].tolist() == ["1", "2"]
    assert table.frame["feed_per_tooth_mm"][0] == 0.1 + 0.2
    assert table.frame["stable"].tolist() == ["yes", "no"]
    assert table.frame["operation"].tolist() == ["slot", ""]


def test_a_table_that_is_there_twice_is_an_error(tmp_path):
    pd.DataFrame({"run": ["r1"]}).to_parquet(tmp_path / "runs.parquet")
    assert faults(tmp_path, HEADER + ROW) == ["runs.csv: there is runs.parquet too: keep one"]


def test_a_file_that_is_no_parquet_is_an_error(tmp_path):
    (tmp_path / "runs.parquet").write_text("run\nr1\n")
    assert "runs.parquet: cannot be read as Parquet" in str(read_table(tmp_path, "runs")[1][0])


def test_a_parquet_table_whose_text_is_no_unicode_is_refused_by_name(tmp_path):
    broken = pa.StringArray.from_buffers(1, pa.py_buffer(np.array([0, 2], "<i4")), pa.py_buffer(b"\xe1\xff"))
    pq.write_table(pa.table({"run": broken}), tmp_path / "runs.parquet")
    found = [str(finding) for finding in read_table(tmp_path, "runs")[1]]
    assert len(found) == 1
    assert found[0].startswith("runs.parquet: cannot be read as Parquet")


@pytest.mark.parametrize(
    ("header", "says"),
    [
        ("run,feed_mm", ["feed_mm: is not a known column", 'did you mean "feed_per_tooth_mm"']),
        ("runs,spindle_rpm", ["run: is missing", 'did you mean "runs"']),
    ],
)
def test_a_column_under_another_spelling_is_proposed(tmp_path, header, says):
    (tmp_path / "runs.csv").write_text(f"{header}\n1,2\n")
    _, findings = read_table(tmp_path, "runs")
    text = "\n".join(map(str, findings))
    assert [part for part in says if part not in text] == []
