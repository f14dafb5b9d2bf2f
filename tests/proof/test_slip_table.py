"""The table of slips: every edit changes a batch that it suits; outcomes that must not be are known."""

import shutil
from pathlib import Path

import pytest

from proof.slip_edits import Mistake
from proof.slip_list import mistakes
from proof.slips import CAUGHT, FALSE_CAUSE, FLAGGED, IDLE, SILENT, Ended, _judged, tried

RAW = Path(__file__).parents[2] / "data/raw"
SLIP = Mistake("a slip", lambda _folder: True)


def verdict(status="clean", effects=(), **more):
    entry = {"status": status, "effects": [{"effect": name} for name in effects]} | more
    return {"observables": {"force": entry}}


def contents(folder):
    return {file.relative_to(folder): file.read_bytes() for file in folder.rglob("*") if file.is_file()}


@pytest.mark.parametrize("slip", mistakes(full=False), ids=lambda slip: slip.name)
def test_an_edit_changes_a_batch_that_it_suits_and_leaves_any_other_alone(slip, tmp_path):
    suited = 0
    for name in ("irb6640-published", "trimule-published"):  # nothing was recorded in these
        shutil.copytree(RAW / name, tmp_path / name)
        assert slip.edit(tmp_path / name) is False
    for name in ("clean-slot", "kr160-side", "trimule-helical", "irb6640-face"):
        shutil.copytree(RAW / name, tmp_path / name)
        if slip.edit(tmp_path / name):
            suited += 1
            assert contents(tmp_path / name) != contents(RAW / name)
            break
    assert suited


def test_an_outcome_is_a_false_cause_a_flag_or_silence():
    def outcome(after, before=None):
        return _judged(SLIP, "b", Ended(before or verdict(), {"k": 1.0}), Ended(after, {"k": 2.0})).outcome

    assert outcome(verdict("explained", ["tool_wear"])) == FALSE_CAUSE
    assert outcome(verdict("explained", ["tool_wear"]), verdict("explained", ["tool_wear"])) == SILENT
    assert outcome(verdict("unexplained")) == FLAGGED
    assert outcome(verdict(misses=0.7)) == FLAGGED
    assert outcome(verdict() | {"contradictions": [{"words": "it is"}]}) == FLAGGED
    assert outcome(verdict()) == SILENT


def test_a_prediction_that_the_held_out_runs_contradict_now_is_flagged():
    sound, contradicted = ({"verification": {"holds": each, "words": "11 of 23"}} for each in (True, False))
    before, after = (Ended({"observables": {"lobes": {"status": "insufficient", "effects": []} | one}}, {})
                     for one in (sound, contradicted))  # fmt: skip
    assert _judged(SLIP, "b", before, after).said == "11 of 23"
    assert _judged(SLIP, "b", after, after).outcome == IDLE


def test_a_slip_is_without_effect_where_no_figure_leaves_its_interval():
    def figure(value):
        return {"lobes": {"depth": {"value": value, "ci95": [0.9, 1.1], "unit": "mm"}}}

    def outcome(after):
        return _judged(SLIP, "b", Ended(verdict(), figure(1.0)), Ended(verdict(), after)).outcome

    assert outcome(figure(1.0)) == outcome(figure(1.05)) == IDLE
    assert outcome(figure(1.2)) == outcome({}) == outcome(figure(None)) == SILENT


@pytest.mark.slow
@pytest.mark.parametrize("name", ["clean-slot", "kr160-side", "trimule-helical", "irb6640-face"])
def test_no_slip_is_given_a_false_cause_or_passes_without_a_word(name):
    results = list(tried(RAW / name, mistakes(full=True), loop=True))
    assert CAUGHT in {result.outcome for result in results}
    assert [one for one in results if one.outcome in (FALSE_CAUSE, SILENT)] == []
