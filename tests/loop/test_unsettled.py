"""A fit that did not converge, or leaves an effect undetermined, is no result."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from toy import BEND, GAIN, GATES, RIPPLE, TWIN, Wave, problem
from worded import in_words

from metro.loop.checks.left_out import left_out
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import fit
from metro.loop.fitting.noise import first_noise
from metro.loop.search import rivals, settled, trial
from metro.loop.search.search import search
from metro.loop.search.settled import unsettled
from metro.loop.search.trial import tried
from metro.loop.statement import Statement
from metro.loop.verdict import verdict


def fitted(task, *effects):
    blocks = task.role("identify")
    base = fit(Candidate(task.base), blocks, first_noise(GATES.model_form_budget, task.scatter, blocks))
    return fit(Candidate(task.base, effects), blocks, base.noise, base) if effects else base


def test_a_fit_is_settled_and_one_that_is_not_is_told():
    found = fitted(problem(1, truth=Wave(bend=0.1), phased=False), BEND)
    assert unsettled(found) is None
    assert unsettled(replace(found, step=0.4)) is None  # nothing that its interval would show
    assert "did not converge (next step: 3 standard deviations)" in in_words(
        unsettled(replace(found, step=3.0))
    )


def test_an_effect_that_the_base_imitates_is_not_determined():
    blind = replace(GAIN, parameters=tuple(replace(p, plausible=None) for p in GAIN.parameters))
    found = fitted(problem(2, phased=False), blind)
    assert found.rank == 1  # not told apart: the effect and the base parameter that imitates it
    assert unsettled(found) == Statement("undetermined")


def test_an_effect_of_which_the_runs_leave_everything_open_is_not_determined():
    found = fitted(problem(1, truth=Wave(bend=0.1), phased=False), BEND)
    half = 2.0 * float(np.sqrt(found.covariance[-1, -1] * found.dispersion))
    for width, determined in ((0.9 * half, False), (1.1 * half, True)):
        ends = {"lower": found.theta[0] - width, "upper": found.theta[0] + width}
        narrow = replace(BEND, parameters=tuple(replace(p, **ends) for p in BEND.parameters))
        bounded = replace(found, candidate=Candidate(found.candidate.base, (narrow,)))
        assert (unsettled(bounded) is None) is determined


def test_an_effect_that_may_not_be_negative_and_is_nothing_is_at_no_end():
    found = fitted(problem(1, truth=Wave(bend=0.1), phased=False), BEND)
    one_sided = replace(BEND, parameters=tuple(replace(p, lower=0.0) for p in BEND.parameters))
    assert one_sided.parameters[0].neutral == 0.0
    candidate = Candidate(found.candidate.base, (one_sided,))
    assert unsettled(replace(found, candidate=candidate, theta=np.zeros(1))) is None


def test_an_effect_at_its_bound_has_converged_and_is_no_result():
    low = replace(BEND, parameters=tuple(replace(p, upper=0.05, starts=(0.01,)) for p in BEND.parameters))
    found = fitted(problem(3, truth=Wave(bend=0.2), phased=False), low)
    assert found.theta == pytest.approx([0.05])
    assert found.converged
    (name,) = [parameter.name for parameter in low.parameters]
    why = Statement("implausible", {"parameter": name, "bound": 0.05})
    assert unsettled(found) == why
    both = replace(
        found,
        candidate=Candidate(found.candidate.base, (low, RIPPLE)),
        theta=np.append(found.theta, 0.0),
        covariance=np.pad(found.covariance, (0, 1), constant_values=1e-9),
        pressed=np.append(found.pressed, 0.0),
    )
    beside = unsettled(both)  # of the one tried last, the fault is that another is at its bound with it
    assert beside == Statement("beside", {"effect": "bend", "why": why})
    assert (
        in_words(beside) == f"with it, bend is no result: its {name} would exceed the plausible limit of 0.05"
    )


@pytest.mark.parametrize(("alike", "reason"), [(0.0, False), (0.5, False), (0.99, True), (-0.99, True)])
def test_an_effect_is_refused_for_another_one_only_where_it_is_the_reason(alike, reason):
    """Of the interval of one, the part that another one takes is gone where that is known: 1 - r² is left."""
    found = fitted(problem(1, truth=Wave(bend=0.1), phased=False), BEND)
    half = 2.0 * float(np.sqrt(found.covariance[-1, -1] * found.dispersion))
    ends = {"lower": found.theta[0] - 0.5 * half, "upper": found.theta[0] + 0.5 * half}
    vague = replace(BEND, parameters=tuple(replace(p, **ends) for p in BEND.parameters))
    deviation = np.sqrt(np.append(np.diag(found.covariance), 1e-6))
    covariance = np.diag(deviation**2)
    covariance[-1, -2] = covariance[-2, -1] = alike * deviation[-1] * deviation[-2]
    both = replace(
        found,
        candidate=Candidate(found.candidate.base, (vague, RIPPLE)),
        theta=np.append(found.theta, 0.1),
        covariance=covariance,
        pressed=np.append(found.pressed, 0.0),
    )
    beside = Statement("beside", {"effect": "bend", "why": Statement("undetermined")})
    assert unsettled(both) == beside
    assert unsettled(both, RIPPLE) == (beside if reason else None)
    assert unsettled(both, vague) == Statement("undetermined")


@pytest.mark.parametrize(("deviations", "settled"), [(0.5, True), (3.0, False), (60.0, False)])
def test_a_bound_that_a_freed_parameter_would_not_leave_by_much_refuses_no_effect(deviations, settled):
    """Not where the estimate is counts, but whether the runs say that the true value is beyond."""
    task = problem(3, truth=Wave(bend=0.2), phased=False)
    free = fitted(task, BEND)
    upper = free.theta[0] - deviations * np.sqrt(free.covariance[-1, -1] * free.dispersion)
    low = replace(BEND, parameters=tuple(replace(p, upper=upper, starts=(0.01,)) for p in BEND.parameters))
    found = fitted(task, low)
    assert found.theta == pytest.approx([upper])
    assert (unsettled(found) is None) is settled


@pytest.mark.parametrize(("limit", "refused"), [("nothing_above", False), ("nothing_below", True)])
def test_a_bound_refuses_an_effect_unless_it_is_the_one_that_is_a_physical_limit(limit, refused):
    low = [replace(p, upper=0.05, starts=(0.01,), **{limit: True}) for p in BEND.parameters]
    found = fitted(problem(3, truth=Wave(bend=0.2), phased=False), replace(BEND, parameters=tuple(low)))
    assert found.theta == pytest.approx([0.05])
    assert (unsettled(found) is not None) is refused


@pytest.mark.parametrize("decisive", [False, True])
@pytest.mark.parametrize("group", [0, 1])
def test_a_group_whose_decisive_parameter_is_open_does_not_show_the_effect(group, decisive):
    found = fitted(problem(1, truth=Wave(bend=0.1), phased=False), BEND)
    half = 2.0 * float(np.sqrt(found.covariance[-1, -1] * found.dispersion))
    (bend,) = BEND.parameters
    ends = {"lower": found.theta[0] - 0.9 * half, "upper": found.theta[0] + 0.9 * half}
    vague = replace(bend, name="vague", group=1, decisive=decisive, **ends)
    both = replace(BEND, parameters=(replace(bend, group=group), vague))
    why = settled._undetermined(both, np.repeat(found.theta, 2), np.full(2, half), np.zeros(2, dtype=bool))
    assert (why is None) is (group == 0 or not decisive)


def test_an_effect_whose_fit_is_no_result_is_not_claimed(monkeypatch):
    task = problem(1, truth=Wave(bend=0.1), phased=False)
    base = fitted(task)
    assert [t.why_not for t in tried(base, [BEND], base.noise, GATES, 0.004)] == [None]
    halted = trial.raced
    monkeypatch.setattr(trial, "raced", lambda *given: (replace(halted(*given)[0], step=2.0), False))
    assert tried(base, [BEND], base.noise, GATES, 0.004)[0].why_not.code == "not_converged"


@dataclass(frozen=True)
class Brittle(Wave):
    """A wave that has no prediction for a run whose order exceeds ``last``, once it is bent."""

    last: int = 99

    def beyond(self, block, _beta):
        return "it breaks" if self.bend and block.order > self.last else ""


def brittle(last, *roles):
    """A problem whose bent model breaks at the runs of ``roles`` after the one of order ``last``."""
    task = problem(1, truth=Wave(bend=0.1), phased=False)
    late = tuple(replace(block, order=last + 1 if block.role in roles else 0) for block in task.blocks)
    return replace(task, base=Brittle(**vars(task.base), last=last), blocks=late)


def test_where_the_model_does_not_hold_a_fit_is_no_result():
    sound, broken = brittle(7), brittle(7, "identify")
    assert unsettled(fitted(sound, BEND)) is None
    first = broken.role("identify")[0].run
    assert in_words(unsettled(fitted(broken, BEND))) == f"in {first} it breaks"
    assert search(sound, (BEND,), GATES).names == ("bend",)
    outcome = search(broken, (BEND,), GATES)
    assert outcome.names == ()
    assert [in_words(trial.why_not) for trial in outcome.trials] == [f"in {first} it breaks"]


def test_a_held_out_run_beyond_the_model_is_said_and_decides_nothing():
    for task, beyond in ((brittle(7), False), (brittle(7, "validate"), True)):
        outcome = search(task, (BEND,), GATES)
        assert outcome.names == ("bend",)  # the fit knows nothing of these runs
        rows = verdict.comparison(task, *(verdict.held_out(task, f) for f in (outcome.base, outcome.final)))
        told = in_words(verdict.judge(task, outcome, rows, GATES))
        assert told["status"] == "explained"
        assert ("The model cannot predict one held-out run" in told["verification"]["words"]) is beyond


def test_of_a_base_that_did_not_converge_nothing_is_called_clean():
    task = problem(4, phased=False)
    outcome = search(task, (BEND,), GATES)
    rows = verdict.comparison(task, *[verdict.held_out(task, outcome.base)] * 2)
    assert verdict.judge(task, outcome, rows, GATES)["status"] == "clean"
    astray = replace(outcome, base=replace(outcome.base, step=6.0), final=replace(outcome.final, step=6.0))
    told = in_words(verdict.judge(task, astray, rows, GATES))
    assert told["status"] == "unexplained"
    assert "did not converge" in told["unexplained"]["signature"]
    assert np.isfinite(outcome.final.step)


@dataclass(frozen=True)
class Fragile(Wave):
    """A wave that predicts the greatest feed only while its bend stays below a limit."""

    limit: float = np.inf

    def beyond(self, block, _beta):
        return "too much bend" if block.setting.feed == 4.0 and self.bend > self.limit else None


def test_an_effect_that_leaves_no_prediction_where_a_condition_is_left_out_is_not_added():
    task = problem(2, truth=Wave(bend=0.1), phased=False)
    blocks = task.role("identify")
    prior = first_noise(GATES.model_form_budget, task.scatter, blocks)

    def bends(limit):
        """Bend of all runs, of those without the greatest feed, and why the trial is not added."""
        base = fit(Candidate(Fragile(limit=limit)), blocks, prior)
        (one,) = tried(base, [BEND], prior, GATES, GATES.materiality)
        ((part,),) = [p for name, p in left_out(one.fit, prior).items() if name == "identify-4"]
        return one.fit.theta[0], part.others.theta[0], one.why_not

    whole, without, why = bends(np.inf)
    assert why is None
    assert without > whole  # so that the fit of all runs has a prediction
    _, _, why = bends(0.5 * (whole + without))
    assert why == Statement("no_prediction", {"run": "r4", "why": "too much bend"})
    assert bends(1.01 * without)[2] is None


def test_what_leaves_no_prediction_where_a_condition_is_left_out_is_no_rival(monkeypatch):
    task = problem(2, truth=Wave(bend=0.1), phased=False)
    blocks = task.role("identify")
    prior = first_noise(GATES.model_form_budget, task.scatter, blocks)
    base = fit(Candidate(task.base), blocks, prior)
    bent = fit(Candidate(task.base, (BEND,)), blocks, prior, base)
    found = rivals.contested(base, bent, (BEND, TWIN), prior, GATES).rivals
    assert [rival.other for rival in found] == ["twin"]
    why = Statement("no_prediction", {"run": "r4", "why": "too much bend"})
    monkeypatch.setattr(rivals, "beyond_left_out", lambda *_: why)
    assert not rivals.contested(base, bent, (BEND, TWIN), prior, GATES).rivals


def test_what_gains_nothing_is_not_significant_whether_or_not_it_converged():
    found = fitted(problem(1, truth=Wave(bend=0.1), phased=False), BEND)
    astray = replace(found, step=5.0)
    none = trial.Evidence(0.5, 0.6, {}, 0.1, 0.1, 0.0)
    one = trial.Trial(BEND, astray, none, q_value=0.6)
    assert trial._refused(one, GATES, GATES.materiality).code == "no_evidence"
    gains = replace(one, evidence=replace(none, statistic=80.0, p_value=1e-9), q_value=1e-9)
    assert trial._refused(gains, GATES, GATES.materiality).code == "not_converged"


def test_effects_that_are_slow_are_fitted_anew_last():
    current = fitted(problem(1, truth=Wave(bend=0.1), phased=False), BEND)
    base = fitted(problem(1, truth=Wave(bend=0.1), phased=False))
    slow = replace(BEND, slow=True)
    again = trial.without(base, (slow, RIPPLE), base.noise)
    assert again.candidate.effects == (RIPPLE, slow)
    assert current.total <= again.total + 1.0
