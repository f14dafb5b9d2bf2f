"""Batches like those that other laboratories have, made by hand: hammer tests of many kinds, logs, scans."""

import numpy as np
import pandas as pd

HAMMER = """\
format: 1
batch: {name}
source: measured
cell: bench
instruments:
  hammer: {{rate_hz: 2048, window: none}}
"""
TOOL = "tool: {diameter_mm: 12, teeth: 4, helix_deg: 30}\n"
FREQUENCY = np.arange(1.0, 500.0, 0.5)
NATURAL, DAMPING = np.array([112.0, 307.0]), np.array([0.02, 0.015])
COEFFICIENTS = (
    "coefficients: {ktc_n_mm2: 900, krc_n_mm2: 300, kac_n_mm2: 200, "
    "kte_n_mm: 15, kre_n_mm: 20, kae_n_mm: 5}\n"
)


def shapes(place):
    """Return the shapes of two modes of a beam at a place between 0 and 1."""
    return np.array([np.cos(2 * np.pi * place), np.cos(3 * np.pi * place)])


def receptance(one, other):
    """Return the receptance between two places of the beam, m/N."""
    natural = 2.0 * np.pi * NATURAL[:, None]
    s = 2j * np.pi * FREQUENCY
    modes = (
        0.2
        * (shapes(one) * shapes(other))[:, None]
        / (s**2 + 2 * DAMPING[:, None] * natural * s + natural**2)
    )
    return modes.sum(axis=0)


def frf(folder, pairs, *, name="frf", manifest=""):
    """Write a batch of FRFs between points of a beam: ``pairs`` of (reference, response) numbers."""
    folder.mkdir()
    (folder / "batch.yaml").write_text(HAMMER.format(name=folder.name) + manifest)
    rows = ["test,position,reference,response,replicate,kind,file,response_unit"]
    for reference, response in pairs:
        values = receptance((reference - 1) / 8.0, (response - 1) / 8.0)
        file = f"{name}-{reference}-{response}.csv"
        table = {"frequency_hz": FREQUENCY, "real": values.real, "imag": values.imag}
        pd.DataFrame(table).to_csv(folder / file, index=False)
        rows.append(f"beam,1,{reference}x,{response}x,1,frf,{file},m")
    (folder / "impacts.csv").write_text("\n".join(rows) + "\n")


def records(folder, pairs, *, repeats=2):
    """Write a batch of hammer records, each of one hit and one response."""
    folder.mkdir()
    (folder / "batch.yaml").write_text(HAMMER.format(name=folder.name))
    rng = np.random.default_rng(1)
    time = np.arange(4096) / 2048.0
    rows = ["test,position,reference,response,replicate,kind,file,response_unit"]
    for reference, response in pairs:
        for repeat in range(1, repeats + 1):
            start = 20 + 3 * repeat
            force = np.zeros(time.size)
            force[start : start + 4] = [60.0, 140.0, 120.0, 40.0]
            amounts = shapes((reference - 1) / 8.0) * shapes((response - 1) / 8.0)
            answer = np.zeros(time.size)
            for amount, natural, damping in zip(amounts, 2 * np.pi * NATURAL, DAMPING, strict=True):
                free = np.exp(-damping * natural * time) * np.sin(natural * time) * amount
                answer += 0.2 / natural * np.gradient(np.gradient(free, time), time)
            response_m_s2 = np.convolve(force, answer)[: time.size] / 2048.0
            response_m_s2 += rng.normal(0.0, 1e-3, time.size)
            table = {
                "t_s": time,
                "force_n": force + rng.normal(0, 0.05, time.size),
                "response": response_m_s2,
            }
            file = f"hit-{reference}-{response}-{repeat}.csv"
            pd.DataFrame(table).to_csv(folder / file, index=False)
            rows.append(f"beam,1,{reference}x,{response}x,{repeat},record,{file},m/s2")
    (folder / "impacts.csv").write_text("\n".join(rows) + "\n")


LOG_COLUMNS = [f"q{i}_set_deg" for i in range(1, 7)] + [f"q{i}_deg" for i in range(1, 7)]


def logs_alone(folder):
    """Write a batch of an arm of which only the robot's own log of each cut is there."""
    folder.mkdir()
    text = "format: 1\nsource: measured\ncell: kr160\ntool_in_flange_mm: [0, 0, 300]\n"
    (folder / "batch.yaml").write_text(f"{text}batch: {folder.name}\n{TOOL}")
    rows = [
        "run,operation,spindle_rpm,feed_per_tooth_mm,axial_depth_mm,radial_depth_mm,direction,robot_log,idle_log"
    ]
    time = np.arange(200) * 0.012
    for run in range(1, 4):
        for which, load in (("cut", 30.0), ("idle", 0.0)):
            rng = np.random.default_rng(10 * run + int(load))
            angles = {name: 10.0 * (i % 6) + 5 * time for i, name in enumerate(LOG_COLUMNS)}
            torques = {f"tau{i}_nm": 100 * i + load + rng.normal(0, 3, time.size) for i in range(1, 7)}
            pd.DataFrame({"t_s": time, **angles, **torques}).to_csv(folder / f"{which}{run}.csv", index=False)
        rows.append(f"r{run},side,4000,0.0{run + 4},2,4,down,cut{run}.csv,idle{run}.csv")
    (folder / "runs.csv").write_text("\n".join(rows) + "\n")


def scans_alone(folder):
    """Write a batch of scans of faces with neither a path nor anything else."""
    folder.mkdir()
    text = "format: 1\nsource: measured\ncell: bench\nwork: {size_mm: [60, 40, 20]}\n"
    (folder / "batch.yaml").write_text(f"{text}batch: {folder.name}\n")
    rows = ["run,operation,scan"]
    for run in range(1, 4):
        rng = np.random.default_rng(run)
        x, y = (axis.ravel() for axis in np.meshgrid(np.arange(0, 61, 1.5), np.arange(0, 41, 1.5)))
        np.savetxt(folder / f"face{run}.xyz", np.c_[x, y, rng.normal(0, 0.005, x.size)])
        rows.append(f"r{run},face,face{run}.xyz")
    (folder / "runs.csv").write_text("\n".join(rows) + "\n")


def slopes_alone(folder):
    """Write a batch of a level's readings alone: two faces on grids of lines, one on a single line."""
    folder.mkdir()
    text = "format: 1\nsource: measured\ncell: bench\ninstruments: {level: {sigma_urad: 1}}\n"
    (folder / "batch.yaml").write_text(f"{text}batch: {folder.name}\n")
    along = [(x, y, x + 200, y) for y in range(0, 601, 200) for x in range(0, 800, 200)]
    across = [(x, y, x, y + 200) for x in range(0, 801, 200) for y in range(0, 600, 200)]
    rows = ["run,slopes"]
    for run, feet in enumerate(([*along, *across], [*along, *across], along[:4]), 1):
        slopes = np.random.default_rng(run).normal(30.0, 5.0, len(feet))
        table = pd.DataFrame(feet, columns=["x1_mm", "y1_mm", "x2_mm", "y2_mm"]).assign(slope_urad=slopes)
        table.to_csv(folder / f"level{run}.csv", index=False)
        rows.append(f"r{run},level{run}.csv")
    (folder / "runs.csv").write_text("\n".join(rows) + "\n")


PLACES = range(1, 10)
WRITERS = {
    "made-driving-point": lambda folder: frf(folder, [(1, 1)]),
    "made-no-driving-point": lambda folder: frf(folder, [(1, 2), (1, 3)]),
    "made-roving-hammer": lambda folder: frf(folder, [(place, 1) for place in PLACES]),
    "made-roving-sensor": lambda folder: frf(folder, [(1, place) for place in PLACES]),
    "made-roving-lobes": lambda folder: frf(
        folder, [(place, 1) for place in PLACES], manifest=TOOL + COEFFICIENTS
    ),
    "made-grid": lambda folder: frf(folder, [(hit, place) for hit in (1, 5) for place in PLACES]),
    "made-one-hit": lambda folder: records(folder, [(1, 1)], repeats=1),
    "made-hits": lambda folder: records(folder, [(1, 1), (3, 3)]),
    "made-hits-many-responses": lambda folder: records(folder, [(1, 1), (1, 3), (1, 5)]),
    "made-hits-roving": lambda folder: records(folder, [(place, 1) for place in PLACES]),
    "made-hits-no-driving-point": lambda folder: records(folder, [(2, 1), (3, 1)]),
    "made-logs-alone": logs_alone,
    "made-scans-alone": scans_alone,
    "made-slopes-alone": slopes_alone,
}
