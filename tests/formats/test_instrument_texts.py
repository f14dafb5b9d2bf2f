"""Instruments that state their own units: SignalCalc, Gocator, software gauges, universal files of modes."""

import gzip
import os
from pathlib import Path

import numpy as np
import pytest

from metro.formats import FormatError
from metro.formats.registry import read, read_frfs, sniff
from metro.formats.uff_modes import read_modes

FIELD = Path(os.environ.get("METRO_REAL_DATA", Path(__file__).parents[2] / "../shared/real")).parent / "field"
field = pytest.mark.skipif(not FIELD.is_dir(), reason="the field files are not there")
PREAMBLE = "Units: Ratio\nRef Chan:Resp Chan\t0-Z:0-Z\n\nFrequency\t Real\t Imaginary\n\nUnits:\nHz\t{}\t \n"
GRID = "Info\nCSV Version,Sensor Count\n2,1\nEnd\n\nPart\nFrame\n1\nY\\X,0.5,1,1.5\n10,1,,3\n11,{},5,6\nEnd\n"
GAUGE = "<?xml version='1.0'?><DATA><UNITS>{}</UNITS><NUMPOINTS>{}</NUMPOINTS><SPACING>0.5</SPACING>"
VALUES = (
    "<DATA_POINT_VALUES>"
    + "\n".join(["1", "-1", "3", "-1", "1", "-1", "1", "-1"])
    + "\n</DATA_POINT_VALUES></DATA>"
)


def written(tmp_path, content):
    (tmp_path / "a.out").write_bytes(content)
    return tmp_path / "a.out"


@pytest.mark.parametrize(
    ("unit", "found", "factor"),
    [("(m/s²)(N)", "m/s2", 1.0), ("(g)/(N)", "g", 1.0), ("(mm)(kN)", "m", 1e-6)],
)
def test_an_frf_of_signalcalc_has_the_unit_that_it_states(tmp_path, unit, found, factor):
    rows = "".join(f"{k * 0.5:e}\t {k}\t {-k}\n" for k in range(20))
    content = (PREAMBLE.format(unit) + rows).encode("cp1252")
    for each in (content, gzip.compress(content)):
        (frf,) = read_frfs(written(tmp_path, each))
        assert frf.unit == found
        np.testing.assert_allclose(frf.table["imag"], -factor * np.arange(20))
    assert frf.table["frequency_hz"].iloc[-1] == 9.5


def test_an_frf_of_signalcalc_that_is_no_response_per_force_is_refused(tmp_path):
    with pytest.raises(FormatError, match="expected a response per force"):
        read(written(tmp_path, PREAMBLE.format("V").encode() + b"0 1 2\n" * 9), "frf")


def test_the_heights_of_a_gocator_grid_become_points_and_gaps_none(tmp_path):
    path = written(tmp_path, GRID.format(4).encode())
    sniff(path, "cloud")
    expected = [[0.5, 10, 1], [1.5, 10, 3], [0.5, 11, 4], [1, 11, 5], [1.5, 11, 6]]
    np.testing.assert_array_equal(read(path, "cloud"), expected)


@pytest.mark.parametrize(
    ("cell", "says"), [("4,4", "line 11: found 4 heights, expected 3"), ("x", "line 11")]
)
def test_a_gocator_grid_that_is_not_whole_is_refused(tmp_path, cell, says):
    with pytest.raises(FormatError, match=says):
        read(written(tmp_path, GRID.format(cell).encode()), "cloud")


def test_a_software_gauge_has_its_unit_and_spacing(tmp_path):
    table = read(written(tmp_path, (GAUGE.format("um", 8) + VALUES).encode()), "profile")
    np.testing.assert_allclose(table["z_mm"][:4], [1e-3, -1e-3, 3e-3, -1e-3])
    np.testing.assert_allclose(table["x_mm"], np.arange(8) * 0.5e-3)


@pytest.mark.parametrize(("unit", "count", "says"), [("bar", 8, "'bar'"), ("um", 9, "8 heights, expected 9")])
def test_a_software_gauge_at_odds_with_itself_is_refused(tmp_path, unit, count, says):
    with pytest.raises(FormatError, match=says):
        read(written(tmp_path, (GAUGE.format(unit, count) + VALUES).encode()), "profile")


@field
def test_the_modes_of_a_universal_file_are_those_that_its_text_states():
    path = next((FIELD / "modal-poles-unv").glob("*.unv"))
    stated = [line.split() for line in path.read_text().splitlines() if line.startswith("MODE NO.")]
    modes = read_modes(path)
    assert len(modes) == len(stated) == 11
    for mode, words in zip(modes, stated, strict=True):
        assert mode.damped == pytest.approx(float(words[4].removesuffix("(Hz),")), rel=2e-5)
        assert mode.damping == pytest.approx(float(words[6]), rel=2e-4)
    with pytest.raises(FormatError, match=r"11 × 55 \(data at nodes, as mode shapes\)"):
        read_frfs(path)


@field
def test_the_square_wave_has_the_deviations_that_it_was_made_with():
    z = read(FIELD / "profile-square/square.xml", "profile")["z_mm"] * 1e3
    deviation = z - z.mean()
    assert np.abs(deviation).mean() == pytest.approx(1.0, abs=1e-9)
    assert np.sqrt((deviation**2).mean()) == pytest.approx(1.0, abs=1e-9)
    assert np.ptp(z) == pytest.approx(2.0, abs=1e-9)


def cutpro(unit="m/N", last="Imag"):
    rows = "".join(f"{k * 0.5:14.6e}\t{k * 1e-7:.12e}\t{-k * 1e-8:.12e}\t\n" for k in range(2, 20))
    first = (
        f"  5.000000e-01\t1.000000000000e-07\t-1.000000000000e-08\tFreq\tHz\tReal\t{unit}\t{last}\tReal\t\n"
    )
    return first + rows


@pytest.mark.parametrize(
    ("unit", "found", "factor"), [("m/N", "m", 1.0), ("um/N", "m", 1e-6), ("g/N", "g", 1.0)]
)
def test_an_frf_of_cutpro_has_its_first_line_and_its_unit(tmp_path, unit, found, factor):
    (tmp_path / "x.frf").write_text(cutpro(unit))
    (frf,) = read_frfs(tmp_path / "x.frf")
    assert frf.unit == found
    np.testing.assert_allclose(frf.table["frequency_hz"], 0.5 * np.arange(1, 20))
    np.testing.assert_allclose(frf.table["real"], factor * 1e-7 * np.arange(1, 20))
    np.testing.assert_allclose(frf.table["imag"], -factor * 1e-8 * np.arange(1, 20))


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (cutpro(last="Phase"), "line 1: found"),
        (cutpro(unit="V"), "line 1"),
        (cutpro() + "1.0\tx\t2.0\n", "line 20"),
        ("", "is empty, expected an FRF"),
    ],
)
def test_an_frf_that_is_none_of_cutpro_is_refused_with_the_line(tmp_path, content, says):
    (tmp_path / "x.frf").write_text(content)
    with pytest.raises(FormatError, match=says):
        read(tmp_path / "x.frf", "frf")
