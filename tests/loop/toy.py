"""A small problem with known truth: a wave of two parameters, a phase per run, and effects on it."""

from dataclasses import dataclass, replace

import numpy as np

from metro.effects.effect import Effect, EffectParameter
from metro.loop.search.trial import Gates
from metro.observables.problem import Block, Parameter, Problem

POINTS = 24
ANGLE = 2 * np.pi * np.arange(POINTS) / POINTS
BETA = np.array([5.0, 8.0])
SIGMA = 0.05
SCATTER = 0.01
GATES = Gates(model_form_budget=0.002, materiality=0.004, false_additions=0.05, held_out_gain=3.0, seed=1)


@dataclass(frozen=True)
class Setting:
    """``feed`` of a run, and whether its phase is unknown."""

    feed: float
    phased: bool = True


@dataclass(frozen=True)
class Wave:
    """beta0 · feed · (1+gain)(cos τ + bend cos 3τ) + beta1 (1 + sin 2τ + sin 5τ / 2 + ripple sin 4τ)."""

    bend: float = 0.0
    ripple: float = 0.0
    gain: float = 0.0
    spike: float = 0.0

    @property
    def parameters(self):
        return (Parameter("a", "N"), Parameter("b", "mN", 1e-3))

    def nuisance_starts(self, block):
        if not block.setting.phased:
            return np.zeros((1, 0))
        return (2 * np.pi * np.arange(16) / 16)[:, None]

    def design(self, block, nuisance, _beta=None):
        tau = ANGLE - (nuisance[0] if len(nuisance) else 0.0)
        first = block.setting.feed * (1 + self.gain) * (np.cos(tau) + self.bend * np.cos(3 * tau))
        second = (
            1
            + np.sin(2 * tau)
            + 0.5 * np.sin(5 * tau)
            + self.ripple * np.sin(4 * tau)
            + self.spike * np.cos(7 * tau)
        )
        return np.stack([first, second], axis=1), np.zeros(POINTS)


def effect(name, attribute, **options):
    """An effect that adds its one parameter to an attribute of the wave."""
    parameter = EffectParameter(attribute, "1", -2.0, 2.0, 0.05, starts=(-0.1, 0.1), **options)

    def apply(model, values):
        return replace(model, **{attribute: getattr(model, attribute) + values[attribute]})

    return Effect(name, ("toy",), (parameter,), apply, "", "", f"an experiment for {name}")


BEND, TWIN, RIPPLE, GAIN = (
    effect("bend", "bend"),
    effect("twin", "bend"),
    effect("ripple", "ripple"),
    effect("gain", "gain"),
)


def block(run, feed, role, rng, *, truth=None, condition=None, phased=True, scatter=SCATTER, order=1):
    """One run of the truth: coefficients scattered, phase drawn, white noise."""
    empty = Block(
        run=run,
        condition=condition or f"{role}-{feed:g}",
        role=role,
        order=order,
        measured=np.zeros(POINTS),
        sigma=np.full(POINTS, SIGMA),
        setting=Setting(feed, phased),
        axis=np.full(POINTS, "x"),
        zeros=np.zeros((POINTS, 0)),
        zero_sd=np.zeros(0),
        coordinates={"axis": np.full(POINTS, "x"), "angle_deg": np.degrees(ANGLE)},
        labels=np.repeat(["first quarter", "second quarter", "third quarter", "last quarter"], POINTS // 4),
    )
    phase = rng.uniform(0, 2 * np.pi, 1) if phased else np.zeros(0)
    matrix, _ = (truth or Wave()).design(empty, phase)
    beta = BETA * (1 + scatter * rng.normal(size=2))
    return replace(empty, measured=matrix @ beta + SIGMA * rng.normal(size=POINTS))


def problem(
    seed, *, truth=None, phased=True, feeds=(1.0, 2.0, 3.0, 4.0), repeats=3, held=(2.5, 3.5), scatter=SCATTER
):
    """Blocks of identification runs (``repeats`` of each feed, in turn) and two validation runs."""
    rng = np.random.default_rng(seed)
    plan = [(feed, "identify") for _ in range(repeats) for feed in feeds] + [
        (feed, "validate") for feed in held
    ]
    blocks = tuple(
        block(f"r{i}", feed, role, rng, truth=truth, phased=phased, scatter=scatter, order=i)
        for i, (feed, role) in enumerate(plan, start=1)
    )
    return Problem("toy", "N", 1.0, Wave(), blocks, np.full(2, SCATTER))
