"""The writer of canonical tables."""

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from metro.batch.canonical import write_parts
from metro.batch.processed import COLUMNS, Processed, read_table


@pytest.mark.parametrize("table", sorted(COLUMNS))
def test_a_table_without_parts_has_its_columns_and_no_rows(tmp_path, table):
    write_parts(tmp_path / "t.parquet", table, [], {})
    found = read_table(tmp_path / "t.parquet")
    assert list(found) == list(COLUMNS[table])
    assert len(found) == 0


def test_types_are_the_same_with_and_without_rows(tmp_path):
    part = {"run": "a", "point": np.arange(3), "pass": 1, "x_mm": np.zeros(3)}
    write_parts(tmp_path / "full.parquet", "path", [part], {})
    write_parts(tmp_path / "empty.parquet", "path", [], {})
    full, empty = read_table(tmp_path / "full.parquet"), read_table(tmp_path / "empty.parquet")
    assert full.dtypes.tolist() == empty.dtypes.tolist()
    assert full["point"].dtype == np.int64
    assert full["y_mm"].isna().all()


def test_a_run_is_a_row_group_and_is_read_alone(tmp_path):
    parts = ({"run": run, "x_mm": np.full(5, float(k)), "z_mm": np.zeros(5)} for k, run in enumerate("abc"))
    write_parts(tmp_path / "t.parquet", "profile", parts, {})
    assert pq.ParquetFile(tmp_path / "t.parquet").num_row_groups == 3
    assert read_table(tmp_path / "t.parquet", "b")["x_mm"].tolist() == [1.0] * 5


def test_provenance_stands_in_the_schema_metadata(tmp_path):
    write_parts(tmp_path / "t.parquet", "scan", [], {"sources": "abc"})
    metadata = pq.read_schema(tmp_path / "t.parquet").metadata
    assert metadata[b"metro.sources"] == b"abc"
    assert b"metro.version" in metadata


def test_a_part_that_fails_leaves_the_old_table_and_nothing_else(tmp_path):
    def failing():
        yield {"run": "a", "x_mm": np.zeros(2)}
        raise RuntimeError

    write_parts(tmp_path / "t.parquet", "profile", [], {})
    with pytest.raises(RuntimeError):
        write_parts(tmp_path / "t.parquet", "profile", failing(), {})
    assert len(read_table(tmp_path / "t.parquet")) == 0
    assert [file.name for file in tmp_path.iterdir()] == ["t.parquet"]


def test_a_whole_table_is_one_part(tmp_path):
    table = pd.DataFrame({"pose": ["A", "B"], "point": ["", "1"], "mxx": [1.0, np.nan]})
    write_parts(tmp_path / "t.parquet", "mass", [dict(table)], {})
    found = read_table(tmp_path / "t.parquet")
    assert found["pose"].tolist() == ["A", "B"]
    assert np.isnan(found["mxx"][1])


def test_rows_of_a_run_come_in_the_pieces_that_were_written(tmp_path):
    sizes = [("a", 3), ("b", 2), ("a", 1), ("c", 4)]
    place = iter(range(100))
    parts = [{"run": run, "x_mm": np.array([float(next(place)) for _ in range(n)])} for run, n in sizes]
    write_parts(tmp_path / "scan.parquet", "scan", parts, {})
    tables = Processed(tmp_path)
    found = [piece["x_mm"].tolist() for piece in tables.pieces("scan", "a")]
    assert [each for each in found if each] == [[0.0, 1.0, 2.0], [5.0]]
    assert tables("scan", "a")["x_mm"].tolist() == [0.0, 1.0, 2.0, 5.0]
    assert not sum(len(piece) for piece in tables.pieces("scan", "d"))
    tables("scan").to_parquet(tmp_path / "scan.parquet")  # all runs in one row group
    assert [piece["x_mm"].tolist() for piece in tables.pieces("scan", "b")] == [[3.0, 4.0]]
