"""One way in which the bookkeeping of a batch's force records may be wrong, ready to be fitted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from metro.slips.waveform import Design, Record, WaveFit, fit


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """The records and designs that belong to one slip.

    Attributes
    ----------
    kind : the family: axes, teeth, gain, direction, rows. remedy : the line or cell to write.
    file, column : where it is.
    """

    kind: str
    remedy: str
    column: str
    records: Sequence[Record]
    designs: Sequence[Design]
    file: str = "batch.yaml"

    def fitted(self) -> WaveFit:
        """Fit the coefficients under this hypothesis."""
        return fit(self.records, self.designs)
