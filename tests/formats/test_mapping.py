"""A file that is not in the contract's own form, mapped, gives exactly what that form gives."""

import gzip

import h5py
import nptdms
import numpy as np
import pandas as pd
import pytest
import scipy.io

from metro.formats import FormatError
from metro.formats.mapping import Source, mapping_of
from metro.formats.registry import read, read_frfs, read_pieces, sniff

RATE = 10_000.0
_RANDOM = np.random.default_rng(5)
OWN = pd.DataFrame(
    {"t_s": np.arange(40) / RATE, **{f"f{axis}_n": _RANDOM.normal(size=40) * 100 for axis in "xyz"}}
)
SAME = {f"f{axis}_n": {"from": f"K {axis}", "unit": "N"} for axis in "xyz"}


def source(path, record="", **given):
    return Source(path, record, mapping_of('files."*"', given))


def failure(one, kind="force"):
    with pytest.raises(FormatError) as caught:
        read(one, kind)
    return caught.value.message


def theirs(columns="xyz"):
    """The forces under another program's names."""
    return {f"K {axis}": OWN[f"f{axis}_n"].to_numpy() for axis in columns}


def as_text(tmp_path, separator, decimal=".", before="Rig 7\nsensor 9257B\n", name="a.dat"):
    rows = pd.DataFrame(theirs()).to_csv(sep=separator, index=False, decimal=decimal)
    (tmp_path / name).write_text(before + rows)
    return source(tmp_path / name, rate_hz=RATE, columns=SAME)


def as_mat(tmp_path):
    scipy.io.savemat(
        tmp_path / "a.mat", {f"K{axis}_7": OWN[f"f{axis}_n"] for axis in "xyz"} | {"Kx_8": [1.0]}
    )
    columns = {f"f{axis}_n": {"from": f"K{axis}_{{record}}", "unit": "N"} for axis in "xyz"}
    return source(tmp_path / "a.mat", "7", rate_hz=RATE, columns=columns)


def as_mat_of_a_matrix(tmp_path):
    scipy.io.savemat(tmp_path / "a.mat", {"data": OWN[["fx_n", "fy_n", "fz_n"]].to_numpy()})
    columns = {f"f{axis}_n": {"from": f"data[{k}]", "unit": "N"} for k, axis in enumerate("xyz", 1)}
    return source(tmp_path / "a.mat", rate_hz=RATE, columns=columns)


def as_hdf5_of_a_matrix(tmp_path):
    with h5py.File(tmp_path / "a.mat", "w") as file:
        file["data"] = OWN[["fx_n", "fy_n", "fz_n"]].to_numpy().T  # as MATLAB stores the transpose
    columns = {f"f{axis}_n": {"from": f"data[{k}]", "unit": "N"} for k, axis in enumerate("xyz", 1)}
    return source(tmp_path / "a.mat", rate_hz=RATE, columns=columns)


def as_npz(tmp_path):
    np.savez(tmp_path / "a.npz", **theirs())
    return source(tmp_path / "a.npz", rate_hz=RATE, columns=SAME)


def as_parquet(tmp_path):
    pd.DataFrame(theirs()).to_parquet(tmp_path / "a.parquet")
    return source(tmp_path / "a.parquet", rate_hz=RATE, columns=SAME)


def as_tdms(tmp_path):
    with nptdms.TdmsWriter(tmp_path / "a.tdms") as writer:
        for name, values in theirs().items():
            writer.write_segment([nptdms.ChannelObject("Cut", name, values)])
    return source(tmp_path / "a.tdms", rate_hz=RATE, columns=SAME)


def as_two_files(tmp_path):
    as_text(tmp_path, ",")
    (tmp_path / "z_3.csv").write_text("\n".join(map(repr, OWN["fz_n"].tolist())))
    columns = {**SAME, "fz_n": {"file": "z_{record}.csv", "from": 1, "unit": "N"}}
    return source(tmp_path / "a.dat", "3", rate_hz=RATE, columns=columns)


CONTAINERS = {
    "commas": lambda folder: as_text(folder, ","),
    "tabs": lambda folder: as_text(folder, "\t"),
    "semicolons and decimal commas": lambda folder: as_text(folder, ";", ","),
    "MATLAB, several records": as_mat,
    "MATLAB, a matrix": as_mat_of_a_matrix,
    "MATLAB 7.3, a matrix": as_hdf5_of_a_matrix,
    "NumPy archive": as_npz,
    "Parquet": as_parquet,
    "TDMS": as_tdms,
    "two files": as_two_files,
}


@pytest.mark.parametrize("make", CONTAINERS.values(), ids=CONTAINERS)
def test_a_mapped_file_gives_the_numbers_that_the_contract_s_own_form_gives(tmp_path, make):
    OWN.to_csv(tmp_path / "own.csv", index=False)
    mapped = make(tmp_path)
    sniff(mapped, "force")
    pd.testing.assert_frame_equal(
        read(mapped, "force"), read(tmp_path / "own.csv", "force"), check_exact=True
    )
    pieces = pd.concat(read_pieces(mapped, "force", 7), ignore_index=True)
    pd.testing.assert_frame_equal(pieces, OWN, check_exact=True)


def test_a_text_may_be_packed_by_gzip(tmp_path):
    one = as_text(tmp_path, "\t")
    (tmp_path / "a.dat.gz").write_bytes(gzip.compress(one.path.read_bytes()))
    packed = source(tmp_path / "a.dat.gz", rate_hz=RATE, columns=SAME)
    pd.testing.assert_frame_equal(read(packed, "force"), OWN, check_exact=True)


def test_columns_without_names_are_numbered_and_the_first_row_may_be_stated(tmp_path):
    rows = OWN.assign(n=np.arange(1, 41)).to_csv(index=False, header=False)
    (tmp_path / "a.txt").write_text("9,9,9,9,9\n" + rows)
    columns = {"t_s": {"from": 1, "unit": "s"}} | {
        f"f{axis}_n": {"from": k, "unit": "N"} for k, axis in enumerate("xyz", 2)
    }
    found = read(source(tmp_path / "a.txt", start_row=2, columns=columns), "force")
    pd.testing.assert_frame_equal(found, OWN, check_exact=True)


@pytest.mark.parametrize(
    ("column", "given", "factor"),
    [
        ("fx_n", {"unit": "kN"}, 1e3),
        ("fx_n", {"unit": "N", "scale": -1}, -1.0),
        ("fx_n", {"unit": "V", "sensitivity": "200 N/V"}, 200.0),
        ("fx_n", {"unit": "mV", "sensitivity": "2 mV/N"}, 0.5),
        ("fx_n", {"unit": "V", "sensitivity": "-5 mV/lbf", "scale": 2}, -2 * 1000 / 5 * 4.4482216152605),
        ("t_s", {"unit": "ms"}, 1e-3),
    ],
)
def test_units_signs_scales_and_sensitivities(tmp_path, column, given, factor):
    table = OWN.rename(columns={column: "raw"})
    table.to_csv(tmp_path / "a.csv", index=False)
    found = read(source(tmp_path / "a.csv", columns={column: {"from": "raw", **given}}), "force")
    np.testing.assert_allclose(found[column], factor * OWN[column], rtol=1e-14)


@pytest.mark.parametrize(
    ("given", "unit", "factor"),
    [
        ({"unit": "g"}, "g", 1.0),
        ({"unit": "cm/s2"}, "m/s2", 0.01),
        ({"unit": "V", "sensitivity": "10 mV/g"}, "g", 100.0),
        ({"unit": "V", "sensitivity": "10 mV/(m/s²)"}, "m/s2", 100.0),
        ({"unit": "µm"}, "m", 1e-6),
        ({"unit": "inch"}, "m", 0.0254),
        ({"unit": "mm/s"}, "m/s", 1e-3),
    ],
)
def test_a_response_comes_in_a_unit_that_impacts_csv_can_name(tmp_path, given, unit, factor):
    table = pd.DataFrame({"t_s": OWN["t_s"], "force_n": OWN["fx_n"], "acc": OWN["fy_n"]})
    table.to_csv(tmp_path / "a.csv", index=False)
    found = read(source(tmp_path / "a.csv", columns={"response": {"from": "acc", **given}}), "record")
    assert found.attrs["response_unit"] == unit
    np.testing.assert_allclose(found["response"], factor * table["acc"], rtol=1e-14)


def test_an_frf_of_complex_numbers_in_g_per_newton(tmp_path):
    values = _RANDOM.normal(size=30) + 1j * _RANDOM.normal(size=30)
    scipy.io.savemat(tmp_path / "a.mat", {"H": values})
    columns = {part: {"from": f"H.{part}", "unit": "g/N"} for part in ("real", "imag")}
    (found,) = read_frfs(source(tmp_path / "a.mat", resolution_hz=0.5, columns=columns))
    assert found.unit == "g"
    np.testing.assert_array_equal(found.table["frequency_hz"], np.arange(30) * 0.5)
    np.testing.assert_array_equal(found.table["real"] + 1j * found.table["imag"], values)


def test_a_scan_in_inches(tmp_path):
    points = _RANDOM.normal(size=(20, 3))
    vertices = "".join("{} {} {}\n".format(*map(repr, row)) for row in points.tolist())
    kinds = "".join(f"property double {axis}\n" for axis in "xyz")
    (tmp_path / "a.ply").write_text(
        f"ply\nformat ascii 1.0\nelement vertex 20\n{kinds}end_header\n{vertices}"
    )
    columns = {f"{axis}_mm": {"unit": "inch"} for axis in "xyz"}
    np.testing.assert_array_equal(read(source(tmp_path / "a.ply", columns=columns), "cloud"), points * 25.4)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (
            {"fx_n": {"from": "K X1", "unit": "N"}},
            ["columns.fx_n", '"K X1"', 'did you mean "K x"', "K y, K z"],
        ),
        ({"fx_n": {"from": 9, "unit": "N"}}, ["columns.fx_n", "asks for column 9", "has 3", "K x, K y"]),
        ({"fx_n": "K x"}, ["columns.fx_n", "no unit", "N, kN"]),
        ({"fx_n": {"from": "K x", "unit": "V"}}, ["columns.fx_n", "unit V", "sensitivity", "200 N/V"]),
        ({"fx_n": {"from": "K x", "unit": "bar"}}, ["columns.fx_n", "'bar'", "N, kN"]),
        ({"fx_n": {"from": "K {record}", "unit": "N"}}, ["asks for one record", "a.dat#1"]),
        ({"fx_n": {"file": "b.csv", "from": 1, "unit": "N"}}, ["b.csv is not there", "beside a.dat"]),
    ],
)
def test_a_wrong_mapping_is_said_with_its_key_the_file_and_what_it_has(tmp_path, change, says):
    one = as_text(tmp_path, ",")
    message = failure(source(one.path, rate_hz=RATE, columns={**SAME, **change}))
    assert [part for part in ["batch.yaml", 'files."*"', *says] if part not in message] == []


def test_a_file_without_time_asks_for_its_rate(tmp_path):
    message = failure(source(as_text(tmp_path, ",").path, columns=SAME))
    assert "says nothing of t_s" in message
    assert "rate_hz" in message


def test_a_record_that_is_not_there_lists_those_that_are(tmp_path):
    one = as_mat(tmp_path)
    message = failure(Source(one.path, "6", one.mapping))
    assert 'found no "Kx_6"' in message
    assert "it has the records 7, 8" in message


def test_a_record_without_a_place_for_it_in_the_mapping_is_refused(tmp_path):
    one = as_text(tmp_path, ",")
    assert "names the record 3" in failure(Source(one.path, "3", one.mapping))


@pytest.mark.parametrize("header", ["Time [ms],Fx [kN],Fy (N),force_z_N", "Time_ms,fx_kN,Fy_N,Fz [N]"])
@pytest.mark.parametrize("suffix", [".csv", ".parquet", ".dat"])
def test_names_may_state_their_units(tmp_path, header, suffix):
    table = (OWN / [1e-3, 1e3, 1, 1]).set_axis(header.split(","), axis=1)
    path = tmp_path / f"a{suffix}"
    table.to_parquet(path) if suffix == ".parquet" else table.to_csv(path, index=False)
    pd.testing.assert_frame_equal(read(path, "force"), OWN, rtol=1e-14)


def test_a_column_under_another_spelling_is_proposed(tmp_path):
    OWN.rename(columns={"fx_n": "f_x_n"}).to_csv(tmp_path / "a.csv", index=False)
    assert 'did you mean "f_x_n" for fx_n?' in failure(tmp_path / "a.csv")


def test_a_labview_measurement_is_a_text_like_others(tmp_path):
    end = "***End_of_Header***\t\t\t\t\n"
    header = f"LabVIEW Measurement\t\nSeparator\tTab\n{end}\nChannels\t3\t\t\t\n{end}"
    rows = pd.DataFrame({"X_Value": OWN["t_s"], **theirs(), "Comment": ""})
    (tmp_path / "a.lvm").write_text(header + rows.to_csv(sep="\t", index=False))
    columns = {**SAME, "t_s": {"from": "X_Value", "unit": "s"}}
    pd.testing.assert_frame_equal(
        read(source(tmp_path / "a.lvm", columns=columns), "force"), OWN, check_exact=True
    )
