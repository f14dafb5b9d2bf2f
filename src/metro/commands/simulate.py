"""``metro simulate``: a batch of the virtual cell, to try everything on.

The simulator shares no code with the models that are to identify the effects that it hides. It is another
program, and it is called as one.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from metro.batch.findings import BatchError, Finding
from metro.batch.whole_folder import whole_folder
from metro.batch.writing import write_atomically
from metro.commands.calls import require_name, wrong_call
from metro.commands.hidden import Style, hidden, simulated, simulator
from metro.commands.output import print_json
from metro.spelling import suggestion


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
    """Write a simulated batch, and outside the raw data a file of the effects that it hides.

    Parameters
    ----------
    kind : what is measured in it: force, lobes, flatness, joint_force, deformation, waviness or study.
    effects : ``NAME``, whose parameters are drawn, or ``NAME:PARAMETER=VALUE,…``, with all of them given.

    Raises
    ------
    CallError
        The name is no name for a batch; there is no such kind, effect or parameter; or a value is not valid.
    ContractError
        The folder exists already, or the simulator is not installed, or the simulator refuses.
    """
    folder = root / name
    require_name(name)
    kinds = simulated()
    if kind not in kinds:
        expected = suggestion(kind, kinds) or f", expected one of: {', '.join(kinds)}"
        raise wrong_call("--kind", f"found {kind!r}{expected}")
    chosen = [word for effect in effects for word in ("--effect", *hidden(effect, kind))]
    if folder.exists():
        raise BatchError([Finding("error", str(folder), "is there already: choose another name")])
    secret = truth / f"{name}.truth.json"
    with whole_folder(folder) as filled:
        hidden_file = filled.with_suffix(".truth.json")
        _call(kind, filled, ("--seed", str(seed), "--style", style, "--truth", str(hidden_file), *chosen))
        write_atomically(secret, lambda stream: stream.write(hidden_file.read_bytes()))
    if as_json:
        print_json({"batch": name, "folder": str(folder), "truth": str(secret)})
        return
    sys.stdout.write(f"Created {folder}. The hidden effects are listed in {secret}. Next: run snakemake.\n")


def _call(kind: str, folder: Path, options: Sequence[str]) -> None:
    """Let the simulator fill a folder."""
    # The tool is drawn by the seed: how many teeth it has is not known before.
    teeth = " (pitch_deg takes a number for each tooth)" if "pitch_deg" in " ".join(options) else ""
    simulator(f"could not make the batch{teeth}", kind, str(folder), *options)
