"""Which effects could make what another one makes, against changes whose shape is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from toy import BEND, GAIN, GATES, RIPPLE, TWIN, Wave, effect, problem

from metro.loop.fitting import fit as fit_room
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import Race, cost_under, fit, refit
from metro.loop.fitting.noise import first_noise
from metro.loop.fitting.race import raced
from metro.loop.search import rivals as rivals_room
from metro.loop.search.replaceable import FAR, Change, is_needed
from metro.loop.search.rivals import contested
from metro.loop.search.trial import tried

SPIKE = effect("spike", "spike")


def fits(truth, *chosen, phased=True, **options):
    """Return the base fit, that with all effects chosen, and the noise before anything is known."""
    task = problem(2, truth=truth, phased=phased, **options)
    blocks = task.role("identify")
    prior = first_noise(GATES.model_form_budget, task.scatter, blocks)
    base = current = fit(Candidate(task.base), blocks, prior)
    for one in chosen:
        current = fit(Candidate(task.base, (*current.candidate.effects, one)), blocks, prior, current)
    return base, current, prior


def test_an_effect_of_the_same_shape_could_and_those_of_others_could_not():
    base, current, _ = fits(Wave(bend=0.2), BEND)
    change = Change(base, current)
    assert [change.could_be(one) for one in (TWIN, RIPPLE, SPIKE)] == [True, False, False]


def test_what_base_and_phases_take_of_a_change_is_not_asked_of_another_effect():
    """A gain is the first coefficient: nothing of it is left, so that anything could stand in for it."""
    base, _, prior = fits(Wave(bend=0.2))
    gain = fit(Candidate(base.candidate.base, (GAIN,)), base.blocks, prior, base)
    gain = replace(gain, theta=np.array([0.3]))
    change = Change(base, gain)
    whole = sum(float(made @ made) for made in change.made)
    assert change.alone < 1e-6 * whole
    assert change.could_be(RIPPLE)


def test_the_share_that_is_left_is_that_of_least_squares():
    base, current, _ = fits(Wave(bend=0.2, ripple=0.1), BEND)
    change = Change(base, current)
    columns, made = [], np.concatenate(change.made)
    for at, (_, common, _, own) in enumerate(change.system.rows):
        block = np.zeros((len(common), len(change.made)))
        block[:, at] = own[:, 0]
        signatures = np.column_stack([one[at] for one in change._signatures(RIPPLE)])
        columns.append(np.hstack([common, signatures, block]))
    design = np.vstack(columns)
    left = made - design @ np.linalg.lstsq(design, made, rcond=None)[0]
    signatures = [np.column_stack(own) for own in zip(*change._signatures(RIPPLE), strict=True)]
    assert change._left(signatures) == pytest.approx(float(left @ left), rel=1e-6)


def test_a_shape_is_where_it_starts_while_the_size_beside_it_is_none():
    """A bend of ``size`` over ``length``: at the length zero, which no bound lets it have, it is nothing."""

    def apply(model, values):
        return replace(model, bend=model.bend + values["size"] / values["length"])

    size = replace(BEND.parameters[0], name="size", starts=(0.0,))
    length = replace(size, name="length", lower=0.5, upper=5.0, starts=(2.0, 4.0))
    drawn = replace(BEND, name="drawn", parameters=(size, length), apply=apply)
    base, current, _ = fits(Wave(bend=0.2), BEND)
    change = Change(base, current)
    assert change._idle(drawn).tolist() == [0.0, 2.0]
    with np.errstate(all="raise"):
        made = [np.concatenate(one) for one in change._signatures(drawn)]
    (bent,) = (
        np.concatenate(change._made_by(change._with(BEND), np.array([size.scale / 2.0]), before))
        for before in [[base.predict(block) for block in base.blocks]]
    )
    of_size, of_length = made[-2:]
    np.testing.assert_allclose(of_size, bent)
    assert not of_length.any()
    assert change.could_be(drawn)


def test_a_small_change_may_be_made_by_anything():
    base, current, _ = fits(Wave(bend=0.004), BEND)
    change = Change(base, current)
    assert change._lost(change.alone) < FAR
    assert change.could_be(RIPPLE)


def test_only_those_that_could_are_fitted_in_a_contest(monkeypatch):
    base, current, prior = fits(Wave(bend=0.2), BEND)
    asked = []

    def counted(candidate, *rest):
        asked.append(candidate.effects[-1].name)
        return raced(candidate, *rest)

    monkeypatch.setattr(rivals_room, "raced", counted)
    contest = contested(base, current, (BEND, TWIN, RIPPLE, SPIKE), prior, GATES)
    assert set(asked) == {"twin"}
    assert [rival.pair for rival in contest.rivals] == [("bend", "twin")]


def of_joint(form, prior):
    """One of the laws by which joint 1 may be bent."""
    return replace(effect("bent", "bend"), form=form, where={"joint": 1}, prior=prior)


def test_a_cause_whose_forms_have_more_weight_together_takes_the_place_of_an_effect_that_has_less():
    """Each law has two sevenths, and the effect that is in the model three."""
    laws = of_joint("plain", 1.0), of_joint("amplified", 1.0)
    base, current, prior = fits(Wave(bend=0.2), replace(TWIN, prior=1.5))
    contest = contested(base, current, (replace(TWIN, prior=1.5), *laws), prior, GATES)
    assert [one.name for one in contest.final.candidate.effects] == ["bent"]
    assert contest.weight["bent"] == pytest.approx(4 / 7, abs=0.05)
    assert [rival.pair for rival in contest.rivals] == [("bent", "twin")]


def test_of_the_forms_of_a_cause_the_one_with_the_most_weight_takes_its_place():
    rare, usual = of_joint("rare", 0.1), of_joint("usual", 0.9)
    base, current, prior = fits(Wave(bend=0.2), rare)
    contest = contested(base, current, (rare, usual), prior, GATES)
    assert [one.form for one in contest.final.candidate.effects] == ["usual"]
    assert contest.weight["bent"] == pytest.approx(1.0, abs=0.01)
    assert contest.rivals == ()


def test_a_likeness_that_leaves_much_beside_all_is_fitted_in_the_place_of_none(monkeypatch):
    like = replace(TWIN, name="like", resembled=True)
    base, current, prior = fits(Wave(bend=0.2, ripple=0.3), BEND)
    asked = []

    def counted(how):
        def asking(candidate, *rest):
            asked.append([one.name for one in candidate.effects])
            return how(candidate, *rest)

        return asking

    monkeypatch.setattr(rivals_room, "fit", counted(fit))
    monkeypatch.setattr(rivals_room, "raced", counted(raced))
    contested(base, current, (BEND, like), prior, GATES)
    assert asked == [["bend", "like"]]


def test_a_likeness_is_tried_where_nothing_of_the_library_may_be_added():
    like = replace(TWIN, name="like", resembled=True)
    base, _, prior = fits(Wave(bend=0.2))
    with_bend = {one.effect.name for one in tried(base, (BEND, like), prior, GATES, 0.001)}
    without = {one.effect.name: one for one in tried(base, (RIPPLE, like), prior, GATES, 0.001)}
    assert with_bend == {"bend"}
    assert without["like"].why_not is None
    assert without["ripple"].why_not is not None


def test_a_fit_below_its_bound_serves_any_and_one_above_serves_lower_ones(monkeypatch):
    base, _, prior = fits(Wave(bend=0.2, ripple=0.15), phased=False)
    start = replace(base, noise=base.noise.sound)
    made, fitted = [], fit_room._fitted

    def counted(candidate, *rest):
        made.append(candidate.effects[-1].name)
        return fitted(candidate, *rest)

    monkeypatch.setattr(fit_room, "_fitted", counted)

    def fit_of(one, bound):
        return fit(Candidate(base.candidate.base, (one,)), base.blocks, prior, start, Race(bound))

    cost = cost_under(fit_of(BEND, np.inf), start.noise)
    assert fit_of(BEND, cost + 5.0) is fit_of(BEND, np.inf)
    given_up = fit_of(RIPPLE, cost + 5.0)
    assert fit_of(RIPPLE, cost) is given_up
    assert made == ["bend", "ripple"]
    assert fit_of(RIPPLE, np.inf) is not given_up
    assert made == ["bend", "ripple", "ripple"]


def test_a_fit_without_a_condition_ends_where_new_derivatives_end_it():
    _, current, prior = fits(Wave(bend=0.3, ripple=0.2), BEND, RIPPLE)
    others = [block for block in current.blocks if block.condition != "identify-3"]
    held = refit(current, others, prior)
    whole = fit_room._refined(
        current.candidate, others, prior, current.noise,
        fit_room.State(current.theta.copy(), current.beta.copy(), dict(current.nuisance)), rounds=1,
    )  # fmt: skip
    sd = np.sqrt(np.diag(whole.covariance))[len(whole.beta) :]
    assert np.abs(held.theta - current.theta).max() > 1e-4
    assert (np.abs(held.theta - whole.theta) < 0.1 * sd).all()
    assert np.sqrt(np.diag(held.covariance)[2:]) == pytest.approx(sd, rel=0.02)


def test_what_a_fit_loses_far_too_much_without_is_needed_and_what_another_makes_too_is_not():
    _, current, _ = fits(Wave(bend=0.2), BEND, RIPPLE)
    assert [is_needed(current, one) for one in (BEND, RIPPLE)] == [True, False]
    _, twice, _ = fits(Wave(bend=0.2), BEND, TWIN)
    assert not is_needed(twice, BEND)  # its twin takes all of it
    phased = replace(BEND, own=1)
    assert not is_needed(
        replace(current, candidate=replace(current.candidate, effects=(phased, RIPPLE))), phased
    )


def test_to_first_order_it_is_what_a_fit_without_it_loses():
    _, current, prior = fits(Wave(bend=0.2), BEND)
    smaller = fit(Candidate(current.candidate.base), current.blocks, prior)
    assert is_needed(current, BEND)
    assert current.total - smaller.total > FAR
