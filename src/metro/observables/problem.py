"""The interface of an observable to the loop: blocks of evidence, and a model that predicts them.

A **block** is the evidence of one run on one observable. It is the unit of evidence: the 10^5 samples of one
run share its coefficients, its phase and its zero, so they count once. A **model** predicts a block as
``offset + X @ beta``; it is linear in the base parameters, or linearised about their values. All other
nonlinear quantities are either parameters of an effect, which changes the model, or nuisances of a block
(such as an unknown start phase).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import TYPE_CHECKING, Any, Literal, Protocol, TypeVar, cast, runtime_checkable

import numpy as np

from metro.units import Array, ComplexArray

if TYPE_CHECKING:
    from metro.observables.task import Handler

Result = TypeVar("Result")
Role = Literal["identify", "validate", "calibrate"]


@dataclass(frozen=True)
class Parameter:
    """A parameter of a model: its name and its unit in the outputs, and that unit in SI."""

    name: str
    unit: str
    si: float = 1.0


@dataclass(frozen=True, eq=False)
class Block:
    """The evidence of one run on one observable.

    Attributes
    ----------
    run, condition, role, order
        Identity of the run; ``calibrate`` marks evidence on the base parameters alone (a load test). No
        effect of the cut changes it, and the report never compares it.
    measured : (n,) SI, in a basis in which the noise is nearly white (orders, path points, …).
    sigma : (n,) standard error of ``measured`` from within the run.
    setting : what the model needs to predict the block; the observable's own frozen dataclass.
    axis : (n,) label of the axis that each element belongs to; materiality and the budget are judged per
        axis.
    zeros : (n, q) directions of run-level additive error (a zero offset per axis, a registration plane).
    zero_sd : (q,) prior standard deviations of the amplitudes of ``zeros``, SI.
    unidentified : (n, u) directions of errors of the base model from parameters that matter only in this
        block and that no run of the fit identifies, each of one standard deviation, SI; None: none.
    alike : (n,) standard error of ``measured`` less predicted that all repeats of a condition may share, so
        that it does not average out over them. ``Noise.alike`` is the shared share. None: none.
    scale : (n,) size of the signal around each element; the model-form budget is a fraction of it. None: rms
        of its axis.
    symmetries : (k, m) shifts of the nuisance under which the base model does not change (which tooth is the
        first one), but a model with an effect does; None: none.
    labels : (n,) label of each element in the words of the report ("order 1"); the residual is tested per
        axis and label.
    belief : whether it is what is believed of the base parameters beforehand (the errors that instruments
        are allowed). It is left out of no fit; an effect that spares it a strain gains by that.
    repeats : how many times the block repeats one waveform (its time blocks); the model's error is the same
        in each.
    slow : slow changes along the run that are tested for, by their name in the report: (repeats, k) each.
    patterns : shapes that the residual is tested for, by their name in the report: (n, k) each.
    synthesis : (m, n) map from ``measured`` to the rows of the comparison table; None if they are the same.
    anchor : (m,) origin of ``synthesis`` in the rows of the comparison; None: zero.
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
    belief: bool = False
    repeats: int = 1
    labels: np.ndarray | None = None
    symmetries: Array | None = None
    unidentified: Array | None = None
    alike: Array | None = None
    slow: Mapping[str, Array] = field(default_factory=dict)
    patterns: Mapping[str, Array] = field(default_factory=dict)

    @property
    def error(self) -> Array:
        """Standard error of ``measured`` less predicted, (n,): the run's own and the one repeats share."""
        return self.sigma if self.alike is None else np.hypot(self.sigma, self.alike)

    def to_rows(self, values: Array) -> Array:
        """Express differences in the fit's basis, (n,) or (n, k), in the rows of the comparison table."""
        return values if self.synthesis is None else self.synthesis @ values

    def compared(self, values: Array) -> Array:
        """Express a vector of the fit's basis, (n,), as rows of the comparison table, with the anchor."""
        rows = self.to_rows(values)
        return rows if self.anchor is None else self.anchor + rows


class Model(Protocol):
    """A frozen dataclass of parts that predicts blocks; effects replace or wrap its parts."""

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The p base parameters, in the order of ``beta``."""
        ...

    def nuisance_starts(self, block: Block) -> Array:
        """Return starts (k, m) of the block's m nonlinear unknowns over their whole range; (1, 0) if none."""
        ...

    def design(self, block: Block, nuisance: Array, beta: Array | None) -> tuple[Array, Array]:
        """Matrix ``X`` (n, p) and offset (n,), SI: the prediction is ``offset + X @ beta``.

        A model that is not linear in the base parameters is linearised about ``beta`` (None: not known yet).
        """
        ...


@runtime_checkable
class Batched(Protocol):
    """A model that predicts a block at many nuisances in one call."""

    def predictions(self, block: Block, nuisances: Array, beta: Array) -> Array:
        """Return the prediction (k, n) of a block at each of ``nuisances`` (k, m), SI."""
        ...


@cache  # asked for each prediction: what ``isinstance`` does for a protocol takes longer than some of these
def _is_batched(kind: type) -> bool:
    """Whether models of a kind predict at many nuisances in one call."""
    return issubclass(kind, Batched)


def predictions(model: Model, block: Block, nuisances: Array, beta: Array) -> Array:
    """Return the prediction (k, n) of a block at each of ``nuisances`` (k, m), by any model, SI."""
    if _is_batched(type(model)):
        return cast(Batched, model).predictions(block, nuisances, beta)
    designs = [model.design(block, nuisance, beta) for nuisance in nuisances]
    return np.array([offset + matrix @ beta for matrix, offset in designs]).reshape(-1, len(block.measured))


@runtime_checkable
class Overlaid(Protocol):
    """A model whose blocks can be laid over one another, whatever the own unknowns of each."""

    def overlaid(self, block: Block, nuisance: Array, values: Array) -> ComplexArray:
        """Lay values (n,) of a block where those of all blocks are: (channels, harmonics), averaged.

        Empty where the block cannot be laid over others.
        """
        ...

    def circumstances(self, block: Block) -> Mapping[str, float]:
        """Return the settings of a block's run to which a waveform may be proportional, SI."""
        ...

    def place(self, channel: int, harmonic: int) -> tuple[str, str]:
        """Return axis and label of a place of what is laid over."""
        ...


@runtime_checkable
class Moved(Protocol):
    """A model that is computed faster as a small change of another one, such as for a derivative."""

    def moved_from(self, origin: Any) -> Model:
        """Return the model as a small change of another of its kind."""
        ...


@cache
def _is_moved(kind: type) -> bool:
    """Whether models of a kind are computed faster as a small change of another one."""
    return issubclass(kind, Moved)


def moved_from(model: Model, origin: Model) -> Model:
    """Return a model as a small change of another one; as it is where that makes nothing faster."""
    if type(model) is type(origin) and _is_moved(type(model)):
        return cast(Moved, model).moved_from(origin)
    return model


@runtime_checkable
class Differing(Protocol):
    """A model that shares work with models that hardly differ from it, such as for derivatives."""

    def differences(
        self, others: Sequence[Any], block: Block, nuisances: Array, beta: Array
    ) -> tuple[Array, Array]:
        """Return by how much predictions differ from that at the first of ``nuisances`` (1 + m, …), SI.

        Those of ``others``, (q, n), and its own at the other nuisances, (m, n).
        """
        ...


@cache
def _is_differing(kind: type) -> bool:
    """Whether models of a kind share work with models that hardly differ from them."""
    return issubclass(kind, Differing)


def differences(
    model: Model, others: Sequence[Model], block: Block, nuisances: Array, beta: Array
) -> tuple[Array, Array]:
    """Return differences as :meth:`Differing.differences` does, of any model.

    All are predicted by one way, so that what changes nothing differs by exactly zero.
    """
    if _is_differing(type(model)) and all(type(other) is type(model) for other in others):
        return cast(Differing, model).differences(others, block, nuisances, beta)
    unmoved = moved_from(model, model)
    predicted = predictions(unmoved, block, nuisances[:1], beta)[0]
    moved = [
        predictions(moved_from(other, model), block, nuisances[:1], beta)[0] - predicted for other in others
    ]
    at_others = predictions(unmoved, block, nuisances[1:], beta) - predicted
    return np.array(moved).reshape(-1, len(predicted)), at_others


@runtime_checkable
class Limited(Protocol):
    """A model without a valid prediction for some values of its parameters, where only a search may go."""

    def beyond(self, block: Block, beta: Array) -> str:
        """Reason why the prediction of a block is not valid, in words after the run's name; or empty."""
        ...


@dataclass(frozen=True)
class Made:
    """A proposed row of the run table: the row of run ``like`` with some settings changed.

    ``times``: columns whose number is multiplied by a factor; ``given``: columns with another value.
    """

    like: str
    times: Mapping[str, float] = field(default_factory=dict)
    given: Mapping[str, float | str] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Proposal:
    """Runs that could be made next.

    ``words`` describe them in the report. ``blocks`` hold the setting of each proposed run; their
    ``measured`` is that of a similar run and only gives the size of the signal. ``made``: the row of the run
    table of each block; empty if they are no runs of the run table (a load test, a record in the air).
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
    base : the base model, which contains what the manifest declares and nothing else.
    blocks : all blocks, in the order of cutting.
    scatter : (p,) relative run-to-run standard deviation of each base parameter: a prior for the repeats.
    systematic : relative error that all runs may share because the base model's inputs do (a force estimate,
        a gauge); an effect must change the prediction by more than twice this error to be identified.
    notes : sentences for the report on what this problem had to omit or assume.
    feasible : runs that could be made next, among which the loop searches for the most informative one.
    basis_unit : unit of the blocks, if it differs from that of the comparison (torques, compared as forces).
    unresolved : rms (SI) of what the form of an instrument alone leaves over a run: less is no finding,
        however small the signal is.
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
    unresolved: float = 0.0

    def role(self, *roles: Role) -> tuple[Block, ...]:
        """Return the blocks that have one of ``roles``."""
        return tuple(block for block in self.blocks if block.role in roles)

    def least_residual(self, relative: float) -> float:
        """Return the least residual that counts, relative to the signal: ``relative`` or more.

        What the inputs of the model may cause in all runs, and what an instrument does not resolve, is none.
        """
        cut = np.concatenate([block.measured for block in self.role("identify")] or [np.zeros(0)])
        signal = math.sqrt(float(np.mean(cut**2))) if np.any(cut) else math.inf
        return max(relative, 2.0 * self.systematic, self.unresolved / signal)

    def handled_by(self, handler: Handler[Result]) -> Result:
        """Let a handler do with the problem what it does with those whose measurements are samples."""
        return handler.sampled(self)


@dataclass(frozen=True)
class BaseFit:
    """The identified base model, from which an observable writes its identified quantities.

    ``beta`` (p,) in SI with its ``covariance`` (p, p); ``dof`` are run-level degrees of freedom (for
    Student's t); ``nuisance`` holds each block's nonlinear unknowns by run.
    """

    beta: Array
    covariance: Array
    dof: float
    nuisance: Mapping[str, Array]


@dataclass(frozen=True)
class Refusal:
    """Why an observable, or a quantity, cannot be identified from this batch.

    Attributes
    ----------
    reason : which key, table or file is missing. moot : whether it would change nothing in the batch, so that
        the report need not mention it.
    """

    reason: str
    moot: bool = False

    def handled_by(self, handler: Handler[Result]) -> Result:
        """Let a handler do what it does where an observable cannot be had."""
        return handler.refused(self)
