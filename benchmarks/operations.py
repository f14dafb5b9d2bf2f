"""The hot operations beside their peers and floors: what ``python -m benchmarks`` times.

A peer does the same with other software, or as the textbook has it; the floor is the least that the data
themselves cost (a sum, a Fourier transform, the eigenvalues). Both are timed in the same run.
"""

import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path

import bench_forces
import bench_identification
import bench_lobes
import bench_modal
import bench_robot
import bench_surface
import numpy as np

from metro.dynamics import band
from metro.dynamics.lobes import stability_boundary
from metro.dynamics.plscf import normal_equations, poles
from metro.signals import kalman, orders
from metro.surface.face import measure_face

Work = Callable[[], object]


@dataclass(frozen=True)
class Peer:
    """Something to compare with.

    Attributes
    ----------
    make : size → the work, ready to be called, and how many times it is to be taken: of what would take
        hours a part is timed.
    least : the times that the operation must be faster, else the operation has become slower.
    """

    name: str
    make: Callable[[int], tuple[Work, float]]
    least: float


@dataclass(frozen=True)
class Operation:
    """What is timed.

    Attributes
    ----------
    unit : what ``sizes`` count; peers and floor are timed at the size ``at``.
    make, floor : size → the work, ready to be called.
    most : the times that the operation may take the floor's time.
    """

    name: str
    unit: str
    sizes: tuple[int, ...]
    at: int
    make: Callable[[int], Work]
    peers: tuple[Peer, ...]
    floor_name: str
    floor: Callable[[int], Work]
    most: float


def noise(*shape):
    return np.random.default_rng(0).normal(size=shape)


def ffts(samples):
    return partial(np.fft.rfft, noise(samples, 3), axis=0)


def force_floor(samples):
    return partial(np.sin, np.linspace(0.0, 1e3, 3 * samples))


def identification(samples):
    batch, read = bench_identification.batch_of(
        samples / (bench_identification.RUNS * bench_identification.RATE)
    )
    return partial(bench_identification.identified, batch, read)


HIGHEST = 24


def record(samples):
    """Return time, angle and three noisy channels of 100 revolutions a second at 10 kHz."""
    time = np.arange(samples) / 10_000
    angle = 200 * np.pi * time
    return time, angle, np.sin(4 * angle)[:, None] + 0.1 * noise(samples, 3)


def order_averages(samples):
    return partial(orders.order_averages, *record(samples), HIGHEST, 4)


def dense_orders(samples):
    _, angle, signal = record(samples)

    def fit():
        turned = np.arange(1, HIGHEST + 1) * angle[:, None]
        matrix = np.hstack([np.ones((samples, 1)), np.cos(turned), np.sin(turned)])
        return np.linalg.lstsq(matrix, signal)

    return fit, 1.0


def lobes(speeds):
    return partial(
        stability_boundary, bench_lobes.ONE, bench_lobes.one_mode(1.0), np.linspace(5000, 10000, speeds)
    )


def classical_grid(speeds):
    return partial(bench_lobes.dense_radius, bench_lobes.one_mode(1.0), 6000.0, 5e-4), 101.0 * speeds


def eigenvalues(number, size):
    stack = noise(number, size, size)
    return partial(np.linalg.eigvals, stack)


BAND_SPEEDS = np.linspace(500, 2500, 80)


def band_samples(samples):
    boundary = stability_boundary(bench_lobes.EIGHT, bench_lobes.SLOT, BAND_SPEEDS)
    deviations = noise(samples, 26) * np.repeat([0.002, 0.02, 0.02, 0.03], [8, 8, 8, 2])
    return partial(band.depth_samples, bench_lobes.EIGHT, bench_lobes.SLOT, boundary, deviations)


def boundaries_anew(samples):
    return partial(stability_boundary, bench_lobes.EIGHT, bench_lobes.SLOT, BAND_SPEEDS), samples


def band_floor(samples):
    return partial(np.matmul, noise(samples, 26), noise(26, len(BAND_SPEEDS)))


ORDERS = range(2, 61, 2)


def stabilisation(outputs):
    frequency, frf, *_ = bench_modal.large_set()
    wide = np.resize(frf.transpose(1, 0, 2), (outputs, len(frequency), 3)).transpose(1, 0, 2)

    def diagram():
        equations = normal_equations(frequency, wide, np.ones((len(frequency), outputs)), 60)
        return [poles(equations, order) for order in ORDERS]

    return diagram


def companions(_outputs):
    parts = [eigenvalues(1, 3 * order) for order in ORDERS]
    return lambda: [part() for part in parts]


def steps(samples):
    return np.cumsum(0.3 * noise(samples, 6), axis=0)


def smoother(samples):
    one = np.ones(6)
    return partial(kalman.smooth, steps(samples), one, 0.09 * one)


def filterpys(samples):
    """The filter and smoother of one joint, of which a tenth of the samples is timed."""
    from filterpy.kalman import KalmanFilter

    signal, few = steps(samples)[:, :1], samples // 10
    peer = KalmanFilter(dim_x=1, dim_z=1)
    peer.F = peer.H = peer.R = np.eye(1)
    peer.Q, peer.x, peer.P = np.array([[0.09]]), signal[:1].copy(), np.eye(1)

    def smooth():
        mean, spread, _, _ = peer.batch_filter(signal[:few, 0])
        return peer.rts_smoother(mean, spread)

    return smooth, 60.0


def log_of_ten_minutes(_samples):
    cut, idle = bench_robot.logs()
    return partial(bench_robot.whole, cut, idle)


@cache
def face_file(points):
    """Write a face, to be kept for peers and floor."""
    folder = Path(tempfile.gettempdir()) / f"metro-benchmark-{points}"
    folder.mkdir(exist_ok=True)
    bench_surface.write(folder / "face.ply", points)
    return folder / "face.ply"


def face_points(points):
    source = bench_surface.PlyPoints(face_file(points))
    return source[0 : len(source)].astype(np.float64)


def flatness(points):
    path = face_file(points)
    return lambda: measure_face(bench_surface.PlyPoints(path), 19e-6, "known", uncertainty=False)


def svd(points):
    exact = face_points(points)
    return partial(np.linalg.svd, exact - exact.mean(axis=0), full_matrices=False), 1.0


def ransac(points):
    import open3d

    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(face_points(points)))
    return partial(cloud.segment_plane, 1e-4, 3, 1000), 1.0


def best_fit(points):
    from skspatial.objects import Plane, Points

    return partial(Plane.best_fit, Points(face_points(points)), full_matrices=False), 1.0


def report(_pages):
    sys.path.insert(0, str(Path(__file__).parents[1] / "tests/report"))
    import synthetic_results

    from metro.report.batch_report import batch_report

    return partial(batch_report, synthetic_results.results())


def figures(_pages):
    """Draw one figure with a curve as SVG: what a report has a score of."""
    import io

    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    def drawn():
        figure, axes = plt.subplots()
        axes.plot(np.arange(100.0))
        figure.savefig(io.BytesIO(), format="svg")
        plt.close(figure)

    return drawn


OPERATIONS = (
    Operation(
        *("force of a run, runout", "samples", (10_000, 100_000, 1_000_000, 10_000_000), 10_000),
        lambda samples: partial(bench_forces.ours, samples),
        (
            Peer("slices, a loop", lambda n: (partial(bench_forces.slice_loop, n), 1.0), 20.0),
            Peer("slices, vectorised", lambda n: (partial(bench_forces.slices_vectorised, n), 1.0), 5.0),
        ),
        *("sine of every sample", force_floor, 100.0),
    ),
    Operation(
        *("coefficients from waveforms", "samples", (90_000, 900_000, 9_000_000), 900_000),
        identification,
        (),
        *("Fourier transform", ffts, 100.0),
    ),
    Operation(
        *("order averages", "samples", (10_000, 100_000, 1_000_000, 10_000_000), 100_000),
        order_averages,
        (Peer("least squares of the whole record", dense_orders, 0.2),),
        *("Fourier transform", ffts, 100.0),
    ),
    Operation(
        *("stability lobes", "speeds", (20, 200, 2000), 200),
        lobes,
        (Peer("classical grid", classical_grid, 1000.0),),
        *("eigenvalues", lambda speeds: eigenvalues(14 * speeds, 14), 20.0),
    ),
    Operation(
        *("band of the lobes", "samples", (60, 600, 6000), 600),
        band_samples,
        (Peer("every boundary anew", boundaries_anew, 20.0),),
        *("one matrix product", band_floor, 1e5),
    ),
    Operation(
        *("poles of all orders to 60 (pLSCF)", "outputs", (6, 60, 600, 6000), 60),
        stabilisation,
        (),
        *("eigenvalues", companions, 20.0),
    ),
    Operation(
        *("Kalman smoother, six joints", "samples", (1_600, 16_000, 160_000, 1_600_000), 16_000),
        smoother,
        (Peer("filterpy", filterpys, 50.0),),
        *("cumulative sum", lambda n: partial(np.cumsum, noise(n, 6), axis=0), 100.0),
    ),
    Operation(
        *("robot log of ten minutes, aligned and smoothed", "samples", (50_000,), 50_000),
        log_of_ten_minutes,
        (Peer("filterpy alone", filterpys, 2.0),),
        *("cumulative sum", lambda n: partial(np.cumsum, noise(n, 6), axis=0), 1e4),
    ),
    Operation(
        *("PLY file to certified flatness", "points", (20_000, 200_000, 2_000_000, 20_000_000), 2_000_000),
        flatness,
        (
            Peer("SVD, a plane only", svd, 0.05),
            Peer("Open3D's RANSAC, a plane only", ransac, 0.2),
            Peer("scikit-spatial, a plane only", best_fit, 0.05),
        ),
        *("sum of the points", lambda n: partial(np.sum, face_points(n)), 1000.0),
    ),
    Operation(
        *("PDF of a batch", "reports", (1,), 1),
        report,
        (),
        *("one figure", figures, 300.0),
    ),
)
