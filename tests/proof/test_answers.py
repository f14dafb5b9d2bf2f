"""What somebody else's program says, scored against figures that are counted by hand."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from metro.stages.problem_file import FILE
from proof import seal
from proof.answers import ABSENT, AnswerError, answer, p_value
from proof.figures import demanded
from proof.layout import Layout
from proof.opening import opened_for
from proof.protocol import log
from proof.protocol.judge import LOG, NotJudgedError, listed
from proof.score import FAILED

ROOT = Path(__file__).parents[2]
DRIFT = {"slope_n_s": [3.0, -2.0, 4.0]}
HIDDEN = {
    "blind-1": ("none", {}, {}),
    "blind-2": ("none", {}, {}),
    "blind-3": ("one", {"charge_drift": DRIFT}, {"charge_drift": 6.0}),
    "blind-4": ("one", {"tool_wear": {"edge_growth_per_m": 0.2}}, {"tool_wear": 3.0}),
    "blind-5": ("one", {"tool_wear": {"edge_growth_per_m": 0.02}}, {"tool_wear": 0.2}),
    "blind-6": ("outside", {"hard_spot": {"ktc_step": 0.1}}, {"hard_spot": 4.0}),
}
TRUTH = {"observable": "force", "seed": 1, "style": "d", "commit": "0" * 40}


def write(path, content):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(content))


@pytest.fixture
def out(tmp_path):
    """Six batches whose problems are posed and whose oracle was asked."""
    layout = Layout(tmp_path / "suite")
    truths = {
        name: {"batch": name, "kind": kind, "effects": effects} for name, (kind, effects, _) in HIDDEN.items()
    }
    seal.close({**TRUTH, "batches": truths}, layout.truth, layout.seal)
    for name, (_, effects, sizes) in HIDDEN.items():
        write(layout.raw / name / "batch.yaml", {"tool": {"teeth": 3}})
        problems = layout.processed / name / FILE
        problems.parent.mkdir(parents=True)
        problems.touch()
        os.utime(problems, (1.0, 1.0))
        if effects:
            figures = {"before": 10.0, "after": 2.0, "floor": 2.0, "sizes": sizes}
            write(layout.oracle / f"{name}.json", figures)
    return layout


def said(folder, name, status, *effects, **more):
    entry = {"status": status, "effects": list(effects), **more}
    write(folder / f"{name}.json", {"batch": name, "observables": {"force": entry}})


@pytest.fixture
def answers(tmp_path):
    """One of two empty batches gets an effect, one of two visible singles is named, the outside is clean."""
    folder = tmp_path / "answers"
    said(folder, "blind-1", "clean")
    said(folder, "blind-2", "explained", {"effect": "tool_runout", "probability": 0.97})
    interval = {"value": 3.2, "ci95": [2.9, 3.5]}
    parameters = {"slope_n_s": [interval, {"value": -2.1, "ci95": [-2.2, -2.05]}, {"value": 4.0}]}
    drift = {"effect": "charge_drift", "probability": 0.9, "parameters": parameters}
    said(folder, "blind-3", "explained", drift, before={"rms": 10.0}, after={"rms": 3.0})
    said(folder, "blind-4", "explained", {"effect": "pitch_error"})
    said(folder, "blind-6", "clean")
    return folder


def test_the_figures_are_those_counted_by_hand(out, answers):
    scores = opened_for("mine", answers, out, 1)
    found = {figure.label: (figure.value, figure.count) for figure in demanded(scores)}
    assert found["nothing hidden: an effect is added"] == (0.5, 2)
    assert found["one effect: named, alone or first of declared rivals"] == (0.5, 2)
    assert found["one effect: a wrong one named with p > 0.9"] == (0.5, 2)  # claimed without a probability
    assert found["outside the library: a rest is admitted"] == (0.0, 1)
    assert found["share of the oracle's reduction reached"] == (pytest.approx(7.0 / 8.0), 1)
    assert found["held-out error after, over the noise"] == (pytest.approx(1.5), 1)
    assert found["95 % intervals of parameters that hold the truth"] == (0.5, 2)  # the third states none
    assert found["two effects: both named"][1] == 0
    assert next(s for s in scores if s.batch == "blind-5").status == FAILED  # nothing was said of it
    assert "What mine says" in (out.root / "table-mine.md").read_text()


def test_a_verdict_of_ours_is_an_answer(tmp_path):
    """The example of the contract, as far as it is one."""
    page = (ROOT / "docs/data-contract.md").read_text()
    assert "verdict.json" in page
    entry = {
        "status": "explained",
        "unit": "N",
        "noise_floor": 1.9,
        "held_out_runs": ["r07", "r08"],
        "before": {"rms": 11.8, "nrmse": 0.083, "ci95": [10.9, 12.7]},
        "after": {"rms": 2.1, "nrmse": 0.015, "ci95": [1.9, 2.3]},
        "effects": [
            {
                "effect": "joint_backlash",
                "probability": 0.99,
                "parameters": {"joint": 3, "angle_mdeg": {"value": 9.8, "ci95": [9.5, 10.1], "unit": "mdeg"}},
            }
        ],
        "candidates": [{"effect": "tool_wear", "probability": 0.004, "why_not": "…"}],
        "indistinguishable": [["a", "b"]],
        "next_experiment": "…",
        "unexplained": None,
    }
    write(
        tmp_path / "verdict.json", {"format": 1, "batch": "b", "metro": "0", "observables": {"force": entry}}
    )
    assert answer(tmp_path, "verdict", "force") == {**ABSENT, **entry}
    assert answer(tmp_path, "verdict", "lobes") is None
    assert answer(tmp_path, "other", "force") is None


@pytest.mark.parametrize(
    ("entry", "place"),
    [
        ({"effects": []}, "status"),
        ({"status": "fine"}, "fine"),
        ({"status": "clean", "effects": [{"probability": 0.5}]}, "effect"),
        ({"status": "clean", "effects": [{"effect": "tool_wear", "probability": 1.5}]}, "1.5"),
        ({"status": "clean", "after": 3.0}, "after"),
    ],
)
def test_what_is_no_answer_is_refused_with_its_file_and_place(tmp_path, entry, place):
    write(tmp_path / "blind-1.json", {"observables": {"force": entry}})
    with pytest.raises(AnswerError, match=rf"blind-1\.json.*{place}"):
        answer(tmp_path, "blind-1", "force")


def test_the_p_value_is_the_smallest_corrected_one_and_that_of_labels_their_surprise():
    tried = [{"effect": "a", "q_value": 0.4}, {"effect": "b", "q_value": 0.3}]
    assert p_value({"observables": {"force": {"story": {"candidates": tried}}}}, "force") == 0.3
    words = {"code": "surprise", "values": {"before": 0.07, "after": 0.5}}
    labels = {"candidates": [{"effect": "a"}], "noise": {"words": words}}
    assert p_value({"observables": {"lobes": {"story": labels}}}, "lobes") == 0.07
    assert p_value(None, "force") is None


def test_only_programs_of_others_stand_beside_ours_and_only_where_we_were_judged(out, answers, tmp_path):
    scores = opened_for("mine", answers, out, 1)
    (tmp_path / "docs").mkdir()
    with pytest.raises(NotJudgedError, match="no commit was judged"):
        listed(out, "mine", scores, checkout=tmp_path)
    ours = {**TRUTH, "format": 1, "program": "metro", "seal": out.seal.read_text().strip()}
    log.append(tmp_path / LOG, ours)
    with pytest.raises(NotJudgedError, match="another one"):
        listed(out, "stepwise", scores, checkout=tmp_path)
    assert len(log.rows(tmp_path / LOG)) == 1


def test_the_program_of_the_page_answers_and_is_scored(out, tmp_path):
    """It is run as it is printed, on records of which one set drifts."""
    code = re.search(r"```python\n(.*?)```", (ROOT / "docs/protocol.md").read_text(), re.DOTALL)[1]
    assert len(code.splitlines()) <= 34
    (tmp_path / "mine.py").write_text(code)
    rng = np.random.default_rng(4)
    time = np.linspace(0.0, 0.5, 200)
    for name in out.batches:
        slopes = np.array(DRIFT["slope_n_s"]) * (name == "blind-3")
        files = []
        for i in range(6):
            forces = 50.0 + slopes * time[:, None] + 0.05 * rng.standard_normal((200, 3))
            record = pd.DataFrame({"t_s": time, **dict(zip(("fx_n", "fy_n", "fz_n"), forces.T, strict=True))})
            files.append(f"r{i}.{'csv' if i % 2 else 'parquet'}")
            file = out.raw / name / files[-1]
            record.to_csv(file, index=False) if i % 2 else record.to_parquet(file)
        pd.DataFrame({"run": range(7), "dynamometer": [*files, ""]}).to_csv(
            out.raw / name / "runs.csv", index=False
        )
    where = out.answers("mine")
    subprocess.run([sys.executable, "mine.py", str(out.root), str(where)], cwd=tmp_path, check=True)
    scores = {s.batch: s for s in opened_for("mine", where, out, 1)}
    assert scores["blind-3"].exact
    assert [one.covered for one in scores["blind-3"].estimates] == [True, True, True]
    assert {s.status for name, s in scores.items() if name != "blind-3"} == {"clean"}
