"""SQL over all batches: every table and result as a view, whatever version of metro wrote it."""

import csv
import io
import json

import pandas as pd
import pytest
from typer.testing import CliRunner

from metro.cli import app
from metro.dataset.results import quantities
from metro.dataset.views import connect, table_files


@pytest.fixture
def ask(campaign):
    def ask(sql, *options):
        folders = ("--processed", campaign / "data/processed", "--reports", campaign / "reports")
        return CliRunner().invoke(app, ["query", sql, *map(str, folders), *options])

    return ask


def rows(result):
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)


def test_a_table_has_the_rows_of_all_batches_and_the_batch_as_a_column(ask):
    found = rows(ask("SELECT batch, run, value FROM grown ORDER BY batch, run", "--json"))
    assert [tuple(row.values()) for row in found] == [
        ("early", "r1", 3),
        ("late", "r1", 2.5),
        ("late", "r2", 4.5),
    ]


def test_columns_that_came_or_went_between_versions_are_null_where_they_are_not(ask):
    found = rows(ask("SELECT batch, \"index\", sigma FROM grown WHERE run = 'r1' ORDER BY batch", "--json"))
    assert [tuple(row.values()) for row in found] == [("early", 1, None), ("late", None, 0.1)]


def test_a_count_that_became_a_measure_is_read_as_a_measure(ask):
    kinds = {row["column_name"]: row["column_type"] for row in rows(ask("DESCRIBE grown", "--json"))}
    assert kinds == {
        "batch": "VARCHAR",
        "run": "VARCHAR",
        "index": "BIGINT",
        "value": "DOUBLE",
        "sigma": "DOUBLE",
    }


@pytest.mark.parametrize(("table", "count"), [("absent", 2), ("untyped", 1)])
def test_a_batch_without_the_table_takes_nothing_from_the_others(ask, table, count):
    assert rows(ask(f"SELECT count(*) AS n, count(value) AS known FROM {table}", "--json")) == [
        {"n": count, "known": count}
    ]


def test_the_files_are_those_that_pandas_reads_one_by_one(campaign):
    files = table_files(campaign / "data/processed", "grown")
    expected = pd.concat([pd.read_parquet(file).assign(batch=file.parent.name) for file in files])
    views = connect(campaign / "data/processed", campaign / "reports")
    assert views.sql("SELECT sum(value), count(sigma) FROM grown").fetchall() == [
        (expected["value"].sum(), expected["sigma"].count())
    ]


def test_identified_quantities_verdicts_and_effects_are_views(ask):
    (found,) = rows(ask("SELECT * FROM identified WHERE batch = 'late'", "--json"))
    assert found == {
        "batch": "late",
        "name": "force.mean.ktc",
        "value": 950,
        "lo": 945,
        "hi": 955,
        "unit": "N/mm2",
    }
    found = rows(
        ask("SELECT batch, status, before_rms, after_rms, held_out_runs FROM verdicts ORDER BY 1", "--json")
    )
    assert [tuple(row.values()) for row in found] == [
        ("early", "clean", 11.8, 11.8, 2),
        ("late", "explained", 11.8, 2.1, 2),
    ]
    found = rows(ask("SELECT effect, parameter, value FROM effects WHERE unit = 'deg'", "--json"))
    assert [tuple(row.values()) for row in found] == [
        ("tool_runout", "pitch_deg[0]", 1),
        ("tool_runout", "pitch_deg[1]", -1),
    ]
    assert rows(ask("SELECT count(*) AS n FROM candidates", "--json")) == [{"n": 4}]


def test_results_and_tables_can_be_joined(ask):
    sql = "SELECT b.cell, avg(g.value) AS mean FROM batches b JOIN grown g USING (batch) GROUP BY ALL"
    assert rows(ask(sql, "--json")) == [{"cell": "bench", "mean": pytest.approx(10 / 3)}]


def test_a_query_without_text_lists_the_views(ask):
    found = {row["view"]: row for row in rows(ask("", "--json"))}
    assert found["grown"]["rows"] == 3
    assert found["grown"]["columns"] == "batch, run, index, value, sigma"
    assert {"identified", "verdicts", "effects", "candidates", "batches", "runs"} <= set(found)


def test_comma_separated_values_are_read_back_as_they_were(ask):
    printed = ask("SELECT batch, sigma FROM grown ORDER BY ALL", "--csv").stdout
    assert list(csv.reader(io.StringIO(printed))) == [
        ["batch", "sigma"],
        ["early", ""],
        ["late", "0.1"],
        ["late", "0.2"],
    ]


def test_columns_of_one_name_are_all_in_the_record(ask):
    assert rows(ask("SELECT 1 AS a, 2 AS a", "--json")) == [{"a": 1, "a_1": 2}]


def test_what_json_cannot_say_is_null(ask):
    assert rows(ask("SELECT 'nan'::DOUBLE AS a, 'inf'::DOUBLE AS b", "--json")) == [{"a": None, "b": None}]


@pytest.mark.parametrize(
    "sql",
    [
        "COPY grown TO '{out}'",
        "EXPLAIN ANALYZE COPY grown TO '{out}'",
        "SELECT 1; COPY grown TO '{out}'",
        "ATTACH '{out}' AS other",
        "CREATE TABLE t AS SELECT 1",
        "INSTALL httpfs",
        "SET memory_limit = '1GB'",
    ],
)
def test_a_query_can_only_read(ask, sql, tmp_path):
    result = ask(sql.format(out=tmp_path / "out"))
    assert result.exit_code == 1
    assert "only reads" in result.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("sql", ["SELECT nothing FROM grown", "SELECT FROM", "SELECT * FROM nowhere"])
def test_what_duckdb_says_of_a_mistake_is_shown_without_a_traceback(ask, sql):
    result = ask(sql)
    assert result.exit_code == 1
    assert result.stderr.startswith("query: ")
    assert "Traceback" not in result.stderr


def test_a_folder_without_batches_is_named(tmp_path):
    result = CliRunner().invoke(app, ["query", "SELECT 1", "--processed", str(tmp_path)])
    assert result.exit_code == 1
    assert str(tmp_path) in result.stderr


def test_a_folder_that_is_being_written_is_no_batch(own_campaign):
    (own_campaign / "data/processed/early").rename(own_campaign / "data/processed/.early.abcdefgh")
    result = CliRunner().invoke(app, ["query", "SELECT DISTINCT batch FROM runs", "--json"])
    assert json.loads(result.stdout) == [{"batch": "late"}]


def test_the_path_of_a_quantity_is_that_of_the_file():
    content = {
        "modes": [{"frequency": {"value": 21.0, "ci95": [20.0, 22.0], "unit": "Hz"}, "position": 1}],
        "pitch": {"value": [1.0, None], "ci95": [[0.5, 1.5], None], "unit": "deg"},
        "axial": "yes",
        "name": {"value": "text", "unit": "1"},
        "known": True,
    }
    assert list(quantities(content)) == [
        ("modes[0].frequency", 21.0, 20.0, 22.0, "Hz"),
        ("modes[0].position", 1.0, None, None, ""),
        ("pitch[0]", 1.0, 0.5, 1.5, "deg"),
        ("pitch[1]", None, None, None, "deg"),
    ]
