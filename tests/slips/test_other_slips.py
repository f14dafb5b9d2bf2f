"""Joint torques, stiffness, labels, scans and copies: what contradicts is found, and nothing else."""

import re
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from metro.batch.batch import Batch
from metro.observables.joint_force import tip
from metro.slips.copies import HIT, copies
from metro.slips.joints import joint_slips
from metro.slips.labels import label_slips
from metro.slips.redundancy import stiffness_slips
from metro.slips.scans import scan_slips
from metro.stages.reading import Recordings
from metro.stages.recordings import hit

RNG = np.random.default_rng(5)


def torques(monkeypatch, change):
    """A problem with two runs whose torques are those asked for, after ``change`` (6, m) → (6, m)."""
    blocks = []
    for _ in range(2):
        asked = RNG.normal(size=(6, 40)) * np.array([60.0, 40.0, 25.0, 15.0, 10.0, 5.0])[:, None]
        measured = change(asked) + 0.5 * RNG.normal(size=asked.shape)
        flat = {"measured": measured.ravel(), "sigma": np.full(asked.size, 0.5)}
        blocks.append(SimpleNamespace(**flat, setting=SimpleNamespace(asked=asked.ravel()[:, None])))
    monkeypatch.setattr(tip, "carried", lambda _arm, run, _offset: run.asked)
    arm = SimpleNamespace(with_tip_moved=lambda _offset: None)
    base = SimpleNamespace(arm=arm, offset=0.0, joints=tuple(range(6)))
    return SimpleNamespace(base=base, blocks=tuple(blocks))


def said(slips):
    return slips[0].text if slips else ""


def test_torques_as_they_are_contradict_nothing_and_a_scale_error_of_a_drive_neither(monkeypatch):
    for gain in (1.0, 0.8, 1.3):
        assert joint_slips(torques(monkeypatch, lambda asked, gain=gain: gain * asked)) == ()


def test_all_torques_reversed_are_found_and_what_else_does_it_is_said(monkeypatch):
    text = said(joint_slips(torques(monkeypatch, lambda asked: -asked)))
    assert "the sign of tau1_nm, tau2_nm, tau3_nm, tau4_nm, tau5_nm, tau6_nm is turned" in text
    assert "reads" in text


def test_one_torque_reversed_and_two_exchanged_are_named(monkeypatch):
    sign = np.array([1.0, -1.0, 1.0, 1.0, 1.0, 1.0])[:, None]
    assert "the sign of tau2_nm is turned" in said(joint_slips(torques(monkeypatch, lambda a: sign * a)))
    text = said(joint_slips(torques(monkeypatch, lambda a: a[[2, 1, 0, 3, 4, 5]])))
    assert "tau1_nm holds the torque of joint 3" in text
    assert "tau3_nm holds the torque of joint 1" in text


def test_a_gain_that_no_drive_has_is_found_with_its_interval(monkeypatch):
    assert "100 ±" in said(joint_slips(torques(monkeypatch, lambda asked: 100.0 * asked)))


def test_torques_that_follow_the_force_at_another_time_have_no_gain_of_a_drive(monkeypatch):
    """Half of such a torque is as the force asks for, as of a clock that is late by most of an entry."""

    def later(asked, unit=1.0):
        return unit * (0.45 * asked + 0.9 * np.roll(asked, 7, axis=1))

    assert joint_slips(torques(monkeypatch, later)) == ()
    assert "the unit of tau1_nm" in said(joint_slips(torques(monkeypatch, lambda a: later(a, 1e-3))))


STATIONS = pd.DataFrame({"position": ["1"], "kx_n_um": [0.93], "ky_n_um": [31.0], "kz_n_um": [9.3]})


def modes(factor):
    stiffness = [7.2e6, 4.0e6, 4.2e6, 2.2e6]
    return [
        {"position": "1/7", "direction": "x", "stiffness": {"value": factor * each}} for each in stiffness
    ]


@pytest.mark.parametrize("factor", [1.0, 2.0, 0.5])
def test_modes_about_as_stiff_as_the_table_contradict_nothing(factor):
    assert stiffness_slips(STATIONS, modes(factor)) == ()


def test_an_acceleration_in_g_is_recognised_by_its_factor():
    text = said(stiffness_slips(STATIONS, modes(9.81)))
    assert "g (response_unit: g in impacts.csv)" in text
    assert float(re.search(r"ratio is (\d+\.\d+)", text)[1]) == pytest.approx(9.81, rel=0.1)
    assert "Likely" not in said(stiffness_slips(STATIONS, modes(40.0)))


def cuts_at(depths, unstable):
    return pd.DataFrame({"depth_mm": depths, "boundary_mm": 1.0, "labelled": np.asarray(unstable, float)})


NONE_HEARD = pd.DataFrame({"probability": [], "labelled": []}, dtype=float)


def test_labels_that_are_inverted_are_found_by_the_ranks_and_not_by_the_boundary():
    depths = np.linspace(0.2, 2.0, 16)
    for scale in (1.0, 3.0, 0.2):  # a boundary that is off as a whole says nothing
        deep = depths > scale * 1.1 if scale == 1.0 else depths > 1.1
        assert label_slips(cuts_at(depths * scale, deep), NONE_HEARD) == ()
        assert "exchanged" in said(label_slips(cuts_at(depths * scale, ~deep), NONE_HEARD))


def test_records_that_say_the_opposite_of_their_labels_show_it():
    heard = pd.DataFrame({"probability": [0.02] * 12 + [0.98] * 4, "labelled": [1] * 12 + [0] * 4})
    none = cuts_at([], [])
    assert "of 16 labelled cuts" in said(label_slips(none, heard))
    assert label_slips(none, heard.assign(labelled=1 - heard["labelled"])) == ()


class Tables:
    """Canonical tables in memory."""

    def __init__(self, **tables):
        self.tables = tables

    def __call__(self, name, run=None):
        table = self.tables.get(name, pd.DataFrame(columns=["run", *HIT]))
        return table if run is None else table[table["run"] == run]

    def pieces(self, name, run):
        yield self(name, run)


def batch_of(**columns):
    runs = pd.DataFrame({"order": range(1, 5), **columns}, index=[f"r{i}" for i in range(1, 5)])
    for column in ("dynamometer", "robot_log", "scan", "profile", "slopes"):
        runs[column] = columns.get(column, "")
    return Batch("b", {}, {}, runs, {})


def clouds(scale):
    parts = []
    for i in range(1, 5):
        points = RNG.uniform(0.0, 50.0, (3000, 2))
        height = 0.02 * np.sin(points[:, 0] / 9.0) + 0.019 * RNG.normal(size=3000)
        height = height * (scale if i == 2 else 1.0)
        frame = pd.DataFrame({"x_mm": points[:, 0], "y_mm": points[:, 1], "z_mm": height})
        parts.append(frame.assign(run=f"r{i}"))
    return Tables(scan=pd.concat(parts))


def test_a_cloud_whose_heights_have_another_scale_than_the_others_is_found():
    batch = batch_of(scan=[f"s{i}.ply" for i in range(4)])
    assert scan_slips(batch, clouds(1.0)) == ()
    assert scan_slips(batch, clouds(3.0)) == ()  # a rougher face, no scale of length
    text = said(scan_slips(batch, clouds(10.0)))
    assert "z of s1.ply is in another unit, a factor of 10" in text


def forces(same):
    parts = [
        pd.DataFrame(RNG.normal(size=(100, 3)), columns=["fx_n", "fy_n", "fz_n"]).assign(run=f"r{i}")
        for i in range(1, 5)
    ]
    if same:
        parts[2]["fy_n"] = parts[0]["fy_n"].to_numpy()
    return Tables(force=pd.concat(parts))


def test_a_channel_that_is_another_runs_is_an_error_that_names_both():
    batch = batch_of(dynamometer=[f"f{i}.csv" for i in range(1, 5)])
    assert list(copies(batch, forces(same=False))) == []
    (finding,) = copies(batch, forces(same=True))
    assert (finding.severity, finding.file, finding.run) == ("error", "f3.csv", "r3")
    assert "same values as fy_n of f1.csv (run r1)" in finding.message


def test_hits_that_share_a_response_are_an_error_and_coarse_ones_are_not():
    def hit(test, response):
        return pd.DataFrame(
            {"test": test, "position": "1", "reference": "1x", "response": "1x", "replicate": 1}
            | {"response_si": response}
        )

    one, other = RNG.normal(size=200), RNG.normal(size=200)
    batch = batch_of()
    assert list(copies(batch, Tables(hit=pd.concat([hit("a", one), hit("b", other)])))) == []
    assert len(list(copies(batch, Tables(hit=pd.concat([hit("a", one), hit("b", one)]))))) == 1
    flat = np.tile([0.0, 1.0], 100)
    assert list(copies(batch, Tables(hit=pd.concat([hit("a", flat), hit("b", flat)])))) == []


def test_two_files_of_hits_with_the_same_numbers_are_refused_with_both_named(tmp_path):
    ring = RNG.normal(size=400)
    force = np.concatenate([np.zeros(20), np.hanning(16) * 300, np.zeros(364)]) + 1e-3 * RNG.normal(size=400)
    for point, strength in ((3, 1.0), (8, 0.9)):
        for name, values, digits in (("impact", strength * force, 12), ("accel", ring, 12 + point)):
            lines = [f"{value:.{digits}e}" for value in np.round(values, 9)]
            (tmp_path / f"{name}_p{point}.txt").write_text("\n".join(f"{k} {x}" for k, x in enumerate(lines)))
    response = {"file": "accel_p{record}.txt", "from": 2, "unit": "m/s2"}
    columns = {"force_n": {"from": 2, "unit": "N"}, "response": response}
    mappings = {"impact_p*.txt": {"rate_hz": 1000, "columns": columns}}
    recordings = Recordings(tmp_path, lambda: None, mappings)
    rows = [
        {"test": "", "position": "1", "reference": f"{p}z", "response": "1z", "replicate": 1.0}
        | {"kind": "record", "file": f"impact_p{p}.txt#{p}", "response_unit": "m/s2"}
        for p in (3, 8)
    ]
    assert len(list(hit(batch_of(), pd.DataFrame(rows), recordings))) == 1
    (problem,) = recordings.problems
    assert "accel_p8.txt has the same values as accel_p3.txt" in problem.message
    assert problem.severity == "error"
