"""Write the reference of every key, column and effect: ``python scripts/reference.py docs``.

What a key may be comes from the schema, what an effect is from its file, what each key, column and parameter
means from ``reference.yaml`` beside this file; one without a meaning, and a meaning without one, are errors.
"""

import json
import sys
from collections.abc import Iterator, Mapping, Sequence
from importlib.resources import files
from pathlib import Path

import yaml
from reference_effects import effects_page, row

from metro.batch.columns import TABLES, Column
from metro.units import JSON

ROOT = Path(__file__).parents[1]
MEANINGS = Path(__file__).with_suffix(".yaml")
BOUNDS = {"exclusiveMinimum": ">", "minimum": "≥", "exclusiveMaximum": "<", "maximum": "≤"}
PARAMETERS = "[effects](reference-effects.md)"
NOTE = "<!-- Made by `python scripts/reference.py docs`: change the schemas or scripts/reference.yaml. -->\n"


def main(folder: str) -> None:
    """Write the pages into a folder."""
    for name, text in pages().items():
        (Path(folder) / name).write_text(text, encoding="utf-8")


def pages() -> dict[str, str]:
    """Return the pages, text by file name."""
    meanings = yaml.safe_load(MEANINGS.read_text(encoding="utf-8"))
    batch = [
        "# Reference: batch.yaml, cell.yaml and the tables\n",
        NOTE,
        "Frames, signs and zeros: [data contract](data-contract.md#signs-frames-and-zeros).\n",
        *keys("batch.yaml", "batch", meanings["batch"]),
        *keys("cell.yaml", "cell", meanings["cell"]),
        *columns(TABLES, meanings["columns"]),
    ]
    config = [
        "# Reference: config/config.yaml\n",
        NOTE,
        "Another file: `snakemake --configfile mine.yaml` ([running the workflow](running.md)). "
        "An unknown key is an error.\n",
        *keys("config/config.yaml", "config", meanings["config"], _defaults()),
    ]
    return {
        "reference-batch.md": "\n".join(batch),
        "reference-config.md": "\n".join(config),
        "reference-effects.md": effects_page(NOTE, meanings["effects"]),
    }


def keys(title: str, name: str, meanings: JSON, defaults: dict[str, str] | None = None) -> list[str]:
    """Return the section of a schema, line by line.

    Raises
    ------
    ValueError
        A key has no meaning, or a meaning has no key.
    """
    schema = json.loads(files("metro.batch").joinpath(f"schemas/{name}.json").read_text(encoding="utf-8"))
    every = {path: (inner, needed) for path, inner, needed in walk(schema)}
    found = {path: each for path, each in every.items() if not path.startswith("known.")}
    if set(found) != set(meanings):
        raise ValueError(f"{MEANINGS.name}, {name}: differ in {sorted(set(found) ^ set(meanings))}")
    head = ["key", "required", "value", *(["default"] if defaults else []), "meaning"]
    lines = [f"## {title}\n", row(head), row(["---"] * len(head))]
    for path, (inner, needed) in found.items():
        default = [f"`{defaults[path]}`" if path in defaults else ""] if defaults else []
        lines.append(row([f"`{path}`", "yes" if needed else "", allowed(inner), *default, meanings[path]]))
    effects = ", ".join(f"`{path.removeprefix('known.')}`" for path in every if path not in found)
    return [
        *lines,
        *(["", f"Keys of `known`: {effects}; their parameters: {PARAMETERS}."] * bool(effects)),
        "",
    ]


def walk(schema: JSON, above: str = "") -> Iterator[tuple[str, JSON, bool]]:
    """Yield (path of keys, schema, whether required) of every key; an object's own keys after it."""
    for key, inner in schema.get("properties", {}).items():
        yield f"{above}{key}", inner, key in schema.get("required", ())
        yield from walk(inner, f"{above}{key}.")


def allowed(schema: JSON) -> str:
    """Say in words what a schema allows."""
    if "const" in schema:
        return f"`{schema['const']}`"
    if "enum" in schema:
        return ", ".join(f"`{value}`" for value in schema["enum"])
    if schema["type"] == "array":
        least, most = schema.get("minItems", 0), schema.get("maxItems")
        return f"list of {least}{'' if least == most else ' or more'}, each {allowed(schema['items'])}"
    bounds = " and".join(f" {sign} {schema[name]:g}" for name, sign in BOUNDS.items() if name in schema)
    words = {"string": "text", "object": "keys"}.get(schema["type"], schema["type"])
    return f"{schema.get('description', words)}{bounds}"


def columns(tables: Mapping[str, Sequence[Column]], meanings: Mapping[str, str]) -> list[str]:
    """Return the sections of the tables, line by line.

    Raises
    ------
    ValueError
        A column has no meaning, or a meaning has no column.
    """
    named = {f"{name}.{column.name}" for name, table in tables.items() for column in table}
    if named != set(meanings):
        raise ValueError(f"{MEANINGS.name}, columns: differ in {sorted(named ^ set(meanings))}")
    lines = []
    for name, table in tables.items():
        lines += [f"## {name}.csv\n", row(["column", "required", "cell", "meaning"]), row(["---"] * 4)]
        for column in table:
            needed, meaning = "yes" if column.required else "", meanings[f"{name}.{column.name}"]
            lines.append(row([f"`{column.name}`", needed, column.expected, meaning]))
        lines.append("")
    return lines


def _defaults() -> dict[str, str]:
    """Return the settings that the checkout comes with, by path of keys."""
    content = yaml.safe_load((ROOT / "config/config.yaml").read_text(encoding="utf-8"))
    parts = {name: part for name, part in content.items() if isinstance(part, dict)}
    inner = {f"{name}.{key}": value for name, part in parts.items() for key, value in part.items()}
    flat = {key: value for key, value in content.items() if key not in parts}
    return {key: json.dumps(value) for key, value in (flat | inner).items()}


if __name__ == "__main__":
    main(sys.argv[1])
