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

from metro.batch.findings import BatchError, ContractError, Finding, suggestion
from metro.batch.whole_folder import whole_folder
from metro.batch.writing import write_atomically
from metro.commands.calls import require_name, wrong_call
from metro.commands.hidden import EFFECTS, Style, hidden
from metro.commands.output import print_json

PROGRAM = "virtual_cell"


def simulate(
    name: str,
    *,
    kind: str,
    effects: Sequence[str],
    seed: int,
    style: Style,
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
    CallError
        The name is not one of a batch; there is no such kind, effect or parameter, or a value is not one.
    ContractError
        The folder is there already, or the simulator is not, or refuses.
    """
    folder = root / name
    require_name(name)
    if kind not in EFFECTS:
        expected = suggestion(kind, EFFECTS) or f", expected one of: {', '.join(EFFECTS)}"
        raise wrong_call("--kind", f"found {kind!r}{expected}")
    chosen = [word for effect in effects for word in ("--effect", *hidden(effect, kind))]
    if folder.exists():
        raise BatchError([Finding("error", str(folder), "is there already: choose another name")])
    if importlib.util.find_spec(PROGRAM) is None:
        message = "the simulator is not installed: it comes with metro-machining; install that package again"
        raise ContractError([Finding("error", PROGRAM, message)])
    secret = truth / f"{name}.truth.json"
    with whole_folder(folder) as filled:
        told = filled.with_suffix(".truth.json")
        _call(kind, filled, ("--seed", str(seed), "--style", style, "--truth", str(told), *chosen))
        write_atomically(secret, lambda stream: stream.write(told.read_bytes()))
    if as_json:
        print_json({"batch": name, "folder": str(folder), "truth": str(secret)})
        return
    sys.stdout.write(f"{folder} is there. What it hides stands in {secret}. Call: snakemake\n")


def _call(kind: str, folder: Path, options: Sequence[str]) -> None:
    """Let the simulator fill a folder."""
    command = [sys.executable, "-m", PROGRAM, kind, str(folder), *options]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        said = (done.stderr.strip() or "it failed without a word").splitlines()[-1]
        # The tool is drawn by the seed: how many teeth it has is not known before.
        teeth = " (pitch_deg takes a number for each tooth)" if "pitch_deg" in " ".join(options) else ""
        raise ContractError([Finding("error", PROGRAM, f"could not make the batch{teeth}: {said}")])
