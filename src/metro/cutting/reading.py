"""What a sensor reads of a force, as order coefficients: the innermost loops of every fit of a force."""

from __future__ import annotations

import math

import numpy as np

from metro.compiled import compiled_with_arrays
from metro.units import Array, ComplexArray


@compiled_with_arrays
def read_orders(force: ComplexArray, direction: Array, phase: Array, response: ComplexArray) -> Array:
    """Turn forces to the direction of feed and to the phase of the tool, and let a sensor read them.

    Parameters
    ----------
    force : (k or 1, blocks or 1, orders, 3, p) amplitudes of e^{+ikα} at phase 0, x along the feed, N per
        unit of each coefficient.
    direction : (k,) of feed, counter-clockwise from work +x, rad. phase : (k,) of tooth 0, rad.
    response : (k or 1, blocks, orders, 3, 3) reading over force, work frame.

    Returns
    -------
    (k, blocks, 3, 2·orders − 1, p) order coefficients (:mod:`metro.signals.orders`), N per unit.
    """
    orders, columns, blocks = force.shape[2], force.shape[4], response.shape[1]
    read = np.empty((len(phase), blocks, 3, 2 * orders - 1, columns))
    for i in range(len(phase)):
        cosine, sine = math.cos(direction[i]), math.sin(direction[i])
        one, other = i % force.shape[0], i % response.shape[0]
        for block in range(blocks):
            at = block % force.shape[1]
            for order in range(orders):
                wave = complex(math.cos(order * phase[i]), math.sin(order * phase[i]))
                map_ = response[other, block, order]
                for column in range(columns):
                    along, across = force[one, at, order, 0, column], force[one, at, order, 1, column]
                    x, y = wave * (cosine * along - sine * across), wave * (sine * along + cosine * across)
                    z = wave * force[one, at, order, 2, column]
                    for axis in range(3):
                        seen = map_[axis, 0] * x + map_[axis, 1] * y + map_[axis, 2] * z
                        if order == 0:
                            read[i, block, axis, 0, column] = seen.real
                        else:
                            read[i, block, axis, 2 * order - 1, column] = seen.real
                            read[i, block, axis, 2 * order, column] = -seen.imag
    return read


@compiled_with_arrays
def responses(shares: Array, speed: float, modes: Array, orders: int) -> ComplexArray:
    """Return what a sensor with resonances reads of a force at the orders 0…, (blocks, orders, 3, 3).

    Parameters
    ----------
    shares : (blocks, 3, 3, 3) of each channel in the reading. speed : rev/s.
    modes : (resonances, 2, 3) frequency, Hz, and damping on each channel, in series.
    """
    seen = np.zeros((len(shares), orders, 3, 3), np.complex128)
    for order in range(orders):
        for channel in range(3):
            gain = 1.0 + 0.0j
            for mode in modes:
                ratio = speed * order / mode[0, channel]
                gain /= complex(1.0 - ratio * ratio, 2.0 * mode[1, channel] * ratio)
            for block in range(len(shares)):
                for i in range(3):
                    for j in range(3):
                        seen[block, order, i, j] += gain * shares[block, channel, i, j]
    return seen
