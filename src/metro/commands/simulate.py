"""``metro simulate``: a batch of the virtual cell, to try everything on.

The simulator shares no code with the models that are to find what it hides: it is another program, and is
called as one.
"""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from metro.batch.discover import NAME, NAME_IN_WORDS
from metro.batch.findings import BatchError, ContractError, Finding
from metro.batch.whole_folder import whole_folder
from metro.batch.writing import write_atomically
from metro.commands.completion import OBSERVABLES
from metro.commands.output import print_json

PROGRAM = "virtual_cell"


def simulate(
    name: str,
    *,
    kind: str,
    effects: Sequence[str],
    seed: int,
    style: str,
    root: Path,
    truth: Path,
    as_json: bool,
) -> None:
    """Write a simulated batch, and beside the raw root what it hides.

    Parameters
    ----------
    kind : what is measured in it: force, lobes, flatness, joint_force, deformation or waviness.
    effects : ``NAME``, its parameters drawn, or ``NAME:PARAMETER=VALUE,…``, all of them given.

    Raises
    ------
    ContractError
        The name is not one of a batch, the folder is there already, or the simulator is not, or refuses.
    """
    folder = root / name
    if not NAME.fullmatch(name):
        raise BatchError([Finding("error", name, f"is no name for a batch: it is made of {NAME_IN_WORDS}")])
    if kind not in OBSERVABLES:
        expected = f"found {kind!r}, expected one of: {', '.join(OBSERVABLES)}"
        raise BatchError([Finding("error", "--kind", expected)])
    if folder.exists():
        raise BatchError([Finding("error", str(folder), "is there already: choose another name")])
    if importlib.util.find_spec(PROGRAM) is None:
        message = "the simulator is not installed: it comes with metro-machining; install that package again"
        raise ContractError([Finding("error", PROGRAM, message)])
    secret = truth / f"{name}.truth.json"
    with whole_folder(folder) as filled:
        told = filled.with_suffix(".truth.json")
        _call(kind, filled, effects, ("--seed", str(seed), "--style", style, "--truth", str(told)))
        write_atomically(secret, lambda stream: stream.write(told.read_bytes()))
    if as_json:
        print_json({"batch": name, "folder": str(folder), "truth": str(secret)})
        return
    sys.stdout.write(f"{folder} is there. What it hides stands in {secret}. Call: snakemake\n")


def _call(kind: str, folder: Path, effects: Sequence[str], options: Sequence[str]) -> None:
    """Let the simulator fill a folder."""
    command = [sys.executable, "-m", PROGRAM, kind, str(folder), *options]
    for effect in effects:
        hidden, _, settings = effect.partition(":")
        command += ["--effect", hidden, *filter(None, settings.split(","))]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        said = (done.stderr.strip() or "it failed without a word").splitlines()[-1]
        wrong = " (the parameters of an effect are given all, or none)" if said.startswith("KeyError") else ""
        raise ContractError([Finding("error", PROGRAM, said + wrong)])
