"""The table of main results that page one begins with."""

import numpy as np
import pandas as pd
import pytest

from metro.batch.batch import Batch
from metro.report.content import Table
from metro.report.results import Results
from metro.report.sections.key_results import key_results
from metro.report.sections.summary import first_words
from tests.report import synthetic_results as made


def results(identified, **tables):
    return Results(Batch("b", {}, {}, pd.DataFrame(), {}), tables, identified, {}, {})


def rows(identified, **tables):
    (table,) = key_results(results(identified, **tables))
    return {row[0]: row[1:] for row in table.rows}


def mode(frequency, damping, stiffness, **more):
    return {
        "position": 2,
        "direction": "y",
        "frequency": made.q(frequency, 1.0, "Hz"),
        "damping": made.q(damping, 0.001, "1"),
        "stiffness": made.q(stiffness, 0.1e6, "N/m"),
        **more,
    }


def test_nothing_is_tabulated_where_nothing_was_identified():
    assert key_results(results({})) == []


def test_coefficients_come_from_the_waveform_where_there_is_one():
    by_mean = {"ktc": made.q(800.0, 40.0, "N/mm2")}
    by_wave = {"ktc": made.q(850.0, 7.0, "N/mm2"), "kte": made.q(14.0, 0.2, "N/mm")}
    shown = rows({"force": {"mean": by_mean, "waveform": by_wave}})
    assert shown["shear coefficients"] == ["K_tc 850.0 ± 7.0 N/mm²", "waveforms of the identification runs"]
    assert shown["edge coefficients"][0] == "K_te 14.00 ± 0.20 N/mm"
    assert rows({"force": {"mean": by_mean}})["shear coefficients"][1].startswith("mean forces")


OPEN = made.q(900.0, 1300.0, "N/mm2")


@pytest.mark.parametrize(
    ("sets", "shown"),
    [
        (
            {"waveform": OPEN, "mean": made.q(960.0, 150.0, "N/mm2")},
            ["waveforms", "mean forces of the ident"],
        ),
        (  # the better of two others
            {
                "waveform": OPEN,
                "mean": made.q(960.0, 400.0, "N/mm2"),
                "mean_all_runs": made.q(950.0, 90.0, "N/mm2"),
            },
            ["waveforms", "mean forces of all runs"],
        ),
        # no better one, one that is not much better, and a value that is known well enough
        ({"waveform": OPEN, "mean": made.q(900.0, 1500.0, "N/mm2")}, ["waveforms"]),
        ({"waveform": OPEN, "mean": made.q(900.0, 700.0, "N/mm2")}, ["waveforms"]),
        ({"waveform": made.q(900.0, 300.0, "N/mm2"), "mean": made.q(960.0, 50.0, "N/mm2")}, ["waveforms"]),
        ({"waveform": OPEN}, ["waveforms"]),
    ],
)
def test_where_the_waveform_leaves_the_main_coefficient_open_the_best_other_set_stands_below(sets, shown):
    force = {name: {"ktc": ktc} for name, ktc in sets.items()}
    (table,) = key_results(results({"force": force}))
    sources = [row[2] for row in table.rows if row[0] == "shear coefficients"]
    assert len(sources) == len(shown)
    assert all(source.startswith(start) for source, start in zip(sources, shown, strict=True))


def test_the_most_flexible_mode_has_the_largest_receptance_and_not_the_least_stiffness():
    soft = mode(50.0, 0.20, 1.0e6)  # 1 / (2 · 0.20 · 1e6) = 2.5e-6 m/N
    damped_less = mode(90.0, 0.01, 4.0e6)  # 1 / (2 · 0.01 · 4e6) = 12.5e-6 m/N
    value, where = rows({"modes": [soft, damped_less]})["most flexible mode"]
    assert value.startswith("90.0 ± 1.0 Hz")
    assert "stiffness 4.00 ± 0.10 N/µm, receptance 1.25·10⁻⁵ m/N" in value
    assert where == "position 2, direction y; 2 modes identified"


def test_modes_without_a_stiffness_are_given_by_their_frequencies():
    loose = [mode(hz, 0.02, 1.0e6, resolved=False) for hz in (120.0, 80.0)]
    assert (
        rows({"modes": loose})["natural frequencies"][0]
        == "2 modes, 80.00 to 120.0 Hz; stiffness not determined"
    )


def test_the_lowest_stable_depth_is_that_of_the_worst_position_at_its_worst_speed():
    blocks = [{"position": p, "lowest_mm": made.q(mm, 0.01, "mm")} for p, mm in ((1, 0.30), (2, 0.20))]
    lobes = pd.DataFrame(
        {"position": [1, 1, 2, 2], "rpm": [900.0, 1000.0, 900.0, 1000.0], "depth_mm": [0.30, 0.6, 0.5, 0.20]}
    )
    value, where = rows({"lobes": blocks}, lobes_final=lobes)["lowest stable depth"]
    assert (value, where) == ("0.200 ± 0.010 mm at 1000 rpm", "position 2, the lowest of 2 positions")


def test_the_least_stiffness_is_that_of_the_softest_direction_that_was_loaded():
    load = {"pose": "A", "point": "P2", "tests": 6}
    for axis, k in zip("xyz", (2.0, 0.5, np.nan), strict=True):
        load |= {f"k{axis}_n_um": k, f"k{axis}_low_n_um": 0.98 * k, f"k{axis}_high_n_um": 1.02 * k}
    value = rows({}, load_points=pd.DataFrame([load]))["least static stiffness"]
    assert value == ["0.500 ± 0.010 N/µm along y", "load tests at A, P2"]


def test_the_least_stiffness_is_of_a_pose_in_which_the_runs_cut_where_one_was_loaded():
    loads = pd.DataFrame(
        [
            {"pose": pose, "point": "", "tests": 6}
            | {f"k{axis}{end}_n_um": k for axis in "xyz" for end in ("", "_low", "_high")}
            for pose, k in (("p1", 0.5), ("p2", 0.3))
        ]
    )
    for cut, told in (("p1", ("0.500", "load tests at p1, where the runs cut")), ("p9", ("0.300", "at p2"))):
        runs = pd.DataFrame({"pose": [cut]}, index=["r1"])
        batch = Results(Batch("b", {}, {}, runs, {}), {"load_points": loads}, {}, {}, {})
        (table,) = key_results(batch)
        (row,) = table.rows
        assert row[1].startswith(told[0])
        assert row[2].endswith(told[1])


def test_a_joint_that_was_not_determined_is_named_and_no_number_is_invented():
    joints = [made.q(1.8e6, 0.03e6, "N m/rad"), {"value": None, "ci95": [None, None], "unit": "N m/rad"}]
    value, _ = rows({"arm": {"joint_stiffness": joints}})["joint stiffness 1 to 2"]
    assert value == "1.800 ± 0.030, not determined MN m/rad"


@pytest.mark.parametrize(("key", "name"), [("fltt", "flatness FLTt"), ("xm", "range X_m")])
def test_flatness_is_by_the_standard_where_all_faces_have_it(key, name):
    faces = {
        run: {"xm": made.q(um, 2.0, "um"), key: made.q(um, 2.0, "um")} for run, um in (("a", 40), ("b", 20))
    }
    value, about = rows({"faces": faces})[name]
    assert value == "20.0 ± 2.0 µm (b) and 40.0 ± 2.0 µm (a)"
    assert about.endswith("with its noise; flattest and least flat of 2 faces")


def test_flatness_is_that_of_the_surface_under_the_noise_of_the_scan():
    read = {run: {"xm": made.q(um, 2.0, "um")} for run, um in (("a", 40.0), ("b", 42.0))}
    columns = {
        "run": ["a", "b", "a"],
        "index_name": ["xm", "xm", "xa"],
        "corrected_um": [38.0, 30.0, 1.0],
        "low_um": [36.0, 27.0, 0.9],
        "high_um": [40.0, 33.0, 1.1],
    }
    table = pd.DataFrame(columns)
    value, about = rows({"faces": read}, face_indices=table)["range X_m"]
    assert value == "30.0 ± 3.0 µm (b) and 38.0 ± 2.0 µm (a)"
    assert about.endswith("its noise removed; flattest and least flat of 2 faces")
    unknown = table.assign(high_um=[40.0, np.nan, 1.1])  # of one face the noise is not known
    value, about = rows({"faces": read}, face_indices=unknown)["range X_m"]
    assert value == "40.0 ± 2.0 µm (a) and 42.0 ± 2.0 µm (b)"
    assert about.endswith("with its noise; flattest and least flat of 2 faces")


def test_page_one_gives_the_results_before_the_verdict():
    items = first_words(made.results())
    table = next(
        i for i, item in enumerate(items) if isinstance(item, Table) and item.caption == "Main results."
    )
    verdict = next(i for i, item in enumerate(items) if getattr(item, "look", "") == "verdict")
    assert table < verdict
