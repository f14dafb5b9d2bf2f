"""Flatness of a batch: a synthetic face whose compliance is known, and the simulated one, end to end."""

import errno
import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from cost import cost_ratio
from face_manifest import SIZE, manifest
from fake_tables import FakeTables
from load_rows import load_table

from metro.batch.batch import Batch
from metro.batch.findings import ContractError
from metro.batch.processed import COLUMNS, Processed, read_batch
from metro.effects.library import library
from metro.loop.search.search import search
from metro.loop.search.trial import Gates
from metro.observables.cut import conditions as cutting_force
from metro.observables.flatness import observable as flatness
from metro.observables.flatness.face_setting import FaceSetting
from metro.observables.flatness.path import force_over_period, make_path, passages
from metro.observables.flatness.pose_field import LoadSetting
from metro.observables.problem import BaseFit, Block, Problem, Refusal
from metro.structure import Structure
from metro.surface.lowest_cut import KINK
from metro.surface.tip_damping import Rayleigh, SharedRatio

ROOT = Path(__file__).resolve().parents[2]
SIMULATED = ROOT / "data/raw/irb6640-face"
MANIFEST = manifest(spacing_mm=0.5, sigma_mm=0.01)


def compliance(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """C (n, 3, 3) in mm/N at points in mm: varies linearly over the plate."""
    base = np.array([[2.9, 0.1, 0.7], [0.1, 1.4, -0.3], [0.7, -0.3, 1.2]]) * 1e-3
    slope = np.array([[1.0, 0.1, 0.6], [0.1, 0.8, 0.2], [0.6, 0.2, 1.0]]) * 4e-6
    return base + np.multiply.outer(x - 60.0, slope) - np.multiply.outer(y - 30.0, 0.5 * slope)


def path(along_x: bool) -> pd.DataFrame:
    length, width = SIZE if along_x else SIZE[::-1]
    s, lanes = np.arange(-12.0, length + 12.1, 2.0), np.arange(2.0, width, 10.0)
    way, lane = np.tile(s, len(lanes)), np.repeat(lanes, len(s))
    x, y = (way, lane) if along_x else (lane, way)
    number = np.repeat(np.arange(1, len(lanes) + 1), len(s))
    return pd.DataFrame({"point": np.arange(len(way)) + 1, "pass": number, "x_mm": x, "y_mm": y, "z_mm": 0.0})


def loads() -> pd.DataFrame:
    rows = []
    for number, (x, y) in enumerate((x, y) for x in (10.0, 60.0, 110.0) for y in (5.0, 55.0)):
        matrix = compliance(np.array([x]), np.array([y]))[0]
        for axis in range(3):
            for newton in (150.0, 250.0):
                force = newton * np.eye(3)[axis]
                rows.append(
                    ["A", f"P{number}", x, y, 0.0, *force, *np.round(matrix @ force, 4), 1]
                )  # gauges read to 0.1 µm
    return load_table(rows)


def make_batch(manifest: dict = MANIFEST, declared: float = 0.0) -> Batch:
    rows = [
        {
            "run": run,
            "role": role,
            "condition": f"d{depth}",
            "order": order,
            "operation": "face",
            "direction": "down",
        }
        | {
            "spindle_rpm": 12000.0,
            "feed_per_tooth_mm": 0.05,
            "axial_depth_mm": depth,
            "radial_depth_mm": 10.0,
        }
        | {"feed_direction_deg": declared, "pose": "A", "scan": f"{run}.ply", "path": "p.csv"}
        for order, (run, role, depth) in enumerate(
            [("r1", "identify", 1.0), ("r2", "validate", 2.0)], start=1
        )
    ]
    return Batch("plate", manifest, {"cell": "c"}, pd.DataFrame(rows).set_index("run"), {})


def reader(batch: Batch, along_x: bool = True, factor: float = 1.0, noise: float = 0.01) -> FakeTables:
    """Tables of a batch whose faces are the static deflection under the mean force, turned to the path."""
    rng = np.random.default_rng(5)
    values = cutting_force.coefficients(batch, {})
    straight = replace(batch, runs=batch.runs.assign(feed_direction_deg=0.0))

    def scan(run: str) -> pd.DataFrame:
        x, y = (c.ravel() for c in np.meshgrid(np.arange(0.25, SIZE[0], 0.5), np.arange(0.25, SIZE[1], 0.5)))
        force = cutting_force.mean_force_on_tool(straight, run, values)
        force = force if along_x else np.array([-force[1], force[0], force[2]])
        z = (compliance(x, y) @ force)[:, 2] / factor + rng.normal(0.0, noise, x.size)
        return pd.DataFrame({"run": run, "x_mm": x, "y_mm": y, "z_mm": z})

    def read(name: str, run: str | None = None) -> pd.DataFrame:
        made = {"scan": lambda: scan(run), "path": lambda: path(along_x), "loads": loads}
        return made[name]() if name in made else pd.DataFrame(columns=list(COLUMNS[name]))

    return FakeTables(read)


def observed_problem(batch: Batch, read: FakeTables) -> tuple[dict[str, pd.DataFrame], Problem]:
    observed = flatness.observe(batch, read, {})
    assert isinstance(observed, dict)
    task = flatness.problem(batch, observed, {})
    assert isinstance(task, Problem), task
    return observed, task


def load_blocks(task: Problem) -> list[Block]:
    return [block for block in task.blocks if isinstance(block.setting, LoadSetting)]


def face_blocks(task: Problem) -> list[Block]:
    return [block for block in task.blocks if isinstance(block.setting, FaceSetting)]


def fitted(task: Problem, factor: float = 1.0) -> tuple[BaseFit, float]:
    """Weighted least squares of calibrate and identify blocks, and the rms of the held-out rest (mm)."""
    model = replace(task.base, structure=Structure(factor))

    def design(block: object) -> np.ndarray:
        nuisance = model.nuisance_starts(block)
        return model.design(block, nuisance[len(nuisance) // 2])

    blocks = task.role("calibrate", "identify")
    rows = np.vstack([design(b)[0] / b.sigma[:, None] for b in blocks])
    right = np.concatenate([(b.measured - design(b)[1]) / b.sigma for b in blocks])
    beta = np.linalg.lstsq(rows, right, rcond=None)[0]
    (held,) = task.role("validate")
    rest = held.measured - design(held)[1] - design(held)[0] @ beta
    covariance = np.linalg.pinv(rows.T @ rows)
    return BaseFit(
        beta, covariance, 10.0, {b.run: task.base.nuisance_starts(b)[0] for b in task.blocks}
    ), float(np.sqrt((rest**2).mean()) * 1e3)


def strained(task: Problem, factor: float) -> float:
    """Whitened square that a fit to all blocks leaves, with what is believed of the force beforehand."""
    model = replace(task.base, structure=Structure(factor))
    parts = [(block, *model.design(block, model.nuisance_starts(block)[0])) for block in task.blocks]
    rows = np.vstack([matrix / block.sigma[:, None] for block, matrix, _ in parts])
    right = np.concatenate([(block.measured - offset) / block.sigma for block, _, offset in parts])
    rest = right - rows @ np.linalg.lstsq(rows, right, rcond=None)[0]
    return float(rest @ rest)


@pytest.fixture(scope="module")
def plate() -> tuple[Batch, dict[str, pd.DataFrame], Problem]:
    batch = make_batch()
    return batch, *observed_problem(batch, reader(batch))


def test_the_known_compliance_comes_back(plate: tuple) -> None:
    _, _, task = plate
    fit, rest = fitted(task)
    names = [p.name for p in task.base.parameters]
    values = dict(zip(names, fit.beta, strict=True))
    # at the middle of the load points, (60, 30) mm
    assert values["c_zx_u0v0_A"] == pytest.approx(0.7e-6, rel=0.02)
    assert values["c_zy_u0v0_A"] == pytest.approx(-0.3e-6, rel=0.02)
    assert values["c_zz_u0v0_A"] == pytest.approx(1.2e-6, rel=0.02)
    assert rest < 5e-3  # the rim finishes a point 8 mm away, where the tip is up to 3 µm higher or lower


def test_the_damping_is_reported_where_impacts_told_it_and_nowhere_else(plate: tuple) -> None:
    batch, observed, task = plate

    def reported(damping: Rayleigh | SharedRatio) -> dict:
        blocks = [
            replace(block, setting=replace(block.setting, ringing=SimpleNamespace(damping=damping)))
            if isinstance(block.setting, FaceSetting)
            else block
            for block in task.blocks
        ]
        return flatness.report(batch, observed, {}, replace(task, blocks=tuple(blocks)), None)

    assert "tip" not in reported(SharedRatio())
    told = reported(Rayleigh(np.array([0.9, 0.002]), np.diag([1e-4, 1e-9]), 1.0))["tip"]
    assert told["a0"]["value"] == pytest.approx(0.9)


def test_a_softer_arm_in_the_cut_is_predicted_by_its_factor_and_by_no_other() -> None:
    batch = make_batch()
    _, task = observed_problem(batch, reader(batch, factor=0.8))
    # One face does not tell force, place and stiffness apart: two of other depths do.
    strain = {factor: strained(task, factor) for factor in (0.7, 0.8, 0.9, 1.0)}
    assert min(strain, key=strain.__getitem__) == 0.8
    assert fitted(task, 1.0)[1] > 3 * fitted(task, 0.8)[1]


def test_load_tests_are_calibration_that_the_factor_does_not_touch(plate: tuple) -> None:
    _, _, task = plate
    loaded, face = load_blocks(task)[0], task.role("identify")[0]
    soft, beside = replace(task.base, structure=Structure(0.5)), len(task.base.believed)
    np.testing.assert_allclose(soft.design(loaded, np.zeros(0))[0], task.base.design(loaded, np.zeros(0))[0])
    yielding, stiff = (model.design(face, np.zeros(1))[0] for model in (soft, task.base))
    # Passages that are less than a kink apart finish a place together, and their difference doubles as well.
    known = face.setting.loaded[np.concatenate([part.used for part in task.base.fields])]
    heights = stiff[:, beside:] @ known
    assert np.abs(heights).max() > 20 * KINK
    np.testing.assert_allclose(yielding[:, beside:] @ known, 2 * heights, atol=KINK, rtol=0.0)


def test_an_error_of_the_place_that_all_scans_share_is_found_and_softens_nothing() -> None:
    """Heights that are off in all faces alike are the scanner's place: compliance is that of the loads."""
    batch = make_batch()
    _, task = observed_problem(batch, reader(batch))
    plane = {block.run: block.setting.plane @ [40e-6, -15e-6, 8e-6] for block in face_blocks(task)}
    off = replace(
        task,
        blocks=tuple(
            replace(block, measured=block.measured + plane[block.run]) if block.run in plane else block
            for block in task.blocks
        ),
    )
    (right, _), (found, rest) = fitted(task), fitted(off)
    place = [one.name.startswith("place") for one in task.base.believed]
    assert (found.beta - right.beta)[: len(place)][place] == pytest.approx([40e-6, -15e-6, 8e-6], rel=0.1)
    assert found.beta[len(place) :] == pytest.approx(right.beta[len(place) :], rel=0.02, abs=1e-9)
    assert rest < 4e-3


def test_the_path_is_trusted_over_a_declared_feed_direction() -> None:
    batch = make_batch(declared=0.0)
    _, task = observed_problem(batch, reader(batch, along_x=False))
    assert fitted(task)[1] < 3e-3
    assert any("the path is trusted" in note for note in task.notes)


def test_sigma_is_that_of_the_measured_heights(plate: tuple) -> None:
    batch, _, task = plate
    force = cutting_force.mean_force_on_tool(batch, "r1", cutting_force.coefficients(batch, {}))
    block = task.role("identify")[0]
    at = compliance(block.coordinates["x_mm"], block.coordinates["y_mm"]) @ force
    rest = block.measured * 1e3 - at[:, 2]
    assert np.std(rest / (block.sigma * 1e3)) == pytest.approx(1.0, abs=0.25)


def test_what_the_place_alone_tells_is_neither_measured_nor_predicted_where_none_is_declared() -> None:
    manifest = MANIFEST | {"instruments": {"scanner": {"spacing_mm": 0.5, "sigma_mm": 0.01}}}
    batch = make_batch(manifest)
    _, task = observed_problem(batch, reader(batch))
    block = task.role("identify")[0]
    start = task.base.nuisance_starts(block)[0]
    matrix, offset = task.base.design(block, start)
    for heights in (block.measured, matrix, offset):
        assert np.abs(block.zeros.T @ heights).max() < 1e-9 * max(np.abs(heights).max(), 1e-9) * len(
            block.zeros
        )
    assert block.zero_sd == pytest.approx(0.0)  # so that it is in no noise floor
    assert fitted(task)[1] < 3e-3
    placed = make_batch()
    task = observed_problem(placed, reader(placed))[1]
    assert task.role("identify")[0].zero_sd == pytest.approx(1e-5)


@pytest.mark.parametrize("place_known", [True, False])
def test_an_effect_changes_a_face_of_unknown_place_by_no_offset_and_no_tilt(place_known: bool) -> None:
    """Materiality is judged by this change: growth of the tool is a tilt, but for the returns in its time."""
    scanner = {"spacing_mm": 0.5, "sigma_mm": 0.01}
    batch = make_batch() if place_known else make_batch(MANIFEST | {"instruments": {"scanner": scanner}})
    _, task = observed_problem(batch, reader(batch))
    block = task.role("identify")[0]
    grown = replace(task.base, setup=replace(task.base.setup, growth=((6e-6, math.inf),)))
    start = task.base.nuisance_starts(block)[0]
    change = grown.design(block, start)[1] - task.base.design(block, start)[1]
    plane = np.abs(block.zeros.T @ change).max()
    assert np.abs(change).max() > 1e-8
    assert (plane > 1e-7) == place_known


def test_a_scan_that_lies_elsewhere_has_indices_but_is_not_paired() -> None:
    manifest = MANIFEST | {"instruments": {"scanner": {"spacing_mm": 0.5, "sigma_mm": 0.01}}}
    batch = make_batch(manifest)
    read = reader(batch)

    def moved(name: str, run: str | None = None) -> pd.DataFrame:
        table = read(name, run)
        return table.assign(x_mm=table["x_mm"] + 500.0) if name == "scan" else table

    observed = flatness.observe(batch, FakeTables(moved), {})
    task = flatness.problem(batch, observed, {})
    assert isinstance(task, Refusal)
    assert "to_work" in task.reason
    faces = flatness.report(batch, observed, {}, task, None)["faces"]
    assert faces["r1"]["fltt"]["value"] > 0


def test_a_full_temporary_folder_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(flatness, "measured_run", full)
    batch = make_batch()
    with pytest.raises(ContractError, match="points: cannot be written: No space left on device; make room"):
        flatness.observe(batch, reader(batch), {})


def test_the_report_has_every_index_of_the_contract(plate: tuple) -> None:
    batch, observed, task = plate
    faces = flatness.report(batch, observed, {}, task, fitted(task)[0])["faces"]
    expected = {
        "xm",
        "xa",
        "xg",
        "fltt",
        "fltp",
        "fltv",
        "fltq",
        "minimum_zone",
        "sigma",
        "xm_predicted",
        "points",
    }
    assert expected <= set(faces["r2"])
    assert faces["r2"]["xg"]["value"] <= faces["r2"]["xa"]["value"] <= faces["r2"]["xm"]["value"]
    assert set(observed["face_map"].columns) == {"run", "x_mm", "y_mm", "deviation_um"}
    assert len(observed["face_map"][observed["face_map"]["run"] == "r1"]) <= 3600


@pytest.mark.parametrize(
    ("missing", "word"), [("loads", "loads.csv"), ("coefficients", "coefficients"), ("tool", "tool")]
)
def test_what_is_lacking_is_named(missing: str, word: str, plate: tuple) -> None:
    batch, observed, _ = plate
    manifest = {key: value for key, value in MANIFEST.items() if key != missing}
    tables = observed | ({"face_loads": observed["face_loads"][:0]} if missing == "loads" else {})
    refused = flatness.problem(replace(batch, manifest=manifest), tables, {})
    assert isinstance(refused, Refusal)
    assert word in refused.reason


def test_a_batch_without_scans_is_refused() -> None:
    batch = make_batch()
    batch = replace(batch, runs=batch.runs.assign(scan="", path=""))  # with a path they would be planned
    assert isinstance(flatness.observe(batch, reader(batch), {}), Refusal)


def test_passes_back_and_forth_are_left_out_with_the_reason(plate: tuple) -> None:
    batch, observed, _ = plate
    points = observed["face_points"].copy()
    points = points.iloc[
        np.lexsort((np.where(points["pass"] % 2, 1, -1) * points["x_mm"], points["pass"], points["run"]))
    ]
    refused = flatness.problem(batch, observed | {"face_points": points}, {})
    assert isinstance(refused, Refusal)
    assert "one-way" in refused.reason


def test_the_rim_goes_over_a_point_in_front_of_the_axis_and_behind_it() -> None:
    found = passages(make_path(path(along_x=True)), np.array([0.060]), np.array([0.012 + 0.003]), 0.008)
    half = np.sqrt(0.008**2 - 0.003**2)  # from the pass at 12 mm
    far = np.sqrt(0.008**2 - 0.007**2)  # from the pass at 22 mm
    assert sorted(found.x[0][found.valid[0]]) == pytest.approx(
        [0.06 - half, 0.06 - far, 0.06 + far, 0.06 + half]
    )
    assert sorted(found.number[0][found.valid[0]]) == [1, 1, 2, 2]


def test_the_force_of_a_pass_rises_at_the_edge_to_its_mean_and_falls_to_nothing() -> None:
    batch = make_batch()
    tool = cutting_force.cutter(batch)
    values = cutting_force.coefficients(batch, {})
    force, period, speed = force_over_period(batch, "r1", values, make_path(path(along_x=True)), tool)
    assert speed == pytest.approx(0.04)
    assert period == pytest.approx(0.144 / 0.04 + 0.144 / 0.2 + 0.6)
    at = -0.012 + speed * period * np.arange(len(force)) / len(force)
    whole = cutting_force.mean_force_on_tool(batch, "r1", values)
    np.testing.assert_allclose(force[(at > 0.0) & (at < 0.112)] - whole, 0.0, atol=1e-6 * np.abs(whole).max())
    assert np.abs(force[(at < -0.008) | (at > 0.12)]).max() < 1e-6 * np.abs(whole).max()
    entering = force[(at > -0.008) & (at < 0.0), 2]
    assert (np.diff(entering) >= -1e-6).all()


def test_a_face_costs_as_much_as_a_few_search_trees_of_its_points() -> None:
    from scipy.spatial import KDTree

    from metro.surface.face import measure_face
    from metro.surface.footprint import sample

    rng = np.random.default_rng(0)
    x, y = (c.ravel() for c in np.meshgrid(np.arange(1333) * 0.375e-3, np.arange(263) * 0.375e-3))
    cloud = np.column_stack([x, y, 5e-5 * np.sin(20 * x) + rng.normal(0, 19e-6, x.size)])
    where = rng.uniform(0.01, 0.09, (2, 2500))

    def face() -> None:
        measure_face(cloud, 19e-6, "manifest")
        sample(cloud, *where)

    assert cost_ratio(face, lambda: KDTree(cloud)) < 12.0


def simulated_plate(folder: Path) -> Problem:
    """Transients, scatter, correlated noise, registration errors: by a simulator that shares no code."""
    from metro.stages.ingest import ingest

    ingest(SIMULATED, ROOT / "config/cells", folder, {}, "test")
    return observed_problem(read_batch(folder), Processed(folder))[1]


@pytest.mark.skipif(not SIMULATED.is_dir(), reason="data/raw/irb6640-face is not there")
def test_the_simulated_plate_fits_an_arm_as_stiff_as_it_was_in_the_cut(tmp_path: Path) -> None:
    task = simulated_plate(tmp_path / "p")
    assert all(isinstance(b.setting, FaceSetting) == (b.role != "calibrate") for b in task.blocks)
    misfit = {
        factor: sum(_misfit(task, factor, run) for run in ("r02", "r03", "r05", "r06"))
        for factor in (0.7, 0.8, 0.9, 1)
    }
    assert min(misfit, key=misfit.__getitem__) == 0.8


@pytest.mark.slow
@pytest.mark.skipif(not SIMULATED.is_dir(), reason="data/raw/irb6640-face is not there")
def test_the_simulated_plate_shows_how_stiff_the_arm_was_in_the_cut(tmp_path: Path) -> None:
    task = simulated_plate(tmp_path / "p")
    # The force of the base model can stand in for it, and so can masses: far beyond what is believed of them.
    outcome = search(task, library("flatness"), Gates(0.007, 0.004, 0.05, 3.0, 1))
    assert sum(outcome.base.chi2[b.run] for b in task.blocks if b.belief) > 30.0
    assert [effect.name for effect in outcome.final.candidate.effects] == ["stiffness_scale"]
    assert outcome.final.theta[0] == pytest.approx(0.8, abs=0.05)


def _misfit(task: Problem, factor: float, run: str) -> float:
    """Least whitened square of a face's rest over damping, offset and tilts; compliance by loads alone."""
    model = replace(task.base, structure=Structure(factor))
    block = next(b for b in task.blocks if b.run == run)
    loaded = np.concatenate(
        [
            np.linalg.lstsq(model.design(b, np.zeros(0))[0], b.measured, rcond=None)[0][columns]
            for b, columns in zip(
                load_blocks(task),
                np.split(np.arange(len(model.believed), len(model.parameters)), 2),
                strict=True,
            )
        ]
    )
    loaded = np.concatenate([np.zeros(len(model.believed)), loaded])
    scaled = (block.zeros * block.zero_sd) / block.sigma[:, None]
    best = np.inf
    for nuisance in model.nuisance_starts(block):
        matrix, offset = model.design(block, nuisance)
        rest = (block.measured - offset - matrix @ loaded) / block.sigma
        gain = np.linalg.solve(np.eye(3) + scaled.T @ scaled, scaled.T @ rest)
        best = min(best, float(rest @ rest - rest @ scaled @ gain))
    return best
