"""MATLAB files: v5 to v7 as SciPy writes them and by hand, v7.3 as HDF5 with MATLAB's marks."""

import struct
import tracemalloc
import zlib

import h5py
import numpy as np
import pytest
from corpus_matlab import matlab73
from scipy.io import savemat

from metro.formats import FormatError
from metro.formats.registry import read, read_frfs, sniff

N = 12
TIME = np.arange(N) * 1e-3
FORCE = {"t_s": TIME, "fx_n": np.arange(N) + 0.25, "fy_n": -np.arange(N) * 2.0, "fz_n": np.arange(N) ** 2 / 8}
WRITERS = {
    "v6": savemat,
    "v7": lambda path, content: savemat(path, content, do_compression=True),
    "v7.3": matlab73,
}
every_version = pytest.mark.parametrize("version", WRITERS)


def written(tmp_path, version, content):
    path = tmp_path / "signal.mat"
    WRITERS[version](path, content)
    return path


def failure(path, kind="force"):
    for call in (sniff, read):
        with pytest.raises(FormatError) as caught:
            call(path, kind)
        assert caught.value.path == path
    return caught.value.message


def check(path):
    sniff(path, "force")
    table = read(path, "force")
    assert list(table) == list(FORCE)
    for name, values in FORCE.items():
        np.testing.assert_allclose(table[name], values, rtol=1e-14)


@every_version
def test_vectors_are_columns_whichever_way_they_stand_and_others_are_passed_over(tmp_path, version):
    content = {
        **FORCE,
        "fx_n": FORCE["fx_n"][:, None],
        "fy_n": FORCE["fy_n"].astype(np.int16),
        "fz_n": FORCE["fz_n"].astype(np.float32),
    }
    check(written(tmp_path, version, {**content, "remark": "hello", "A": np.ones((3, 4)), "flag": True}))


@every_version
def test_fields_of_a_structure_are_columns_and_units_stand_in_another(tmp_path, version):
    found = {"Time": TIME * 1e3, "Fx": FORCE["fx_n"] / 1e3, "Fy": FORCE["fy_n"], "fz_n": FORCE["fz_n"]}
    units = {"Time": "ms", "Fx": "kN", "Fy": "N"}
    check(written(tmp_path, version, {"cut": found, "units": units}))
    check(written(tmp_path, version, {"cut": {**found, "units": units}}))


@pytest.mark.parametrize("version", ["v6", "v7"])
def test_cells_objects_and_sparse_matrices_are_passed_over(tmp_path, version):
    from scipy.sparse import eye_array

    cell = np.array(["a", np.ones(3)], dtype=object)
    many = np.zeros(2, [("a", object), ("b", object)])
    check(written(tmp_path, version, {"c": cell, "many": many, "s": eye_array(3).tocsc(), **FORCE}))


@every_version
@pytest.mark.parametrize(
    ("change", "parts"),
    [
        ({"fy_n": None}, ["lacks the column fy_n", "fx_n, fz_n", "expected t_s, fx_n"]),
        ({"fy_n": None, "Fy": TIME}, ["variable Fy, column fy_n", "''", "N or kN", "name it fy_n"]),
        (
            {"fy_n": None, "Fy": TIME, "units": {"Fy": "oz"}},
            ["variable Fy, column fy_n", "'oz'", "N or kN"],
        ),
        ({"units": {"fy_n": "kN"}}, ["variable fy_n", "'kN'", "expected N as its name says"]),
        ({"cut": {"fy_n": TIME}}, ["column fy_n: found 2 times"]),
        ({"fy_n": TIME[:5]}, ["variable fy_n", "found 5 values", "expected 12"]),
        ({"fy_n": np.ones((N, 2))}, ["variable fy_n", "expected a vector"]),
        ({"fy_n": TIME + 1j}, ["variable fy_n (complex numbers), column fy_n", "no real numbers"]),
        ({"t_s": TIME[::-1]}, ["sample 2, column t_s", "expected a larger value"]),
        ({"fz_n": np.where(TIME == 0.004, np.inf, 1)}, ["sample 5, column fz_n", "inf"]),
    ],
)
def test_what_is_wrong_with_a_variable_is_said_with_its_name(tmp_path, version, change, parts):
    content = {name: each for name, each in {**FORCE, **change}.items() if each is not None}
    message = failure(written(tmp_path, version, content))
    assert [part for part in parts if part not in message] == []


@every_version
def test_empty_variables_are_told_as_such(tmp_path, version):
    path = written(tmp_path, version, dict.fromkeys(FORCE, np.zeros((0, 0))))
    with pytest.raises(FormatError, match="found 0 rows, expected at least"):
        read(path, "force")


@every_version
@pytest.mark.parametrize("share", [0.03, 0.3, 0.6, 0.9, 0.999])
def test_a_file_that_is_cut_off_is_refused_wherever_it_is_cut(tmp_path, version, share):
    path = written(tmp_path, version, {name: np.tile(each, 40) + 0.0 for name, each in FORCE.items()})
    data = path.read_bytes()
    path.write_bytes(data[: int(len(data) * share)])
    assert "ends early" in failure(path)


@every_version
def test_an_frf_may_stand_in_its_columns(tmp_path, version):
    frf = {"frequency_hz": np.arange(1.0, 13.0), "real": TIME, "imag": -TIME}
    (found,) = read_frfs(written(tmp_path, version, frf))
    np.testing.assert_array_equal(found.table["imag"], -TIME)
    assert (found.reference, found.unit) == ("", "")


def element(kind, data, order="<"):
    return struct.pack(order + "II", kind, len(data)) + data + bytes(-len(data) % 8)


def matrix(name, array, order="<", *, stored=None, cls=6):
    """Return a matrix as the specification describes it, its numbers stored in a type."""
    array = np.asarray(array).reshape(1, -1)
    code = {"u1": 2, "i2": 3, "f8": 9}[stored or "f8"]
    parts = [
        element(6, struct.pack(order + "II", cls, 0), order),
        element(5, struct.pack(order + "ii", *array.shape), order),
        element(1, name.encode(), order),
        element(code, array.astype(order + (stored or "f8")).tobytes(), order),
    ]
    return element(14, b"".join(parts), order)


def head(order="<"):
    return b"MATLAB 5.0 MAT-file, by hand".ljust(124) + struct.pack(order + "HH", 0x100, 0x4D49)


@pytest.mark.parametrize("order", ["<", ">"])
def test_either_byte_order_and_numbers_stored_in_a_smaller_type_are_read(tmp_path, order):
    path = tmp_path / "signal.mat"
    whole = np.arange(N)
    parts = [matrix("t_s", TIME, order), matrix("fx_n", whole, order, stored="u1")]
    parts += [matrix("fy_n", -whole, order, stored="i2"), matrix("fz_n", whole / 4, order)]
    path.write_bytes(head(order) + b"".join(parts))
    table = read(path, "force")
    np.testing.assert_array_equal(table.to_numpy(), np.column_stack([TIME, whole, -whole, whole / 4]))


def test_a_table_of_matlab_is_named_with_what_it_is(tmp_path):
    path = tmp_path / "signal.mat"
    flags = element(6, struct.pack("<II", 17, 0))
    opaque = element(14, flags + element(1, b"fx_n") + element(1, b"MCOS") + element(1, b"table"))
    path.write_bytes(head() + opaque + b"".join(matrix(name, TIME) for name in ("t_s", "fy_n", "fz_n")))
    assert "variable fx_n (table or object), column fx_n: found no real numbers" in failure(path)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (struct.pack("<ii", 1, N), struct.pack("<ii", 1, N - 1)),
        (struct.pack("<ii", 1, N), struct.pack("<ii", -1, -N)),
        (struct.pack("<II", 9, 8 * N), struct.pack("<II", 9, 8 * N + 4096)),
        (struct.pack("<II", 9, 8 * N), struct.pack("<II", 8, 8 * N)),
        (matrix("t_s", TIME)[:8], struct.pack("<II", 14, 0xFFFFFFF0)),
    ],
)
def test_damage_is_told(tmp_path, old, new):
    path = tmp_path / "signal.mat"
    data = head() + b"".join(matrix(name, values) for name, values in FORCE.items())
    path.write_bytes(data.replace(old, new))
    assert path.read_bytes() != data
    assert "damaged" in failure(path)


def test_a_small_archive_that_unpacks_to_too_much_is_refused_before_it_is_unpacked(tmp_path, monkeypatch):
    monkeypatch.setattr("metro.formats.matlab_file.LARGEST", 1 << 22)
    monkeypatch.setattr("metro.formats.limits.check_unpacked.__defaults__", (1 << 22,))
    packed = zlib.compress(matrix("t_s", np.zeros(1 << 22)))
    path = tmp_path / "signal.mat"
    path.write_bytes(head() + struct.pack("<II", 15, len(packed)) + packed)
    assert len(packed) < 1 << 16
    tracemalloc.start()
    assert "unpacks to" in failure(path)
    assert tracemalloc.get_traced_memory()[1] < 1 << 24
    tracemalloc.stop()


def test_hdf5_that_claims_more_than_any_recording_is_refused(tmp_path):
    path = tmp_path / "signal.mat"
    with h5py.File(path, "w") as file:
        for name in FORCE:
            file.create_dataset(name, shape=(1 << 34,), dtype="f8", chunks=(1024,))
    assert path.stat().st_size < 1 << 16
    assert "unpacks to" in failure(path)


def test_hdf5_that_points_to_other_files_is_refused(tmp_path):
    secret = tmp_path / "secret"
    np.arange(float(N)).tofile(secret)
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["fx_n"] = TIME
    for number in range(3):
        path = tmp_path / f"signal{number}.mat"
        with h5py.File(path, "w") as file:
            for name in ("t_s", "fy_n", "fz_n"):
                file[name] = FORCE[name]
            if number == 0:
                file["fx_n"] = h5py.ExternalLink(str(tmp_path / "other.h5"), "fx_n")
            elif number == 1:
                file.create_dataset("fx_n", (N,), "f8", external=[(str(secret), 0, 8 * N)])
            else:
                layout = h5py.VirtualLayout((N,), "f8")
                layout[:] = h5py.VirtualSource(str(tmp_path / "other.h5"), "fx_n", (N,))
                file.create_virtual_dataset("fx_n", layout)
        message = failure(path)
        assert "variable fx_n" in message
        assert "expected" in message


def test_hdf5_groups_that_hold_one_another_end(tmp_path):
    path = tmp_path / "signal.mat"
    with h5py.File(path, "w") as file:
        group = file.create_group("a")
        for number in range(300):
            group[f"g{number}"] = group
    assert "found more than 10000 variables" in failure(path)
