"""Characters that the report's own fonts lack: a font of this machine has them, or brackets name them."""

from __future__ import annotations

import functools
import re
import unicodedata
from collections.abc import Iterable
from pathlib import Path

PRIVATE = "Co"  # category of characters that mean what a font says: an archival PDF must not have them
NAMED = "S"  # of symbols, emoji among them: their Unicode name says what they show
LONGEST_WORD = 40  # characters of a word in a figure: a longer one would push the panels off the page
KEPT = 18  # characters of a longer one that are kept at either end
MOST_CODES = 60  # code points of one run that are written: some lines of a page
STYLED = ("bold", "oblique", "italic", "black", "light", "thin")  # in names of fonts that are not the upright


@functools.cache
def machine_fonts() -> tuple[Path, ...]:
    """Return the font files of this machine in a fixed order, upright ones of normal weight first."""
    from matplotlib import font_manager

    files = {Path(file) for file in font_manager.findSystemFonts()}
    return tuple(sorted(files, key=lambda file: (_styled(file), file.name, str(file))))


def _styled(file: Path) -> bool:
    """Return whether a font's name says that it is bold or slanted."""
    return any(word in file.stem.lower() for word in STYLED)


@functools.cache
def coverage(font: Path) -> frozenset[int]:
    """Return the code points that a font file (of a collection, the first font) has outlines for.

    Coloured bitmaps of emoji are no outlines.
    """
    from matplotlib.ft2font import FaceFlags, FT2Font

    try:
        opened = FT2Font(str(font))
    except (RuntimeError, OSError, ValueError):
        return frozenset()
    return frozenset(opened.get_charmap()) if FaceFlags.SCALABLE in opened.face_flags else frozenset()


def fonts_with(characters: Iterable[str], fonts: Iterable[Path] | None = None) -> tuple[Path, ...]:
    """Return the fewest fonts that have as many of the characters as any have: the best first, greedily.

    Parameters
    ----------
    fonts : the files to choose from; those of this machine where left out.
    """
    among = machine_fonts() if fonts is None else tuple(fonts)
    wanted = {ord(character) for character in characters if unicodedata.category(character) != PRIVATE}
    chosen: list[Path] = []
    while wanted and among:
        best = max(among, key=lambda font: len(wanted & coverage(font)))
        if not wanted & coverage(best):
            break
        chosen.append(best)
        wanted -= coverage(best)
    return tuple(chosen)


def without(text: str, missing: Iterable[str]) -> str:
    """Return a text in which runs of missing characters are written in brackets.

    A symbol by its Unicode name, ``[rocket]``, any other by its code point, ``[U+6D4B U+91CF]``; of a run of
    more than ``MOST_CODES`` the first of them, and how many there are.
    """
    lacked = "".join(sorted(set(missing)))
    if not lacked:
        return text
    return re.sub(f"[{re.escape(lacked)}]+", lambda run: f"[{_in_words(run[0])}]", text)


def _in_words(run: str) -> str:
    words = []
    for character in run[:MOST_CODES]:
        symbol = unicodedata.category(character).startswith(NAMED)
        name = unicodedata.name(character, "") if symbol else ""
        words.append(name.lower() or f"U+{ord(character):04X}")
    if len(run) > MOST_CODES:
        words.append(f"… {len(run)} characters")
    return " ".join(words)


def shortened(text: str) -> str:
    """Return a text whose very long words have an ellipsis in their middle."""
    return re.sub(rf"\S{{{LONGEST_WORD + 1},}}", lambda word: f"{word[0][:KEPT]}…{word[0][-KEPT:]}", text)
