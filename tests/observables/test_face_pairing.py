"""Predicted faces beside scanned ones: similarity with its interval, noise taken out, the report."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
import pytest

from metro.observables.flatness.pairing import paired
from metro.observables.problem import BaseFit, Block, Problem
from metro.report.sections.face_pairing import by_face, pairing_items
from metro.units import MM, UM

X, Y = (c.ravel() for c in np.meshgrid(np.linspace(0, 200, 25), np.linspace(5, 95, 8)))
PLANE = np.column_stack([np.ones(len(X)), X, Y])
SHAPE = 40 * UM * np.sin(X / 30) * np.cos(Y / 40)
SHAPE = SHAPE - PLANE @ np.linalg.lstsq(PLANE, SHAPE, rcond=None)[0]


@dataclass(frozen=True)
class Scaled:
    """A face that is beta times a shape."""

    parameters: tuple = ()

    def nuisance_starts(self, _block: Block) -> np.ndarray:
        return np.zeros((1, 0))

    def design(self, _block: Block, _nuisance: np.ndarray, _beta: np.ndarray | None = None) -> tuple:
        return SHAPE[:, None], np.zeros(len(X))


def told(measured: np.ndarray, sigma: float, sd: float = 0.0) -> dict:
    block = Block(
        run="r1",
        condition="c",
        role="validate",
        order=1,
        measured=measured,
        sigma=np.full(len(X), sigma),
        setting=None,
        axis=np.full(len(X), "z"),
        zeros=np.zeros((len(X), 0)),
        zero_sd=np.zeros(0),
        coordinates={"x_mm": X, "y_mm": Y},
    )
    task = Problem("flatness", "mm", MM, Scaled(), (block,), np.zeros(1))
    fit = BaseFit(np.ones(1), np.array([[sd**2]]), np.inf, {"r1": np.zeros(0)})
    return paired(task, fit)["r1"]


def test_a_face_a_fifth_higher_has_the_similarity_and_deviations_of_the_definitions() -> None:
    tilted = 1.2 * SHAPE + 1e-4 + 2e-4 * X / 100
    face = told(tilted, 0.0)
    assert face["pairing"]["xm"]["similarity"]["value"] == pytest.approx(80.0)
    assert face["pairing"]["xa"]["relative_deviation"]["of_simulated"] == pytest.approx(20.0)
    assert face["pairing"]["xg"]["relative_deviation"]["of_measured"] == pytest.approx(100 / 6)
    assert face["pairing"]["relative_deviation"]["of_simulated"] == pytest.approx(20.0)
    assert (face["pairing"]["slope"], face["pairing"]["correlation"]) == pytest.approx((1.2, 1.0))
    assert face["xm_predicted"]["value"] == pytest.approx(np.ptp(SHAPE) / UM)


def test_noise_is_taken_out_of_the_measured_index_and_its_interval_holds_the_truth() -> None:
    rng = np.random.default_rng(0)
    faces = [told(SHAPE + 5 * UM * rng.standard_normal(len(X)), 5 * UM)["pairing"]["xm"] for _ in range(30)]
    truth = told(SHAPE, 0.0)["pairing"]["xm"]["measured"]["value"]
    values = np.array([face["measured"]["value"] for face in faces])
    # as read it is some 15 µm more
    assert values.mean() == pytest.approx(truth, abs=1.5)
    inside = [face["measured"]["ci95"][0] <= truth <= face["measured"]["ci95"][1] for face in faces]
    assert np.mean(inside) >= 0.86
    held = [face["similarity"]["ci95"][0] <= 100 <= face["similarity"]["ci95"][1] + 1 for face in faces]
    assert np.mean(held) >= 0.86


def test_an_uncertain_compliance_widens_the_prediction_and_the_similarity() -> None:
    sure, unsure = (told(SHAPE, 1 * UM, sd) for sd in (0.001, 0.1))
    widths = [np.diff(face["xm_predicted"]["ci95"])[0] for face in (sure, unsure)]
    assert widths[1] == pytest.approx(3.92 * 0.1 * np.ptp(SHAPE) / UM, rel=0.1)
    assert widths[0] < 0.02 * widths[1]
    low = [face["pairing"]["xm"]["similarity"]["ci95"][0] for face in (sure, unsure)]
    assert low[1] < low[0] - 5


def comparison() -> pd.DataFrame:
    rng = np.random.default_rng(1)
    parts = []
    for run, before in (("r1", 0.8), ("r2", 0.5)):
        measured = SHAPE + 3 * UM * rng.standard_normal(len(X)) + 1e-4 * X / 200
        columns = {"measured": measured, "before": before * SHAPE, "after": SHAPE}
        parts.append(
            pd.DataFrame({name: z / MM for name, z in columns.items()}).assign(
                run=run, x_mm=X, y_mm=Y, sigma=3e-2, unit="mm"
            )
        )
    return pd.concat(parts, ignore_index=True)


def test_the_report_states_the_median_similarity_before_and_after_the_loop() -> None:
    faces = by_face(comparison()).set_index("run")
    assert faces.loc["r1", "similar_before"] == pytest.approx(75, abs=8)
    assert faces.loc["r2", "similar_before"] == pytest.approx(0, abs=10)
    assert (faces["similar_after"] > 92).all()
    text, table, picture = pairing_items(comparison())
    assert "2 held-out faces" in text.text
    assert len(table.rows) == 2
    assert len(table.rows[0]) == len(table.header)
    assert len(picture.figure.axes) == 2


def test_a_comparison_without_places_has_no_faces() -> None:
    assert pairing_items(comparison().assign(x_mm=np.nan)) == []
