"""The seal: a hash of the truth, published before anything is run, so that nobody can change the truth after.

The truth holds random salt: without it, the few possible truths could be hashed until one fits.
"""

from __future__ import annotations

import hashlib
import json
import secrets
from pathlib import Path

from metro.units import JSON


class BrokenSealError(RuntimeError):
    """The truth is not the one that was sealed."""


def close(truth: JSON, file: Path, seal: Path) -> str:
    """Write the truth with salt, and its SHA-256 to ``seal``; return the 64 hexadecimal digits."""
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(json.dumps({"salt": secrets.token_hex(32), **truth}, indent=1) + "\n")
    digest = _digest(file)
    seal.write_text(digest + "\n")
    return digest


def unseal(file: Path, seal: Path) -> JSON:
    """Return the truth.

    Raises
    ------
    BrokenSealError
        Its SHA-256 is not the one in ``seal``.
    """
    published, actual = seal.read_text().strip(), _digest(file)
    if actual != published:
        raise BrokenSealError(f"{file}: its SHA-256 is {actual}, {seal} says {published}: it was changed")
    truth: JSON = json.loads(file.read_text())
    return truth


def _digest(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()
