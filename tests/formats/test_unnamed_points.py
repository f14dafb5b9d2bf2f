"""Point lists without names: what need not be x, y, z is refused with what to write, never read as that."""

import os
from pathlib import Path

import numpy as np
import pytest

from metro.formats import FormatError
from metro.formats.mapping import Source, mapping_of
from metro.formats.registry import read

FIELD = Path(os.environ.get("METRO_REAL_DATA", Path(__file__).parents[2] / "../shared/real")).parent / "field"
NUMBERED = FIELD / "scan-numbered-points/ASTRAL_GRANITE_VISION_FLATNESS_004.csv"
POINTS = np.random.default_rng(2).uniform(0, 90, (20, 3)).round(3)
NORMALS = np.tile([0.004, 0.009, 1.0], (20, 1))
COUNT = np.arange(1, 21)[:, None]


def written(tmp_path, *parts, header=""):
    path = tmp_path / "points.csv"
    rows = "\n".join(",".join(f"{v:g}" for v in row) for row in np.hstack(parts))
    path.write_text(f"{header}{rows}\n")
    return path


@pytest.mark.parametrize(
    ("parts", "says", "first"),
    [
        ((COUNT, POINTS), "counts the rows", 2),
        ((COUNT - 1, POINTS, NORMALS), "counts the rows", 2),
        ((NORMALS, POINTS), "directions of length 1", 4),
        ((POINTS, POINTS), "neither normals nor colours", 1),
    ],
)
def test_columns_that_need_not_be_coordinates_are_refused_with_what_to_write(tmp_path, parts, says, first):
    with pytest.raises(FormatError) as caught:
        read(written(tmp_path, *parts), "cloud")
    assert says in caught.value.message
    assert f"x_mm: {{from: {first}, unit: mm}}" in caught.value.message


@pytest.mark.parametrize("more", [(), (POINTS[:, :1],), (NORMALS,), (np.full((20, 3), 128.0),)])
def test_coordinates_before_intensity_normals_or_colours_are_read(tmp_path, more):
    np.testing.assert_array_equal(read(written(tmp_path, POINTS, *more), "cloud"), POINTS)


def test_a_header_that_names_the_coordinates_is_followed(tmp_path):
    path = written(tmp_path, COUNT, POINTS, header="no,x,y,z\n")
    np.testing.assert_array_equal(read(path, "cloud"), POINTS)


@pytest.mark.parametrize(
    "header", ["Time(sec),Fx(N),Fy(N),Fz(N)\n", "t [ms],a,b,c\n", "t_s,fx_n,fy_n,fz_n\n", "a,b,c,U [mV]\n"]
)
def test_columns_whose_names_measure_something_else_are_no_points(tmp_path, header):
    path = written(tmp_path, POINTS[:, :1], POINTS, header=header)
    with pytest.raises(FormatError, match="expected coordinates x, y, z in mm"):
        read(path, "cloud")


@pytest.mark.parametrize("header", ["E [mm],N [mm],H [mm],colour\n", "points of the third plate\n", "1000\n"])
def test_other_names_of_lengths_and_remarks_leave_the_first_three_columns(tmp_path, header):
    path = written(tmp_path, POINTS, POINTS[:, :1], header=header)
    np.testing.assert_array_equal(read(path, "cloud"), POINTS)


@pytest.mark.skipif(not NUMBERED.is_file(), reason="the field files are not there")
def test_numbered_points_of_a_granite_plate_give_its_flatness():
    with pytest.raises(FormatError, match="counts the rows"):
        read(NUMBERED, "cloud")
    columns = {f"{axis}_mm": {"from": k, "unit": "mm"} for k, axis in enumerate("xyz", 2)}
    x, y, z = read(Source(NUMBERED, "", mapping_of("files", {"columns": columns})), "cloud").to_numpy().T
    plane = np.column_stack([x, y, np.ones_like(x)])
    residual = z - plane @ np.linalg.lstsq(plane, z, rcond=None)[0]
    assert np.ptp(residual) == pytest.approx(0.1233, abs=5e-5)
