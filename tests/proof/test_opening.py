"""Opening a proof whose truth and verdicts are written by hand."""

import json
import os
import re

import pytest

from proof import seal
from proof.__main__ import main
from proof.figures import demanded
from proof.layout import Layout
from proof.opening import opened
from proof.run import Job, run
from proof.seal import BrokenSealError

RUNOUT = {"radius_um": 8.0, "angle_deg": 30.0}
FOUND = {
    "radius_um": {"value": 8.2, "ci95": [7.9, 8.5], "unit": "um"},
    "angle_deg": {"value": 151.0, "ci95": [149.0, 153.0], "unit": "deg"},
}


def verdict(status, *named):
    entry = {
        "status": status,
        "noise_floor": 2.0,
        "before": {"rms": 10.0},
        "after": {"rms": 2.0 if named else 10.0},
        "effects": [{"effect": name, "probability": 0.97, "parameters": FOUND} for name in named],
        "candidates": [{"effect": "tool_wear", "probability": 0.01}],
        "indistinguishable": [],
        "unexplained": None,
    }
    return {"observables": {"force": entry}}


def write(path, content):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(content))


@pytest.fixture
def out(tmp_path):
    """Two batches with nothing, one with runout; the oracle's answer is there."""
    layout = Layout(tmp_path)
    kinds = {"blind-1": "none", "blind-2": "one", "blind-3": "none"}
    truth = {
        name: {"batch": name, "kind": kind, "effects": {"tool_runout": RUNOUT} if kind == "one" else {}}
        for name, kind in kinds.items()
    }
    seal.close({"seed": 1, "style": "a", "batches": truth}, layout.truth, layout.seal)
    for name, kind in kinds.items():
        write(layout.raw / name / "batch.yaml", {"tool": {"teeth": 3}})
        found = verdict("explained", "tool_runout") if kind == "one" else verdict("clean")
        write(layout.reports / name / "verdict.json", found)
        write(layout.reports / name / "run.json", {"code": {}, "seconds": {"loop": 20.0}})
        write(layout.processed / name / "loop.json", {"observables": {}})
    answer = {"before": 10.0, "after": 1.9, "floor": 1.9, "sizes": {"tool_runout": 5.0}}
    write(layout.oracle / "blind-2.json", answer)
    return layout


def rows(out, title):
    section = (out.root / "table.md").read_text().split(f"## {title}\n")[1].split("\n## ")[0]
    lines = [line for line in section.splitlines() if line.startswith("| ")][2:]
    return {
        cells[1].strip(): [c.strip() for c in cells[2:-1]] for cells in (re.split(r"\|", x) for x in lines)
    }


def test_the_page_says_what_was_demanded_and_what_came(out, capsys):
    figures = {figure.label: figure for figure in demanded(opened(out, 1))}
    assert not [
        figure for figure in figures.values() if figure.met is False and "intervals" not in figure.label
    ]
    found = rows(out, "What is demanded")
    assert found["nothing hidden: an effect is added"][:3] == ["0.0 %", "0.0 % to 65.8 %", "2"]
    assert found["share of the oracle's reduction reached"][0] == f"{8.0 / 8.1:.3g}"
    assert found["two effects: both named"][-1] == "no case"
    assert rows(out, "Confusion")["tool_runout"][0] == "1"
    assert rows(out, "Parameters").keys() == {"tool_runout"}
    assert "What is demanded" in capsys.readouterr().out
    assert (out.root / "figure.svg").read_text().count("<svg") == 1


def test_a_truth_that_was_changed_is_not_opened(out):
    out.truth.write_text(out.truth.read_text().replace("8.0", "8.2"))
    with pytest.raises(BrokenSealError):
        opened(out, 1)
    assert not (out.root / "table.md").exists()


def test_a_proof_that_is_not_finished_is_not_opened(out):
    (out.reports / "blind-3/run.json").unlink()
    with pytest.raises(FileNotFoundError, match="blind-3"):
        opened(out, 1)


def test_a_batch_that_failed_counts_against(out):
    (out.reports / "blind-2/run.json").unlink()
    (out.reports / "blind-2/failed.txt").write_text("Traceback\n  in the loop\nValueError: no teeth\n")
    found = {one.batch: one for one in opened(out, 1)}
    assert {name: one.failure for name, one in found.items()} == {
        "blind-1": None,
        "blind-2": "ValueError: no teeth",
        "blind-3": None,
    }
    assert rows(out, "Statuses")["one effect, seen"][-1] == "1"
    assert rows(out, "What lies behind")["batches that the pipeline ran through"][0] == "66.7 %"


def test_a_suite_about_lobes_is_opened_by_the_same_command(out):
    truth = json.loads(out.truth.read_text())
    for entry in truth["batches"].values():
        entry["effects"] = {"mode_coupling": {"angle_deg": 20.0}} if entry["effects"] else {}
    seal.close({**truth, "observable": "lobes"}, out.truth, out.seal)
    for name in truth["batches"]:
        entry = verdict("insufficient")["observables"]["force"] | {"next_experiment": "a test"}
        write(out.reports / name / "verdict.json", {"observables": {"lobes": entry}})
    answer = {"before": 0.4, "after": 0.3, "floor": 0.3, "sizes": {"mode_coupling": 3.0}, "enough": False}
    write(out.oracle / "blind-2.json", answer)
    opened(out, 1)
    found = rows(out, "What the tests cannot decide")
    assert found["undecided: a next experiment is named"][:1] == ["100.0 %"]
    assert found["too few tests: insufficient"][2] == "1"
    assert (out.root / "table.md").read_text().startswith("# Proof: lobes")


def test_a_suite_about_an_arm_tells_wrong_joints_from_right_ones(out):
    truth = json.loads(out.truth.read_text())
    for entry in truth["batches"].values():
        entry["effects"] = {"joint_backlash": {"joint": 3, "angle_mdeg": 5.0}} if entry["effects"] else {}
    seal.close({**truth, "observable": "deformation"}, out.truth, out.seal)
    write(
        out.oracle / "blind-2.json",
        {"before": 9.0, "after": 1.9, "floor": 1.9, "sizes": {"joint_backlash": 5.0}},
    )
    for name in truth["batches"]:
        hidden = truth["batches"][name]["effects"]
        entry = verdict("explained", "joint_backlash") if hidden else verdict("clean")
        for found in entry["observables"]["force"]["effects"]:
            found["parameters"] = {"joint": 2}
        write(
            out.reports / name / "verdict.json",
            {"observables": {"deformation": entry["observables"]["force"]}},
        )
    opened(out, 1)
    assert rows(out, "What is demanded")["one effect: a wrong one named with p > 0.9"][0] == "100.0 %"
    assert rows(out, "Confusion")["joint_backlash"][0] == "1"
    assert "| joint_backlash, another joint |" in (out.root / "table.md").read_text()
    assert "wrong joint" in (out.root / "table.md").read_text()


def test_strict_fails_where_a_demand_is_missed_beyond_chance(out):
    main(["open", str(out.root), "--strict", "--jobs", "1"])
    for name in ("blind-1", "blind-3"):
        write(out.reports / name / "verdict.json", verdict("explained", "tool_wear"))
    with pytest.raises(SystemExit, match="nothing hidden"):
        main(["open", str(out.root), "--strict", "--jobs", "1"])


def test_different_versions_of_the_code_are_owned_up_to(out):
    write(out.reports / "blind-1/run.json", {"code": {"loop": "other"}, "seconds": {"loop": 20.0}})
    opened(out, 1)
    assert "2 versions of the code" in (out.root / "table.md").read_text()


def test_a_batch_is_done_when_this_code_has_run_on_it_as_it_is(tmp_path):
    job = Job(tmp_path, tmp_path, tmp_path, tmp_path / "reports", {"loop": {}}, {"loop": "abc"}, False)
    (tmp_path / "batch.yaml").write_text("")
    assert not job.done
    write(job.mark, {"code": {"loop": "abc"}, "seconds": {}})
    assert job.done
    os.utime(tmp_path / "batch.yaml", (job.mark.stat().st_mtime + 5.0,) * 2)
    assert not job.done
    os.utime(tmp_path / "batch.yaml", (0.0, 0.0))
    write(job.mark, {"code": {"loop": "older"}, "seconds": {}})
    assert not job.done


def test_a_batch_that_cannot_be_run_is_named_with_its_reason_and_its_old_verdict_goes(tmp_path):
    out = Layout(tmp_path)
    (out.raw / "blind-1").mkdir(parents=True)
    (out.raw / "blind-1/batch.yaml").write_text("format: 1\nbatch: another\nsource: simulated\ncell: none\n")
    write(out.reports / "blind-1/verdict.json", verdict("clean"))
    assert run(out, 1, keep=False, pdf=False) == ["blind-1"]
    assert "another" in (out.reports / "blind-1/failed.txt").read_text()
    assert not (out.reports / "blind-1/verdict.json").exists()
