"""``python -m virtual_cell``: make raw batches.

python -m virtual_cell bundled data/raw python -m virtual_cell force data/raw/blind-3 --effect tool_runout
--seed 3 python -m virtual_cell force data/raw/blind-4 --effect tool_wear edge_growth_per_m=0.1 --seed 4
--truth sealed.json python -m virtual_cell lobes data/raw/blind-5 --effect mode_coupling --seed 5
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Collection
from pathlib import Path

from virtual_cell.batches import bundled
from virtual_cell.blind import KINDS
from virtual_cell.hidden import Parameters
from virtual_cell.recipes.force import STYLES


def main(arguments: list[str] | None = None) -> None:
    """Run the command line."""
    options = _parser().parse_args(arguments)
    if options.command == "bundled":
        bundled(options.root)
        return
    if options.command == "effects":
        print(json.dumps({name: dict(recipe.effects) for name, recipe in KINDS.items()}))
        return
    recipe = KINDS[options.command]
    hidden = dict(_effect(words, recipe.hides(options.style)) for words in options.effect)
    truth = recipe.make(options.folder, hidden, options.seed, options.style)
    path = options.truth or options.folder.parent / f"{options.folder.name}.truth.json"
    path.write_text(json.dumps(truth, indent=1) + "\n")


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m virtual_cell", description="Simulate raw batches.")
    commands = parser.add_subparsers(dest="command", required=True)
    every = commands.add_parser("bundled", help="remake the bundled batches")
    every.add_argument("root", type=Path)
    commands.add_parser("effects", help="list as JSON what each kind of batch can hide, with its parameters")
    for name, recipe in KINDS.items():
        hidden = ", ".join(dict.fromkeys([*recipe.effects, *recipe.harder]))
        one = commands.add_parser(
            name, help=f"make a {name} batch; the truth goes beside the folder, not into it"
        )
        one.add_argument("folder", type=Path)
        one.add_argument(
            *("-e", "--effect"),
            action="append",
            nargs="+",
            default=[],
            metavar=("NAME", "PARAMETER=VALUE"),
            help="hide an effect, its parameters as given or drawn; may be repeated: " + hidden,
        )
        one.add_argument("--seed", type=int, default=0)
        one.add_argument("--style", choices=STYLES, default="a", help="how it is measured")
        one.add_argument("--truth", type=Path, help="where to write the truth")
    return parser


def _effect(words: list[str], known: Collection[str]) -> tuple[str, Parameters | None]:
    """Read ``NAME PARAMETER=VALUE …``; values are JSON."""
    name, *settings = words
    if name not in known:
        raise SystemExit(f"no effect {name!r}; known are {', '.join(known)}")
    return name, {key: json.loads(value) for key, value in (s.split("=", 1) for s in settings)} or None


if __name__ == "__main__":
    main()
