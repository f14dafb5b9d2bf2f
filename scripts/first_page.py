"""Draw the first page of a report: ``python scripts/first_page.py REPORT.pdf PICTURE.png``."""

import sys
from pathlib import Path

import pypdfium2
from PIL.Image import Quantize

WIDTH, COLOURS = 900, 128  # pixels; of the palette: print, with a few accents
MOST = 150_000  # bytes


def picture(report: Path, target: Path) -> int:
    """Write page 1 of ``report`` to ``target``; return its size in bytes.

    Raises
    ------
    ValueError
        The picture would be larger than a page of documentation should load.
    """
    with pypdfium2.PdfDocument(report) as document:
        page = document[0]
        image = page.render(scale=WIDTH / page.get_width()).to_pil()
    image.convert("RGB").quantize(COLOURS, method=Quantize.FASTOCTREE).save(target, optimize=True)
    size = target.stat().st_size
    if size > MOST:
        raise ValueError(f"{target}: {size} bytes, at most {MOST} are wanted")
    return size


if __name__ == "__main__":
    print(picture(Path(sys.argv[1]), Path(sys.argv[2])))
