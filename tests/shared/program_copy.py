"""A copy of the program to run a workflow in."""

import shutil
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def copy_program(folder):
    """Copy what a checkout needs to run: Snakefile, rules, profiles, settings and source."""
    shutil.copy(ROOT / "Snakefile", folder)
    for name in ("workflow", "profiles", "config", "src"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
