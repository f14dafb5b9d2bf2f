"""Force records read piece by piece: the same samples, places and faults as read at once."""

import h5py
import nptdms
import numpy as np
import pandas as pd
import pytest
import scipy.io

from metro.formats import FormatError
from metro.formats.registry import read, read_pieces

COUNT = 1000
TIME = np.arange(COUNT) / 1e4
FORCE = np.random.default_rng(4).normal(size=(COUNT, 3)).round(6)
NAMES = ("fx_n", "fy_n", "fz_n")


def table(time=TIME, force=FORCE):
    return pd.DataFrame({"t_s": time, **dict(zip(NAMES, force.T, strict=True))})


def write_tdms(path, columns):
    """In segments of unlike lengths, as a recorder writes them that flushes now and then."""
    with nptdms.TdmsWriter(path) as writer:
        for first, last in ((0, 130), (130, 131), (131, 640), (640, len(columns))):
            some = columns.iloc[first:last]
            units = {"t_s": "s"} | dict.fromkeys(NAMES, "N")
            writer.write_segment(
                [nptdms.ChannelObject("log", n, some[n].to_numpy(), {"unit_string": units[n]}) for n in some]
            )


def write_dynoware(path, columns):
    head = "DynoWare\nTime\tFx\tFy\tFz\ns\tN\tN\tN\n"
    path.write_text(head + columns.to_csv(sep="\t", header=False, index=False))


def write_hdf5(path, columns):
    with h5py.File(path, "w", userblock_size=512) as file:
        for name in columns:
            file[name] = columns[name].to_numpy()[None]
            file[name].attrs["MATLAB_class"] = np.bytes_("double")
    with path.open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")


WRITERS = {
    "r.csv": lambda path, columns: columns.to_csv(path, index=False),
    "r.parquet": lambda path, columns: columns.to_parquet(path, row_group_size=170),
    "r.tdms": write_tdms,
    "dyno.txt": write_dynoware,
    "five.mat": lambda path, columns: scipy.io.savemat(path, {n: columns[n].to_numpy() for n in columns}),
    "seven.mat": write_hdf5,
}


@pytest.fixture(params=sorted(WRITERS))
def name(request):
    return request.param


@pytest.mark.parametrize("rows", [1000, 999, 333, 64])
def test_the_pieces_are_the_whole(tmp_path, name, rows):
    WRITERS[name](tmp_path / name, table())
    pieces = list(read_pieces(tmp_path / name, "force", rows))
    found, whole = pd.concat(pieces, ignore_index=True), read(tmp_path / name, "force")
    pd.testing.assert_frame_equal(found, whole)
    np.testing.assert_allclose(whole[list(NAMES)], FORCE, rtol=0, atol=1e-12)
    assert max(map(len, pieces)) <= rows
    assert len(pieces) >= COUNT / rows


@pytest.mark.parametrize("row", [100, 650])
def test_a_time_that_falls_is_found_within_a_piece_and_between_two(tmp_path, name, row):
    time = TIME.copy()
    time[row:] -= 5e-4
    WRITERS[name](tmp_path / name, table(time))
    with pytest.raises(FormatError) as whole:
        read(tmp_path / name, "force")
    with pytest.raises(FormatError) as pieces:
        list(read_pieces(tmp_path / name, "force", 50))
    assert pieces.value.message == whole.value.message
    assert f"found {time[row]:.9g} after {time[row - 1]:.9g}" in whole.value.message


def test_a_force_that_is_not_finite_is_named_by_its_row_in_the_file(tmp_path, name):
    force = FORCE.copy()
    force[777, 1] = np.inf
    WRITERS[name](tmp_path / name, table(force=force))
    with pytest.raises(FormatError) as whole:
        read(tmp_path / name, "force")
    with pytest.raises(FormatError, match=r"7[78]\d, column fy_n: found inf") as pieces:
        list(read_pieces(tmp_path / name, "force", 50))
    assert pieces.value.message == whole.value.message


def test_samples_that_lack_a_value_are_left_out_of_every_piece_and_the_last_one_is_needed(tmp_path, name):
    force = FORCE.copy()
    force[[49, 50, 777], 1] = np.nan
    WRITERS[name](tmp_path / name, table(force=force))
    pieces = list(read_pieces(tmp_path / name, "force", 50))
    found, kept = pd.concat(pieces, ignore_index=True), np.delete(np.arange(COUNT), [49, 50, 777])
    np.testing.assert_allclose(found[list(NAMES)], FORCE[kept], rtol=0, atol=1e-12)
    notes = [note for piece in pieces for note in piece.attrs.get("notes", ())]
    assert sum(note.value for note in notes) == 3.0
    force[-1, 2] = np.nan
    WRITERS[name](tmp_path / name, table(force=force))
    for call in (lambda path: read(path, "force"), lambda path: list(read_pieces(path, "force", 50))):
        with pytest.raises(FormatError, match="column fz_n: found nothing or NaN in the last row"):
            call(tmp_path / name)


def test_seven_samples_are_no_record(tmp_path, name):
    WRITERS[name](tmp_path / name, table(TIME[:7], FORCE[:7]))
    with pytest.raises(FormatError, match="found 7 rows, expected at least 8"):
        list(read_pieces(tmp_path / name, "force", 2))
