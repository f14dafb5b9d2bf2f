"""The flatness model: the tip's deflection under the mean force, as the cutter's rim leaves it in a face."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

import numpy as np

from metro.observables.flatness.beliefs import FORCE, LOSS, BelievedSetting, parameters, places
from metro.observables.flatness.beside import Beside
from metro.observables.flatness.beside import swung as swung_beside
from metro.observables.flatness.face_setting import FaceSetting
from metro.observables.flatness.pose_field import (
    LoadSetting,
    PoseField,
    loaded_columns,
    own_columns,
)
from metro.observables.flatness.rung import lossier, rung, sharper
from metro.observables.flatness.setup import Setup, swung
from metro.observables.flatness.tip import Known, static, terms, tip
from metro.observables.problem import Block, Parameter
from metro.observables.waviness.model import Vibration, phase_starts, phases_of
from metro.structure import Structure
from metro.surface.lowest_cut import lowest_cut
from metro.surface.tip_stiffness import POWERS, Basis
from metro.units import UM, Array

if TYPE_CHECKING:
    from scipy.sparse import csr_array

ENTRIES = ("zx", "zy", "zz")
FARTHEST = 0.7  # of what the tip's frequencies are off, as a logarithm: half or twice as high


@dataclass(frozen=True)
class FlatnessModel:
    """Height of the face over its programmed plane: that of the tip, (C(P) F)_z and the ringing about it.

    The lowest of all passages of the rim over a point determines the height, because removed material does
    not come back. The static part is linear in the coefficients of C; the ringing is computed with C from the
    load tests, and is the model's offset.

    Attributes
    ----------
    fields : the compliance over (x, y) at each pose, known from load tests.
    placed : whether the place of the scanner is declared. All scans share its error: height and two tilts.
    ringing : poses at which the tip rings; the mass declared there leaves its frequencies a bit off.
    beside : modes of the arm that swing beside those of the tip.
    structure : stiffness of the arm in the cut, relative to these tests.
    setup : deviations of spindle, tool and work from the programmed setup.
    vibration : of the tip, from the start of the first pass; each face has its own phase of each wave.
    """

    fields: tuple[PoseField, ...]
    placed: bool = False
    ringing: tuple[str, ...] = ()
    beside: tuple[Beside, ...] = ()
    structure: Structure = field(default_factory=Structure)
    setup: Setup = field(default_factory=Setup)
    vibration: tuple[Vibration, ...] = ()

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """What is believed of beforehand, and C_zx, C_zy, C_zz in the terms of each pose's basis, um/N."""
        return self.believed + tuple(
            Parameter(f"c_{entry}_u{i}v{j}_{part.pose}", "um/N", UM)
            for part in self.fields
            for entry, seen in zip(ENTRIES, part.entries, strict=True)
            if seen
            for i, j in POWERS[: part.basis.terms]
        )

    @cached_property
    def believed(self) -> tuple[Parameter, ...]:
        """What is believed of beforehand."""
        return parameters(placed=self.placed, beside=self.beside, ringing=self.ringing)

    def nuisance_starts(self, block: Block) -> Array:
        """Return starts of a face's nuisance, (k, m): the phase of each wave, and at least one."""
        if not isinstance(block.setting, FaceSetting):
            return np.zeros((1, 0))
        return phase_starts(self.vibration)

    def design(self, block: Block, nuisance: Array, beta: Array | None = None) -> tuple[Array, Array]:
        """Matrix (n, p) in m per (m/N), and the offset of ringing, vibration and setup (n,) m."""
        setting, count = block.setting, len(block.measured)
        if isinstance(setting, BelievedSetting):
            return np.eye(count, len(self.parameters)), np.zeros(count)
        if isinstance(setting, LoadSetting):
            loaded = loaded_columns(self.fields, setting)
            return np.hstack([np.zeros((count, len(self.believed))), loaded]), np.zeros(count)
        known = None if beta is None else tuple(beta.tolist())
        shared, offset, changes, swings = _shaped(
            self._cutting, setting, phases_of(self.vibration, nuisance), known
        )
        harder, rising, lossy = changes.T
        offset = offset + setting.bowed(self.setup.bowed)
        columns = self.structure.in_cut(
            (setting.force[:, None] * shared[:, None, :]).reshape(len(shared), -1)
        )
        parts = [*([setting.plane] if self.placed else []), setting.form]
        parts += [harder[:, None]]
        parts += [
            swings if each.pose == setting.pose else np.zeros((len(shared), len(each.parameters)))
            for each in self.beside
        ]
        here = np.array(self.ringing) == setting.pose
        parts += [np.outer(lossy, here), np.outer(rising, here)]
        parts += [own_columns(part, setting.pose, columns) for part in self.fields]
        return setting.shape(np.hstack(parts)), setting.shape(offset - self._off(setting, beta) * rising)

    def predictions(self, block: Block, nuisances: Array, beta: Array) -> Array:
        """Heights (k, n) m at each of ``nuisances`` (k, m), as :meth:`design` gives them.

        Only the heights under ``beta`` are averaged, and not those of each column: this is what most of a
        search consists of.
        """
        setting = block.setting
        if not isinstance(setting, FaceSetting):
            matrix, offset = self.design(block, np.zeros(0), beta)
            return np.tile(offset + matrix @ beta, (len(nuisances), 1))
        form = np.hstack([*([setting.plane] if self.placed else []), setting.form])
        common = form @ beta[: form.shape[1]]
        common = common + setting.bowed(self.setup.bowed)
        predicted = [common + setting.mean(self.finished(setting, each, beta)[1]) for each in nuisances]
        return setting.shape(np.reshape(predicted, (-1, len(common))).T).T

    def differences(
        self, others: Sequence[FlatnessModel], block: Block, nuisances: Array, beta: Array
    ) -> tuple[Array, Array]:
        """Return differences as :meth:`metro.observables.problem.Differing.differences` does.

        Each passage moves a place by its share in finishing it: what a small change of its height does.
        """
        setting, count = block.setting, len(block.measured)
        if not isinstance(setting, FaceSetting):
            base = self.predictions(block, nuisances, beta)
            there = [other.predictions(block, nuisances[:1], beta)[0] for other in others]
            return np.reshape(there, (-1, count)) - base[0], base[1:] - base[0]
        phases = [phases_of(self.vibration, each) for each in nuisances]
        at = self._cutting, setting, phases[0], tuple(beta.tolist())
        weights, (cut, _, _) = _weights(*at), _finished(*at)

        def moved_to(model: FlatnessModel, swing: tuple[float, ...]) -> Array:
            if model is self and swing == phases[0]:
                return np.zeros(count)
            height = setting.averaged(weights, model._cut(setting, np.array(swing), beta) - cut)
            return setting.shape(height + setting.bowed(model.setup.bowed - self.setup.bowed))

        moved = np.array([moved_to(other, phases[0]) for other in others])
        own = np.array([moved_to(self, swing) for swing in phases[1:]])
        return moved.reshape(-1, count), own.reshape(-1, count)

    def _tip(self, setting: FaceSetting, beta: Array) -> Array:
        """Return the height of the tip at each passage by ``beta``, (n, k) m, as stiff as in load tests."""
        place, first = places(self.believed), len(self.believed)
        for part in self.fields:
            count = int(part.used.sum())
            if part.pose == setting.pose:
                coefficients = np.zeros(len(part.used))
                coefficients[part.used] = beta[first : first + count]
            first += count
        harder, loss = self._rings(setting, beta)
        known = Known(
            coefficients=tuple(coefficients.tolist()),
            harder=harder,
            tuning=self.tuning(self._off(setting, beta)),
            loss=loss,
            beside=tuple(
                (each.modes, tuple(float(beta[place[one.name]]) for one in each.parameters))
                for each in self._beside(setting)
            ),
        )
        return tip(self._basis(setting), setting, known)

    def _rings(self, setting: FaceSetting, beta: Array | None) -> tuple[float, float]:
        """Return by how much the force is larger, relative, and the damping ratio higher, than is known."""
        if beta is None:
            return 0.0, 0.0
        place, loss = places(self.believed), f"{LOSS}{setting.pose}"
        return float(beta[place[FORCE]]), float(beta[place[loss]]) if loss in place else 0.0

    def _beside(self, setting: FaceSetting) -> list[Beside]:
        """Return the modes that swing beside those of the tip in a face, if there are any."""
        rings = setting.ringing is not None
        return [each for each in self.beside if each.pose == setting.pose and rings]

    @cached_property
    def _cutting(self) -> FlatnessModel:
        """What of the model determines which passage finishes a place: a bow moves all of them alike."""
        return replace(self, setup=self.setup.cutting)

    def _off(self, setting: FaceSetting, beta: Array | None) -> float:
        """Return by how much the frequencies of the tip are off, relative."""
        if beta is None or setting.pose not in self.ringing:
            return 0.0
        return float(beta[self._ringing_place(setting)])

    def _ringing_place(self, setting: FaceSetting) -> int:
        """Return the place in ``beta`` of how far the frequencies of the tip are off at the face's pose."""
        return len(self.believed) - len(self.ringing) + self.ringing.index(setting.pose)

    def tuning(self, off: float) -> float:
        """Return the tip's frequencies in the cut over those of the load tests with the declared mass.

        A step of a fit may go beyond what a frequency can be off by.
        """
        return math.exp(min(max(off, -FARTHEST), FARTHEST)) / math.sqrt(
            float(self.structure.in_cut(np.ones(1))[0])
        )

    def finished(
        self, setting: FaceSetting, nuisance: Array, beta: Array | None = None
    ) -> tuple[Array, Array]:
        """Share of each passage in finishing each place, (n, k), and the height of the places, (n,) m.

        What decides which passage is the lowest are the heights of the face itself, by ``beta``: by those of
        the load tests, a face would jump by what the two differ, wherever another passage becomes the lowest.
        For ``nuisance`` see :meth:`nuisance_starts`; without ``beta`` the tip is that of the load tests.
        """
        known = None if beta is None else tuple(beta.tolist())
        return _finished(self._cutting, setting, phases_of(self.vibration, nuisance), known)[1:]

    def heights(self, setting: FaceSetting, nuisance: Array) -> Array:
        """Height of the cut at each passage by the load tests, (n, k) m; infinite if there is no passage."""
        return np.where(setting.passages.valid, self._cut(setting, nuisance, None), np.inf)

    def _cut(self, setting: FaceSetting, nuisance: Array, beta: Array | None) -> Array:
        """Height of the cut at each passage, (n, k) m, whatever of it another passage takes away."""
        above = _above(self._cutting, setting, phases_of(self.vibration, nuisance), self._off(setting, beta))
        return above + self._deflected(setting, beta)

    def _deflected(self, setting: FaceSetting, beta: Array | None) -> Array:
        """Height of the tip at each passage by what is linear in ``beta``, (n, k) m; None: by load tests."""
        loaded = self._static(setting) if beta is None else self._tip(setting, beta)
        return self.structure.in_cut(loaded)

    def _static(self, setting: FaceSetting) -> Array:
        return static(self._basis(setting), setting)

    def _basis(self, setting: FaceSetting) -> Basis:
        return next(part.basis for part in self.fields if part.pose == setting.pose)


# A search tries one phase after another with the same setup, and one setup after another with the same phase.
@lru_cache(maxsize=64)
def _above(model: FlatnessModel, setting: FaceSetting, phases: tuple[float, ...], off: float) -> Array:
    """Height of the cut over the static one at each passage, (n, k) m; ``off`` of the tip's frequencies."""
    force = float(np.linalg.norm(setting.force))
    above = model.setup.cuts(setting.x, setting.y, setting.passages, setting.pace, force=force)
    for swing, phase in zip(model.vibration, phases, strict=True):
        above = above + swung(swing, phase, setting.passages, setting.pace)
    if setting.ringing is not None:
        above = above + model.structure.in_cut(rung(setting, model.tuning(off)))
    return above


@lru_cache(maxsize=512)
def _shaped(
    model: FlatnessModel, setting: FaceSetting, phases: tuple[float, ...], known: tuple[float, ...] | None
) -> tuple[Array, Array, Array, Array]:
    """Return means over each bin: terms of the basis, (bins, terms), and heights that are added to theirs.

    These are an offset, (bins,) m; what is gained per relative rise of the force and of the frequencies, and
    per damping ratio, (bins, 3) m; and what other modes give, (bins, parameters). The gains by force and
    damping hold for the compliance of the load tests alone, so that they are linear in the base parameters.
    The result is cached because noise and parameters are estimated in turn, many times over.
    """
    beta, at = None if known is None else np.array(known), (model, setting, phases, known)
    weights, lowest = _weights(*at), setting.mean(_finished(*at)[2])
    basis, tuning = model._basis(setting), model.tuning(model._off(setting, beta))
    harder = static(basis, setting) + rung(setting, tuning)
    share_of_force, loss = model._rings(setting, beta)
    rising = sharper(setting, tuning, harder=share_of_force, loss=loss)
    gained = harder, rising, lossier(setting, tuning)
    others = [swung_beside(each.modes, setting) for each in model._beside(setting)]

    swings = [model.structure.in_cut(each) for every in others for each in np.moveaxis(every, -1, 0)]

    def means(parts: Iterable[Array]) -> Array:
        averages = [setting.averaged(weights, part) for part in parts]
        return np.reshape(averages, (-1, len(lowest))).T

    shared = means(np.moveaxis(terms(basis, setting), -1, 0))
    offset = lowest - setting.averaged(weights, model._deflected(setting, beta))
    return shared, offset, means(map(model.structure.in_cut, gained)), means(swings)


# The derivatives by base parameters and those by effects ask for the same, one after the other.
@lru_cache(maxsize=4)
def _weights(
    model: FlatnessModel, setting: FaceSetting, phases: tuple[float, ...], known: tuple[float, ...] | None
) -> csr_array:
    """Return weights of the passages in each bin, (bins, k n)."""
    return setting.weights_of(_finished(model, setting, phases, known)[1])


# A step of a fit predicts all faces of a batch, and then asks for their derivatives where it led.
@lru_cache(maxsize=32)
def _finished(
    model: FlatnessModel, setting: FaceSetting, phases: tuple[float, ...], known: tuple[float, ...] | None
) -> tuple[Array, Array, Array]:
    """Return the height of all cuts, the share of each in finishing a place, (n, k), and its height, (n,)."""
    cut = model._cut(setting, np.array(phases), None if known is None else np.array(known))
    return cut, *lowest_cut(cut, setting.passages.valid)
