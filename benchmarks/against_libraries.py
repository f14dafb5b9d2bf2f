"""What is written by hand here beside the library that does it: ``python benchmarks/against_libraries.py``.

Prints the tables of docs/dependencies.md. Times are CPU seconds of one core, the best of three.
"""

import os
import sys
import tempfile
import time
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).parent))

import bench_surface
import numpy as np
from scipy.optimize import least_squares
from scipy.sparse import lil_matrix

from metro.formats import FormatError
from metro.formats.registry import read
from metro.formats.uff import Function, read_functions
from metro.formats.uff_writer import universal_file
from metro.loop.checks.signature import q_values
from metro.loop.fitting import descent
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.noise import Noise
from metro.loop.fitting.system import State
from metro.observables.problem import Block, Parameter
from metro.signals import kalman, kalman_uneven

CUT = 0.6  # of a file that is kept
POINTS, BINS = 2_000_000, 16_000


def seconds(work):
    """Return the least CPU seconds of three calls."""
    spent = []
    for _ in range(3):
        start = time.process_time()
        work()
        spent.append(time.process_time() - start)
    return min(spent)


def cut(path):
    """Keep the first part of a file."""
    content = path.read_bytes()
    path.write_bytes(content[: int(CUT * len(content))])
    return path


def refusal(path, kind):
    """Return what our reader says of a damaged file."""
    try:
        read(path, kind)
    except FormatError as error:
        return f"refused: {str(error).removeprefix(str(path)).lstrip(': ')}"
    return "read"


def tdms(folder):
    """Four channels of 4000 values in four segments, cut off."""
    import nptdms

    path = folder / "a.tdms"
    with nptdms.TdmsWriter(str(path)) as writer:
        for _ in range(4):
            names = ("Time", "Fx", "Fy", "Fz")
            values = np.random.default_rng(0).normal(size=(4, 1000))
            properties = {"unit_string": "N"}
            channels = [
                nptdms.ChannelObject("Cut", n, v, properties) for n, v in zip(names, values, strict=True)
            ]
            writer.write_segment(channels)
    (group,) = nptdms.TdmsFile.read(cut(path)).groups()
    counts = ", ".join(str(len(channel)) for channel in group.channels())
    return f"npTDMS: {counts} values of 4000 each, and a line in the log", refusal(path, "force")


def uff(folder):
    """An FRF whose lines lie 5000 Hz / 2^14 apart, which the header prints as 0.305176 Hz."""
    import pyuff

    path, spacing = folder / "a.uff", 5000 / 2**14
    lines = spacing * np.arange(4097)
    given = Function(4, "1x", "1x", "m", lines, np.ones(len(lines), complex))
    path.write_bytes(universal_file([given]))
    theirs = next(each for each in pyuff.UFF(str(path)).read_sets() if each["type"] == 58)
    own, other = read_functions(path)[0].frequency, theirs["x"][: len(lines)]
    return f"pyuff: {np.abs(other - lines).max():.1g} Hz off at the last line", (
        f"{np.abs(own - lines).max():.1g} Hz"
    )


def ply(folder):
    """Two million points, cut off."""
    import open3d

    path = folder / "a.ply"
    bench_surface.write(path, POINTS)
    cloud = np.asarray(open3d.io.read_point_cloud(str(cut(path))).points)
    zeros = int((cloud == 0).all(axis=1).sum())
    return f"Open3D: {zeros:,} of {len(cloud):,} points are zeros, with a warning on the console", refusal(
        path, "cloud"
    )


def stl(folder):
    """A mesh of 20 000 triangles, cut off."""
    import open3d

    path = folder / "a.stl"
    mesh = open3d.geometry.TriangleMesh.create_sphere(resolution=100)
    mesh.compute_triangle_normals()
    open3d.io.write_triangle_mesh(str(path), mesh)
    whole = len(mesh.triangles)
    theirs = len(open3d.io.read_triangle_mesh(str(cut(path))).triangles)
    return f"Open3D: {theirs:,} of {whole:,} triangles", refusal(path, "cloud")


def text(folder, suffix):
    """A cloud as text, one of whose lines is broken."""
    import open3d

    path = folder / f"a{suffix}"
    lines = [f"{x:.4f} {y:.4f} {z:.4f}" for x, y, z in np.random.default_rng(1).uniform(0, 9, (1000, 3))]
    lines[500] = "1.0 2.0 x"
    path.write_text("\n".join([*(["1000"] if suffix == ".pts" else []), *lines]) + "\n")
    theirs = len(open3d.io.read_point_cloud(str(path)).points)
    return f"Open3D: {theirs} of 1000 points", refusal(path, "cloud")


def smoother():
    """One channel by the closed form and by filterpy, which is given a tenth of the samples."""
    rng, few = np.random.default_rng(2), BINS // 10
    signal = np.cumsum(rng.normal(0, 0.3, (BINS, 6)), axis=0) + rng.normal(0, 1.0, (BINS, 6))
    one, wander = np.ones(6), np.full(6, 0.09)
    own = seconds(lambda: kalman.smooth(signal, one, wander))
    part, even = signal[:few, :1], np.ones(few - 1)
    theirs = seconds(lambda: kalman_uneven.smooth(part, one[:1], wander[:1], even))
    apart = np.abs(
        kalman_uneven.smooth(part, one[:1], wander[:1], even)[0] - kalman.smooth(part, one[:1], wander[:1])[0]
    ).max()
    return f"filterpy: {6 * 10 * theirs / own:.0f} × the time, {apart:.0g} apart", f"{own:.2g} s, six joints"


def trials():
    """Likelihood of 29 trials of Q on an uneven clock: together, and by filterpy one by one."""
    from filterpy.kalman import KalmanFilter

    rng, count = np.random.default_rng(3), 500
    signal, even = rng.normal(size=(count, 6)).cumsum(axis=0), np.ones(count - 1)
    drift = np.geomspace(1e-3, 1e3, 29)[:, None] * np.ones(6)
    own = seconds(lambda: kalman_uneven.log_likelihood(signal, np.ones(6), drift, even))

    def one_by_one():
        for q in drift:
            walk = KalmanFilter(dim_x=6, dim_z=6)
            walk.F = walk.H = walk.R = walk.P = np.eye(6)
            walk.x, walk.Q = signal[0], np.diag(q)
            walk.batch_filter(signal[1:])

    return f"filterpy: {seconds(one_by_one) / own:.0f} × the time", f"{own:.2g} s"


def white():
    """Ljung and Box's test of six channels."""
    from statsmodels.stats.diagnostic import acorr_ljungbox

    found = np.random.default_rng(4).normal(size=(400, 6))

    def theirs():
        return [acorr_ljungbox(c, lags=[10], model_df=1)["lb_pvalue"].iloc[0] for c in found.T]

    ours = kalman.whiteness(found)
    times = seconds(theirs) / seconds(lambda: kalman.whiteness(found))
    return f"statsmodels: {times:.0f} × the time, {np.abs(ours - theirs()).max():.0g} apart", "six channels"


def discoveries():
    """Benjamini and Hochberg's q-values."""
    from scipy.stats import false_discovery_control

    rng = np.random.default_rng(5)
    draws = [rng.random(rng.integers(1, 40)) ** 3 for _ in range(2000)]
    pairs = [(q_values(list(p)), false_discovery_control(p)) for p in draws]
    apart = max(np.max(np.abs(a - b) / b) for a, b in pairs)
    differ = sum(not np.array_equal(a, b) for a, b in pairs)
    return f"scipy: last digit differs in {differ} of 2000 draws, by {apart:.0g}", "8 lines"


class Phases:
    """A wave of four parameters whose phase is every run's own."""

    time = np.linspace(0.0, 4.0 * np.pi, 200)
    parameters = tuple(Parameter(f"b{i}", "1") for i in range(4))

    def nuisance_starts(self, _block):
        return np.zeros((1, 1))

    def design(self, _block, nuisance, _beta):
        angle = self.time + nuisance[0]
        columns = [np.cos(angle), np.cos(2 * angle), np.sin(2 * angle), np.ones(len(angle))]
        return np.column_stack(columns), np.zeros(len(angle))


def eliminated(runs):
    """Four parameters and the phases of many runs: ours, scipy's, and scipy's with its zeros declared."""
    rng, model, count = np.random.default_rng(6), Phases(), len(Phases.time)
    true, start, one = np.array([3.0, 1.0, 0.5, 0.2]), np.array([2.0, 0.5, 0.1, 0.0]), np.full(count, 0.1)
    phases = rng.uniform(-0.4, 0.4, runs)
    data = [model.design(None, [p], None)[0] @ true + rng.normal(0, 0.1, count) for p in phases]
    name, none = np.full(count, "y"), np.zeros((count, 0))
    blocks = [
        Block(f"r{i}", "c", "identify", i, y, one, None, name, none, np.zeros(0), {})
        for i, y in enumerate(data)
    ]
    noise, candidate = Noise(0.0, np.zeros(4), {"c": 1.0}), Candidate(model)

    def ours():
        state = State(np.zeros(0), start.copy(), {block.run: np.zeros(1) for block in blocks})
        return descent.descend(candidate, blocks, noise, state, 500, enough=1e-9)[0].beta

    def residual(x):
        parts = zip(x[4:], data, strict=True)
        return np.concatenate([(model.design(None, [p], None)[0] @ x[:4] - y) / 0.1 for p, y in parts])

    zeros = lil_matrix((runs * count, 4 + runs), dtype=int)
    zeros[:, :4] = 1
    for i in range(runs):
        zeros[i * count : (i + 1) * count, 4 + i] = 1
    begin = np.concatenate([start, np.zeros(runs)])
    own = seconds(ours)
    dense, sparse = (
        seconds(lambda given=given: least_squares(residual, begin, jac_sparsity=given)) / own
        for given in (None, zeros)
    )
    apart = np.abs(ours() - least_squares(residual, begin).x[:4]).max()
    return f"scipy: {dense:.2g} × the time, with its zeros declared {sparse:.2g} ×, {apart:.0g} apart", (
        f"{own:.2g} s"
    )


def main():
    """Print a row for each place."""
    print("| what | the library | ours |\n| --- | --- | --- |", flush=True)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for title, row in (
            ("TDMS, cut at 60 %", lambda: tdms(folder)),
            ("UFF 58, lines printed as 0.305176 Hz apart", lambda: uff(folder)),
            ("PLY, cut at 60 %", lambda: ply(folder)),
            ("STL, cut at 60 %", lambda: stl(folder)),
            ("XYZ, a broken line", lambda: text(folder, ".xyz")),
            ("PTS, a broken line", lambda: text(folder, ".pts")),
            ("smoother of an even walk, 16 000 samples", smoother),
            ("likelihood of an uneven walk, 29 trials of 500 samples", trials),
            ("Ljung and Box's test", white),
            ("Benjamini and Hochberg's q-values", discoveries),
            ("parameters with a phase of each run, 12 runs", lambda: eliminated(12)),
            ("the same, 108 runs", lambda: eliminated(108)),
        ):
            library, own = row()
            print(f"| {title} | {library} | {own} |", flush=True)


if __name__ == "__main__":
    main()
