"""The machine's stiffness in the cut, relative to that of static load tests."""

from __future__ import annotations

from dataclasses import dataclass

from metro.units import Array


@dataclass(frozen=True)
class Structure:
    """How stiff the machine is while it cuts, relative to its load tests.

    A part of every model that turns forces into displacements of the tip, so that one effect serves them all.

    Attributes
    ----------
    stiffness_factor : true stiffness in the cut = factor × that of the load tests.
    """

    stiffness_factor: float = 1.0

    def in_cut(self, compliance: Array) -> Array:
        """Turn a compliance of the load tests, or anything proportional to one, into that of the cut."""
        return compliance / self.stiffness_factor
