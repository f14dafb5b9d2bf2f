"""Scans as parts of the canonical table: their unit, their part, their size, and the memory they take."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from metro.batch.batch import Batch
from metro.stages import scans
from metro.stages.reading import Recordings

EYE = np.eye(4).tolist()


def raster(width, height, pitch=1.0):
    x, y = np.meshgrid(np.arange(0.5, width, pitch), np.arange(0.5, height, pitch))
    return np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])


def batch(size=(100, 60, 30), **scanner):
    manifest = {"instruments": {"scanner": scanner}} | ({"work": {"size_mm": list(size)}} if size else {})
    return Batch("b", manifest, {}, pd.DataFrame({"scan": ["s.ply"]}, index=["r"]), {})


def write(folder, points):
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n"
    header += "".join(f"property float {name}\n" for name in "xyz") + "end_header\n"
    (folder / "s.ply").write_bytes(header.encode() + np.asarray(points, "<f4").tobytes())


def scanned(folder, points, described, path=None):
    """Return the parts, and what the stage has to say of a scan with these points."""
    write(folder, points)
    recordings = Recordings(folder, lambda: None)
    if path is not None:
        recordings.paths["r"] = np.array(path, float)
    parts = list(scans.scan(described, recordings))
    return parts, recordings


def problem(folder, points, described, path=None):
    (found,) = scanned(folder, points, described, path)[1].problems
    assert found.file == "s.ply"
    return found.message


def test_a_scan_of_the_work_is_taken_as_it_is(tmp_path):
    points = raster(100, 60)
    parts, recordings = scanned(tmp_path, points, batch())
    assert recordings.problems == []
    np.testing.assert_array_equal(np.concatenate([part["x_mm"] for part in parts]), points[:, 0])
    assert [finding["check"] for finding in recordings.findings] == ["missing points", "size of the scan"]


@pytest.mark.parametrize(
    ("size", "unit"), [(1e3, "metres"), (25.4, "inches"), (10.0, "centimetres"), (1e-3, "micrometres")]
)
@pytest.mark.parametrize("placed", [True, False])
def test_a_scan_in_another_unit_is_refused_with_what_was_expected(tmp_path, size, unit, placed):
    described = batch(to_work=EYE) if placed else batch()
    message = problem(tmp_path, raster(100, 60) / size, described)
    assert message.endswith(
        f"the work is 100 × 60 mm: coordinates seem to be in {unit}, expected millimetres"
    )


@pytest.mark.parametrize("sides", [(100, 40), (140, 60), (70, 42)])
def test_a_scan_of_another_part_is_refused(tmp_path, sides):
    message = problem(tmp_path, raster(*sides), batch())
    assert "the work is 100 × 60 mm, expected 80 × 48 to 125 × 75 mm" in message
    assert "another part" in message


def test_a_scan_that_was_turned_by_its_transform_is_of_another_part(tmp_path):
    assert "another part" in problem(tmp_path, raster(60, 100), batch(to_work=EYE))
    assert scanned(tmp_path, raster(60, 100), batch())[1].problems == []


def test_the_margin_is_declared(tmp_path):
    assert scanned(tmp_path, raster(50, 30), batch(extent_margin=1.1))[1].problems == []
    assert "expected 50 × 30 to 200 × 120 mm" in problem(tmp_path, raster(45, 30), batch(extent_margin=1.0))


def noisy(points):
    return points + np.random.default_rng(1).normal(0, 0.02, points.shape)


def test_a_placed_scan_of_the_part_on_its_table_is_told_what_planes_there_are(tmp_path):
    table = raster(300, 200, 2.0) - np.array([100, 70, 30])
    scene = noisy(np.vstack([table, raster(100, 60)]))
    message = problem(tmp_path, scene, batch(to_work=EYE))
    assert message.endswith(
        "(instruments.scanner.extent_margin)?; the points lie on 2 planes: 298 × 198 mm "
        "(70 % of the points), 99.1 × 59.1 mm (30 % of the points); "
        "plane 2 has the size of the face: keep its points alone"
    )


def test_a_scan_of_two_parts_of_other_sizes_is_told_of_two_groups(tmp_path):
    scene = noisy(np.vstack([raster(160, 60), raster(160, 60) + np.array([300, 0, 0])]))
    assert problem(tmp_path, scene, batch()).endswith("; the points lie in 2 groups apart")


def said_of_a_scene(tmp_path, points, described):
    recordings = scanned(tmp_path, points, described)[1]
    assert recordings.problems == []
    return next(row["message"] for row in recordings.findings if row["check"] == "scene")


def test_of_a_scene_the_faces_of_the_parts_size_are_measured(tmp_path):
    table = raster(300, 200, 2.0) - np.array([100, 70, 30])
    said = said_of_a_scene(tmp_path, noisy(np.vstack([table, raster(100, 60)])), batch())
    assert "1 face of it is measured: 99.1 × 59.1 mm (30 %)" in said
    assert "not the size of the part: 298 × 198 mm" in said


def test_two_parts_of_one_size_are_two_faces(tmp_path):
    points = noisy(np.vstack([raster(100, 60), raster(100, 60) + np.array([300, 0, 0])]))
    assert "2 faces of it are measured" in said_of_a_scene(tmp_path, points, batch())


def test_one_plane_in_one_piece_needs_no_more_words(tmp_path):
    for points in (noisy(raster(100, 30)), np.tile([[1.0, 2.0, 3.0]], (50, 1)), raster(300, 1)):
        assert problem(tmp_path, points, batch(to_work=EYE)).endswith("(instruments.scanner.extent_margin)?")


def test_without_a_size_the_path_tells_the_unit(tmp_path):
    nothing = batch(size=None)
    assert scanned(tmp_path, raster(100, 60), nothing)[1].problems == []
    assert scanned(tmp_path, raster(100, 60), nothing, path=(130, 50))[1].problems == []
    assert "in metres" in problem(tmp_path, raster(100, 60) / 1e3, nothing, path=(130, 50))
    assert "another part" in problem(tmp_path, raster(100, 60), nothing, path=(330, 50))


def test_a_few_wild_points_do_not_hide_the_unit(tmp_path):
    wild = np.vstack([raster(100, 60) / 1e3, np.random.default_rng(0).uniform(-500, 500, (20, 3))])
    assert "in metres" in problem(tmp_path, wild, batch())


def test_the_pieces_of_a_scan_are_put_in_the_work_frame_alike(tmp_path, monkeypatch):
    monkeypatch.setattr(scans, "PIECE", 1000)
    turn = [[0.0, -1.0, 0.0, 60.0], [1.0, 0.0, 0.0, 5.0], [0.0, 0.0, 1.0, 7.0], [0.0, 0.0, 0.0, 1.0]]
    points = raster(100, 60)
    parts, recordings = scanned(tmp_path, points, batch(size=(60, 100, 30), to_work=turn))
    assert recordings.problems == []
    assert [len(part["x_mm"]) for part in parts] == [1000] * 6
    found = np.vstack([np.column_stack([part[f"{axis}_mm"] for axis in "xyz"]) for part in parts])
    np.testing.assert_array_equal(
        found, np.column_stack([60 - points[:, 1], points[:, 0] + 5, points[:, 2] + 7])
    )


def test_the_memory_a_scan_takes_does_not_grow_with_its_points(tmp_path):
    """Twice and eight times a piece: the same peak; a table of the larger one would be 50 MB."""
    peaks = []
    for pieces in (2, 8):
        write(tmp_path, np.resize(raster(100, 60, 0.2), (pieces * scans.PIECE, 3)))
        recordings = Recordings(tmp_path, lambda: None)
        tracemalloc.start()
        count = sum(len(part["x_mm"]) for part in scans.scan(batch(), recordings))
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
        assert count == pieces * scans.PIECE
    assert peaks[1] < 1.1 * peaks[0]
    assert peaks[1] < 40e6


def scene(share_on_the_face):
    """Return a face of 100 mm by 60 mm with holes, through which one sees 10 mm to 30 mm deep."""
    points = raster(100, 60)
    off = np.arange(len(points)) % 100 >= 100 * share_on_the_face
    depth = 10.0 + 20.0 * np.random.default_rng(3).random(len(points))
    return np.where(off[:, None] * [False, False, True], depth[:, None], points)


@pytest.mark.parametrize("described", [batch(to_work=EYE), batch()])
def test_a_scene_with_less_than_the_face_is_not_taken_for_the_face(tmp_path, described):
    said = problem(tmp_path, scene(0.6), described)
    assert (
        "is scanner.to_work in batch.yaml that of this scan?" in said or "keep the points of the face" in said
    )


def test_the_face_of_a_scene_that_holds_more_is_cut_out_of_it(tmp_path):
    said = said_of_a_scene(tmp_path, scene(0.6), batch(size=None))
    assert "1 face of it is measured: 59 × 59 mm (60 %)" in said


def test_a_face_with_some_points_beside_it_and_a_rough_or_bowed_one_are_faces(tmp_path):
    face = raster(100, 60)
    bowed = face + [0, 0, 1] * (1e-3 * (face[:, :1] - 50.0) ** 2)  # by 2.5 mm
    rough = face + [0, 0, 1] * np.random.default_rng(4).normal(0.0, 0.5, (len(face), 1))
    for points in (scene(0.95), bowed, rough):
        assert scanned(tmp_path, points, batch(size=None))[1].problems == []


@pytest.mark.parametrize(("size", "unit"), [(25.4, "inches"), (10.0, "centimetres")])
def test_millimetres_that_were_taken_for_another_unit_are_named(tmp_path, size, unit):
    message = problem(tmp_path, raster(100, 60) * size, batch())
    assert message.endswith(f"coordinates seem to be millimetres that were taken for {unit}")


def test_the_size_of_the_points_is_shown_back(tmp_path):
    recordings = scanned(tmp_path, raster(100, 60) + [0, 0, 0.4] * (raster(100, 60)[:, :1] > 50), batch())[1]
    (said,) = [row["message"] for row in recordings.findings if row["check"] == "size of the scan"]
    assert said.startswith("the points span 99 × 59 × 0.")


@pytest.mark.parametrize(
    ("factor", "said"), [(1 / 25.4, "be in inches"), (25.4, "that were taken for inches")]
)
def test_without_a_size_the_length_of_the_cut_tells_of_a_wrong_unit(tmp_path, factor, said):
    runs = pd.DataFrame({"scan": ["s.ply"], "cut_length_mm": [100.0]}, index=["r"])
    described = replace(batch(size=None), runs=runs)
    findings = scanned(tmp_path, raster(100, 60) * factor, described)[1].findings
    assert said in next(row["message"] for row in findings if row["check"] == "unit of length")
    findings = scanned(tmp_path, raster(70, 60), described)[1].findings
    assert not [row for row in findings if row["check"] == "unit of length"]
