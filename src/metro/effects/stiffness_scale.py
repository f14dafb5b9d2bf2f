"""Stiffness scale: the stiffness in the cut differs from that of the load tests, in all joints or in one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from metro.effects.effect import Effect, EffectParameter, per_joint
from metro.effects.elastic_joints import with_joints
from metro.effects.parts import WithStructure, WithTorsion
from metro.observables.problem import Refusal


def apply(model: WithStructure, values: Mapping[str, float]) -> WithStructure:
    """Multiply the stiffness that a model has in the cut by ``factor``; load tests are left as they are."""
    scaled = replace(model.structure, stiffness_factor=model.structure.stiffness_factor * values["factor"])
    return replace(model, structure=scaled)


# The frequency at which a tip rings goes with the root of its stiffness: waves are found from beside only.
BESIDE = (0.45, 0.6, 0.75, 0.88, 0.96, 1.04, 1.14, 1.37, 1.67, 2.1)

OF_MACHINE = Effect(
    name="stiffness_scale",
    observables=("flatness",),
    parameters=(EffectParameter("factor", "1", 0.2, 5.0, 0.05, starts=BESIDE, neutral=1.0, reciprocal=True),),
    apply=apply,
    signature=(
        "Deformation or deviation in proportion to the predicted one, over all runs and places. "
        "A force that is wrong by the same factor looks the same."
    ),
    literature="Abele et al., Prod. Eng. 1 (2007) 387: stiffness under process load against static tests",
    experiment=(
        "load tests at the force level of the cut, and a dynamometer in one cut to separate force and "
        "stiffness"
    ),
    remedy=(
        "predict cuts with the stiffness found here, and repeat the load tests with "
        "the preload and warmth of the cut"
    ),
)


def _gives_way(effect: Effect, problem: Any) -> Effect | Refusal:
    give = np.array([getattr(block.setting, "give", 0.0) for block in problem.role("identify")])
    if not give.any():
        return Refusal("")  # no machine that gives way, or it is said already that nobody knows how far
    sd = np.array([getattr(block.setting, "give_sd", 0.0) for block in problem.role("identify")])
    unsure = float(np.linalg.norm(sd) / np.linalg.norm(give))  # how much softer the gears of an arm may be
    return replace(effect, parameters=(replace(effect.parameters[0], neutral_sd=unsure),))


# Without waves, one start on each side of the neutral factor is enough.
AWAY = (EffectParameter("factor", "1", 0.2, 5.0, 0.05, starts=(0.8, 1.2), neutral=1.0, reciprocal=True),)
OF_SIDE_CUTS = replace(
    OF_MACHINE,
    observables=("force",),
    parameters=AWAY,
    form="side cuts",
    signature=(
        "Side cuts by an arm, which gives way, that are deeper or shallower than the load tests let expect. "
        "Seen where the arm gives way by a part of the radial depth, and by another one in other runs."
    ),
    adapt=_gives_way,
)
OF_ARM = replace(
    OF_MACHINE, observables=("deformation",), parameters=AWAY, form="all joints", where={"joint": "all"}
)


def _of(joint: int) -> Effect:
    def of_joint(model: WithTorsion, values: Mapping[str, float]) -> WithTorsion:
        return replace(model, torsion=model.torsion.with_joint(joint, factor=values["factor"]))

    return replace(
        OF_MACHINE,
        observables=("deformation",),
        parameters=AWAY,
        apply=of_joint,
        signature=(
            "Deformation in proportion to the contribution of one joint. In cuts that load the arm in the "
            "same way this is a constant share of the whole, and the joints cannot be distinguished."
        ),
        experiment="cuts in poses, or in directions of feed, in which the joints' shares are others",
        adapt=with_joints,
    )


EFFECT = (OF_MACHINE, OF_SIDE_CUTS, OF_ARM, *per_joint(_of))
