"""The force model of a batch: tool, law, structure and sensor, and the coefficients to be identified."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from metro.cutting.chipped import Chipped
from metro.cutting.cutter import Cutter
from metro.cutting.engagement import with_wall_proud
from metro.cutting.force import COEFFICIENTS, Cut
from metro.cutting.helical import BOTTOM_EDGES, Helix, bottom_thrust, ramped
from metro.cutting.law import EdgeLaw
from metro.cutting.reading import read_orders
from metro.observables.force import terms as added
from metro.observables.force.dynamometer import Dynamometer, Recording, transfer
from metro.observables.force.order_basis import (
    FEEDS,
    Orders,
    Soft,
    in_balance,
    lost,
    order_basis,
    shares_of_feeds,
    yielding_orders,
)
from metro.observables.problem import Block, Parameter
from metro.signals.orders import amplitudes
from metro.units import N_MM, N_MM2, Array, ComplexArray

PHASES_PER_PITCH = 12
ORBIT_PHASES = 12
LAID_OVER = 24  # highest order at which runs are laid over one another: most records have it


@dataclass(frozen=True)
class ForceSetting:
    """Inputs of the force of a run (SI): its cut, and how its record was averaged.

    ``feed_direction`` is the turn of the feed frame about z, rad; ``cut_length`` the length cut from the
    first run to the middle of this one, m; ``give`` the height by which the wall is proud in this ``cut``, m,
    for an arm with the stiffness of its load tests, and ``give_sd`` its error. ``feed_ratio`` is true over
    nominal feed per tooth: the feed rate is as programmed, so a spindle that turns more slowly than stated
    cuts thicker chips. The chip is taken as proportional to it.
    """

    cut: Cut
    feed_direction: float
    highest: int
    recording: Recording
    cut_length: float
    helix: Helix | None = None
    feed_ratio: float = 1.0
    give: float = 0.0
    give_sd: float = 0.0


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
    can identify. ``end_declared``: whether the cutter's end is that of the manifest, else it is assumed flat.
    ``terms``: what the model has beside these parts (:mod:`metro.observables.force.terms`).
    ``origin``: the model that this one hardly differs from, such as for a derivative: the deflection of a
    tool that yields is found from that of the origin, by one step.
    """

    cutter: Cutter
    law: EdgeLaw
    true_path: bool = True
    bottom_edges: tuple[str, ...] = ()
    structure: Structure = field(default_factory=Structure)
    sensor: Dynamometer = field(default_factory=Dynamometer)
    chipped: tuple[Chipped, ...] = ()
    end_declared: bool = False
    terms: tuple[added.Term, ...] = ()
    origin: ForceModel | None = None

    def moved_from(self, origin: ForceModel) -> ForceModel:
        """Return the model as a small change of another; as it is where its tool does not yield."""
        return replace(self, origin=origin) if any(self.structure.compliance) else self

    def with_term(self, term: added.Term) -> ForceModel:
        """Return the model with one more term."""
        return replace(self, terms=(*self.terms, term))

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
        force = self._force(block.setting, beta)
        rows = self._rows(force, block.setting, nuisance[None])[0]
        bent = None if beta is None else added.bent(self.terms, (rows @ beta)[None], block)
        if bent is None or beta is None:
            return rows, self._offset(block)
        more = added.bent_columns(bent[1][0], rows, block)
        return rows + more, self._offset(block) + bent[0][0] - more @ beta

    def predictions(self, block: Block, nuisances: Array, beta: Array) -> Array:
        """Return the prediction (k, n) of a block at each of ``nuisances`` (k, m)."""
        return self._predicted(self._force(block.setting, beta) @ beta, block, nuisances)

    def differences(
        self, others: Sequence[ForceModel], block: Block, nuisances: Array, beta: Array
    ) -> tuple[Array, Array]:
        """Return by how much predictions at the first of ``nuisances`` differ, of others and at the others.

        Of models that hardly differ from this one, (q, n), and of this one at the other nuisances, (m, n):
        all that differs in nothing that a force or a reading depends on is computed once.
        """
        here, setting = self.moved_from(self), block.setting
        models = [here, *(other.moved_from(self) for other in others)]
        own = here._force(setting, beta) @ beta
        forces = [own if model._cuts_like(here) else model._force(setting, beta) @ beta for model in models]
        predicted = np.empty((len(models), len(block.zeros)))
        left = list(range(len(models)))
        while left:
            first = left[0]
            alike = [
                i
                for i in left
                if forces[i].shape == forces[first].shape and models[i]._reads_like(models[first])
            ]
            stacked = np.stack([forces[i] for i in alike], axis=-1)
            predicted[alike] = models[first]._rows(stacked, setting, nuisances[:1])[0].T
            left = [i for i in left if i not in alike]
        for i, model in enumerate(models):
            predicted[i] = model._recorded(predicted[i : i + 1], block)[0]
        moved = here._predicted(own, block, nuisances)
        return predicted[1:] - predicted[0], moved[1:] - moved[0]

    def _cuts_like(self, other: ForceModel) -> bool:
        """Whether all that a force depends on is the same."""
        mine, its = self.structure, other.structure
        return (
            self.cutter == other.cutter
            and self.terms == other.terms
            and (mine.compliance, mine.stiffness_factor) == (its.compliance, its.stiffness_factor)
            and (self.law, self.chipped, self.true_path) == (other.law, other.chipped, other.true_path)
            and self.bottom_edges == other.bottom_edges
        )

    def _reads_like(self, other: ForceModel) -> bool:
        """Whether all that the reading of a force depends on is the same."""
        mine, its = self.structure, other.structure
        orbits = (mine.orbit_amplitude, mine.orbit_phase), (its.orbit_amplitude, its.orbit_phase)
        return self.sensor == other.sensor and self.terms == other.terms and orbits[0] == orbits[1]

    def _predicted(self, force: ComplexArray, block: Block, nuisances: Array) -> Array:
        """Return the prediction (k, n) by a force (feeds, blocks or 1, orders, 3) at nuisances (k, m)."""
        return self._recorded(self._rows(force[..., None], block.setting, nuisances)[..., 0], block)

    def _recorded(self, read: Array, block: Block) -> Array:
        """Return readings (k, n) as they are recorded: bent, and with what is not of the cut."""
        bent = added.bent(self.terms, read, block)
        return (read if bent is None else read + bent[0]) + self._offset(block)

    def overlaid(self, block: Block, nuisance: Array, values: Array) -> ComplexArray:
        """Amplitudes (3, orders) of values of a block at phase 0; empty in helical milling."""
        setting: ForceSetting = block.setting
        if setting.helix is not None:
            return np.zeros((3, 0), complex)
        waves = amplitudes(values.reshape(block.repeats, 3, -1).mean(axis=0).T)[: LAID_OVER + 1]
        waves = np.pad(waves, ((0, LAID_OVER + 1 - len(waves)), (0, 0)))
        return np.asarray(waves.T * np.exp(-1j * nuisance[0] * np.arange(LAID_OVER + 1)))

    def circumstances(self, block: Block) -> dict[str, float]:
        """Return the settings of a cut to which a force may be proportional."""
        setting: ForceSetting = block.setting
        arc = setting.cut.engagement
        return {
            "feed": setting.cut.feed_per_tooth,
            "depth": setting.cut.axial_depth,
            "speed": setting.recording.speed,
            "arc": arc.exit - arc.entry,
            "travel": setting.cut_length,
        }

    def place(self, channel: int, harmonic: int) -> tuple[str, str]:
        """Return axis and label of an order."""
        return "xyz"[channel], f"order {harmonic}" if harmonic else "mean"

    def _force(self, setting: ForceSetting, beta: Array | None) -> ComplexArray:
        """Amplitudes of the force at phase 0, x along the feed: (feeds, blocks or 1, H+1, 3, p)."""
        force = np.asarray(self._orders(self._cutting(setting), beta) * self._worn(setting), complex)
        if setting.helix is not None:
            force = ramped(force.reshape(-1, *force.shape[2:]), setting.helix.ramp).reshape(force.shape)
        if self.bottom_edges:
            bottom = np.zeros((*force.shape[:3], len(self.bottom_edges)), complex)
            bottom[:, 0, 2] = self._bottom(setting)
            force = np.concatenate([force, bottom], axis=3)
        return added.acted(self.terms, force, self, setting)

    def of_cut(self, setting: ForceSetting, cut: Cut, cutter: Cutter | None = None) -> ComplexArray:
        """Amplitudes (H+1, 3, 6) of the force of another cut, or tool, in the place of a setting's own."""
        return order_basis(
            cutter or self.cutter, self.law, cut, setting.highest, self.true_path
        ) * self._worn(setting)

    def _worn(self, setting: ForceSetting) -> Array:
        shear, edge = setting.feed_ratio, self.law.edge(setting.cut_length)
        return np.array([shear, shear, shear, edge, edge, edge])

    def _rows(self, force: ComplexArray, setting: ForceSetting, nuisances: Array) -> Array:
        """Return what is read of a force (feeds, blocks or 1, H+1, 3, p) at nuisances (k, m): (k, n, p)."""
        recording, orders, p = setting.recording, force.shape[2], force.shape[-1]
        phase, direction = nuisances[:, 0], np.full(len(nuisances), setting.feed_direction)
        if setting.helix is not None:
            direction = nuisances[:, 1]
        if len(force) > 1:
            shares = np.moveaxis(shares_of_feeds(recording, direction), -1, 0)[..., None, None, None]
            force = np.sum(shares * force[:, None], axis=0)
        response = added.seen(self.terms, transfer(self.sensor, recording, orders), self, setting)[None]
        if setting.helix is not None and self.structure.orbit_amplitude:
            feed = direction[:, None] + recording.orbit * np.array(recording.middles)
            wave = recording.attenuation * np.cos(feed - self.structure.orbit_phase)
            axial = np.ones((*feed.shape, 3))
            axial[..., 2] += self.structure.orbit_amplitude * wave
            response = response * axial[:, :, None, :, None]
        return read_orders(force, direction, phase, response).reshape(len(nuisances), -1, p)

    def _cutting(self, setting: ForceSetting) -> ForceSetting:
        """Return the setting that an arm of this stiffness cuts: a softer arm cuts less of the wall."""
        more = setting.give * (1.0 / self.structure.stiffness_factor - 1.0)
        if not more:
            return setting
        arc = with_wall_proud(setting.cut.engagement, self.cutter.radius, more)
        return replace(setting, cut=replace(setting.cut, engagement=arc))

    def _orders(self, setting: ForceSetting, beta: Array | None) -> ComplexArray:
        """Amplitudes of the orders of the peripheral force, feed frame, (feeds, H+1, 3, 6).

        A tool that yields in helical milling has one for each direction of ``FEEDS``, otherwise there is one.
        """
        if self.chipped:
            sound = replace(self, chipped=())
            whole = (self.cutter, self.law, setting.cut)
            return sound._orders(setting, beta) + lost(whole, self.chipped, setting.highest, self.true_path)
        tool, highest = (self.cutter, self.law, setting.cut), setting.highest
        if beta is None or not any(self.structure.compliance):
            return order_basis(*tool, highest, self.true_path)[None]
        yielding = np.stack([each.orders for each in self._yielding(setting, beta)])
        if self.cutter.cylindrical:
            return yielding
        # What yielding changes is that of a cylinder of the same depth: a rounded end that is deflected is
        # not modelled.
        rigid = (order_basis(each, *tool[1:], highest, self.true_path) for each in self._ends())
        return np.asarray(yielding + np.subtract(*rigid))

    def _ends(self) -> tuple[Cutter, Cutter]:
        """Return the cutter, and the cylinder that it would be with a flat end."""
        return self.cutter, replace(self.cutter, corner=0.0, taper=0.0)

    def _yielding(self, setting: ForceSetting, beta: Array) -> list[Orders]:
        """Return the force on a tool that yields, in each direction of feed that is computed."""
        starts: Sequence[Soft | None] = [None] * len(FEEDS)
        if self.origin and any(self.origin.structure.compliance):
            starts = self.origin._soft(setting, beta)
        return [
            yielding_orders(soft, setting.highest, start)
            for soft, start in zip(self._soft(setting, beta), starts, strict=False)
        ]

    def _soft(self, setting: ForceSetting, beta: Array) -> list[Soft]:
        """Return the tool that yields and its cut, in each direction of feed that is computed."""
        cut = self._cutting(setting).cut
        worn = tuple((beta[:6] * np.repeat([1.0, self.law.edge(setting.cut_length)], 3)).tolist())
        return [
            Soft(self._ends()[1], self.law, cut, self.structure.seen(feed), worn, self.true_path)
            for feed in (FEEDS if setting.helix else (setting.feed_direction,))
        ]

    def beyond(self, block: Block, beta: Array) -> str:
        """Say that a tool this soft would not cut steadily, if force and deflection have no equilibrium."""
        setting = block.setting
        if not any(self.structure.compliance) or all(
            in_balance(soft, setting.highest, None) for soft in self._soft(setting, beta)
        ):
            return ""
        return "force and deflection find no balance: a tool this soft would not cut steadily"

    def _bottom(self, setting: ForceSetting) -> list[float]:
        """Thrust of the bottom edges along z over the whole revolution: it is not inclined by the ramp."""
        if setting.helix is None:
            return [0.0] * len(self.bottom_edges)
        thrust = dict(zip(BOTTOM_EDGES, bottom_thrust(self.cutter, setting.helix), strict=True))
        return [thrust[name] for name in self.bottom_edges]

    def _offset(self, block: Block) -> Array:
        """Offset (n,) from the drift of the sensor since its zero was read, and from terms."""
        pushed = added.pushed(self.terms, self, block)
        if not any(self.sensor.slope):
            return np.zeros(len(block.zeros)) + pushed
        recording: Recording = block.setting.recording
        since = np.array(recording.middles) - recording.zero_at
        each = len(block.zeros) // len(since)
        return np.asarray(np.repeat(since, each) * (block.zeros @ self.sensor.drift)) + pushed
