"""Universal files: what is written comes back, and the variants of other programs are read."""

from pathlib import Path

import numpy as np
import pytest

from metro.formats import FormatError
from metro.formats.registry import read, read_frfs, sniff
from metro.formats.uff import FRF, Function, read_functions
from metro.formats.uff_writer import universal_file

DF = 0.01953125


def functions(count=2001, first=1, df=DF):
    rng = np.random.default_rng(0)
    frequency = df * (first + np.arange(count))
    values = rng.normal(size=(3, count)) * 1e-7 + 1j * rng.normal(size=(3, count)) * 1e-7
    pairs = [("1x", "1x", "m"), ("1x", "7z", "m/s"), ("12y", "3y", "m/s2")]
    return [Function(FRF, *pair, frequency, v) for pair, v in zip(pairs, values, strict=True)]


@pytest.mark.parametrize("binary", [True, False])
@pytest.mark.parametrize("count", [2000, 2001, 9])
def test_what_is_written_comes_back(tmp_path, binary, count):
    given = functions(count)
    (tmp_path / "a.uff").write_bytes(universal_file(given, binary=binary))
    found = read_functions(tmp_path / "a.uff")
    assert [(f.kind, f.reference, f.response, f.unit) for f in found] == [
        (f.kind, f.reference, f.response, f.unit) for f in given
    ]
    for one, other in zip(found, given, strict=True):
        np.testing.assert_array_equal(one.frequency, other.frequency)
        np.testing.assert_allclose(one.values, other.values, rtol=0 if binary else 1e-11, atol=0)


@pytest.mark.parametrize("df", [DF, 1 / 3, 0.2048, 51200 / 65536, 1.0])
@pytest.mark.parametrize("first", [0, 1, 1023])
def test_a_step_of_six_digits_becomes_the_rate_over_the_samples_again(tmp_path, df, first):
    given = functions(4001, first, df)
    (tmp_path / "a.uff").write_bytes(universal_file(given))
    found = read_functions(tmp_path / "a.uff")[0]
    np.testing.assert_allclose(found.frequency, given[0].frequency, rtol=1e-12)


def test_uneven_lines_are_written_out_in_full(tmp_path):
    frequency = np.sort(np.random.default_rng(1).uniform(10, 20, 33))
    given = Function(FRF, "1x", "2x", "m", frequency, np.exp(1j * frequency))
    (tmp_path / "a.uff").write_bytes(universal_file([given]))
    np.testing.assert_array_equal(read_functions(tmp_path / "a.uff")[0].frequency, frequency)
    (tmp_path / "b.uff").write_bytes(universal_file([given], binary=False))
    np.testing.assert_allclose(read_functions(tmp_path / "b.uff")[0].frequency, frequency, atol=1e-4)


def test_single_precision_abscissae_before_double_values_are_told_by_the_size(tmp_path):
    frequency = np.array([1.0, 2.5, 2.75, 4.0, 8.0, 9.5])
    (tmp_path / "a.uff").write_bytes(
        universal_file([Function(FRF, "1x", "2x", "m", frequency, np.exp(1j * frequency))])
    )
    text = (tmp_path / "a.uff").read_bytes()
    table = np.stack([frequency, np.cos(frequency), np.sin(frequency)], axis=1)
    rows = [row[:1].astype("<f4").tobytes() + row[1:].astype("<f8").tobytes() for row in table]
    assert table.astype("<f8").tobytes() in text
    (tmp_path / "a.uff").write_bytes(text.replace(table.astype("<f8").tobytes(), b"".join(rows)))
    (found,) = read_functions(tmp_path / "a.uff")
    np.testing.assert_array_equal(found.frequency, frequency)
    np.testing.assert_allclose(found.values, np.exp(1j * frequency), rtol=1e-15)


@pytest.mark.parametrize("binary", [True, False])
def test_carriage_returns_before_the_end_marks_change_nothing(tmp_path, binary):
    given = functions(17)
    (tmp_path / "a.uff").write_bytes(universal_file(given, binary=binary))
    text = (tmp_path / "a.uff").read_bytes()
    text = text.replace(b"\n    -1\n", b"\r\n    -1\r\n") if binary else text.replace(b"\n", b"\r\n")
    (tmp_path / "a.uff").write_bytes(text)
    found = read_functions(tmp_path / "a.uff")
    assert len(found) == 3
    np.testing.assert_allclose(found[2].values, given[2].values, rtol=1e-11)


def test_an_end_mark_right_after_binary_data_and_one_too_many_are_taken(tmp_path):
    given = functions(17)
    (tmp_path / "a.uff").write_bytes(universal_file(given))
    text = (tmp_path / "a.uff").read_bytes()
    (tmp_path / "a.uff").write_bytes(
        b"    -1\n" + text[:164] + text[164:].replace(b"\n    -1\n", b"    -1\n")
    )
    assert len(read_functions(tmp_path / "a.uff")) == 3


def test_binary_data_that_look_like_an_end_mark_are_data(tmp_path):
    hidden = np.frombuffer(b"\n    -1\n    -1\n ", dtype="<f8")
    values = np.full(8, hidden[0] + 1j * hidden[1])
    given = Function(FRF, "1x", "1x", "m", np.arange(8.0), values)
    (tmp_path / "a.uff").write_bytes(universal_file([given, given]))
    assert [len(f.values) for f in read_functions(tmp_path / "a.uff")] == [8, 8]


def line(form, *values):
    return form.format(*values) + "\n"


def single_precision(tmp_path, rsp=-3, units=(1.0, 1.0), kind=5):
    """A text dataset as SDRC prints it: six columns of 13."""
    values = [-1.5e-7, -2.5e-7, 3e-7, -4e-7, 5e-7, 6e-7, 7e-7, 8e-7]
    printed = [f"{value:13.5E}" for value in values]
    body = "".join(printed[:6]) + "\n" + "".join(printed[6:]) + "\n"
    text = "    -1\n   164\n" + line("{:10d}{:<20}{:10d}", 5, "mm (milli-newton)", 2)
    text += "".join(f"{u:25.17E}".replace("E", "D") for u in (*units, 1.0)) + "\n"
    text += f"{0.0:25.17E}\n".replace("E", "D") + "    -1\n    -1\n    58\n" + 5 * "NONE\n"
    text += f"    4         0    1         0 NONE               7{rsp:4d} NONE               1   1\n"
    text += line("{:10d}{:10d}{:10d}{:13.5E}{:13.5E}{:13.5E}", kind, 4, 1, 2.0, 0.5, 0.0)
    for code in (18, 8, 13, 0):
        text += line("{:10d}{:5d}{:5d}{:5d} {:<20} {:<20}", code, 0, 0, 0, "NONE", "NONE")
    path = tmp_path / "single.unv"
    path.write_text(text + body + "    -1\n")
    return path


def test_fixed_columns_and_a_negative_direction(tmp_path):
    (found,) = read_functions(single_precision(tmp_path))
    assert (found.reference, found.response, found.unit) == ("1x", "7z", "m")
    np.testing.assert_allclose(found.frequency, [2.0, 2.5, 3.0, 3.5])
    np.testing.assert_allclose(-found.values[:2], [-1.5e-7 - 2.5e-7j, 3e-7 - 4e-7j])


def test_units_of_the_file_become_si(tmp_path):
    (si,) = read_functions(single_precision(tmp_path, rsp=3))
    (found,) = read_functions(
        single_precision(tmp_path, rsp=3, units=(1000.0, 1.0))
    )  # millimetres per newton
    np.testing.assert_allclose(found.values, si.values / 1000.0)


def test_a_rotation_and_data_that_end_early_are_named(tmp_path):
    with pytest.raises(FormatError, match=r"dataset 2 \(58\).*found direction 4, expected a translation"):
        read_functions(single_precision(tmp_path, rsp=4))
    path = single_precision(tmp_path)
    path.write_text(path.read_text().replace("  7.00000E-07  8.00000E-07\n", ""))
    with pytest.raises(FormatError, match="found 6 numbers, expected 8"):
        read_functions(path)


def test_binary_data_that_end_early_are_named(tmp_path):
    (tmp_path / "a.uff").write_bytes(universal_file(functions(100)[:1]))
    (tmp_path / "a.uff").write_bytes((tmp_path / "a.uff").read_bytes()[:-900])
    with pytest.raises(FormatError, match="no end mark"):
        read_functions(tmp_path / "a.uff")


def test_the_registry_reads_a_universal_file_by_its_content(tmp_path):
    given = functions(64)
    (tmp_path / "a.unv").write_bytes(universal_file(given))
    sniff(tmp_path / "a.unv", "frf")
    table = read(tmp_path / "a.unv", "frf")
    np.testing.assert_array_equal(table["real"], given[0].values.real)
    assert [(f.reference, f.response, f.unit) for f in read_frfs(tmp_path / "a.unv")] == [
        ("1x", "1x", "m"),
        ("1x", "7z", "m/s"),
        ("12y", "3y", "m/s2"),
    ]
    np.testing.assert_array_equal(read_frfs(tmp_path / "a.unv")[1].table["imag"], given[1].values.imag)


def test_coherence_stands_beside_its_response(tmp_path):
    given = functions(32)
    coherence = Function(6, "1x", "7z", "", given[1].frequency, np.linspace(0.5, 1, 32) + 0j)
    (tmp_path / "a.uff").write_bytes(universal_file([*given, coherence]))
    tables = [f.table for f in read_frfs(tmp_path / "a.uff")]
    assert ["coherence" in table for table in tables] == [False, True, False]
    np.testing.assert_array_equal(tables[1]["coherence"], coherence.values.real)


def test_a_list_of_points_that_starts_with_minus_one_is_no_universal_file(tmp_path):
    path: Path = tmp_path / "cloud.xyz"
    path.write_text("".join(f"-1 {i} {i * i}\n" for i in range(5)))
    assert len(read(path, "cloud")) == 5


def test_an_independent_reader_reads_what_is_written(tmp_path):
    pyuff = pytest.importorskip("pyuff", reason="pyuff is not installed (development only)")
    given = functions(101)
    for binary in (True, False):
        (tmp_path / "a.uff").write_bytes(universal_file(given, binary=binary))
        sets = [each for each in pyuff.UFF(str(tmp_path / "a.uff")).read_sets() if each["type"] == 58]
        assert [(s["rsp_node"], s["rsp_dir"], s["ref_node"], s["ref_dir"]) for s in sets] == [
            (1, 1, 1, 1),
            (7, 3, 1, 1),
            (3, 2, 12, 2),
        ]
        for each, function in zip(sets, given, strict=True):
            np.testing.assert_allclose(each["data"][:101], function.values, rtol=1e-11)
            np.testing.assert_allclose(each["x"][:101], function.frequency, atol=1e-4)


def test_what_an_independent_writer_writes_is_read(tmp_path):
    pyuff = pytest.importorskip("pyuff", reason="pyuff is not installed (development only)")
    given = functions(101)[1]
    for binary in (0, 1):
        prepared = pyuff.prepare_58(
            binary=binary,
            func_type=4,
            rsp_node=7,
            rsp_dir=3,
            ref_node=1,
            ref_dir=1,
            data=given.values,
            x=given.frequency,
            abscissa_spacing=1,
            id1="NONE",
            rsp_ent_name="NONE",
            ref_ent_name="NONE",
            abscissa_spec_data_type=18,
            ordinate_spec_data_type=11,
            orddenom_spec_data_type=13,
        )
        pyuff.UFF(str(tmp_path / "a.uff")).write_sets([prepared], "add")
        found = read_functions(tmp_path / "a.uff")[-1]
        assert (found.reference, found.response, found.unit) == ("1x", "7z", "m/s")
        np.testing.assert_allclose(found.values, given.values, rtol=1e-11)
        np.testing.assert_array_equal(found.frequency, given.frequency)


@pytest.mark.parametrize("count", [0, -1])
def test_a_function_of_no_values_is_refused(tmp_path, count):
    path = single_precision(tmp_path)
    text = path.read_text()
    path.write_text(text.replace(line("{:10d}{:10d}", 5, 4).rstrip("\n"), f"{5:10d}{count:10d}", 1))
    with pytest.raises(FormatError, match=rf"dataset 2 \(58\).*found a count of {count} values"):
        read_functions(path)
