"""Export of a batch's FRFs for other programs: one universal file per position."""

from __future__ import annotations

from pathlib import Path

from metro.batch.processed import read_batch, read_table
from metro.batch.writing import write_atomically
from metro.formats import FormatError
from metro.formats.uff import FRF, Function
from metro.formats.uff_writer import universal_file
from metro.observables.stability.modal_test import receptances


def frf_export(processed: Path, out: Path, position: str) -> list[str]:
    """Write the FRFs of a position, all lines of them, as datasets 58b; return what to print.

    They are those that modal identification starts from: receptances in m/N, estimated from the hammer
    records (H1 of gated hits) or as the FRF files hold them, repeats averaged. ``position`` may be "" where
    there is only one.

    Raises
    ------
    FormatError
        When there are no FRFs at the position, or none is named where there are several.
    """
    batch, notes = read_batch(processed), list[str]()
    measured = receptances(
        lambda name: read_table(processed / f"{name}.parquet"), batch.instrument("hammer"), notes
    )
    there = list(dict.fromkeys(item.position for item in measured))
    if not there:
        raise FormatError(processed, "; ".join(["found no FRF and no usable hammer record", *notes]))
    if position not in there and (position or len(there) > 1):
        raise FormatError(
            processed, f"found FRFs at position {', '.join(there)}, expected one of them: --position"
        )
    chosen = [item for item in measured if item.position == (position or there[0])]
    content = universal_file(
        [Function(FRF, one.reference, one.response, "m", one.frequency, one.frf) for one in chosen]
    )
    write_atomically(out, lambda stream: stream.write(content))
    return [*notes, f"{out}: {len(chosen)} FRFs of position {position or there[0]}, m/N"]
