"""The flatness model: the tip's deflection under the mean force, as the cutter's rim leaves it in a face."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

import numpy as np

from metro.observables.flatness.beliefs import FORCE, LOSS, BelievedSetting, parameters, places
from metro.observables.flatness.beside import Beside
from metro.observables.flatness.beside import swung as swung_beside
from metro.observables.flatness.path import Pace, Passages
from metro.observables.flatness.pose_field import (
    LoadSetting,
    PoseField,
    loaded_columns,
    own_columns,
)
from metro.observables.flatness.ringing import Ringing
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
# Places across and along the feed, in radii of a disc, whose mean equals that over the disc: exactly for a
# cubic, and to 0.2 % for a wave of three radii or more.
ACROSS, AHEAD = np.sqrt(0.5) * np.array([[-1.0, 1.0, 0.0, 0.0], [0.0, 0.0, -1.0, 1.0]])


@dataclass(frozen=True, eq=False)
class FaceSetting:
    """A face at the points of its path, and beside it.

    Attributes
    ----------
    pose : of the arm. x, y : (4 n,) places of n points, m: four about each one, which represent its disc.
    disc : half axis of the discs along the passes, m.
    first : index of the first point of each bin that is compared.
    passages : of the rim over the points. pace : their times. size : of the work along x and y, m; NaN if it
        is not known.
    force : (3,) mean force on the tool in full engagement, N, work frame.
    loaded : (3 · terms,) coefficients of the compliance from the load tests alone; they determine which
        passage was the lowest.
    ringing : None if the mass of the arm is not known; the tip then follows the force statically.
    unplaced : (bins, 3) orthonormal heights of an offset and two tilts, which are left out of the measured
        and the predicted heights, because the scan's place does not determine them; None where it does.
    """

    pose: str
    x: Array
    y: Array
    disc: float
    first: np.ndarray
    passages: Passages
    pace: Pace
    size: tuple[float, float]
    force: Array
    loaded: Array
    ringing: Ringing | None
    unplaced: Array | None = None

    def shape(self, values: Array) -> Array:
        """Return heights of the bins, (n,) or (n, k), without what the scan's place leaves open."""
        return values if self.unplaced is None else values - self.unplaced @ (self.unplaced.T @ values)

    @cached_property
    def middle(self) -> Passages:
        """The passages, with the axis' position along the pass for the middle of each disc."""
        ahead = np.tile(self.disc * AHEAD, len(self.x) // len(AHEAD))
        return replace(self.passages, along=self.passages.along - ahead[:, None])

    def weights_of(self, share: Array) -> csr_array:
        """Weight of each passage in each bin, (bins, 4 n k), by its ``share`` of a place: few have any."""
        from scipy.sparse import csr_array

        at = np.flatnonzero(share)
        begins = np.searchsorted(at, share.shape[1] * np.arange(len(share) + 1))
        return self._weights @ csr_array((share.ravel()[at], at, begins), shape=(len(share), share.size))

    def mean(self, values: Array) -> Array:
        """Average the values of places, (4 n,) or (4 n, p), over the discs, and these over the bins."""
        return np.asarray(self._weights @ values)

    def binned(self, values: Array) -> Array:
        """Average the values of points, (n,) or (n, p), over the bins."""
        return np.asarray((np.add.reduceat(values, self.first, axis=0).T / self._count).T)

    @cached_property
    def plane(self) -> Array:
        """Heights of an offset and two tilts, (bins, 3), each tilt ±1 at the edges of the work."""
        across = []
        for values, size in zip((self.x, self.y), self.size, strict=True):
            at = self.mean(values)
            low, high = (0.0, size) if math.isfinite(size) else (float(at.min()), float(at.max()))
            across.append((2.0 * at - low - high) / ((high - low) or 1.0))
        return np.column_stack([np.ones_like(across[0]), *across])

    @property
    def form(self) -> Array:
        """Heights of three curvatures, (bins, 3), each 1 at the edges or corners of the work."""
        _, across, along = self.plane.T
        return np.column_stack([across**2, across * along, along**2])

    @property
    def _count(self) -> np.ndarray:
        """Points in each bin."""
        return np.diff(np.append(self.first, len(self.x) // len(ACROSS)))

    @cached_property
    def _weights(self) -> csr_array:
        """Weight of each place in the mean of each bin; it is cached because a fit averages many times."""
        from scipy.sparse import csr_array

        weight = np.repeat(1.0 / self._count, self._count * len(ACROSS)) / len(ACROSS)
        begins = np.append(len(ACROSS) * self.first, len(weight))
        return csr_array((weight, np.arange(len(weight)), begins))


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
        offset = offset + setting.mean(self.setup.bowed(setting.x, setting.y, setting.size))
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
        common = common + setting.mean(self.setup.bowed(setting.x, setting.y, setting.size))
        predicted = [common + setting.mean(self.finished(setting, each, beta)[1]) for each in nuisances]
        return setting.shape(np.reshape(predicted, (-1, len(common))).T).T

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
        above = _above(self._cutting, setting, phases_of(self.vibration, nuisance), self._off(setting, beta))
        return lowest_cut(above + self._deflected(setting, beta), setting.passages.valid)

    def heights(self, setting: FaceSetting, nuisance: Array) -> Array:
        """Height of the cut at each passage by the load tests, (n, k) m; infinite if there is no passage."""
        above = _above(self._cutting, setting, phases_of(self.vibration, nuisance), 0.0)
        return np.where(setting.passages.valid, above + self._deflected(setting, None), np.inf)

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
    above = model.setup.cuts(setting.x, setting.y, setting.passages, setting.pace)
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
    beta = None if known is None else np.array(known)
    share, lowest = model.finished(setting, np.array(phases), beta)
    basis, tuning = model._basis(setting), model.tuning(model._off(setting, beta))
    harder = static(basis, setting) + rung(setting, tuning)
    share_of_force, loss = model._rings(setting, beta)
    rising = sharper(setting, tuning, harder=share_of_force, loss=loss)
    gained = harder, rising, lossier(setting, tuning)
    others = [swung_beside(each.modes, setting) for each in model._beside(setting)]
    swings = np.concatenate([*others, np.zeros((*share.shape, 0))], axis=-1)
    heights = np.stack([model._deflected(setting, beta), *map(model.structure.in_cut, gained)], axis=-1)
    weights = setting.weights_of(share)
    parts = terms(basis, setting), heights, model.structure.in_cut(swings)
    shared, means, given = (weights @ part.reshape(share.size, -1) for part in parts)
    return shared, setting.mean(lowest) - means[:, 0], means[:, 1:], given
