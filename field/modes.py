"""Published modes beside ours, one to one: what is missing, and what nobody published."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from field.taken import Found
from metro.report.numbers import with_interval
from metro.units import JSON

REACH = 0.1  # relative distance beyond which two modes are not the same


def assigned(published: Sequence[float], ours: Sequence[float]) -> dict[int, int]:
    """Return which of our frequencies belongs to which published one, as many pairs as there can be.

    Each belongs to one at most, and of all such pairings the one with the least sum of the distances of their
    logarithms is taken: two published modes never have the same mode of ours beside them.
    """
    from scipy.optimize import linear_sum_assignment

    distance = np.abs(np.log(np.array(published)[:, None] / np.array(ours)[None, :]))
    near = distance <= np.log1p(REACH)
    # A pair out of reach costs more than all pairs within it, so that none is given up for it.
    rows, columns = linear_sum_assignment(np.where(near, distance, 1.0 + len(published)))
    return {int(row): int(column) for row, column in zip(rows, columns, strict=True) if near[row, column]}


def mode(hz: float, published: Sequence[float], key: str = "frequency") -> Callable[[Found], JSON | None]:
    """Take the identified mode that belongs to the one of ``hz`` among all that are ``published``."""

    def ours(found: Found) -> JSON | None:
        modes = _identified(found)
        place = assigned(published, [one["frequency"]["value"] for one in modes]).get(
            list(published).index(hz)
        )
        return None if place is None else dict(modes[place][key])

    return ours


def others(published: Sequence[float]) -> Callable[[Found], JSON | None]:
    """List the identified modes that belong to none of the ``published`` ones."""

    def ours(found: Found) -> JSON | None:
        modes = _identified(found)
        taken = set(assigned(published, [one["frequency"]["value"] for one in modes]).values())
        rest = [one["frequency"] for i, one in enumerate(modes) if i not in taken]
        listed = "; ".join(with_interval(one["value"], one.get("ci95")) for one in rest)
        return {"listed": f"{listed} Hz"} if rest else {"listed": "none"}

    return ours


def _identified(found: Found) -> list[JSON]:
    return [one for one in found["identified"].get("modes") or [] if one.get("frequency")]
