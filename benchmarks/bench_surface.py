"""Seconds and memory for a face: from a PLY file to plane, all indices and the certified minimum zone.

Peers on the same points in the same run: NumPy's SVD, Open3D's RANSAC plane, scikit-spatial's best fit (each
a plane only, from an array in memory). Memory is that of a process of its own, above the interpreter with its
modules loaded. Run: ``python benchmarks/bench_surface.py [350000 5000000 20000000]``.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from metro.formats.ply import read_header
from metro.surface.face import measure_face

SIZES = (350_000, 5_000_000, 20_000_000)
PEER_LIMIT = 5_000_000


class PlyPoints:
    """Vertices of a PLY file of three floats each, read slice by slice, in metres."""

    def __init__(self, path: Path) -> None:
        header = read_header(path)
        self.path, self.count, self.start = path, header.vertices, header.size

    def __len__(self) -> int:
        return self.count

    def __getitem__(self, rows: slice) -> np.ndarray:
        first, last, _ = rows.indices(self.count)
        flat = np.fromfile(self.path, "<f4", 3 * (last - first), offset=self.start + 12 * first)
        return flat.reshape(-1, 3)


def write(path: Path, count: int) -> None:
    """Write a dome under noise of 19 µm as binary PLY, in metres."""
    columns = int(np.sqrt(count * 5))
    rows = count // columns
    x, y = np.meshgrid(np.linspace(0, 0.5, columns), np.linspace(0, 0.1, rows))
    z = 6e-5 * np.cos(12 * x) * np.cos(40 * y) + np.random.default_rng(0).normal(0, 19e-6, x.shape)
    with path.open("wb") as stream:
        lines = ["ply", "format binary_little_endian 1.0", f"element vertex {x.size}"]
        lines += [f"property float {axis}" for axis in "xyz"]
        stream.write(("\n".join([*lines, "end_header"]) + "\n").encode())
        np.stack([x, y, z], axis=-1).astype("<f4").tofile(stream)


def measured(path: Path) -> None:
    """Measure a file and print wall and CPU seconds, and megabytes above what the modules take."""
    small = np.random.default_rng(0).uniform(0, [0.05, 0.05, 1e-5], (20_000, 3))
    measure_face(small)  # loads SciPy
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    told = []
    for uncertainty in (False, True):
        wall, cpu = [], []
        for _ in range(3):
            start = time.perf_counter(), time.process_time()
            measure_face(PlyPoints(path), 19e-6, "known", uncertainty=uncertainty)
            wall.append(time.perf_counter() - start[0])
            cpu.append(time.process_time() - start[1])
        memory = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
        what = "with bias and uncertainty" if uncertainty else "indices and minimum zone"
        told.append(f"{what}: {min(wall):.4f} s wall, {min(cpu):.4f} s CPU, {memory:.0f} MB")
    print("; ".join(told))


def best(task: Callable[[], object]) -> float:
    """Least CPU seconds of two."""
    seconds = []
    for _ in range(2):
        start = time.process_time()
        task()
        seconds.append(time.process_time() - start)
    return min(seconds)


def peers(path: Path) -> dict[str, float]:
    """CPU seconds of the floor and of other ways to a plane."""
    source = PlyPoints(path)
    points = source[0 : len(source)]
    found = {"np.sum": best(lambda: points.sum(dtype=np.float64))}
    exact = points.astype(np.float64)
    found["SVD"] = best(lambda: np.linalg.svd(exact - exact.mean(axis=0), full_matrices=False))
    try:
        import open3d

        cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(exact))
        found["Open3D RANSAC"] = best(lambda: cloud.segment_plane(1e-4, 3, 1000))
    except ImportError:
        pass
    if len(points) <= PEER_LIMIT:
        try:
            from skspatial.objects import Plane, Points

            found["scikit-spatial"] = best(lambda: Plane.best_fit(Points(exact), full_matrices=False))
        except ImportError:
            pass
    return found


def main(sizes: list[int]) -> None:
    """Print a line per size."""
    with tempfile.TemporaryDirectory() as folder:
        for size in sizes:
            path = Path(folder) / "face.ply"
            write(path, size)
            command = [sys.executable, __file__, "--file", str(path)]
            told = subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
            print(f"{size} points: {told}", flush=True)
            print(
                "  peers, CPU s:", {name: round(value, 4) for name, value in peers(path).items()}, flush=True
            )


if __name__ == "__main__":
    if sys.argv[1:2] == ["--file"]:
        measured(Path(sys.argv[2]))
    else:
        main([int(size) for size in sys.argv[1:]] or list(SIZES))
