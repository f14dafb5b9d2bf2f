"""Where the workflow is: in this folder, in the checkout that metro runs from, or installed beside it."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

from metro.commands.calls import wrong_call

HERE = Path("Snakefile")
CHECKOUT = Path(__file__).resolve().parents[3] / "Snakefile"
DISTRIBUTION, INSTALLED = "metro-machining", "share/metro/Snakefile"
TARGET = Path(__file__).resolve().parents[2] / INSTALLED  # of pip's --target, which moves it after its record


def workflow_file(given: Path | None = None) -> Path:
    """Return the file of the workflow.

    Parameters
    ----------
    given : the one that the user names; None: that of this folder, else of the checkout or the installation.

    Raises
    ------
    CallError
        There is none.
    """
    if given is not None:
        if not given.is_file():
            raise wrong_call("--snakefile", f"{given} is not there")
        return given
    present = next((path for path in (HERE, CHECKOUT, TARGET, *_installed()) if path.is_file()), None)
    if present is None:
        message = "is not there: metro is installed without its workflow; name it with --snakefile"
        raise wrong_call(str(HERE), message)
    return present


def _installed() -> list[Path]:
    """Return the workflow that the installed package brought along, if it did."""
    try:
        files = distribution(DISTRIBUTION).files or []
    except PackageNotFoundError:
        return []
    return [Path(str(file.locate())).resolve() for file in files if file.as_posix().endswith(INSTALLED)]
