"""What the stability of milling depends on: a structure of modes at the tool tip, and a cut.

Feed frame: x feed, z from tip to spindle, y = z × x, immersion from +y clockwise towards +x.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from metro.cutting.cutter import Cutter
from metro.cutting.envelope import mean_inclination
from metro.units import Array, ComplexArray


@dataclass(frozen=True)
class Structure:
    """Modes of the tool tip against the work, each in one direction of the plane of cutting.

    Attributes
    ----------
    axis : (m,) 0 for a mode in x, 1 for a mode in y: the row of ``directions``.
    omega : (m,) undamped angular frequencies, rad/s.
    zeta : (m,) damping ratios, 0 < zeta < 1.
    stiffness : (m,) modal stiffnesses for unit displacement of the tip along the mode, N/m.
    directions : (d, 2) unit vectors along which modes move, in the feed frame: x and y unless turned. Modes
        along neither couple the two.

    A direction without modes is rigid. For a boundary at k speeds, frequencies, damping ratios and
    stiffnesses may be those at each of them, (k, m), and with them the directions, (k, d, 2).
    """

    axis: np.ndarray
    omega: Array
    zeta: Array
    stiffness: Array
    directions: Array = field(default_factory=lambda: np.eye(2))

    @property
    def of_speeds(self) -> bool:
        """Whether each speed has modes of its own."""
        return self.omega.ndim > 1

    def at(self, speeds: np.ndarray) -> Structure:
        """Return the structure at speeds of some indices, or under a mask; one of all speeds as it is."""
        if not self.of_speeds:
            return self
        omega, zeta, stiffness = (part[speeds] for part in (self.omega, self.zeta, self.stiffness))
        directions = self.directions[speeds] if self.directions.ndim > 2 else self.directions
        return Structure(self.axis, omega, zeta, stiffness, directions)

    @property
    def along(self) -> Array:
        """(..., m, 2) unit vector along which each mode moves."""
        return self.directions[..., self.axis, :]

    @property
    def poles(self) -> ComplexArray:
        """(..., m) poles with positive imaginary part, rad/s."""
        return self.omega * (-self.zeta + 1j * np.sqrt(1.0 - self.zeta**2))

    @property
    def residues(self) -> ComplexArray:
        """(..., m) residues of the receptance at :attr:`poles`: 1 / (2 i m omega_d), m/(N s)."""
        return self.omega**2 / (2j * self.stiffness * self.poles.imag)

    def mode(self, which: int) -> Structure:
        """One mode alone."""
        axis, *parts = (part[[which]] for part in (self.axis, self.omega, self.zeta, self.stiffness))
        return Structure(axis, parts[0], parts[1], parts[2], self.directions)

    def receptance(self, omega: Array) -> ComplexArray:
        """Receptance (..., 2, 2) of displacement by force, m/N, at angular frequencies of shape (...).

        Of modes of k speeds: at frequencies (k, f).
        """
        own, zeta, stiffness, along = self.omega, self.zeta, self.stiffness, self.along
        if self.of_speeds:
            own, zeta, stiffness = own[:, None], zeta[:, None], stiffness[:, None]
            along = along[:, None] if along.ndim > 2 else along
        ratio = np.asarray(omega)[..., None] / own
        modal = 1.0 / (stiffness * (1.0 - ratio**2 + 2j * zeta * ratio))
        full: ComplexArray = np.einsum("...m,...mi,...mj->...ij", modal, along, along)
        return full

    def turned(self, angle: float) -> Structure:
        """Return the structure with all its modes turned by ``angle``, rad, from x towards y."""
        c, s = math.cos(angle), math.sin(angle)
        return replace(self, directions=self.directions @ np.array([[c, s], [-s, c]]))

    def stiffer(self, factor: Array) -> Structure:
        """Return the structure with ``factor`` (m,), or (k, m) of k speeds, times its stiffnesses.

        Masses and damping ratios are constant.
        """
        omega = self.omega * np.sqrt(factor)
        zeta = np.broadcast_to(self.zeta, omega.shape)
        return replace(self, omega=omega, zeta=zeta, stiffness=self.stiffness * factor)

    def with_mode(self, axis: int, omega: float, zeta: float, stiffness: float) -> Structure:
        """Return the structure with one more mode along direction ``axis``."""
        return Structure(
            np.append(self.axis, axis),
            np.append(self.omega, omega),
            np.append(self.zeta, zeta),
            np.append(self.stiffness, stiffness),
            self.directions,
        )


@dataclass(frozen=True)
class Edge:
    """Edge of an end that is not flat: it presses along the normal of its envelope and along the meridian.

    With κ between that normal and the tool axis, and without helix, the tangential force per height is that
    of a flat end, and the radial one ``krc sin κ - kac cos κ`` takes the place of ``krc``.

    Attributes
    ----------
    tool : whose meridian it is. krc, kac : coefficients along the normal and along the meridian, N/m².
    """

    tool: Cutter
    krc: float
    kac: float

    def radial(self, depth: float) -> float:
        """Mean radial coefficient over the height of a cut of a depth, m: N/m²."""
        along, across = mean_inclination(self.tool, depth)
        return along * self.krc - across * self.kac


@dataclass(frozen=True)
class RawFace:
    """Face of the work that a side cut removes: what of a tooth is beyond it is in the work.

    Attributes
    ----------
    distance : from the tool's axis, m, above 0.
    towards : immersion at which a tooth is farthest beyond it, rad.
    """

    distance: float
    towards: float

    def reach(self, radius: float) -> float:
        """Angle on either side of ``towards`` up to which a tooth of a radius is beyond the face, rad."""
        return math.acos(min(self.distance / radius, 1.0))


@dataclass(frozen=True)
class Engaged:
    """What of the height of a corner is in a side cut at each immersion: the face is met by the widest part.

    Attributes
    ----------
    edge : with a straight flank of no taper above its corner. face, depth : of the cut, m.
    """

    edge: Edge
    face: RawFace
    depth: float

    def __call__(self, phi: Array) -> tuple[Array, Array]:
        """Return what the tangential and the normal coefficient act with at immersions ``phi``.

        Means over the height of the cut of 1 and of sin κ − K_ac/K_rc cos κ, over the part that is engaged.
        """
        least = self.face.distance / np.maximum(np.cos(phi - self.face.towards), 1e-9)  # radius in the work
        low = np.minimum(self._height(least), self.depth)
        whole = self._inclined(np.full_like(low, self.depth))
        sine, cosine = (whole - self._inclined(low)) / self.depth
        return 1.0 - low / self.depth, sine - self.edge.kac / self.edge.krc * cosine

    def widest(self) -> float:
        """Radius at the upper end of the cut, m."""
        tool = self.edge.tool
        above = max(tool.corner - self.depth, 0.0)
        return tool.radius - tool.corner + math.sqrt(tool.corner**2 - above**2)

    def _height(self, radius: Array) -> Array:
        """Return the height above which the tool is wider than a radius, m; infinite where it never is."""
        tool = self.edge.tool
        beside = np.maximum(radius - tool.radius + tool.corner, 0.0)
        height = tool.corner - np.sqrt(np.maximum(tool.corner**2 - beside**2, 0.0))
        return np.where(beside < tool.corner, height, np.inf)

    def _inclined(self, height: Array) -> Array:
        """Integrals of sin κ and cos κ over the height from the tip on, (2, ...), m."""
        corner = self.edge.tool.corner
        arc = np.minimum(height, corner)
        kappa = np.arccos(1.0 - arc / corner)
        sine = corner * (kappa / 2.0 - np.sin(2.0 * kappa) / 4.0) + (height - arc)
        return np.stack([sine, arc - arc**2 / (2.0 * corner)])


@dataclass(frozen=True)
class Cut:
    """Engagement and cutting coefficients.

    Attributes
    ----------
    teeth : number of equally spaced teeth.
    entry, exit : immersion angles between which a tooth cuts, rad.
    ktc, krc : tangential and radial cutting coefficients, N/m².
    edge : of an end that is not flat: what of the coefficients acts along the radius at each depth of cut.
        The mean at one depth is ``krc``, for what takes one coefficient.
    face : that a side cut removes, where the edge is not straight; None of a slot.
    engaged : what of the edge is engaged at each immersion, at the one depth that this is the cut of.
    damping : of the process, coefficient over the tool's radius, N/m²: a tooth that moves into the work at a
        speed v is pushed back by ``damping * depth * v / spindle's angular speed``. For a boundary at k
        speeds it may be that at each of them, (k,).
    """

    teeth: int
    entry: float
    exit: float
    ktc: float
    krc: float
    damping: float | Array = 0.0
    edge: Edge | None = None
    face: RawFace | None = None
    engaged: Engaged | None = None

    def at(self, speeds: np.ndarray) -> Cut:
        """Return the cut at speeds of some indices, or under a mask; one of all speeds as it is."""
        damping = np.asarray(self.damping)
        return replace(self, damping=damping[speeds]) if damping.ndim else self

    def at_depth(self, depth: float) -> Cut:
        """Return the cut with what an axial depth, m, makes of its edge, at all depths.

        In a slot that is the mean radial coefficient. In a side cut a corner meets the raw face the later the
        narrower it is, and what is narrower than the face's distance does not cut.
        """
        if self.edge is None:
            return self
        tool = self.edge.tool
        if self.face is None or tool.corner == 0.0 or tool.taper or not self.edge.krc:
            return replace(self, krc=self.edge.radial(depth), edge=None, face=None)
        engaged = Engaged(self.edge, self.face, depth)
        towards, reach = self.face.towards, self.face.reach(engaged.widest())
        entry, leave = max(self.entry, towards - reach), min(self.exit, towards + reach)
        made = replace(self, entry=entry, exit=max(entry, leave), krc=self.edge.krc)
        return replace(made, edge=None, face=None, engaged=engaged)

    def harder(self, tangential: float, radial: float) -> Cut:
        """Return the cut with so many times the tangential and the radial coefficient."""
        edge = self.edge and replace(self.edge, krc=self.edge.krc * radial, kac=self.edge.kac * radial)
        return replace(self, ktc=self.ktc * tangential, krc=self.krc * radial, edge=edge)

    @property
    def pitch(self) -> float:
        """Angle between teeth, rad."""
        return 2.0 * math.pi / self.teeth

    def tooth_period(self, rpm: Array) -> Array:
        """Tooth period in seconds at spindle speeds in rev/min."""
        return 60.0 / (self.teeth * np.asarray(rpm, dtype=float))

    def acting(self, phi: Array) -> tuple[Array, Array]:
        """Return what ktc and krc act with at immersions: 1, or the means of what is engaged of an edge."""
        return (np.ones_like(phi), np.ones_like(phi)) if self.engaged is None else self.engaged(phi)

    def force_direction(self, phi: Array) -> Array:
        """(..., 2) force on the tool per chip area times thickness, N/m²: ``F = a * force_direction * h``."""
        s, c = np.sin(phi), np.cos(phi)
        along, inward = self.acting(phi)
        ktc, krc = self.ktc * along, self.krc * inward
        return np.stack([-(ktc * c + krc * s), ktc * s - krc * c], axis=-1)


def chip_direction(phi: Array) -> Array:
    """(..., 2) direction along which a displacement of the tool thickens the chip."""
    return np.stack([np.sin(phi), np.cos(phi)], axis=-1)


def immersion(direction: str, radial_depth: float, diameter: float) -> tuple[float, float]:
    """Entry and exit angles (rad) of a tooth.

    Parameters
    ----------
    direction : up, down (climb) or slot.
    radial_depth, diameter : same unit; a full radial depth is a slot.

    Raises
    ------
    ValueError
        When the radial depth is not in (0, diameter], or the direction is none of these.
    """
    if direction == "slot":
        return 0.0, math.pi
    if not 0.0 < radial_depth <= diameter:
        raise ValueError(
            f"radial depth {radial_depth:g}: expected more than 0 and at most the diameter {diameter:g}"
        )
    if direction not in ("up", "down"):
        raise ValueError(f"direction {direction!r}: expected up, down or slot")
    swept = math.acos(1.0 - 2.0 * radial_depth / diameter)
    return (0.0, swept) if direction == "up" else (math.pi - swept, math.pi)
