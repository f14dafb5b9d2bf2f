"""The force model of a batch: tool, law, structure and sensor, and the coefficients to be identified."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from metro.cutting.chipped import Chipped
from metro.cutting.cutter import Cutter
from metro.cutting.engagement import with_wall_proud
from metro.cutting.force import COEFFICIENTS, Cut, force_basis
from metro.cutting.helical import BOTTOM_EDGES, Helix, bottom_thrust, ramped, turned
from metro.cutting.law import EdgeLaw
from metro.cutting.yielding_steady import NotBalancedError, yielding_basis
from metro.observables.force.dynamometer import Dynamometer, Recording, read
from metro.observables.problem import Block, Parameter
from metro.signals.orders import advance, to_orders
from metro.units import N_MM, N_MM2, Array

PHASES_PER_PITCH = 12
ORBIT_PHASES = 12
FEEDS = (
    0.0,
    math.pi / 3.0,
    2.0 * math.pi / 3.0,
)  # these three directions suffice, because a spring repeats after half a turn


@dataclass(frozen=True)
class ForceSetting:
    """Inputs of the force of a run (SI): its cut, and how its record was averaged.

    ``feed_direction`` is the turn of the feed frame about z, rad; ``cut_length`` the length cut from the
    first run to the middle of this one, m; ``give`` the height by which the wall is proud in this ``cut``, m,
    for an arm with the stiffness of its load tests. ``feed_ratio`` is true over nominal feed per tooth: the
    feed rate is as programmed, so a spindle that turns more slowly than stated cuts thicker chips. The chip
    is taken as proportional to it.
    """

    cut: Cut
    feed_direction: float
    highest: int
    recording: Recording
    cut_length: float
    helix: Helix | None = None
    feed_ratio: float = 1.0
    give: float = 0.0


@dataclass(frozen=True)
class Structure:
    """Response of the machine to the force.

    ``orbit_amplitude``, ``orbit_phase`` (rad): the axial force has the factor 1 + amplitude × cos(ψ − phase),
    with ψ the direction of feed in helical milling. ``compliance`` of the tool's tip along work x, y, m/N.
    ``stiffness_factor`` : of an arm in side cuts, relative to its load tests.
    """

    orbit_amplitude: float = 0.0
    orbit_phase: float = 0.0
    compliance: tuple[float, float] = (0.0, 0.0)
    stiffness_factor: float = 1.0

    def seen(self, direction: float) -> tuple[float, float, float]:
        """Compliance xx, yy, xy in a frame turned about z by the direction of feed, rad: m/N."""
        x, y = self.compliance
        c, s = math.cos(direction), math.sin(direction)
        return c * c * x + s * s * y, s * s * x + c * c * y, c * s * (y - x)


@dataclass(frozen=True)
class ForceModel:
    """Mechanistic milling force; linear in the cutting coefficients.

    ``true_path`` takes the chip from the trochoidal paths of the teeth; else from circles (feed × sine of the
    immersion). A block's nuisance is the angle of tooth 0 at the record's start, rad, and in helical milling
    also the direction of feed there. ``bottom_edges`` names those of K_Fac and K_Fae that the helical runs
    can identify.
    """

    cutter: Cutter
    law: EdgeLaw
    true_path: bool = True
    bottom_edges: tuple[str, ...] = ()
    structure: Structure = field(default_factory=Structure)
    sensor: Dynamometer = field(default_factory=Dynamometer)
    chipped: tuple[Chipped, ...] = ()

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The cutting coefficients."""
        names = COEFFICIENTS + self.bottom_edges
        return tuple(
            Parameter(name, "N/mm2", N_MM2) if name.endswith("c") else Parameter(name, "N/mm", N_MM)
            for name in names
        )

    def nuisance_starts(self, block: Block) -> Array:
        """Start phases over the whole revolution: which tooth is first matters once teeth differ."""
        setting: ForceSetting = block.setting
        count = PHASES_PER_PITCH * self.cutter.teeth
        phases = 2.0 * math.pi * np.arange(count) / count
        if setting.helix is None:
            return phases[:, None]
        directions = 2.0 * math.pi * np.arange(ORBIT_PHASES) / ORBIT_PHASES
        return np.stack(np.meshgrid(phases, directions, indexing="ij"), axis=-1).reshape(-1, 2)

    def design(self, block: Block, nuisance: Array, beta: Array | None = None) -> tuple[Array, Array]:
        """Order coefficients of the force per unit of each coefficient: rows (time block, axis, order).

        A tool that yields has the displacement that belongs to the coefficients ``beta``; without them it is
        rigid.
        """
        setting = self._cutting(block.setting)
        recording = setting.recording
        basis = advance(self._orders(setting, beta), float(nuisance[0]))
        basis = basis * np.repeat([setting.feed_ratio, self.law.edge(setting.cut_length)], 3)[:, None]
        turn = setting.feed_direction
        if setting.helix is not None:
            basis = ramped(basis, setting.helix.ramp)
            turn = float(nuisance[1])
        if self.bottom_edges:
            bottom = self._bottom(setting, len(basis))[..., None]
            basis = np.concatenate([basis, np.repeat(bottom, basis.shape[3], axis=3)], axis=2)
        count, feeds = basis.shape[2:]
        seen = self._seen(turned(basis, turn).reshape(len(basis), 3, -1), setting, turn)
        if feeds > 1:
            shares = _shares_of_feeds(recording, turn)
            seen = np.einsum("bhapf,bf->bhap", seen.reshape(*seen.shape[:3], count, feeds), shares)
        matrix = seen.transpose(0, 2, 1, 3).reshape(-1, count)
        return matrix, self._drift(block, recording)

    def _cutting(self, setting: ForceSetting) -> ForceSetting:
        """Return the setting that an arm of this stiffness cuts: a softer arm cuts less of the wall."""
        more = setting.give * (1.0 / self.structure.stiffness_factor - 1.0)
        if not more:
            return setting
        arc = with_wall_proud(setting.cut.engagement, self.cutter.radius, more)
        return replace(setting, cut=replace(setting.cut, engagement=arc))

    def _orders(self, setting: ForceSetting, beta: Array | None) -> Array:
        """Order coefficients of the peripheral force, feed frame, (2H+1, 3, 6, feeds).

        A tool that yields in helical milling has one for each direction of ``FEEDS``, otherwise there is one.
        """
        if self.chipped:
            sound = replace(self, chipped=())
            return sound._orders(setting, beta) + self._lost(setting)[..., None]
        tool, highest = (self.cutter, self.law, setting.cut), setting.highest
        if beta is None or not any(self.structure.compliance):
            return _order_basis(*tool, highest, self.true_path)[..., None]
        return np.stack([each.orders for each in self._yielding(setting, beta)], axis=3)

    def _yielding(self, setting: ForceSetting, beta: Array) -> list[_Yielding]:
        """Return the force on a tool that yields, in each direction of feed that is computed."""
        worn = tuple((beta[:6] * np.repeat([1.0, self.law.edge(setting.cut_length)], 3)).tolist())
        return [
            _yielding_orders(
                *(self.cutter, self.law, setting.cut, self.structure.seen(feed), worn),
                highest=setting.highest,
                true_path=self.true_path,
            )
            for feed in (FEEDS if setting.helix else (setting.feed_direction,))
        ]

    def beyond(self, block: Block, beta: Array) -> str:
        """Say that a tool this soft would not cut steadily, if force and deflection have no equilibrium."""
        if not any(self.structure.compliance) or all(
            each.balanced for each in self._yielding(self._cutting(block.setting), beta)
        ):
            return ""
        return "force and deflection find no balance: a tool this soft would not cut steadily"

    def _lost(self, setting: ForceSetting) -> Array:
        """Order coefficients of what chipped teeth change in the force, as if the tool did not yield.

        The highest chip breaks the whole tool, the next one the tool that is left, up to its own height.
        """
        tool, changes = self.cutter, []
        for chipped in sorted(self.chipped, key=lambda one: -one.height):
            broken, low = chipped.change(tool, setting.cut)
            with_it, without = (
                _order_basis(each, self.law, low, setting.highest, self.true_path) for each in (broken, tool)
            )
            changes.append(with_it - without)
            tool = broken
        return np.asarray(np.sum(changes, axis=0))

    def _bottom(self, setting: ForceSetting, orders: int) -> Array:
        """Thrust of the bottom edges along z over the whole revolution: it is not inclined by the ramp."""
        columns = np.zeros((orders, 3, len(self.bottom_edges)))
        if setting.helix is not None:
            thrust = dict(zip(BOTTOM_EDGES, bottom_thrust(self.cutter, setting.helix), strict=True))
            columns[0, 2] = [thrust[name] for name in self.bottom_edges]
        return columns

    def _seen(self, basis: Array, setting: ForceSetting, direction: float) -> Array:
        """Return the sensor's reading of the force in each time block, (blocks, orders, 3, coefficients)."""
        recording = setting.recording
        if self.sensor.ideal:
            seen = np.repeat(basis[None], len(recording.middles), axis=0)
        else:
            seen = read(self.sensor, recording, basis)
        if setting.helix is not None and self.structure.orbit_amplitude:
            feed = direction + recording.orbit * np.array(recording.middles)
            wave = recording.attenuation * np.cos(feed - self.structure.orbit_phase)
            seen[:, :, 2] *= (1.0 + self.structure.orbit_amplitude * wave)[:, None, None]
        return seen

    def _drift(self, block: Block, recording: Recording) -> Array:
        """Offset (n,) from the drift of the sensor since its zero was read."""
        if not any(self.sensor.slope):
            return np.zeros(len(block.zeros))
        since = np.array(recording.middles) - recording.zero_at
        each = len(block.zeros) // len(since)
        return np.asarray(np.repeat(since, each) * (block.zeros @ self.sensor.drift))


def _shares_of_feeds(recording: Recording, direction: float) -> Array:
    """Shares (blocks, feeds) of ``FEEDS`` in each time block of an orbit; ``direction`` of feed at its start.

    A spring that does not turn with the feed changes the force nearly as a sinusoid of twice the direction of
    feed. Three directions determine this sinusoid, and the time block averages it.
    """
    feed = direction + recording.orbit * np.array(recording.middles)
    attenuation = np.sinc(recording.orbit * recording.span / math.pi)
    wave = attenuation * np.cos(2.0 * (feed[:, None] - np.array(FEEDS)))
    return np.asarray((1.0 + 2.0 * wave) / len(FEEDS))


@lru_cache(maxsize=4096)
def _order_basis(cutter: Cutter, law: EdgeLaw, cut: Cut, highest: int, true_path: bool) -> Array:
    basis = to_orders(force_basis(cutter, law, cut, true_path), highest)
    basis.flags.writeable = False
    return basis


class _Yielding(NamedTuple):
    """Order coefficients of a tool that yields, and whether they are those of its whole compliance."""

    orders: Array
    balanced: bool


@lru_cache(maxsize=1024)
def _yielding_orders(
    cutter: Cutter,
    law: EdgeLaw,
    cut: Cut,
    spring: tuple[float, float, float],
    coefficients: tuple[float, ...],
    *,
    highest: int,
    true_path: bool,
) -> _Yielding:
    """Return the orders of a tool that yields; the compliance is halved until the tool cuts steadily.

    A search then has a slope to follow. A fit that ends there is not a result (``ForceModel.beyond``).
    """
    along, across, mixed = spring
    compliance = np.array([[along, mixed], [mixed, across]])
    sharp, balanced = np.array(coefficients), True
    while True:
        try:
            basis = yielding_basis(cutter, law, cut, sharp, compliance, true_path=true_path)
        except NotBalancedError:
            compliance, balanced = 0.5 * compliance, False
        else:
            break
    orders = to_orders(basis, highest)
    orders.flags.writeable = False
    return _Yielding(orders, balanced)
