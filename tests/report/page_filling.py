"""How full the pages of a PDF are, and how large its letters: measured from its objects."""

import ctypes
import math

import pypdfium2
from pypdfium2 import raw

TOP, BOTTOM = 18 * 72 / 25.4, 14 * 72 / 25.4  # margins of the template, points
LINE = 14.0  # a gap of less is between two lines, points


def empty_shares(pdf):
    """Return of each page the share of its height, between the margins, that nothing is drawn in."""
    return [_empty(page) for page in pypdfium2.PdfDocument(pdf)]


def _empty(page):
    height = page.get_height()
    low, high = TOP, height - BOTTOM
    bounds = (each.get_bounds() for each in page.get_objects(max_depth=1))
    bands = sorted((height - top, height - bottom) for _, bottom, _, top in bounds)
    at, empty = low, 0.0
    for first, last in [
        *((max(a, low), min(b, high)) for a, b in bands if b > low and a < high),
        (high, high),
    ]:
        empty += first - at if first - at > LINE else 0.0
        at = max(at, last)
    return empty / (high - low)


def least_letters(pdf):
    """Return the size of the smallest text of a PDF in points; figures hold no text but outlines."""
    sizes = set()
    for page in pypdfium2.PdfDocument(pdf):
        for each in page.get_objects([raw.FPDF_PAGEOBJ_TEXT]):
            size = ctypes.c_float()
            raw.FPDFTextObj_GetFontSize(each, size)
            matrix = each.get_matrix()
            sizes.add(size.value * math.hypot(matrix.c, matrix.d))
    return min(sizes)
