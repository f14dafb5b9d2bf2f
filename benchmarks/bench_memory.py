"""Peak memory of the stages that read recordings, against the samples and points that they read.

A batch of two runs whose dynamometer records grow, and one of two faces whose clouds grow: the bundled
simulated batches with longer recordings in the place of theirs. Ingest and identify are processes of their
own; what they take more per sample or point is the slope over the sizes, and with it the largest that fits in
1 GiB. Run: ``python benchmarks/bench_memory.py [force | scan] [sizes]``.
"""

import os
import shutil
import sys
import tempfile
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
from command_cost import cost

from metro.codehash import code_hash

ROOT = Path(__file__).parents[1]
BOUND = 1024.0  # MiB
SIZES = {"force": (500_000, 2_000_000, 8_000_000), "scan": (1_000_000, 4_000_000, 16_000_000)}
BUNDLED = {"force": "clean-slot", "scan": "irb6640-face"}
METRO = (sys.executable, "-c", "from metro.cli import app; app()")
IDENTIFY = '{"model_form_budget": 0.007}'
CHANNELS = ("fx_n", "fy_n", "fz_n", "mx_nm", "my_nm", "mz_nm")
PIECE = 1 << 20  # rows that are written at once
REVOLUTION = 100  # samples of 6000 rpm at 10 kHz


def write_record(path, count):
    """Write six channels of three teeth that cut after a second of air, revolution by revolution."""
    rng = np.random.default_rng(0)
    angle = 2 * np.pi * np.arange(REVOLUTION) / REVOLUTION
    tooth = np.maximum(np.sin(3 * angle), 0.0)
    force = np.column_stack([-80.0 * tooth, 150.0 * tooth, 40.0 * tooth])
    schema = pa.schema([("t_s", pa.float64()), *((name, pa.float32()) for name in CHANNELS)])
    with pq.ParquetWriter(path, schema) as writer:
        for start in range(0, count, PIECE):
            place = np.arange(start, min(start + PIECE, count))
            signal = np.where(place[:, None] >= 10_000, force[place % REVOLUTION], 0.0)
            signal = np.hstack([signal, 0.01 * signal]) + rng.normal(0.0, 1.0, (len(place), 6))
            arrays = [pa.array(place / 10_000), *(pa.array(each.astype("f4")) for each in signal.T)]
            writer.write_table(pa.table(arrays, schema=schema))


def write_face(path, count):
    """Write a face of 200 mm by 100 mm with a dome and noise, in the frame of the bundled batch's scanner."""
    across = round(np.sqrt(count / 2))
    x, y = np.linspace(0.5, 199.5, 2 * across), np.linspace(0.5, 99.5, across)
    rng = np.random.default_rng(0)
    with path.open("wb") as stream:
        head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(x) * len(y)}\n"
        stream.write((head + "".join(f"property float {axis}\n" for axis in "xyz") + "end_header\n").encode())
        for row in y:
            z = 120.0 + 0.05 * np.cos(x / 80) * np.cos(row / 30) + rng.normal(0.0, 0.019, len(x))
            np.column_stack([np.full(len(x), row + 35.0), 260.0 - x, z]).astype("<f4").tofile(stream)


def batch(folder, kind, count):
    """Make a batch of the first runs of a bundled one, one of each role, with a recording of that size."""
    made = folder / BUNDLED[kind]
    shutil.copytree(ROOT / "data/raw" / made.name, made)
    runs = pd.read_csv(made / "runs.csv").groupby("role", sort=False).head(1)
    runs.to_csv(made / "runs.csv", index=False)
    column, write = {"force": ("dynamometer", write_record), "scan": ("scan", write_face)}[kind]
    write(made / runs.loc[runs["role"] == "identify", column].iloc[0], count)
    return made


def stages(kind, count):
    """Return the costs of ingest and identify."""
    with tempfile.TemporaryDirectory() as name:
        raw, out = batch(Path(name), kind, count), Path(name) / "processed"
        where = {"folder": ROOT, "environment": {**os.environ, "OPENBLAS_NUM_THREADS": "1"}}
        code = {stage: code_hash(stage) for stage in ("ingest", "identify")}
        command = (*METRO, "ingest", raw, "--cells", "config/cells", "--out", out, "--settings", "{}")
        read = cost(*command, "--code", code["ingest"], **where)
        command = (*METRO, "identify", "--processed", out, "--settings", IDENTIFY)
        return read, cost(*command, "--code", code["identify"], **where)


def main(kinds, sizes):
    """Print a line per size, then slope and largest size of each stage."""
    for kind in kinds:
        counts, peaks = sizes or SIZES[kind], []
        for count in counts:
            both = stages(kind, count)
            peaks.append([one.memory for one in both])
            told = (f"{one.memory:.0f} MiB, {one.cpu:.1f} s CPU" for one in both)
            print(f"{kind}, {count:,}: ingest {{}}; identify {{}}".format(*told), flush=True)
        for stage, peak in zip(("ingest", "identify"), np.transpose(peaks), strict=True):
            slope, floor = np.polyfit(counts, peak, 1)
            most = (BOUND - floor) / slope if slope > 0 else np.inf
            print(f"  {stage}: {floor:.0f} MiB + {slope * 2**20:.0f} bytes each, 1 GiB at {most:,.0f}")


if __name__ == "__main__":
    words = sys.argv[1:]
    main([word for word in words if word in SIZES] or SIZES, [int(word) for word in words if word.isdigit()])
