"""The commit under test: what it is, that nothing of it is changed, and the seed that follows from it."""

from __future__ import annotations

import hashlib
import subprocess
from pathlib import Path

UNDER_TEST = ("src", "virtual_cell", "proof", "config")  # what a verdict and its judgement are made by


class UncommittedError(RuntimeError):
    """What would be judged is no commit."""


def under_test(checkout: Path) -> str:
    """Return the hash of the commit that is checked out.

    Raises
    ------
    UncommittedError
        Something of the code under test is not committed: then the hash does not say what is judged.
    """
    changed = _git(checkout, "status", "--porcelain", "--untracked-files=all", "--", *UNDER_TEST)
    if changed:
        first = changed.splitlines()[0][3:]
        raise UncommittedError(f"commit first: {first} is not as in the commit that would be judged")
    return _git(checkout, "rev-parse", "HEAD").strip()


def unchanged(checkout: Path, commit: str) -> None:
    """Check that the code is still that of a commit; others that change none of it may have followed.

    Raises
    ------
    UncommittedError
        The code was changed meanwhile.
    """
    under_test(checkout)
    changed = _git(checkout, "diff", "--name-only", commit, "HEAD", "--", *UNDER_TEST)
    if changed:
        raise UncommittedError(
            f"{changed.splitlines()[0]} was changed since {commit}, which was to be judged"
        )


def seed_of(commit: str, observable: str) -> int:
    """Return the seed of a judged suite: the first 32 bits of the SHA-256 of "<commit> <observable>"."""
    return int(hashlib.sha256(f"{commit} {observable}".encode()).hexdigest()[:8], 16)


def _git(checkout: Path, *arguments: str) -> str:
    done = subprocess.run(["git", *arguments], cwd=checkout, check=True, capture_output=True, text=True)
    return done.stdout
