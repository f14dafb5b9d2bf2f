"""A tooth of which a piece is missing at the tip: what it leaves to the tooth behind it."""

from __future__ import annotations

from dataclasses import dataclass, replace

from metro.cutting.chip import Cut
from metro.cutting.cutter import Cutter


@dataclass(frozen=True)
class Chipped:
    """A chipped tooth: its number, and how much shorter it is, m, up to a height above the tip, m."""

    tooth: int
    length: float
    height: float

    def change(self, cutter: Cutter, cut: Cut) -> tuple[Cutter, Cut]:
        """Return the tool broken all along, and the cut of the heights at which it is.

        Heights do not know of each other: the force changes by that of this tool in this cut less that of the
        whole tool in the same.
        """
        before = cutter.reach or (0.0,) * cutter.teeth
        reach = tuple(was - self.length if j == self.tooth else was for j, was in enumerate(before))
        return replace(cutter, reach=reach), replace(cut, axial_depth=min(self.height, cut.axial_depth))
