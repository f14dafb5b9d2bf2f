"""What becomes of a batch: refused with messages, read with something flagged, read, or worse."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from metro.batch.check import check
from metro.batch.findings import BatchError
from metro.batch.processed import COLUMNS
from metro.stages.ingest import ingest


@dataclass(frozen=True)
class Outcome:
    """How a batch fared.

    Attributes
    ----------
    how : refused (an error), flagged (what the first page of the report shows), read, or crashed.
    where : check or ingest.
    said : messages, each with file and place.
    tables : canonical tables, where the batch was read.
    """

    how: str
    where: str
    said: tuple[str, ...]
    tables: dict


def outcome(folder: Path, out: Path) -> Outcome:
    """Check and ingest a batch; messages are without the folder's path.

    Ingest begins with the check of `metro check`, and makes the folder about ``out`` when that has passed;
    of what it accepts, the command must be able to say what can be computed.
    """
    try:
        ingest(folder, folder, out / folder.name, {}, "code")
        assert check(folder, folder).ok
    except BatchError as error:
        found = Outcome("refused", "ingest" if out.exists() else "check", tuple(map(str, error.problems)), {})
    except Exception as error:  # the very thing that must not happen, whatever it is
        found = Outcome("crashed", "ingest" if out.exists() else "check", (repr(error),), {})
    else:
        tables = {name: pd.read_parquet(out / folder.name / f"{name}.parquet") for name in COLUMNS}
        flags = tables["qc"][~tables["qc"]["ok"]]
        parts = ((row.file, row.run, row.message) for row in flags.itertuples())
        said = tuple(": ".join(part for part in said if part) for said in parts)
        found = Outcome("flagged" if said else "read", "ingest", said, tables)
    return replace(found, said=tuple(message.replace(f"{folder}/", "") for message in found.said))


def alike(one: dict, other: dict) -> bool:
    """Tell whether two batches gave the same canonical tables, to the digits that their files hold."""
    return all(
        _same(table.drop(columns="file", errors="ignore"), other[name].drop(columns="file", errors="ignore"))
        for name, table in one.items()
        if name != "qc"
    )


def _same(one, other):
    if one.shape != other.shape:
        return False
    for name in one:
        if pd.api.types.is_numeric_dtype(one[name]):
            if not np.allclose(one[name], other[name], rtol=1e-9, atol=1e-12, equal_nan=True):
                return False
        elif not one[name].fillna("").equals(other[name].fillna("")):
            return False
    return True
