"""The batches that can be made: the bundled ones, by name."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from virtual_cell.recipes import bottom, chatter, irb6640, irb6640_setup, kr160, slot, trimule
from virtual_cell.write import Row

BUNDLED: dict[str, Callable[[Path], Row]] = {
    "clean-slot": slot.make,
    "irb6640-face": irb6640.make,
    "irb6640-setup": irb6640_setup.make,
    "kr160-side": kr160.make,
    "trimule-bottom": bottom.make,
    "trimule-chatter": chatter.make,
    "trimule-helical": trimule.make,
}


def bundled(root: Path) -> list[Row]:
    """Make every bundled batch under ``root``; return their truths."""
    return [make(root / name) for name, make in BUNDLED.items()]
