"""The proof of joint batches: what counts as named together and alone, and as the part of the force."""

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from proof.joint import CONTRADICTION, KINDS, Attributed, figures, hidden_of, tables
from proof.split import fed, split_figures
from virtual_cell.recipes.joint import SHOWN

STIFF, TIP = ("stiffness_scale", "all"), ("tool_offset_error", "all")


def batch(kind="stiffness_scale", hidden=STIFF, alone=None, together=None, held=()):
    return Attributed("joint-1", kind, hidden, alone or {}, together or {}, held, ())


def named(found):
    return {figure.label: figure for figure in figures(found)}


def test_a_contradiction_is_right_only_where_it_is_one():
    torn = {STIFF: CONTRADICTION}
    assert not batch(together=torn).named
    assert batch(CONTRADICTION, together=torn).named
    assert not batch(CONTRADICTION, together={STIFF: "confirmed"}).named
    assert batch(together={STIFF: "together"}).named


def test_a_cause_of_another_joint_is_another_cause():
    one = batch(
        "friction_reversal", ("friction_reversal", "2"), together={("friction_reversal", "3"): "alone"}
    )
    assert not one.named
    assert one.others == [("friction_reversal", "3")]


def test_what_none_names_alone_and_all_name_together_is_counted_so():
    weak = batch(together={STIFF: "together"}, alone={"deformation": (), "flatness": ()})
    strong = batch(together={STIFF: "confirmed"}, alone={"deformation": (STIFF,), "flatness": (STIFF, TIP)})
    found = named([weak, strong])
    assert found["one cause that shows in two: named by all together, and nothing else"].value == 1.0
    assert found["the same: named by the better one of the two alone, and nothing else"].value == 0.5
    assert found["shows in deformation: named by it alone"].value == 0.5
    assert found["shows in flatness: named by it alone"].value == 0.0


def test_what_is_added_where_nothing_is_hidden_is_not_a_cause_that_is_missed():
    found = named([batch("none", None, together={TIP: "one_observable"}), batch("none", None)])
    assert found["nothing hidden: a cause is added"].value == 0.5
    assert found["one cause: named by all together"].count == 0


def test_every_kind_can_be_hidden_and_a_contradiction_is_one():
    for kind in KINDS:
        hidden = hidden_of(kind, 7)
        assert set(hidden) <= set(SHOWN)
        assert bool(hidden) is (kind != "none")
    values = hidden_of(CONTRADICTION, 7)["stiffness_scale"]
    assert (values["factor"] - 1.0) * (values["factor_of_faces"] - 1.0) < 0.0
    assert abs(np.log(values["factor"] / values["factor_of_faces"])) > 0.19


def test_the_part_of_the_force_is_that_of_the_error_of_the_mean_force_along_what_is_compared(tmp_path):
    parts = {"total": 0.01, "upstream": 0.0035, "own": 0.009, "doubt": 0.0003}
    runs = [{"run": "r1", "when": when, **parts} for when in ("before", "after")]
    (tmp_path / "loop.json").write_text(json.dumps({"chain": {"deformation": {"runs": runs}}}))
    rows = [
        {"observable": "force", "run": "r1", "axis": axis, "angle_deg": angle, "before": 0.0}
        | {"after": value + swing, "measured": value + read}
        for axis, value, read in zip("xyz", (100.0, 50.0, 0.0), (1.0, 0.5, 3.0), strict=True)
        for angle, swing in ((0.0, 5.0), (180.0, -5.0))
    ]
    pd.DataFrame(rows).to_parquet(tmp_path / "comparison.parquet")
    truth = {"r1": {"force_n": [102.0, 50.0, 9.0], "mm_per_n": [0.002, 0.001, 0.0]}}
    (one,) = fed(tmp_path, truth)
    assert one.true == pytest.approx(0.004)
    assert one.read == pytest.approx(0.0025)
    assert [one.off(part) for part in (one.true, one.read)] == pytest.approx([0.05, 0.1])
    assert one.held
    assert not replace(one, doubt=0.0002).held
    assert [figure.met for figure in split_figures([one])] == [True, None, True]
    assert [figure.value for figure in split_figures([one])] == pytest.approx([0.1, 0.05, 1.0])


def test_the_tables_name_the_joint_and_the_status():
    one = batch("gear_ripple", ("gear_ripple", "4"), {"waviness": (("gear_ripple", "4"),)}, {TIP: "alone"})
    _, rows = tables([one])
    assert rows.rows[0][2:] == ("gear_ripple 4", "waviness: gear_ripple 4", "tool_offset_error (alone)")
