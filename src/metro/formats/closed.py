"""Files of programs that nobody describes: what to export from the program instead."""

from __future__ import annotations

# Suffix → what such a file is, and what its program exports that can be read.
CLOSED = {
    ".ks1": ("a binary record of Kyowa's DCS-100A or PCD", "export it as CSV from that program"),
    ".ks2": ("a binary record of Kyowa's DCS-100A or PCD", "export it as CSV from that program"),
    ".dwd": ("a binary record of DynoWare", "export it as text from DynoWare, with time and units"),
}


def closed(suffix: str) -> str:
    """Say what a file of this suffix is and what to do; "" where the suffix is not of such a program."""
    found, instead = CLOSED.get(suffix.lower(), ("", ""))
    return f"is {found}, whose format is not published: {instead}" if found else ""
