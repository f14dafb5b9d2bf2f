"""Gear ripple: the torque of a loaded gear varies with the angle of the joint."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from metro.effects.effect import Effect, EffectParameter, Values, per_joint
from metro.effects.periodogram import peaks
from metro.observables.problem import Problem, Refusal
from metro.robot.amplified import AmplifiedRipple, Structure
from metro.robot.drive_torques import Ripple
from metro.units import DEG, Array

LEAST_CYCLES, LEAST_POINTS = 2.0, 4.0  # that the longest run must show; that a cycle must hold
HIGHEST = 3000.0  # several times the ratio of any gear of an arm
STEPS = 2.0  # per width of a line: the reciprocal of the range of angles of all runs
MOST = 4  # lines that are followed
APART = 2.0  # torques of lines that are more than so many times apart are starts of their own


def _of(joint: int) -> Effect:
    def apply(model: Any, values: Values) -> Any:
        phase, torque = values["phase_deg"] * DEG, values["torque_nm"]
        ripple = Ripple(joint, values["order"], torque * math.cos(phase), torque * math.sin(phase))
        return replace(model, drives=replace(model.drives, ripple=(*model.drives.ripple, ripple)))

    def adapt(effect: Effect, problem: Problem) -> Effect | Refusal:
        """Start from the strongest lines, along the joint's angle, of the base model's residual."""
        angles = [block.setting.q[:, joint] for block in problem.role("identify")]
        orders = _resolved(angles)
        if not len(orders):
            return Refusal("no joint turns enough in these cuts to show a ripple of its gear")
        lines, size = peaks(
            problem, lambda model, block, some: model.ripples(block, joint, some), orders, MOST
        )
        torque, order, phase = effect.parameters
        step = float(orders[1] - orders[0]) if len(orders) > 1 else order.scale
        order = replace(order, upper=2.0 * HIGHEST, scale=step, starts=tuple(lines.tolist()))
        torque = replace(torque, starts=_apart(np.clip(size, torque.scale, torque.upper)))
        return replace(effect, parameters=(torque, order, phase), sought=max(1.0, len(orders) / STEPS))

    return Effect(
        name="gear_ripple",
        observables=("joint_force", "waviness"),
        parameters=(
            EffectParameter("torque_nm", "N m", 0.0, 300.0, 2.0, starts=(1.0,), plausible=30.0),
            EffectParameter("order", "1", 1.0, 5000.0, 10.0, starts=(100.0,)),
            EffectParameter(
                "phase_deg",
                "deg",
                -180.0,
                180.0,
                20.0,
                starts=(-120.0, 0.0, 120.0),
                period=360.0,
                length="torque_nm",
            ),
        ),
        apply=apply,
        part="drives",
        signature=(
            "Torque of one joint that swings with its own angle, the same swing per angle at every feed "
            "and in every run."
        ),
        literature="Taghirad and Belanger, J. Dyn. Sys. Meas. Control 120 (1998) 496: harmonic drives",
        experiment="the same path at half and at twice the feed: a ripple stays where it is along the path",
        remedy="have the gear of this joint checked, or place the work where this joint turns less",
        adapt=adapt,
    )


def _amplified(joint: int) -> Effect:
    """Waves that grow where the arm's structure follows them: others by feed, and with twice the order."""
    plain = _of(joint)

    def apply(model: Any, values: Values) -> Any:
        phase, torque = values["phase_deg"] * DEG, values["torque_nm"]
        ripple = AmplifiedRipple(
            joint,
            values["order"],
            (torque * math.cos(phase), torque * math.sin(phase)),
            (values["double_sine_nm"], values["double_cosine_nm"]),
            Structure(values["mode_hz"], values["mode_damping"]),
        )
        return replace(model, amplified=(*model.amplified, ripple))

    def adapt(effect: Effect, problem: Problem) -> Effect | Refusal:
        found = plain.adapt(plain, problem) if plain.adapt else plain
        if isinstance(found, Refusal):
            return found
        return replace(effect, parameters=(*found.parameters, *MODE), sought=found.sought)

    return replace(
        plain,
        observables=("waviness",),
        parameters=(*plain.parameters, *MODE),
        apply=apply,
        part="amplified",
        adapt=adapt,
        signature=(
            "Waves of one length per turn of a joint at every feed, and of half that length, that are higher "
            "at the feeds that bring them near a frequency of the arm."
        ),
        literature="Schneider et al., Prod. Eng. 8 (2014) 59: modes of industrial robots at 6 to 25 Hz",
    )


# Published first modes of heavy arms lie at 6 to 25 Hz, with 2 to 12 % of critical damping; a fit starts near
# the quartiles, and the waves say the rest.
MODE = (
    EffectParameter("mode_hz", "Hz", 3.0, 60.0, 1.0, starts=(8.6, 17.4), group=1, neutral=60.0, local=True),
    EffectParameter("mode_damping", "1", 0.01, 0.4, 0.03, starts=(0.08,), group=1, neutral=0.08, local=True),
    EffectParameter("double_sine_nm", "N m", -100.0, 100.0, 1.0, starts=(0.0,), group=1, local=True),
    EffectParameter("double_cosine_nm", "N m", -100.0, 100.0, 1.0, starts=(0.0,), group=1, local=True),
)


def _apart(sizes: Array) -> tuple[float, ...]:
    """Keep sizes, rising, well above the one before: a slow line may need ten times a quick one's torque."""
    kept: list[float] = []
    for size in np.sort(sizes).tolist():
        if not kept or size > APART * kept[-1]:
            kept.append(size)
    return tuple(kept)


def _resolved(angles: list[Array]) -> Array:
    """Orders that a joint's angles, one array per run, rad, resolve."""
    spans = np.array([float(np.ptp(one)) for one in angles])
    if not len(spans) or spans.min() <= 0.0:
        return np.zeros(0)
    low = 2.0 * math.pi * LEAST_CYCLES / spans.max()
    high = max(
        2.0 * math.pi * len(one) / LEAST_POINTS / span for one, span in zip(angles, spans, strict=True)
    )
    step = 2.0 * math.pi / (STEPS * float(np.ptp(np.concatenate(angles))))
    return np.asarray(np.arange(low, min(high, HIGHEST), step))


EFFECT = (
    *per_joint(_of),
    *(replace(each, form=f"{each.form}, amplified", prior=0.5) for each in per_joint(_amplified)),
)
