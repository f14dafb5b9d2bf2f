"""Orders of the force on a tool, rigid or yielding, that the force model keeps for many fits."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from metro.cutting.chipped import Chipped
from metro.cutting.cutter import Cutter
from metro.cutting.cylinder_orders import cylinder_orders
from metro.cutting.force import Cut, lost_at_the_floor, placed
from metro.cutting.general_orders import general_orders
from metro.cutting.law import EdgeLaw
from metro.cutting.yielding_steady import NotBalancedError, yielding
from metro.observables.force.dynamometer import Recording
from metro.signals.orders import amplitudes, to_orders
from metro.units import Array, ComplexArray

ANGLES = 360  # of the table of what the floor of a helix takes from a force: half of what a drawn one has
FEEDS = (
    0.0,
    math.pi / 3.0,
    2.0 * math.pi / 3.0,
)  # these three directions suffice, because a spring repeats after half a turn


def shares_of_feeds(recording: Recording, direction: Array) -> Array:
    """Shares (k, blocks, feeds) of ``FEEDS`` in each time block of an orbit, by ``direction`` (k,) of feed.

    A spring that does not turn with the feed changes the force nearly as a sinusoid of twice the direction of
    feed. Three directions determine this sinusoid, and the time block averages it.
    """
    feed = direction[:, None] + recording.orbit * np.array(recording.middles)
    attenuation = np.sinc(recording.orbit * recording.span / math.pi)
    wave = attenuation * np.cos(2.0 * (feed[..., None] - np.array(FEEDS)))
    return np.asarray((1.0 + 2.0 * wave) / len(FEEDS))


@lru_cache(maxsize=4096)
def order_basis(cutter: Cutter, law: EdgeLaw, cut: Cut, highest: int, true_path: bool) -> ComplexArray:
    """Amplitudes of the orders of the force on a rigid tool, (orders, 3, 6): read-only, it is kept."""
    of_shape = cylinder_orders if cutter.cylindrical else general_orders
    basis = of_shape(placed(cutter, cut, true_path), law, cut, highest, true_path=true_path)
    if cut.pitch:
        lost_there = lost_at_the_floor(cutter, law, cut, true_path, ANGLES)
        basis += amplitudes(to_orders(lost_there, highest))
    basis.flags.writeable = False
    return basis


@lru_cache(maxsize=4096)
def lost(
    whole: tuple[Cutter, EdgeLaw, Cut], chipped: tuple[Chipped, ...], highest: int, true_path: bool
) -> ComplexArray:
    """Amplitudes (orders, 3, 6) of what chipped teeth change in the force of a ``whole`` tool that is rigid.

    The highest chip breaks the whole tool, the next one the tool that is left, up to its own height. It is
    kept: read-only.
    """
    tool, law, cut = whole
    changed = np.zeros((highest + 1, 3, 6), complex)
    for one in sorted(chipped, key=lambda chip: -chip.height):
        broken, low = one.change(tool, cut)
        with_it, without = (order_basis(each, law, low, highest, true_path) for each in (broken, tool))
        changed = changed + (with_it - without)
        tool = broken
    changed.flags.writeable = False
    return changed


class Soft(NamedTuple):
    """A tool that yields, its cut, its compliance xx, yy, xy in the feed frame, and its coefficients."""

    cutter: Cutter
    law: EdgeLaw
    cut: Cut
    spring: tuple[float, float, float]
    coefficients: tuple[float, ...]
    true_path: bool


class Orders(NamedTuple):
    """Amplitudes of the orders of a tool that yields, and its deflection."""

    orders: ComplexArray
    bent: Array


def yielding_orders(soft: Soft, highest: int, start: Soft | None) -> Orders:
    """Return the orders of a tool that yields; the compliance is halved until the tool cuts steadily.

    Such a tool is no result (``ForceModel.beyond``). ``start``: a tool that hardly differs.
    """
    found = in_balance(soft, highest, start)
    while found is None:
        along, across, mixed = soft.spring
        soft = soft._replace(spring=(0.5 * along, 0.5 * across, 0.5 * mixed))
        found = in_balance(soft, highest, start)
    return found


@lru_cache(maxsize=1024)
def in_balance(soft: Soft, highest: int, start: Soft | None) -> Orders | None:
    """Return the orders of a tool that yields, which are kept; None where it would not cut steadily."""
    along, across, mixed = soft.spring
    compliance, sharp = np.array([[along, mixed], [mixed, across]]), np.array(soft.coefficients)
    near = in_balance(start, highest, None) if start else None
    try:
        found = yielding(
            soft.cutter,
            soft.law,
            soft.cut,
            sharp,
            compliance,
            true_path=soft.true_path,
            start=None if near is None else near.bent,
        )
    except NotBalancedError:
        return None
    orders = amplitudes(to_orders(found.basis, highest))
    orders.flags.writeable = False
    return Orders(orders, found.bent)
