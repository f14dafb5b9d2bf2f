"""What the loop needs to know of an observable: blocks of evidence, and a model that predicts them.

A **block** is what one run says about one observable. It is the unit of evidence: the 10^5 samples of one run
share its coefficients, its phase and its zero, so they count once. A **model** predicts a block as ``offset +
X @ beta``, linear in the base parameters, or made so about their values; everything else that is nonlinear
is either a parameter of an effect (it made the model what it is) or a per-block nuisance (an unknown start
phase).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, Protocol, runtime_checkable

import numpy as np

from metro.units import Array

Role = Literal["identify", "validate", "calibrate"]


@dataclass(frozen=True)
class Parameter:
    """A quantity that a model has: its name in the outputs, its unit there, and that unit in SI."""

    name: str
    unit: str
    si: float = 1.0


@dataclass(frozen=True, eq=False)
class Block:
    """What one run says about one observable.

    Attributes
    ----------
    run, condition, role, order
        Identity of the run; ``calibrate`` marks evidence on the base parameters alone (a load test), which no
        effect of the cut touches and which is never compared in the report.
    measured : (n,) SI, in whatever basis makes the noise nearly white (orders, path points, …).
    sigma : (n,) standard error of ``measured`` from within the run.
    setting : what the model needs to predict the block; the observable's own frozen dataclass.
    axis : (n,) label of the axis that each element belongs to; materiality and the budget are judged per
        axis.
    zeros : (n, q) directions of run-level additive error (a zero offset per axis, a registration plane).
    zero_sd : (q,) prior standard deviations of the amplitudes of ``zeros``, SI.
    untold : (n, u) directions in which the base model may be off here since no run of the fit tells a
        parameter that matters only here, each of one standard deviation, SI; None: none.
    alike : (n,) standard error of ``measured`` less predicted that may be the same in all repeats of a
        condition, and then does not average out over them; ``Noise.alike`` of it is. None: none.
    scale : (n,) size of the signal around each element, whose fraction the model-form budget is; None: rms of
        its axis.
    symmetries : (k, m) shifts of the nuisance that leave the base model as it is (which tooth is the first
        one), but not a model with an effect; None: none.
    labels : (n,) what each element is in the words of the report ("order 1"); the rest is tested per axis and
        label.
    repeats : how many times the block repeats one waveform (its time blocks): what a model gets wrong is the
        same in each.
    slow : how what repeats may change along the run, by its name in the report: (repeats, k) each.
    patterns : shapes that the rest is tested for, by their name in the report: (n, k) each.
    synthesis : (m, n) map from ``measured`` to the rows of the comparison table; None where they are the
        same.
    anchor : (m,) what ``synthesis`` is counted from in the rows of the comparison; None: zero.
    coordinates : column of the comparison table (axis, t_s, angle_deg, s_mm, x_mm, y_mm) → its (m,) values.
    """

    run: str
    condition: str
    role: Role
    order: int
    measured: Array
    sigma: Array
    setting: Any
    axis: np.ndarray
    zeros: Array
    zero_sd: Array
    coordinates: Mapping[str, np.ndarray]
    synthesis: Array | None = None
    anchor: Array | None = None
    scale: Array | None = None
    repeats: int = 1
    labels: np.ndarray | None = None
    symmetries: Array | None = None
    untold: Array | None = None
    alike: Array | None = None
    slow: Mapping[str, Array] = field(default_factory=dict)
    patterns: Mapping[str, Array] = field(default_factory=dict)

    @property
    def error(self) -> Array:
        """Standard error of ``measured`` less predicted, (n,), be it the run's own or shared by repeats."""
        return self.sigma if self.alike is None else np.hypot(self.sigma, self.alike)

    def to_rows(self, values: Array) -> Array:
        """Express differences in the fit's basis, (n,) or (n, k), in the rows of the comparison table."""
        return values if self.synthesis is None else self.synthesis @ values

    def compared(self, values: Array) -> Array:
        """Express a vector of the fit's basis, (n,), as rows of the comparison table, anchor and all."""
        rows = self.to_rows(values)
        return rows if self.anchor is None else self.anchor + rows


class Model(Protocol):
    """A frozen dataclass made of parts that predicts blocks; effects replace or wrap its parts."""

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The p base parameters, in the order of ``beta``."""
        ...

    def nuisance_starts(self, block: Block) -> Array:
        """Return starts (k, m) of the block's m nonlinear unknowns over their whole range; (1, 0) if none."""
        ...

    def design(self, block: Block, nuisance: Array, beta: Array | None) -> tuple[Array, Array]:
        """Matrix ``X`` (n, p) and offset (n,), SI: the prediction is ``offset + X @ beta``.

        A model that is not linear in the base parameters is so about ``beta`` (None: not known yet).
        """
        ...


@runtime_checkable
class Limited(Protocol):
    """A model that has no prediction for some values of its parameters, only something to search on by."""

    def beyond(self, block: Block, beta: Array) -> str:
        """Why it has none for a block, in words that follow the run's name; empty: it has one."""
        ...


@dataclass(frozen=True)
class Made:
    """A row of the run table as it would be made: like that of run ``like``, but for some settings.

    ``times``: columns whose number is so many times as large; ``given``: columns with another value.
    """

    like: str
    times: Mapping[str, float] = field(default_factory=dict)
    given: Mapping[str, float | str] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Proposal:
    """Runs that could be made next.

    ``words``: what they are, for the report. ``blocks`` hold the setting of each run as it would be made;
    their ``measured`` is that of a run like it, for the size of the signal alone. ``made``: the row of the
    run table of each block; empty where they are no runs of the run table (a load test, a record in the air).
    """

    words: str
    blocks: tuple[Block, ...]
    made: tuple[Made, ...] = ()


@dataclass(frozen=True)
class Problem:
    """An observable of a batch, ready for the fit, the loop and the report.

    Attributes
    ----------
    observable : one of the contract's names (force, joint_force, deformation, waviness, flatness, lobes).
    unit : unit of the comparison table, with ``si`` its size in SI.
    base : the base model, told of what the manifest declares and of nothing else.
    blocks : all blocks, in the order of cutting.
    scatter : (p,) relative run-to-run standard deviation of each base parameter: prior of what repeats tell.
    systematic : relative error that all runs may share because the base model's inputs do (a force estimate,
        a gauge); an effect must change the prediction by more than twice this to be told from it.
    notes : sentences on what this problem had to leave out or assume, for the report.
    feasible : runs that could be made next, among which the loop looks for the one that would tell most.
    basis_unit : unit of what blocks measure, where it is not that of the comparison (torques, compared as
        forces).
    """

    observable: str
    unit: str
    si: float
    base: Model
    blocks: tuple[Block, ...]
    scatter: Array
    systematic: float = 0.0
    notes: tuple[str, ...] = field(default=())
    feasible: tuple[Proposal, ...] = ()
    basis_unit: str | None = None

    def role(self, *roles: Role) -> tuple[Block, ...]:
        """Return the blocks that have one of ``roles``."""
        return tuple(block for block in self.blocks if block.role in roles)


@dataclass(frozen=True)
class BaseFit:
    """The base model as identified, for an observable to write as identified quantities.

    ``beta`` (p,) in SI with its ``covariance`` (p, p); ``dof`` are run-level degrees of freedom (for
    Student's t); ``nuisance`` holds each block's nonlinear unknowns by run.
    """

    beta: Array
    covariance: Array
    dof: float
    nuisance: Mapping[str, Array]


@dataclass(frozen=True)
class Refusal:
    """Why an observable, or a quantity, cannot be had from this batch.

    Attributes
    ----------
    reason : which key, table or file it lacks. moot : whether nothing in the batch would be changed by it, so
        that it is not missed.
    """

    reason: str
    moot: bool = False
