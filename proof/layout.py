"""Where a proof keeps its files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Layout:
    """The folders of one proof.

    ``raw`` holds the batches, ``sealed`` the truth, ``processed`` and ``reports`` what the pipeline writes,
    ``oracle`` what a fit with the true effects reaches.
    """

    root: Path

    @property
    def raw(self) -> Path:
        """Folder of the batches."""
        return self.root / "raw"

    @property
    def truth(self) -> Path:
        """File of what is hidden."""
        return self.root / "sealed" / "truth.json"

    @property
    def seal(self) -> Path:
        """File of the truth's hash."""
        return self.root / "seal.txt"

    @property
    def suite(self) -> Path:
        """File of what the suite is; it is there as soon as the first batch is being made."""
        return self.root / "sealed" / "suite.json"

    def made(self, batch: str) -> Path:
        """File of what one batch hides; it is there once the batch is made."""
        return self.root / "sealed" / "made" / f"{batch}.json"

    def answers(self, program: str) -> Path:
        """Folder of what another program says of the batches."""
        return self.root / "answers" / program

    @property
    def processed(self) -> Path:
        """Folder of the pipeline's tables, by batch."""
        return self.root / "processed"

    @property
    def reports(self) -> Path:
        """Folder of the pipeline's results, by batch."""
        return self.root / "reports"

    @property
    def oracle(self) -> Path:
        """Folder of the oracle's figures, by batch."""
        return self.root / "oracle"

    @property
    def batches(self) -> list[str]:
        """Names of the batches, sorted."""
        return sorted(path.parent.name for path in self.raw.glob("*/batch.yaml"))
