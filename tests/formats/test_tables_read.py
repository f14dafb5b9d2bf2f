"""Signals, logs, paths, profiles and FRFs as CSV, Parquet and npz."""

import numpy as np
import pandas as pd
import pytest

from metro.formats import FormatError
from metro.formats.kinds import KINDS
from metro.formats.registry import read, sniff

HEADER = "t_s,fx_n,fy_n,fz_n\n"


def force(rows=10):
    return "".join(f"{k * 1e-4:.4f},{k},{-k}.5,{k}e1\n" for k in range(rows))


def written(tmp_path, content, name="signal.csv"):
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def failure(path, kind="force", call=read):
    with pytest.raises(FormatError) as caught:
        call(path, kind)
    assert caught.value.path == path
    return caught.value.message


def example(kind, rows=12):
    random = np.random.default_rng(1)
    table = pd.DataFrame(
        {name: random.uniform(-0.9, 0.9, rows) for name in (*KINDS[kind].required, *KINDS[kind].optional)}
    )
    for name in KINDS[kind].whole:
        table[name] = np.arange(rows)
    if KINDS[kind].rising:
        table[KINDS[kind].rising] = np.arange(rows) * 0.25
    sigmas = {f"sigma_{axis}mm" for axis in ("", "x_", "y_", "z_")}
    for name in {"coherence", "distance_mm", "payload_kg", *sigmas} & {*table}:  # never below zero
        table[name] = table[name].abs()
    return table


def whole(table):
    """Return a table without the columns that a joint log can only have one in place of the other."""
    linear = [name for name in table if name.startswith("q") and name.endswith("_mm")]
    return table.drop(columns=[*linear, *(name for name in table if name.startswith("current"))])


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
@pytest.mark.parametrize("kind", sorted(KINDS))
def test_every_kind_survives_a_round_trip(tmp_path, kind, suffix):
    table, path = whole(example(kind)), tmp_path / f"table{suffix}"
    table.to_csv(path, index=False) if suffix == ".csv" else table.to_parquet(path)
    sniff(path, kind)
    found = read(path, kind)
    expected = table[list(KINDS[kind].required)] if kind == "cloud" else table
    pd.testing.assert_frame_equal(found, expected, rtol=1e-14)
    assert all(found[name].dtype == np.int64 for name in KINDS[kind].whole)


def test_csv_may_have_a_byte_order_mark_dos_line_ends_comments_and_other_columns_in_any_order(tmp_path):
    rows = "".join(f"ok, {k * 0.1:.1f} ,{k},\t2,{-k}, #{k}\r\n# hello\r\n\r\n" for k in range(9))
    path = written(tmp_path, "\ufeff# rig 3\r\nRemark, T_s,FX_N , Fy_N,fz_n,\r\n" + rows)
    table = read(path, "force")
    assert list(table) == ["t_s", "fx_n", "fy_n", "fz_n"]
    np.testing.assert_allclose(table["t_s"], np.arange(9) * 0.1)
    np.testing.assert_array_equal(table["fz_n"], -np.arange(9.0))


def test_a_degree_sign_of_another_code_page_does_not_matter(tmp_path):
    path = written(tmp_path, b"# 20 \xb0C\n" + (HEADER + force()).encode())
    assert len(read(path, "force")) == 10


def test_a_blank_optional_column_is_as_none(tmp_path):
    rows = "".join(f"{k},1,2,3,\n" for k in range(9))
    path = written(tmp_path, "t_s,fx_n,fy_n,fz_n,spindle_deg\n" + rows)
    assert "spindle_deg" not in read(path, "force")


@pytest.mark.parametrize(
    ("content", "parts"),
    [
        ("", ["is empty", "a force record"]),
        ("# nothing\n", ["is empty"]),
        (HEADER, ["found 0 rows", "at least 8"]),
        (HEADER + force(7), ["found 7 rows", "at least 8"]),
        ("t_s,fx_n,fy_n\n" + "1,2,3\n", ["lacks the column fz_n", "found the columns t_s, fx_n, fy_n"]),
        ("t_s,fx_n,fx_n,fy_n,fz_n\n1,2,3,4,5\n", ["column fx_n", "2 times"]),
        (force(), ["line 1", "found numbers", "t_s, fx_n, fy_n, fz_n"]),
        ("t_s;fx_n;fy_n;fz_n\n0;1;2;3\n", ["line 1", "semicolons", "decimal point"]),
        (HEADER + force(9) + '1,"2,5",3,4\n', ["line 11, column fx_n", "'2,5'", "decimal point"]),
        (HEADER + "0,0,1,5,2,5,3,5\n" * 9, ["line 2", "8 fields", "expected 4", "decimal point"]),
        (HEADER + force(9) + "0,1,1,5,2,5,3,5\n", ["line 11", "8 fields", "expected 4", "decimal point"]),
        ("a," + HEADER + "0,0,1,2,3\n0,1,1,5,2,3\n", ["line 3", "6 fields", "expected 5"]),
        (HEADER + "# x\n\n" + force(9) + "1,2,bad,4\n", ["line 13, column fy_n", "'bad'", "a number"]),
        (HEADER + "# x\n\n" + force(9) + "1,,3,4\n", ["line 13, column fx_n", "nothing or NaN"]),
        (HEADER + force(9) + "1,2,3,inf\n", ["line 11, column fz_n", "inf", "finite"]),
        (HEADER + force(9) + "1,2,3\n", ["line 11, column fz_n", "nothing", "cut off"]),
        (
            HEADER + force(9) + "".join(f"{k},,3,4\n" for k in range(1, 11)),
            ["line 11, column fx_n", "10 of 19"],
        ),
        (HEADER + force(9) + "0.0008,2,3,4\n", ["line 11, column t_s", "0.0008 after 0.0008", "larger"]),
        ((HEADER + force()).encode("utf-16"), ["UTF-16", "UTF-8"]),
    ],
)
def test_what_is_wrong_with_a_csv_signal_is_said_with_its_place(tmp_path, content, parts):
    message = failure(written(tmp_path, content))
    assert [part for part in parts if part not in message] == []


def test_the_message_begins_with_the_file(tmp_path):
    path = written(tmp_path, HEADER)
    with pytest.raises(FormatError) as caught:
        read(path, "force")
    assert str(caught.value).startswith(f"{path}: found 0 rows")


def test_a_point_number_of_a_path_is_whole(tmp_path):
    path = written(tmp_path, "point,pass,x_mm,y_mm,z_mm\n1,1,0,0,0\n2.5,1,0,0,0\n")
    assert "line 3, column point: found 2.5, expected a whole number" in failure(path, "path")


def test_a_file_that_is_not_there_is_said_to_be_so(tmp_path):
    assert "cannot be opened" in failure(tmp_path / "none.csv")


@pytest.mark.parametrize(("suffix", "title"), [(".tdms", "TDMS"), (".MAT", "MATLAB")])
def test_a_binary_format_that_does_not_start_as_one_is_refused(tmp_path, suffix, title):
    message = failure(written(tmp_path, "x", f"file{suffix}"))
    assert f"does not start as a {title} file, expected a force record" in message


def test_a_text_is_read_whatever_its_suffix_and_what_is_none_is_refused_with_what_can_be_read(tmp_path):
    assert len(read(written(tmp_path, HEADER + force(), "file.dat"), "force")) == 10
    message = failure(written(tmp_path, b"\x01\0\x07", "file.dat"))
    assert "no text" in message
    assert "Parquet" in message


def test_content_goes_before_the_suffix(tmp_path):
    path = tmp_path / "named.csv"
    example("force").to_parquet(path)
    assert len(read(path, "force")) == 12


def test_a_file_that_is_not_what_its_suffix_says_is_refused(tmp_path):
    message = failure(written(tmp_path, HEADER + force(), "signal.parquet"))
    assert "does not start as a Parquet file" in message


def test_a_cloud_is_not_a_force_record(tmp_path):
    message = failure(written(tmp_path, "ply\nformat ascii 1.0\n", "scan.ply"))
    assert "found a PLY file, expected a force record" in message


def test_parquet_faults_name_row_and_column(tmp_path):
    path, table = tmp_path / "a.parquet", example("force")
    table.loc[4, "fy_n"] = np.inf
    table.to_parquet(path)
    assert "row 5, column fy_n" in failure(path)
    table.assign(fy_n="x").to_parquet(path)
    assert "column fy_n: found values of type" in failure(path)
    table.drop(columns="t_s").to_parquet(path)
    assert "lacks the column t_s" in failure(path)
    path.write_bytes(b"PAR1 and no more")
    assert "not a readable Parquet file" in failure(path)


def test_parquet_integers_become_floats_and_nulls_are_found(tmp_path):
    path = tmp_path / "a.parquet"
    table = example("force").assign(fx_n=pd.array([*range(11), 7], dtype="Int64"))
    table.to_parquet(path)
    assert read(path, "force")["fx_n"].dtype == np.float64
    table.loc[3, "fx_n"] = pd.NA
    table.to_parquet(path)
    (note,) = read(path, "force").attrs["notes"]
    assert "row 4, column fx_n" in note.message
    table.loc[11, "fx_n"] = pd.NA
    table.to_parquet(path)
    assert "row 12, column fx_n: found nothing or NaN in the last row" in failure(path)


@pytest.mark.parametrize("kind", ["force", "robot", "joints", "poses"])
def test_a_row_that_lacks_a_value_is_a_lost_sample(tmp_path, kind):
    table, path = whole(example(kind, 40)), tmp_path / "table.csv"
    torn = table.copy()
    torn.loc[[0, 1, 17], table.columns[-1]] = np.nan
    torn.loc[18, table.columns[1]] = np.nan
    torn.to_csv(path, index=False)
    sniff(path, kind)
    found = read(path, kind)
    expected = table.drop(index=[0, 1, 17, 18]).reset_index(drop=True)
    pd.testing.assert_frame_equal(found, expected, rtol=1e-14)
    (note,) = found.attrs["notes"]
    assert (note.check, note.value, note.ok) == ("missing values", 4.0, False)
    assert f"4 of 40 rows lack a value (the first: line 2, column {table.columns[-1]})" in note.message


def test_a_fault_behind_lost_samples_is_named_by_its_own_line(tmp_path):
    path = written(
        tmp_path, HEADER + force(4) + "0.0004,,1,2\n" + force(20)[len(force(5)) :] + "0.001,1,2,3\n"
    )
    assert "line 22, column t_s: found 0.001 after 0.0019" in failure(path)


def test_a_record_may_begin_with_many_samples_that_lack_a_value(tmp_path):
    filling = "".join(f"{k * 1e-4:.4f},{k},{k},\n" for k in range(-30, 0))
    path = written(tmp_path, HEADER + filling + force(80))
    sniff(path, "force")
    assert len(read(path, "force")) == 80


def test_npz_gives_real_and_imaginary_part(tmp_path):
    frequency = np.arange(10.0)
    frf = (1.0 + frequency) * np.exp(-1j * frequency)
    np.savez(tmp_path / "h.npz", freq_hz=frequency, frf=frf, coherence=np.full(10, 0.9))
    table = read(tmp_path / "h.npz", "frf")
    np.testing.assert_array_equal(table["real"] + 1j * table["imag"], frf)
    np.testing.assert_array_equal(table["coherence"], 0.9)


def test_npz_faults_are_named(tmp_path):
    path = tmp_path / "h.npz"
    np.savez(path, freq_hz=np.arange(10.0))
    assert "lacks the array frf" in failure(path, "frf")
    np.savez(path, freq_hz=np.arange(10.0), frf=np.zeros(9, complex))
    assert "array frf: found shape (9,), expected (10,)" in failure(path, "frf")
    path.write_bytes(b"PK\x03\x04 and no more")
    assert "not a readable NumPy archive" in failure(path, "frf")


def test_only_the_0_hz_line_of_an_frf_may_be_undefined(tmp_path):
    lines = [f"{k},1,2" for k in range(10)]
    assert (
        len(read(written(tmp_path, "\n".join(["frequency_hz,real,imag", "0,nan,nan", *lines[1:]])), "frf"))
        == 10
    )
    lines[3] = "3,nan,2"
    message = failure(written(tmp_path, "\n".join(["frequency_hz,real,imag", *lines])), "frf")
    assert "line 5, column real" in message


def test_sniff_sees_faults_of_header_and_first_rows_and_does_not_read_on(tmp_path):
    sniff(written(tmp_path, HEADER + force(500) + "bad\n"), "force")
    assert "line 4, column fx_n" in failure(written(tmp_path, HEADER + force(2) + "1,x,1,1\n"), call=sniff)
    assert "lacks the column" in failure(written(tmp_path, "a,b\n1,2\n"), call=sniff)
    assert "found 0 rows" in failure(written(tmp_path, HEADER), call=sniff)
