"""A gear whose torque comes and goes with the joint's angle while it is loaded."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from metro.effects.effect import Effect, EffectParameter, Values, per_joint
from metro.observables.problem import Problem, Refusal
from metro.robot.drive_torques import Ripple
from metro.units import DEG

LEAST_CYCLES, LEAST_POINTS = 2.0, 4.0  # per run; a path must show, a cycle must hold


def _of(joint: int) -> Effect:
    def apply(model: Any, values: Values) -> Any:
        phase, torque = values["phase_deg"] * DEG, values["torque_nm"]
        ripple = Ripple(joint, values["order"], torque * math.cos(phase), torque * math.sin(phase))
        return replace(model, drives=replace(model.drives, ripple=(*model.drives.ripple, ripple)))

    def adapt(effect: Effect, problem: Problem) -> Effect | Refusal:
        """Start from orders that the paths resolve: two cycles at least, four points in each."""
        runs: list[Any] = [
            block.setting for block in problem.role("identify") if hasattr(block.setting, "rate")
        ]
        spans = np.array([np.ptp(run.q[:, joint]) for run in runs])
        if not len(spans) or spans.max() <= 0.0:
            return Refusal(f"joint {joint + 1} does not move in any run")
        points = len(runs[int(spans.argmax())].q)
        cycle = 2.0 * math.pi / spans.max()  # order that has one cycle in the longest run
        low, high = LEAST_CYCLES * cycle, points / LEAST_POINTS * cycle
        starts = np.arange(low, high, 0.5 * cycle)
        if not len(starts):
            return Refusal(f"joint {joint + 1} turns too little in these cuts to show a ripple")
        torque, order, phase = effect.parameters
        order = replace(order, lower=low / 2, upper=2 * high, scale=0.1 * low, starts=tuple(starts.tolist()))
        return replace(effect, parameters=(torque, order, phase))

    return Effect(
        name="gear_ripple",
        observables=("joint_force", "waviness"),
        parameters=(
            EffectParameter("torque_nm", "N m", 0.0, 300.0, 2.0, starts=(1.0,)),
            EffectParameter("order", "1", 1.0, 5000.0, 10.0, starts=(100.0,)),
            EffectParameter(
                "phase_deg", "deg", -720.0, 720.0, 20.0, starts=(0.0, 120.0, 240.0), period=360.0
            ),
        ),
        apply=apply,
        signature=(
            "Torque of one joint that swings with its own angle, the same swing per angle at every feed "
            "and in every run."
        ),
        literature="Taghirad and Belanger, J. Dyn. Sys. Meas. Control 120 (1998) 496: harmonic drives",
        experiment="the same path at half and at twice the feed: a ripple stays where it is along the path",
        adapt=adapt,
    )


EFFECT = per_joint(_of)
