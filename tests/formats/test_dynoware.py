"""DynoWare text exports, synthetic and real."""

import os
from pathlib import Path

import numpy as np
import pytest

from metro.formats import FormatError
from metro.formats.registry import read, sniff

REAL = Path(os.environ.get("METRO_REAL_DATA", Path(__file__).parents[2] / "../shared/real")) / "batches"
PREAMBLE = (
    "DynoWare,Version 2.5.1.2\nPath:,C:\\Data\\\nDate:, \nTime:, \nSampling rate [Hz]:,10000\nCycle No:,1\n"
)


def export(tmp_path, names="Time,Fx,Fy,Fz", units="s,N,N,N", rows=None, tabs=False):
    rows = [f"{8 + k * 1e-4:.4f},{k},{2 * k},{3 * k}" for k in range(10)] if rows is None else rows
    text = PREAMBLE + "\n".join([names, units, *rows]) + "\n"
    path = tmp_path / "export.txt"
    path.write_text(text.replace(",", "\t") if tabs else text)
    return path


def failure(path):
    with pytest.raises(FormatError) as caught:
        read(path, "force")
    return caught.value.message


@pytest.mark.parametrize("tabs", [False, True])
def test_preamble_and_units_row_are_passed_over(tmp_path, tabs):
    path = export(tmp_path, tabs=tabs)
    sniff(path, "force")
    table = read(path, "force")
    assert list(table) == ["t_s", "fx_n", "fy_n", "fz_n"]
    np.testing.assert_allclose(table["t_s"], 8 + np.arange(10) * 1e-4)
    np.testing.assert_array_equal(table["fz_n"], 3.0 * np.arange(10))


def test_milliseconds_and_kilonewtons_are_converted_channel_by_channel(tmp_path):
    table = read(export(tmp_path, units="ms,kN,N,kN"), "force")
    assert table["t_s"][0] == pytest.approx(8e-3)
    assert table.iloc[4, 1:].tolist() == [4000.0, 8.0, 12000.0]


def test_other_channels_are_ignored_wherever_they_stand(tmp_path):
    rows = [f"{k},99,{k},overload,{2 * k},{3 * k}" for k in range(10)]
    table = read(export(tmp_path, "Time,Mz,Fx,Status,Fy,Fz", "s,Nm,N,,N,N", rows), "force")
    assert table.iloc[5].tolist() == [5.0, 5.0, 10.0, 15.0]


@pytest.mark.parametrize(
    ("change", "parts"),
    [
        ({"units": "s,N,mV,N"}, ["line 8, column fy_n", "'mV'", "N or kN"]),
        ({"units": "h,N,N,N"}, ["line 8, column t_s", "'h'", "s or ms"]),
        ({"units": "s,N,N"}, ["line 8, column fz_n", "''", "N or kN"]),
        ({"names": "Zeit,Fx,Fy,Fz"}, ["no line of channels"]),
        ({"names": "Time,Fx,Fy", "units": "s,N,N"}, ["lacks the column fz_n"]),
        ({"names": "Time;Fx;Fy;Fz"}, ["line 8, column t_s", "'s,N,N,N'", "s or ms"]),
        ({"rows": ["1,2,x,4"]}, ["line 9, column fy_n", "'x'"]),
        ({"rows": ["1,2,3,4"]}, ["found 1 rows", "at least 8"]),
    ],
)
def test_faults_are_named_with_their_place(tmp_path, change, parts):
    message = failure(export(tmp_path, **change))
    assert [part for part in parts if part not in message] == []


@pytest.mark.parametrize("mark", ["\t", ";"])
def test_decimal_commas_are_read_where_they_cannot_part_columns(tmp_path, mark):
    plain = read(export(tmp_path), "force")
    path = tmp_path / "commas.txt"
    text = export(tmp_path).read_text().replace(",", mark).replace("Version 2.5", "Version 2,5")
    head, samples = text.split("N\n")
    path.write_text(head + "N\n" + samples.replace(".", ","))
    sniff(path, "force")
    np.testing.assert_array_equal(read(path, "force"), plain)


def test_the_decimal_comma_is_found_where_the_first_samples_are_whole(tmp_path):
    rows = [f"{k}\t{k},5\t2\t3" if k else "0\t0\t2\t3" for k in range(10)]
    table = read(export(tmp_path, "Time\tFx\tFy\tFz", "s\tN\tN\tN", rows), "force")
    assert table["fx_n"].tolist() == [0, *(k + 0.5 for k in range(1, 10))]


@pytest.mark.parametrize(
    ("odd", "hint"), [("1.5", "in all"), ("1.234,5", "in all"), ("1,2,3", "decimal point")]
)
def test_decimal_commas_and_points_in_one_file_are_refused_with_the_line(tmp_path, odd, hint):
    rows = [f"{k},0\t1,5\t2\t3" for k in range(20)]
    rows[12] = f"12,0\t{odd}\t2\t3"
    message = failure(export(tmp_path, "Time\tFx\tFy\tFz", "s\tN\tN\tN", rows))
    assert [part for part in ("line 21, column fx_n", repr(odd), hint) if part not in message] == []


def test_a_thousands_comma_is_no_decimal_comma(tmp_path):
    rows = [f"{k}.0\t1,500.0\t2\t3" for k in range(10)]
    assert "line 9, column fx_n: found '1,500.0'" in failure(
        export(tmp_path, "Time\tFx\tFy\tFz", "s\tN\tN\tN", rows)
    )


def test_units_may_stand_behind_the_names_and_the_preamble_have_any_length(tmp_path):
    rows = "".join(f"{k},{k},{2 * k},{3 * k}\n" for k in range(10))
    path = tmp_path / "export.txt"
    path.write_text("DynoWare,Version 3\n" + "Remark:,x\n" * 60 + f"Time [ms],Fx [kN],Fy (N),Fz [N]\n{rows}")
    assert read(path, "force").iloc[4].tolist() == [pytest.approx(4e-3), 4000.0, 8.0, 12.0]


def test_times_before_the_trigger_are_negative(tmp_path):
    rows = [f"{(k - 5) * 1e-3:.3f},{k},1,2" for k in range(10)]
    assert read(export(tmp_path, rows=rows), "force")["t_s"].tolist() == [
        pytest.approx((k - 5) * 1e-3) for k in range(10)
    ]


@pytest.mark.skipif(not REAL.is_dir(), reason="the real data (METRO_REAL_DATA) are not there")
def test_a_real_export_has_the_means_that_its_recorder_published():
    path = REAL / "slotting-d25/dyno/6-n6000f300ap3ae25.csv"
    sniff(path, "force")
    table = read(path, "force")
    assert len(table) == 10001
    assert table["t_s"].iloc[[0, -1]].tolist() == [8.0, 9.0]
    means = table[["fx_n", "fy_n", "fz_n"]].mean()
    np.testing.assert_allclose(means, [63.02, -39.80, 55.72], atol=0.005)
