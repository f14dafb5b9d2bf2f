"""Where a rival takes the place of an effect, the other effects are tried again."""

from dataclasses import replace

from toy import BEND, GAIN, GATES, RIPPLE, Wave, problem

from metro.loop.checks.evidence import change, compare
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import fit
from metro.loop.fitting.noise import first_noise
from metro.loop.search import forward as room
from metro.loop.search.rivals import Contest
from metro.loop.search.strategy import SearchSpace
from metro.loop.search.trial import without


def test_others_are_tried_on_the_model_that_won(monkeypatch):
    task = problem(2, truth=Wave(bend=0.1, ripple=0.1), phased=False)
    blocks = task.role("identify")
    prior = first_noise(GATES.model_form_budget, task.scatter, blocks)
    base = fit(Candidate(task.base), blocks, prior)
    space = SearchSpace(base, (BEND, RIPPLE, GAIN), prior, GATES, GATES.materiality)
    started, added = [], room._added

    def first_alone(current, space, known, *replaced):
        """Add one effect at first, as if the other had not passed beside it."""
        started.append({effect.name for effect in current.candidate.effects})
        alone = SearchSpace(base, (BEND,), *(prior, GATES, space.least))
        return added(current, alone if len(started) == 1 else space, known, *replaced)

    def swapped(base, current, *_):
        """Put the ripple in the place of the bend at first, as if it explained the runs better."""
        if [effect.name for effect in current.candidate.effects] != ["bend"]:
            return Contest(current, {effect.name: 1.0 for effect in current.candidate.effects})
        return Contest(without(base, (RIPPLE,), prior), {"ripple": 1.0})

    monkeypatch.setattr(room, "_added", first_alone)
    monkeypatch.setattr(room, "contested", swapped)
    chosen = room.forward(space)
    assert started[:2] == [set(), {"ripple"}]
    assert {effect.name for effect in chosen.fit.candidate.effects} == {"ripple", "bend"}
    assert set(chosen.weight) == {"ripple", "bend"}
    assert change(base, chosen.fit) > GATES.materiality


def test_what_something_too_small_to_be_claimed_explains_as_well_is_not_claimed_either(monkeypatch):
    """The twin takes the place of the bend; beside what that was claimed to be, it is next to nothing."""
    task = problem(2, truth=Wave(bend=0.2), phased=False)
    blocks = task.role("identify")
    prior = first_noise(GATES.model_form_budget, task.scatter, blocks)
    base = fit(Candidate(task.base), blocks, prior)
    twin = replace(BEND, name="twin")
    seen = []

    def swapped(base, current, *_):
        names = [effect.name for effect in current.candidate.effects]
        seen.append(names)
        if names == ["bend"]:
            return Contest(without(base, (twin,), prior), {"twin": 1.0})
        return Contest(current, dict.fromkeys(names, 1.0))

    def compared(smaller, larger):
        new = set(larger.candidate.effects) - set(smaller.candidate.effects)
        return replace(compare(smaller, larger), **({"size": sizes["twin"]} if twin in new else {}))

    monkeypatch.setattr(room, "contested", swapped)
    monkeypatch.setattr(room, "compare", compared)
    for size, left in ((2.0, ["twin"]), (0.5, [])):
        sizes = {"twin": size * GATES.materiality}
        seen.clear()
        chosen = room.forward(SearchSpace(base, (BEND, twin), prior, GATES, GATES.materiality))
        assert seen[0] == ["bend"]
        assert [effect.name for effect in chosen.fit.candidate.effects] == left
    (why,) = (trial.why_not for trial in chosen.trials if trial.effect.name == "twin")
    assert why.code == "immaterial"
