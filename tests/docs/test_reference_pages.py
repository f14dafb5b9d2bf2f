"""The reference of keys is that of the schemas."""

import re
import runpy
from pathlib import Path

import pytest
import yaml

from metro.batch.columns import TABLES
from metro.effects.library import library

ROOT = Path(__file__).parents[2]
reference = runpy.run_path(str(ROOT / "scripts/reference.py"))


@pytest.mark.parametrize("name", sorted(reference["pages"]()))
def test_the_page_is_current(name):
    written = (ROOT / "docs" / name).read_text(encoding="utf-8")
    assert written == reference["pages"]()[name], "python scripts/reference.py docs"


def test_every_column_and_setting_is_on_a_page():
    batch, config = (reference["pages"]()[f"reference-{name}.md"] for name in ("batch", "config"))
    assert {c.name for table in TABLES.values() for c in table} <= set(
        re.findall(r"^\| `(\w+)`", batch, re.M)
    )
    settings = yaml.safe_load((ROOT / "config/config.yaml").read_text())
    assert {f"loop.{key}" for key in settings["loop"]} <= set(re.findall(r"^\| `([\w.]+)`", config, re.M))


def test_the_contract_has_every_effect_with_its_parameters_and_every_column_of_the_runs():
    """The contract's tables are written by hand, for programs that know no code of this one."""
    contract = (ROOT / "docs/data-contract.md").read_text(encoding="utf-8")
    table = contract.partition("### Effect names and parameters")[2]
    rows = re.findall(r"^\| (\w+) \| (.*) \| (.*) \|$", table, re.MULTILINE)
    told = {name: (set(re.findall(r"[a-z_]{5,}", where)), what) for name, where, what in rows}
    del told["effect"]
    own = [effect for effect in library() if not effect.resembled and is_own(effect)]
    assert set(told) == {effect.name for effect in own}
    for effect in own:
        where, what = told[effect.name]
        assert set(effect.observables) <= where
        assert set(effect.names) | set(effect.where) <= set(re.findall(r"\w+", what)), effect.name
    of_runs = contract.partition("### runs.csv")[2].partition("\nTables may be")[0]
    named = " ".join(re.findall(r"^\| (.*?) \|", of_runs, re.MULTILINE))
    assert {column.name for column in TABLES["runs"]} <= set(re.findall(r"\w+", named))


def is_own(effect):
    return effect.apply.__module__.startswith("metro.")


def test_every_effect_is_on_the_page_with_all_that_tells_it():
    page = reference["pages"]()["reference-effects.md"]
    effects, alternatives = page.split("\n## Alternative explanations")
    for effect in filter(is_own, library()):
        part = alternatives if effect.resembled else effects
        section = re.search(rf"^### {effect.name}$.*?(?=^###|\Z)", part, re.DOTALL | re.MULTILINE)[0]
        told = (effect.signature, effect.experiment, effect.literature, *effect.observables)
        assert [each for each in told if each not in section] == []
        assert {f"| `{name}` |" in section for name in effect.names} == {True}


@pytest.mark.parametrize("part", ["columns", "effects"])
def test_a_column_or_a_parameter_without_a_meaning_is_an_error(part):
    meanings = yaml.safe_load((ROOT / "scripts/reference.yaml").read_text())[part]
    (first, *others) = meanings
    kept = {name: meanings[name] for name in others}
    with pytest.raises(ValueError, match=re.escape(first)):
        reference["columns"](TABLES, kept) if part == "columns" else reference["effects_page"]("", kept)


def test_a_key_without_a_meaning_is_an_error():
    meanings = yaml.safe_load((ROOT / "scripts/reference.yaml").read_text())["cell"]
    with pytest.raises(ValueError, match=r"arm\.dh"):
        reference["keys"]("cell.yaml", "cell", {k: v for k, v in meanings.items() if k != "arm.dh"})


@pytest.mark.parametrize(
    ("schema", "words"),
    [
        ({"type": "number", "exclusiveMinimum": 0, "exclusiveMaximum": 1}, "a number > 0 and < 1"),
        ({"enum": ["yes", "no"]}, "`yes`, `no`"),
        (
            {"type": "array", "minItems": 3, "maxItems": 3, "items": {"type": "number"}},
            "list of 3, each a number",
        ),
        ({"type": "array", "minItems": 1, "items": {"type": "string"}}, "list of 1 or more, each text"),
    ],
)
def test_what_a_key_may_be_is_said_in_words(schema, words):
    assert reference["allowed"](schema) == words
