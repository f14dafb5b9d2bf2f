"""What an effect is: a named change of one part of a model, with a few parameters."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

from metro.joint_columns import MOST_AXES
from metro.observables.problem import Refusal
from metro.units import Array

Values = Mapping[str, Any]
Owner = Literal["cell", "tool", "work", "instrument"]
Per = Literal["", "axis", "joint", "tooth"]


@dataclass(frozen=True)
class EffectParameter:
    """A parameter of an effect.

    Attributes
    ----------
    name, unit : as in the contract's table of effects, e.g. ``radius_um`` in ``um``; values are given in this
        unit. Parameters of one name make a list (per axis, per tooth).
    lower, upper : bounds of the search; where they are the same, nothing is sought.
    scale : a typical size: the step of the search and the yardstick of "not zero".
    starts : values from which the joint refit starts.
    plausible : standard deviation of a weak prior about zero (None: flat): of two explanations that the data
        cannot part, the one that a machinist would believe.
    period : for an angle, the period after which the model is the same; None otherwise.
    length : for the angle of a plane vector, the name of the parameter that is its length: a step is one of
        the vector, which does not bend where the vector is short.
    group : parameters of a group are started from all combinations of their ``starts``, group after group,
        those of later groups ``neutral`` meanwhile.
    neutral : value at which the parameter's group changes nothing.
    neutral_sd : standard deviation of what is believed to be neutral, of its reciprocal where that acts: an
        arm may be as soft as that in the cut, and nothing is missing.
    choices : what the values 0, 1, … stand for, where the parameter is a choice among these.
    nothing_below, nothing_above : whether nothing can be beyond the lower, the upper bound: no tool is
        rounder than a ball. A value at such a bound may be true, at any other the true value is beyond it.
    decisive : whether its group is not shown where it is not determined: what has no damping does not ring.
    optional : whether those who declare the effect may leave it out; it is ``neutral`` then.
    local : whether it is another quantity in each observable (an amplitude along another axis): where one
        cause shows in several, the others are shared.
    """

    name: str
    unit: str
    lower: float
    upper: float
    scale: float
    starts: tuple[float, ...]
    period: float | None = None
    length: str = ""
    reciprocal: bool = False
    plausible: float | None = None
    group: int = 0
    neutral: float = 0.0
    neutral_sd: float = 0.0
    choices: tuple[str, ...] = ()
    local: bool = False
    nothing_below: bool = False
    nothing_above: bool = False
    decisive: bool = False
    optional: bool = False

    @property
    def given(self) -> bool:
        """Whether it has one value only, which says what the other parameters mean."""
        return self.lower == self.upper


@dataclass(frozen=True)
class Effect:
    """A cause that a base model may lack.

    Attributes
    ----------
    name : as in the contract.
    observables : names of the observables whose models have the part that it changes.
    parameters : its parameters, in the units of the contract.
    apply : ``apply(model, values) -> model``; ``values`` maps names to numbers in their own units, or to
        lists. It composes: the model that it returns has the effect by ``values`` on top of what the model
        had of it already. So what the loop finds is always what is missing beside that which the manifest
        declares, and never the total. Where ``values`` say that there is nothing, the model predicts as
        before; where the model had nothing of it, it has exactly ``values``.
    signature : one sentence: where it is seen, and what resembles it.
    literature : where the model of the effect comes from.
    experiment : the measurement that would show it best, for "measure this next".
    remedy : what to do about it once it is identified: an instruction that begins with a verb, for the first
        page. Empty: nothing is said.
    adapt : what makes it fit a batch: ``adapt(effect, problem)`` is the effect with the parameters that the
        batch calls for (one per tooth), or why this batch cannot show it. None: as it is.
    mixing : rows that make the values of the contract from the parameters of the search, where these are
        fewer (pitch errors add up to nothing); empty: they are the same.
    resembled : true of a cause that is not one of the contract's: it is tried like the others, so that none
        of them is taken for it, but the verdict only says that the rest resembles it.
    form : where one cause has several models of which a batch has one (a drift in steps or in time; another
        joint): what distinguishes them, for the report.
    where : what of the contract's parameters the form says (``joint``): reported as it is.
    part : field of the model that it changes, where not every model of its observables has it (a printed
        table is predicted without an arm).
    prior : its weight before anything is known, against that of an effect with one form: that of a cause is
        shared by its forms.
    own : number of unknowns that it gives every run for itself (a phase): each is fitted to the run, and
        gains by chance.
    timed : whether the runs have speeds apart, so that these unknowns belong to the time and not to the path.
    belongs_to : what its parameters are a property of. A campaign follows them over the batches of one cell
        and, where they are of the tool or the work, of one tool and one material.
    comparable : whether its parameters mean the same in every batch, so that a campaign may follow them.
    slow : whether a prediction with it takes many times as long: where effects are fitted anew, one after
        another, it comes last.
    per : what its values are given for one by one: a list has an entry for each ``axis`` x, y and z of an
        instrument or for each ``tooth``; of an effect of a ``joint`` there is a form for each.
    sought : number of independent places (lines of a spectrum) among which ``adapt`` looked for it. The best
        of many is good by chance: the evidence is discounted by so many tries.
    """

    name: str
    observables: tuple[str, ...]
    parameters: tuple[EffectParameter, ...]
    apply: Callable[[Any, Values], Any]
    signature: str
    literature: str
    experiment: str
    adapt: Callable[[Effect, Any], Effect | Refusal] | None = None
    mixing: tuple[tuple[float, ...], ...] = ()
    form: str = ""
    resembled: bool = False
    where: Mapping[str, int | str] = field(default_factory=dict, hash=False)
    part: str = ""
    prior: float = 1.0
    own: int = 0
    timed: bool = False
    sought: float = 1.0
    remedy: str = ""
    belongs_to: tuple[Owner, ...] = ("cell",)
    comparable: bool = True
    slow: bool = False
    per: Per = ""

    @property
    def odds(self) -> float:
        """Its weight before anything is known, at the one place where it is found."""
        return self.prior / self.sought

    @property
    def meaning(self) -> str:
        """What it is, in a sentence: the first line of its file, without a title of one or two words."""
        line = (sys.modules[self.apply.__module__].__doc__ or "").partition("\n")[0]
        title, _, sentence = line.partition(": ")
        return sentence[:1].upper() + sentence[1:] if sentence and title.count(" ") < 2 else line

    @property
    def key(self) -> tuple[str, str]:
        """What distinguishes it from every other effect and form: its name and its form."""
        return self.name, self.form

    @property
    def title(self) -> str:
        """Its name, with its form if it has one: ``friction_reversal (joint 3)``."""
        return f"{self.name} ({self.form})" if self.form else self.name

    @property
    def reported(self) -> tuple[EffectParameter, ...]:
        """The parameter that each value of the contract belongs to."""
        return self.parameters[:1] * len(self.mixing) if self.mixing else self.parameters

    @property
    def matrix(self) -> Array:
        """Map (values, parameters) from the parameters of the search to the values of the contract."""
        return np.array(self.mixing) if self.mixing else np.eye(len(self.parameters))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of its values, each once."""
        return tuple(dict.fromkeys(parameter.name for parameter in self.reported))

    @property
    def left_out(self) -> dict[str, Any]:
        """Values of what may be left out, by name."""
        return {parameter.name: parameter.neutral for parameter in self.reported if parameter.optional}

    def spread(self, values: Values) -> Values:
        """Return values as ``apply`` takes them, of those that a person declares.

        Every list is as long as it must be: one number stands for all its entries. A word is its place among
        the choices. What may be left out is neutral.
        """
        lengths = {name: sum(p.name == name for p in self.reported) for name in self.names}
        choices = {parameter.name: parameter.choices for parameter in self.parameters}
        numbers = {
            name: choices[name].index(value) if value in choices[name] else value
            for name, value in (self.left_out | dict(values)).items()
        }
        return {
            name: [value] * lengths[name] if lengths[name] > 1 and not isinstance(value, list) else value
            for name, value in numbers.items()
        }

    @property
    def typical(self) -> float:
        """Typical size of the first parameter: the farthest of its starts from none of the effect.

        It is zero, and says nothing, where a model is linear in the parameter and starts from none.
        """
        first = self.parameters[0]
        return max(abs(start - first.neutral) for start in first.starts)

    def values(self, theta: Array) -> dict[str, Any]:
        """Return the values by name, those of one name as a list; ``theta`` (parameters,)."""
        return by_name(self.reported, [float(value) for value in self.matrix @ theta])


def per_joint(of_joint: Callable[[int], Effect]) -> tuple[Effect, ...]:
    """Return the forms of an effect of one joint, ``of_joint(joint)``, for each (from 0) of any arm."""
    return tuple(
        replace(
            of_joint(joint),
            form=f"joint {joint + 1}",
            where={"joint": joint + 1},
            per="joint",
        )
        for joint in range(MOST_AXES)
    )


def by_name(parameters: tuple[EffectParameter, ...], entries: list[Any]) -> dict[str, Any]:
    """Put one entry per parameter under its name: as it is, or as a list where several have the name."""
    names = [parameter.name for parameter in parameters]
    taken: dict[str, list[Any]] = {}
    for name, entry in zip(names, entries, strict=True):
        taken.setdefault(name, []).append(entry)
    return {name: values if names.count(name) > 1 else values[0] for name, values in taken.items()}


def fitted_to(
    effects: tuple[Effect, ...], problem: Any, *, moot: bool = False
) -> tuple[tuple[Effect, ...], dict[str, str]]:
    """Fit effects to a batch's ``problem``: those that it may show, and of the others why it cannot.

    Of what the base model has already (a refusal without a reason) nothing is said, and of what would change
    nothing here only where ``moot`` asks for it.
    """
    able: list[Effect] = []
    unable: dict[str, str] = {}
    base = getattr(problem, "base", None)  # a problem of labels has a model of its own
    for effect in _of_its_joints(effects, getattr(base, "joints", ())):
        if effect.part and not hasattr(base, effect.part):
            unable[effect.name] = f"what is predicted here has no {effect.part}"
            continue
        adapted = effect.adapt(effect, problem) if effect.adapt else effect
        if isinstance(adapted, Refusal):
            unable |= {effect.name: adapted.reason} if adapted.reason and (moot or not adapted.moot) else {}
        else:
            able.append(adapted)
    return tuple(able), {name: why for name, why in unable.items() if name not in {e.name for e in able}}


def _of_its_joints(effects: tuple[Effect, ...], joints: Sequence[int]) -> tuple[Effect, ...]:
    """Return effects without those of joints that an arm lacks; which one it is, is as likely of each.

    ``joints`` : of the arm of a model, from 0; none of a model that has no joints.
    """
    return tuple(
        replace(effect, prior=effect.prior / len(joints)) if effect.per == "joint" and joints else effect
        for effect in effects
        if effect.per != "joint" or not joints or effect.where["joint"] in {joint + 1 for joint in joints}
    )
