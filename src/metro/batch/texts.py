"""Texts that people write: the characters that none of them may hold."""

from __future__ import annotations

import unicodedata

LAYOUT = "\n\t"  # control characters of a text of several lines


def strange_character(text: str) -> str:
    """Describe the first character that is no part of a text; "" where all are.

    Control characters end texts, move a cursor or are not allowed in a PDF; halves of a surrogate pair cannot
    be written as UTF-8 at all; 66 code points are set aside by Unicode as no characters.
    """
    for place, character in enumerate(text, 1):
        kind = unicodedata.category(character)
        code = ord(character)
        if kind == "Cs" or (kind == "Cc" and character not in LAYOUT) or _no_character(code):
            return f"found the character U+{code:04X} (place {place} of the text)"
    return ""


def _no_character(code: int) -> bool:
    """Return whether a code point is one that Unicode sets aside for good."""
    return 0xFDD0 <= code <= 0xFDEF or code & 0xFFFE == 0xFFFE
