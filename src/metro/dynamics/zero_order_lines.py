"""The eigenvalues of the boundary to zeroth order (:mod:`metro.dynamics.zero_order`), from line to line."""

from __future__ import annotations

import math
from typing import NamedTuple

from metro.compiled import compiled
from metro.units import Array, ComplexArray


class Modes(NamedTuple):
    """Modes of t structures: angular frequency, rad/s, damping ratio, stiffness, N/m, (t, m).

    ``along`` (t, m, 2): their directions.
    """

    omega: Array
    zeta: Array
    stiffness: Array
    along: Array


class Acting(NamedTuple):
    """Mean factors of the chip (2, 2) and of process damping (t, 2, 2); tooth period, s, and rad/s (t, k)."""

    chip: Array
    rubbing: Array
    period: Array
    spin: Array


class Scratch(NamedTuple):
    """Of each speed: root and two eigenvalues at the line before, the root's sign, the largest crossing."""

    before: ComplexArray
    sign: Array
    best: Array


@compiled
def lowest(modes: Modes, acting: Acting, lines: Array, scratch: Scratch, found: tuple[Array, Array]) -> None:
    """Write lowest depths (t, k), m, and chatter frequencies there (t, k), Hz, to ``found``.

    Along the ``lines`` (t, f), rad/s, the two eigenvalues of 1/depth are followed, the root between them
    without a jump. Where one comes to be real, between two lines, is a crossing; the largest counts. Whole
    arrays take 3.4 times as long (128 structures at 30 speeds), and 12 times where each has one speed.
    """
    chip = acting.chip
    chip_det = chip[0, 0] * chip[1, 1] - chip[0, 1] * chip[1, 0]
    before, sign, best = scratch
    depth, chatter = found
    for t in range(lines.shape[0]):
        rub = acting.rubbing[t]
        rub_det = rub[0, 0] * rub[1, 1] - rub[0, 1] * rub[1, 0]
        both = (
            chip[0, 0] * rub[1, 1] + rub[0, 0] * chip[1, 1] - chip[0, 1] * rub[1, 0] - rub[0, 1] * chip[1, 0]
        )
        sign[:] = 1.0
        best[:] = 0.0
        for f in range(lines.shape[1]):
            omega = lines[t, f]
            xx, xy, yy = _receptance(modes, t, omega)
            trace = xx * chip[0, 0] + xy * (chip[0, 1] + chip[1, 0]) + yy * chip[1, 1]
            rubbed = xx * rub[0, 0] + xy * (rub[0, 1] + rub[1, 0]) + yy * rub[1, 1]
            determinant = xx * yy - xy * xy  # a product's determinants, mixed ones too, are products
            for k in range(depth.shape[1]):
                turned = omega * acting.period[t, k]
                z = complex(1.0 - math.cos(turned), math.sin(turned))
                w = complex(0.0, omega / acting.spin[t, k])
                half = 0.5 * (z * trace + w * rubbed)
                root = _root(half * half - determinant * (z * z * chip_det + z * w * both + w * w * rub_det))
                last = before[0, k]
                if f and root.real * last.real + root.imag * last.imag < 0.0:
                    sign[k] = -sign[k]
                before[0, k] = root
                for which in range(2):
                    value = half + (sign[k] if which == 0 else -sign[k]) * root
                    a = before[1 + which, k]
                    if f and a.imag * value.imag < 0.0:
                        share = a.imag / (a.imag - value.imag)
                        inverse = a.real + share * (value.real - a.real)
                        if inverse > best[0, k]:
                            best[0, k] = inverse
                            best[1, k] = lines[t, f - 1] + share * (omega - lines[t, f - 1])
                    before[1 + which, k] = value
        for k in range(depth.shape[1]):
            if best[0, k] > 0.0:
                depth[t, k], chatter[t, k] = 1.0 / best[0, k], best[1, k] / (2.0 * math.pi)


@compiled
def _root(square: complex) -> complex:
    """Return one of the two square roots."""
    greater = math.sqrt(
        0.5 * (math.sqrt(square.real * square.real + square.imag * square.imag) + abs(square.real))
    )
    lesser = 0.5 * square.imag / greater if greater > 0.0 else 0.0
    return complex(greater, lesser) if square.real >= 0.0 else complex(lesser, greater)


@compiled
def _receptance(modes: Modes, t: int, omega: float) -> tuple[complex, complex, complex]:
    """Receptance xx, xy and yy of a structure, m/N."""
    xx = xy = yy = 0j
    for m in range(modes.omega.shape[1]):
        ratio = omega / modes.omega[t, m]
        own = complex(1.0 - ratio * ratio, 2.0 * modes.zeta[t, m] * ratio)
        modal = 1.0 / (modes.stiffness[t, m] * own)
        x, y = modes.along[t, m, 0], modes.along[t, m, 1]
        xx, xy, yy = xx + x * x * modal, xy + x * y * modal, yy + y * y * modal
    return xx, xy, yy
