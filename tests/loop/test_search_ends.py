"""The search ends even where its gates contradict each other."""

from types import SimpleNamespace

import pytest

from metro.loop.search import forward as room
from metro.loop.search.rivals import Contest


def fitted(*names):
    return SimpleNamespace(candidate=SimpleNamespace(effects=names))


@pytest.mark.parametrize("swap", ["rival", "runout"])
def test_a_swap_that_pruning_and_adding_undo_is_made_once(monkeypatch, swap):
    added = []

    def grow(current, *_):
        added.append(current.candidate.effects)
        assert len(added) < 5
        return fitted("resonance", "runout"), [fitted("resonance", "runout")], {}

    monkeypatch.setattr(room, "_added", grow)
    monkeypatch.setattr(room, "_large_enough", lambda current, _: (current, {}))
    monkeypatch.setattr(room, "_pruned", lambda _fit, _space: (fitted("resonance"), {"rival"}))
    monkeypatch.setattr(room, "contested", lambda *_: Contest(fitted("resonance", swap)))
    space = SimpleNamespace(base=fitted(), effects=(), prior=None, gates=None)
    choice = room.forward(space)
    assert choice.fit.candidate.effects == ("resonance", swap)
    assert len(added) == (2 if swap == "rival" else 1)
