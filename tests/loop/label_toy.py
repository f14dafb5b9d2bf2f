"""A boundary in closed form, two effects on it, and labels drawn from it."""

from dataclasses import dataclass, replace

import numpy as np

from metro.effects.effect import Effect, EffectParameter
from metro.loop.search.trial import Gates

GATES = Gates(model_form_budget=0.007, materiality=0.004, false_additions=0.05, held_out_gain=3.0, seed=1)
RPM = np.arange(2000.0, 6000.0, 400.0)
SHARES = np.array([-0.6, -0.3, -0.1, 0.1, 0.3, 0.6])  # of log depth, about the true boundary


@dataclass(frozen=True)
class Line:
    """Log depth of the boundary: linear in speed; the chatter frequency is constant."""

    shift: float = 0.0
    slope: float = 0.0
    hz: float = 300.0

    def boundary(self, rpm):
        return np.log(1e-3) + self.shift + self.slope * (rpm - 4000.0) / 2000.0


def effect(name, field, plausible=0.6, **more):
    return Effect(
        name, ("lobes",), (EffectParameter("size", "1", -2.0, 2.0, 0.1, (0.1,), plausible=plausible),),
        lambda model, values: replace(model, **{field: getattr(model, field) + values["size"]}, **more),
        "", "", "",
    )  # fmt: skip


SHIFT, SLOPE = effect("shift", "shift"), effect("slope", "slope")
TWIN = effect("twin", "shift")  # of the labels; nothing tells it from the shift
LOUD = effect("loud", "shift", hz=450.0)  # the same, heard at another frequency
IDLE = effect("idle", "slope", plausible=1e-3)


@dataclass(frozen=True)
class Made:
    """A problem of labels."""

    runs: tuple
    roles: tuple
    unstable: np.ndarray
    depth: np.ndarray
    point: np.ndarray
    chatter_hz: np.ndarray
    point_rpm: np.ndarray
    observable: str = "lobes"
    notes: tuple = ()
    model_sd: float = 0.15
    label_error: float = 0.005
    moved: float = 0.0  # of the base model's boundary, in log depth

    @property
    def point_tooth_hz(self):
        return 3 * self.point_rpm / 60.0

    @property
    def point_cut(self):
        return np.zeros(len(self.point_rpm), dtype=int)

    def boundaries(self, changes):
        models = [change(Line(shift=self.moved)) for change in changes]
        depth = np.stack([model.boundary(self.point_rpm) for model in models])
        return depth, np.outer([model.hz for model in models], np.ones(len(self.point_rpm)))

    def estimates(self, changes):
        """In error by a little that differs from speed to speed and grows with the change."""
        depth, hz = self.boundaries(changes)
        return depth + 0.2 * np.cos(self.point_rpm / 700.0) * (1.0 + depth - np.log(1e-3)), hz

    def boundaries_at(self, changes, rpm):
        return np.stack([change(Line()).boundary(rpm) for change in changes])

    def deviations(self, draws, seed):
        return 0.02 * np.random.default_rng(seed).standard_normal((draws, len(self.point_rpm)))


def problem(true, seed, rpm=RPM, heard=False):
    """Tests about the true boundary, in error as the model says; every third speed is held out."""
    rng = np.random.default_rng(seed)
    error = 0.1 * rng.standard_normal() + 0.1 * rng.standard_normal(len(rpm))
    point = np.repeat(np.arange(len(rpm)), len(SHARES))
    log_depth = true.boundary(rpm)[point] + np.tile(SHARES, len(rpm))
    limit = true.boundary(rpm)[point] + error[point] + 0.045 * rng.standard_normal(len(point))
    unstable = log_depth > limit
    roles = np.where(point % 3 == 1, "validate", "identify")
    hz = np.where(unstable, true.hz * np.exp(0.02 * rng.standard_normal(len(point))), np.nan)
    hz = hz if heard else np.full(len(point), np.nan)
    runs = tuple(f"t{i:02d}" for i in range(len(point)))
    return Made(runs, tuple(roles), unstable, np.exp(log_depth), point, hz, rpm)
