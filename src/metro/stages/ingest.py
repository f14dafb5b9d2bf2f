"""Ingest: the raw files of a batch become canonical tables, in the axes, signs and units of the contract."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from metro.batch.check import HOLDOUT, examine
from metro.batch.findings import BatchError, errors
from metro.batch.processed import write_batch
from metro.batch.provenance import write_made
from metro.batch.writing import writing
from metro.stages.whole import provenance_of, read_whole
from metro.units import JSON


def ingest(folder: Path, cells: Path, out: Path, settings: JSON, code: str) -> None:
    """Check a batch, read all its files, and write the canonical tables and what describes the batch.

    Parameters
    ----------
    folder : the batch, ``data/raw/<batch>``.
    cells : folder of the shared cells.
    out : ``data/processed/<batch>``.
    settings : with the section ``holdout`` of the configuration, where it is given.
    code : hash of the stage's code, for the provenance.

    Raises
    ------
    BatchError
        With every problem of the contract, or else of the data files; nothing is written then.
    """
    examined = examine(folder, cells, settings.get("holdout", HOLDOUT))
    examined.loaded()  # what is wrong with the tables is said before anything is written
    with _staging(out) as staging:
        whole = read_whole(examined, staging)
        if errors(whole.findings):
            raise BatchError(errors(whole.findings))
        write_batch(staging, whole.batch, provenance_of(whole.sources))
        write_made(staging, "ingest", settings, code)


@contextmanager
def _staging(out: Path) -> Iterator[Path]:
    """Give a folder beside ``out`` to write into; if all went well its files move there, batch.json last."""
    with writing(out):
        out.parent.mkdir(parents=True, exist_ok=True)
        staging = Path(tempfile.mkdtemp(prefix=f".{out.name}.", dir=out.parent))
        try:
            yield staging
            out.mkdir(exist_ok=True)
            # That of an earlier call does not describe these tables.
            (out / "batch.json").unlink(missing_ok=True)
            for file in sorted(staging.iterdir(), key=lambda file: file.name == "batch.json"):
                file.replace(out / file.name)
        finally:
            shutil.rmtree(staging)
