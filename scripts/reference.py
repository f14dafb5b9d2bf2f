"""Write the reference of every key, column and effect: ``python scripts/reference.py docs``.

The same call writes what ``batch.yaml`` may declare of effects, which the check of a batch reads.

What a key may be comes from the schema, what an effect is from its file, what each key, column and parameter
means from ``reference.yaml`` beside this file; one without a meaning, and a meaning without one, are errors.
"""

import json
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import yaml
from reference_effects import effects_page, row

from metro.batch.columns import TABLES, Column
from metro.batch.known import REGISTRY, registry
from metro.batch.ranges import KINDS, bounds, number_in_words, schema
from metro.effects.library import library
from metro.units import JSON

ROOT = Path(__file__).parents[1]
DECLARED = ROOT / "src/metro/batch" / REGISTRY
MEANINGS = Path(__file__).with_suffix(".yaml")
NAMED = {"files": "pattern", "columns": "column"}  # object with keys of one's own → what these are
PARAMETERS = "[effects](reference-effects.md)"
NOTE = "<!-- Made by `python scripts/reference.py docs`: change the schemas or scripts/reference.yaml. -->\n"


def main(folder: str) -> None:
    """Write the pages into a folder."""
    for name, text in pages().items():
        (Path(folder) / name).write_text(text, encoding="utf-8")
    DECLARED.write_text(declared(), encoding="utf-8")


def declared() -> str:
    """Return what can be declared of the effects of this package, as JSON: one line each."""
    own = [effect for effect in library() if effect.apply.__module__.startswith("metro.")]
    lines = [f"  {json.dumps(name)}: {json.dumps(entry)}" for name, entry in registry(own).items()]
    return "{\n" + ",\n".join(lines) + "\n}\n"


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
        *reasons(),
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
    found = {path: (inner, needed) for path, inner, needed in walk(schema(name))}
    if set(found) != set(meanings):
        raise ValueError(f"{MEANINGS.name}, {name}: differ in {sorted(set(found) ^ set(meanings))}")
    head = ["key", "required", "value", *(["default"] if defaults else []), "meaning"]
    lines = [f"## {title}\n", row(head), row(["---"] * len(head))]
    for path, (inner, needed) in found.items():
        default = [f"`{defaults[path]}`" if path in defaults else ""] if defaults else []
        lines.append(row([f"`{path}`", "yes" if needed else "", allowed(inner), *default, meanings[path]]))
    if "known" in found:
        effects = ", ".join(f"`{effect}`" for effect in json.loads(declared()))
        lines += ["", f"Keys of `known`: {effects}; their parameters: {PARAMETERS}."]
    return [*lines, ""]


def walk(schema: JSON, above: str = "") -> Iterator[tuple[str, JSON, bool]]:
    """Yield (path of keys, schema, whether required) of every key; an object's own keys after it.

    Keys that anybody may choose are in angle brackets.
    """
    for key, inner in schema.get("properties", {}).items():
        yield f"{above}{key}", inner, key in schema.get("required", ())
        yield from walk(inner, f"{above}{key}.")
        each = inner.get("additionalProperties")
        if isinstance(each, dict) and "properties" in each:
            entry = f"{above}{key}.<{NAMED[key]}>"
            if isinstance(each["type"], list):  # the entry has a short form, too
                yield entry, each, False
            yield from walk(each, f"{entry}.")


def allowed(rule: JSON) -> str:
    """Say in words what a rule allows."""
    # A reference is to keys that several parts of the schema share: what they are is in the meaning.
    rule = {"type": "object"} if "$ref" in rule else rule
    if "const" in rule:
        return f"`{rule['const']}`"
    if "enum" in rule:
        return ", ".join(f"`{value}`" for value in rule["enum"])
    if rule["type"] == "array":
        least, most = rule.get("minItems", 0), rule.get("maxItems")
        size = f"{least}" if least == most else f"{least} to {most}" if most else f"{least} or more"
        return f"list of {size}, each {allowed(rule['items'])}"
    if isinstance(rule["type"], list):
        return str(rule["description"])
    if rule["type"] in KINDS:
        return number_in_words(rule)
    longest = f", at most {rule['maxLength']} characters" if "maxLength" in rule else ""
    words = {"string": f"text{longest}", "object": "keys"}.get(rule["type"], rule["type"])
    return str(rule.get("description", words))


def reasons() -> list[str]:
    """Return the section that says why each number has the range that it has, line by line."""
    rows = [
        [f"`{name}`", bounds(rule), rule["description"]] for name, rule in schema("ranges")["$defs"].items()
    ]
    return [
        "## Ranges, and why\n",
        row(["quantity", "range", "reason"]),
        row(["---"] * 3),
        *map(row, rows),
        "",
    ]


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
