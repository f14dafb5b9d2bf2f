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
        ({"units": "min,N,N,N"}, ["line 8, column t_s", "'min'", "s or ms"]),
        ({"units": "s,N,N"}, ["line 8, column fz_n", "''", "N or kN"]),
        ({"names": "Zeit,Fx,Fy,Fz"}, ["no line of channels"]),
        ({"names": "Time,Fx,Fy", "units": "s,N,N"}, ["lacks the column fz_n"]),
        ({"names": "Time;Fx;Fy;Fz"}, ["line 7", "semicolons"]),
        ({"rows": ["1,2,x,4"]}, ["line 9, column fy_n", "'x'"]),
        ({"rows": ["1,2,3,4"]}, ["found 1 rows", "at least 8"]),
    ],
)
def test_faults_are_named_with_their_place(tmp_path, change, parts):
    message = failure(export(tmp_path, **change))
    assert [part for part in parts if part not in message] == []


def test_decimal_commas_between_tabs_are_explained(tmp_path):
    path = tmp_path / "export.txt"
    path.write_text(PREAMBLE.replace(",", "\t") + "Time\tFx\tFy\tFz\ns\tN\tN\tN\n8,1\t1,5\t2\t3\n")
    message = failure(path)
    assert "line 9, column t_s" in message
    assert "decimal point" in message


@pytest.mark.skipif(not REAL.is_dir(), reason="the real data (METRO_REAL_DATA) are not there")
def test_a_real_export_has_the_means_that_its_recorder_published():
    path = REAL / "slotting-d25/dyno/6-n6000f300ap3ae25.csv"
    sniff(path, "force")
    table = read(path, "force")
    assert len(table) == 10001
    assert table["t_s"].iloc[[0, -1]].tolist() == [8.0, 9.0]
    means = table[["fx_n", "fy_n", "fz_n"]].mean()
    np.testing.assert_allclose(means, [63.02, -39.80, 55.72], atol=0.005)
