"""The reference of keys is that of the schemas."""

import re
import runpy
from pathlib import Path

import pytest
import yaml

from metro.batch.columns import TABLES

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


def test_a_key_without_a_meaning_is_an_error():
    meanings = yaml.safe_load((ROOT / "scripts/reference.yaml").read_text())["cell"]
    with pytest.raises(ValueError, match=r"arm\.dh"):
        reference["keys"]("cell.yaml", "cell", {k: v for k, v in meanings.items() if k != "arm.dh"})


@pytest.mark.parametrize(
    ("schema", "words"),
    [
        ({"type": "number", "exclusiveMinimum": 0, "exclusiveMaximum": 1}, "number > 0 and < 1"),
        ({"enum": ["yes", "no"]}, "`yes`, `no`"),
        (
            {"type": "array", "minItems": 3, "maxItems": 3, "items": {"type": "number"}},
            "list of 3, each number",
        ),
        ({"type": "array", "minItems": 1, "items": {"type": "string"}}, "list of 1 or more, each text"),
    ],
)
def test_what_a_key_may_be_is_said_in_words(schema, words):
    assert reference["allowed"](schema) == words
