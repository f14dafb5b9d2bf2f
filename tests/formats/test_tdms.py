"""TDMS files, made by hand after the specification, and the one that it prints."""

import struct

import numpy as np
import pytest
from corpus_tdms import halves, index, lead_in, segment, text, values

from metro.formats import FormatError
from metro.formats.registry import read, sniff

N = 12
TIME = np.arange(N) * 1e-3
FORCES = {"Fx": np.arange(N) + 0.25, "Fy": -np.arange(N) * 2.0, "Fz": np.arange(N) ** 2 / 8}
NEWTONS = {"unit_string": "N"}
WAVE = {"unit_string": "N", "wf_increment": 1e-3, "wf_start_offset": 0.5}


def written(tmp_path, *segments):
    path = tmp_path / "signal.tdms"
    path.write_bytes(b"".join(segments))
    return path


def failure(path, kind="force"):
    said = []
    for call in (sniff, read):
        with pytest.raises(FormatError) as caught:
            call(path, kind)
        said.append(caught.value.message)
    assert said[0] == said[1]
    return said[1]


def channels(**change):
    found = {"Time": (TIME, {"unit_string": "s"}), **{name: (each, NEWTONS) for name, each in FORCES.items()}}
    return {name: each for name, each in {**found, **change}.items() if each is not None}


def check(table, time=TIME):
    np.testing.assert_allclose(table["t_s"], time, rtol=1e-12)
    for name, each in FORCES.items():
        np.testing.assert_allclose(table[f"{name.lower()}_n"], each, rtol=1e-12)


# The example of the specification: a group with two channels of three whole numbers each.
PRINTED = bytes.fromhex(
    "5444536d 0e000000 69120000 8f00000000000000 7700000000000000"
    "02000000 13000000 2f2767726f7570272f276368616e6e656c3127"
    "14000000 03000000 01000000 0300000000000000"
    "01000000 04000000 70726f70 20000000 05000000 76616c6964"
    "13000000 2f2767726f7570272f276368616e6e656c3227"
    "14000000 03000000 01000000 0300000000000000 00000000"
    "01000000 02000000 03000000 04000000 05000000 06000000"
)


def test_the_file_that_the_specification_prints_is_read_with_segments_of_values_alone(tmp_path):
    more = [lead_in(8, b"", np.arange(start, start + 6, dtype="<i4").tobytes()) for start in (7, 13)]
    assert "found the columns channel1, channel2" in failure(written(tmp_path, PRINTED, *more), "profile")
    named = PRINTED.replace(b"channel1", b"  x_mm  ").replace(b"channel2", b"  z_mm  ")
    table = read(written(tmp_path, named, *more), "profile")
    assert table["x_mm"].tolist() == [1, 2, 3, 7, 8, 9, 13, 14, 15]
    assert table["z_mm"].tolist() == [4, 5, 6, 10, 11, 12, 16, 17, 18]


@pytest.mark.parametrize("interleaved", [False, True])
@pytest.mark.parametrize("order", ["<", ">"])
def test_either_byte_order_and_layout_give_the_same_table(tmp_path, order, interleaved):
    path = written(tmp_path, segment(channels(), order, interleaved=interleaved))
    sniff(path, "force")
    check(read(path, "force"))


@pytest.mark.parametrize("interleaved", [False, True])
def test_a_segment_may_hold_many_chunks(tmp_path, interleaved):
    parts = [{name: (each[k : k + 4], p) for name, (each, p) in channels().items()} for k in (0, 4, 8)]
    more = b"".join(values(part, "<", interleaved=interleaved) for part in parts[1:])
    check(read(written(tmp_path, segment(parts[0], interleaved=interleaved, more=more)), "force"))


def test_segments_may_leave_out_what_is_as_before_and_change_the_rest(tmp_path):
    parts = [{name: (each[at], p) for name, (each, p) in channels().items()} for at in halves(N)]
    renewed = segment(
        {"Fx": (parts[1]["Fx"][0].astype("<f4"), {})},
        new_list=False,
        raw=values(parts[1] | {"Fx": (parts[1]["Fx"][0].astype("<f4"), {})}, "<"),
    )
    check(read(written(tmp_path, segment(parts[0]), renewed), "force"))


def test_texts_time_stamps_and_other_channels_are_passed_over(tmp_path):
    words = ("a", "bc", "def")
    note = struct.pack("<3I", 1, 3, 6) + b"abcdef"
    stamps = np.zeros(2, "V16")
    found = {
        "Note": (words, {"x": 1}, note),
        "Stamp": (stamps, {}),
        **channels(),
        "Mz": (np.arange(3), NEWTONS),
    }
    check(read(written(tmp_path, segment(found)), "force"))


def test_units_are_converted_and_whole_numbers_read(tmp_path):
    found = channels(Time=(TIME * 1e3, {"unit_string": "ms"}), Fx=(FORCES["Fx"] / 1e3, {"unit_string": "kN"}))
    found["Fy"] = FORCES["Fy"].astype("<i2"), NEWTONS
    check(read(written(tmp_path, segment(found)), "force"))


def test_the_contracts_names_need_no_units(tmp_path):
    found = {f"{name}_N": (each, {}) for name, each in FORCES.items()} | {" t_s": (TIME, {})}
    check(read(written(tmp_path, segment(found)), "force"))


def test_waveforms_have_their_time_in_their_properties(tmp_path):
    found = {name: (each, WAVE) for name, each in FORCES.items()}
    path = written(tmp_path, segment(found))
    sniff(path, "force")
    check(read(path, "force"), 0.5 + TIME)


def test_robot_logs_may_be_in_radians(tmp_path):
    found = {"t_s": (TIME, {})}
    for i in range(1, 7):
        found |= {f"q{i}_set": (TIME + i, {"unit_string": "rad"}), f"q{i}": (TIME, {"unit_string": "deg"})}
        found |= {f"tau{i}": (TIME * i, {"unit_string": "Nm"})}
    table = read(written(tmp_path, segment(found)), "robot")
    np.testing.assert_allclose(table["q6_set_deg"], np.degrees(TIME + 6), rtol=1e-13)
    np.testing.assert_array_equal(table["tau2_nm"], TIME * 2)


def raw_counts():
    return {**NEWTONS, "NI_Number_Of_Scales": 2, "NI_Scaling_Status": "unscaled"}


@pytest.mark.parametrize(
    ("change", "parts"),
    [
        ({"Fy": None}, ["lacks the column fy_n", "t_s, fx_n, fz_n"]),
        ({"Fy": (TIME, {})}, ["channel Cut/Fy, column fy_n", "''", "N or kN", "name it fy_n"]),
        ({"Fy": (TIME, {"unit_string": "V"})}, ["channel Cut/Fy, column fy_n", "'V'", "N or kN"]),
        (
            {"Fy": None, "fy_n": (TIME, {"unit_string": "kN"})},
            ["Cut/fy_n", "'kN'", "expected N as its name says"],
        ),
        ({"fy_n": (TIME, {})}, ["column fy_n: found 2 times"]),
        ({"Fy": (TIME[:5], NEWTONS)}, ["channel Cut/Fy", "found 5 values", "expected 12"]),
        ({"Fy": (np.zeros(N, "V16"), NEWTONS)}, ["channel Cut/Fy", "no real numbers"]),
        ({"Fy": (TIME.astype("<c16"), NEWTONS)}, ["channel Cut/Fy", "no real numbers"]),
        ({"Fy": (TIME, raw_counts())}, ["channel Cut/Fy", "raw counts", "N or kN"]),
        ({"Time": (TIME[::-1], {"unit_string": "s"})}, ["sample 2, column t_s", "expected a larger value"]),
        (
            {"Time": None, "Fx": (TIME, WAVE)},
            ["Cut/Fy: found another start or step of time than channel Cut/Fx"],
        ),
        ({"Fz": (np.where(TIME == 0.004, np.inf, 1), NEWTONS)}, ["sample 5, column fz_n", "inf"]),
    ],
)
def test_what_is_wrong_with_a_channel_is_said_with_its_name(tmp_path, change, parts):
    message = failure(written(tmp_path, segment(channels(**change))))
    assert [part for part in parts if part not in message] == []


def test_a_channel_of_two_groups_is_refused(tmp_path):
    message = failure(written(tmp_path, segment(channels()), segment(channels(), group="It's two")))
    assert "column t_s: found 2 times" in message


WHOLE = segment(channels())


@pytest.mark.parametrize("keep", [5, 27, 40, 200, len(WHOLE) // 2, len(WHOLE) - 1])
def test_a_file_that_is_cut_off_is_refused_wherever_it_is_cut(tmp_path, keep):
    message = failure(written(tmp_path, WHOLE[:keep]))
    assert "ends early" in message
    assert "copy it again" in message


def test_a_second_segment_that_is_cut_off_is_named_with_its_place(tmp_path):
    message = failure(written(tmp_path, WHOLE, WHOLE[:20]))
    assert f"at byte {len(WHOLE)}" in message


@pytest.mark.parametrize(
    ("old", "new", "part"),
    [
        (struct.pack("<I", 4713), struct.pack("<I", 7), "version 7"),
        (WHOLE[12:20], b"\xff" * 8, "was not closed"),
        (struct.pack("<I", 14), struct.pack("<I", 14 + 128), "raw values of DAQmx"),
        (index(TIME)[:4], struct.pack("<I", 0x1269), "raw values of DAQmx"),
        (index(TIME)[:8], struct.pack("<II", 20, 0x4F), "data type 0x4f"),
        (index(TIME)[8:], struct.pack("<IQ", 2, N), "2 dimensions"),
        (index(TIME)[8:], struct.pack("<IQ", 1, N + 1), "expected a multiple of"),
        (index(TIME)[8:], struct.pack("<IQ", 1, 1 << 62), "expected a multiple of"),
        (index(TIME), b"\0\0\0\0" + index(TIME)[4:], "damaged"),
        (text("unit_string"), struct.pack("<I", 1 << 30) + b"unit_string", "ends within a value"),
    ],
)
def test_damage_is_told(tmp_path, old, new, part):
    assert old in WHOLE
    assert part in failure(written(tmp_path, WHOLE.replace(old, new, 1)))


def test_a_file_without_values_is_told_as_such(tmp_path):
    none = {name: (each[:0], p) for name, (each, p) in channels().items()}
    with pytest.raises(FormatError, match="found 0 rows, expected at least 8"):
        read(written(tmp_path, segment(none)), "force")


def test_what_would_unpack_to_more_than_any_recording_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("metro.formats.limits.LARGEST", 100)
    monkeypatch.setattr("metro.formats.limits.check_unpacked.__defaults__", (100,))
    assert "unpacks to 384 bytes, expected at most 100" in failure(written(tmp_path, WHOLE))
