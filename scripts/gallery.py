"""Draw the figures of the gallery from reports that are up to date.

``python scripts/gallery.py data/processed reports docs/figures`` writes a picture for each figure of
:data:`FIGURES`, and prints the caption that the report gives it.
"""

from __future__ import annotations

import io
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from PIL import Image

from metro.report.batch_report import report_sections
from metro.report.content import Abreast, Picture
from metro.report.results import Results
from metro.stages.report import read_results

DPI, COLOURS, MOST = 110, 64, 120_000  # the last: bytes


class Shown(NamedTuple):
    """A figure of the gallery: its file, the batch, and words by which its caption is recognised."""

    name: str
    batch: str
    caption: str


FIGURES = (
    Shown("gallery-force", "trimule-helical", "Measured cutting force and predictions"),
    Shown("gallery-orders", "trimule-helical", "Order spectra of the measured force"),
    Shown("gallery-lobes", "trimule-chatter", "Stability boundary and held-out test cuts"),
    Shown("gallery-chatter", "trimule-chatter", "spectrum of the whole steady cut"),
    Shown("gallery-modes", "trimule-helical", "easured frequency responses and the modal model"),
    Shown("gallery-wall", "kr160-side", "Measured deformation of the wall and predictions"),
    Shown("gallery-face", "irb6640-face", "Deviation from the least-squares planes"),
    Shown("gallery-errors", "kr160-side", "Errors with 95 % intervals"),
)


def pictures(results: Results) -> Iterator[Picture]:
    """Yield the figures of a report in their order."""
    for section in report_sections(results):
        for item in section.items:
            for part in item.items if isinstance(item, Abreast) else (item,):
                if isinstance(part, Picture):
                    yield part


def draw(picture: Picture, target: Path) -> int:
    """Write a figure as a PNG with few colours; return its size in bytes.

    Raises
    ------
    ValueError
        The picture would be larger than a page of documentation should load.
    """
    stream = io.BytesIO()
    picture.figure.savefig(stream, format="png", dpi=DPI, metadata={"Software": None})
    image = Image.open(stream).convert("RGB")
    image.quantize(COLOURS, method=Image.Quantize.FASTOCTREE).save(target, optimize=True)
    size = target.stat().st_size
    if size > MOST:
        raise ValueError(f"{target}: {size} bytes, at most {MOST} are wanted")
    return size


def main(processed: Path, reports: Path, folder: Path) -> None:
    """Draw all figures; a caption that no report has is an error."""
    for batch in sorted({shown.batch for shown in FIGURES}):
        drawn = list(pictures(read_results(processed / batch, reports / batch, {}, "")))
        for shown in (one for one in FIGURES if one.batch == batch):
            picture = next((one for one in drawn if shown.caption in one.caption), None)
            if picture is None:
                raise SystemExit(f"{batch}: no figure says {shown.caption!r}")
            print(shown.name, draw(picture, folder / f"{shown.name}.png"), picture.caption)


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:4]))
