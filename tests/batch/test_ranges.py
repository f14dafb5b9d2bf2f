"""Every number that people write has a range with a reason; beyond it a batch is refused by name."""

import math
import re
from pathlib import Path

import corpus_batches
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from metro.batch import ranges
from metro.batch.cell import read_cell
from metro.batch.check import check
from metro.batch.columns import TABLES
from metro.batch.config import load_config
from metro.batch.documents import read_yaml, schema_findings
from metro.batch.findings import ConfigError, errors
from metro.batch.manifest import read_manifest
from metro.batch.tables import read_table

ROOT = Path(__file__).parents[2]
SOME = ("0", "1e-300", "1e300", "nan")
EXTREMES = (*SOME, "-1", "-1e300", "1e9", "inf", "9" * 400, "-0.0", "1e-29")
IN_FULL = [SOME, pytest.param(EXTREMES, marks=pytest.mark.slow)]
DOCUMENTS = ("batch", "cell", "config")


def numbers(rule, path=()):
    """Yield path (0 for an entry of a list, * for any key) and rule of every number of a schema."""
    if isinstance(rule.get("type"), list) and "integer" in rule["type"]:  # a name or a number
        yield path, {**rule, "type": "integer", "or name": True}
    elif rule.get("type") in ranges.KINDS:
        yield path, rule
    for key, inner in rule.get("properties", {}).items():
        yield from numbers(inner, (*path, key))
    if isinstance(rule.get("additionalProperties"), dict):
        yield from numbers(rule["additionalProperties"], (*path, "*"))
    if "items" in rule:
        yield from numbers(rule["items"], (*path, 0))


ALL = [(name, path, rule) for name in DOCUMENTS for path, rule in numbers(ranges.schema(name))]
COLUMNS = [(table, column) for table, columns in TABLES.items() for column in columns if column.numeric]


def named(name, path):
    return ".".join((name, *map(str, path)))


@pytest.mark.parametrize(("name", "path", "rule"), ALL, ids=[named(name, path) for name, path, _ in ALL])
def test_every_number_of_a_document_has_two_bounds_and_a_reason(name, path, rule):
    least = rule.get("minimum", rule.get("exclusiveMinimum", -math.inf))
    most = rule.get("maximum", rule.get("exclusiveMaximum", math.inf))
    assert -1e15 <= least < most <= 1e15
    assert len(rule["description"]) > 10


def test_every_column_of_numbers_has_a_range_and_all_are_on_the_reference_page():
    assert len(COLUMNS) > 40
    page = (ROOT / "docs/reference-batch.md").read_text(encoding="utf-8")
    for _, column in COLUMNS:
        assert f"| `{column.name}` |" in page
        assert ranges.bounds(column.rule) in page
        assert column.rule["description"] in page
    for name, path, rule in ALL:
        text = (ROOT / f"docs/reference-{'config' if name == 'config' else 'batch'}.md").read_text("utf-8")
        shown = ".".join(str(key) for key in path if key not in (0, "*"))
        assert shown in {
            re.sub(r"\.<\w+>", "", key) for key in re.findall(r"^\| `([^`]+)` \|", text, re.MULTILINE)
        }
        assert rule["description"] in page
        assert "*" in path or ranges.number_in_words(rule) in text


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    """A small batch of every instrument, its description as it is written."""
    folder = tmp_path_factory.mktemp("sound") / "specimen"
    corpus_batches.write(folder, "loads.csv")
    (folder / "runs.csv").write_text(
        f"{corpus_batches.COLUMNS}\nr1,,f1,1,1,side,6000,0.05,1,5,down,60,p1\n", encoding="utf-8"
    )
    return folder


def with_value(document, path, text):
    """Put a text, which is read as a number, where a schema has one; a list gets it throughout."""
    changed, place = document, document
    path = ["spindle_rpm" if key == "*" else key for key in path]
    for key, following in zip(path, (*path[1:], None), strict=True):
        if key == 0:
            place[:] = [text if following is None else place[0] for _ in place]
            place = place[0]
        else:
            place[key] = text if following is None else place.get(key, [0, 0, 0] if following == 0 else {})
            place = place[key]
    return yaml.safe_dump(changed, allow_unicode=True).replace(f"'{text}'", text)


def inside(rule, text):
    if "or name" in rule and isinstance(yaml.safe_load(text), str):
        return True
    value = float(text)
    usable = math.isfinite(value) and ranges.within(rule, value) and not ranges.too_small(value)
    return usable and (rule["type"] == "number" or value.is_integer())


@pytest.mark.parametrize("extremes", IN_FULL, ids=["some", "all"])
@pytest.mark.parametrize("number", ALL, ids=[named(name, path) for name, path, _ in ALL])
def test_an_extreme_number_of_a_document_is_refused_by_name_or_the_batch_is_checked(
    sound, tmp_path, number, extremes
):
    name, path, rule = number
    for text in extremes:
        if name == "config":
            content = yaml.safe_load((ROOT / "config/config.yaml").read_text(encoding="utf-8"))
            (tmp_path / "config.yaml").write_text(with_value(content, path, text), encoding="utf-8")
            try:
                load_config(tmp_path / "config.yaml")
                said = ""
            except ConfigError as error:
                said = str(error)
        else:
            file = sound / f"{name}.yaml"
            before = file.read_text(encoding="utf-8")
            file.write_text(with_value(yaml.safe_load(before), path, text), encoding="utf-8")
            read = read_manifest(sound) if name == "batch" else read_cell(sound, sound, "bench-arm")
            said = "\n".join(map(str, errors(read[-1]) or errors(check(sound, sound).problems)))
            file.write_text(before, encoding="utf-8")
        if not inside(rule, text):
            assert path[-1] in (0, "*") or path[-1] in said or "line" in said, (text, said)
            assert "found" in said, text


@pytest.mark.parametrize(("table", "column"), COLUMNS, ids=[f"{t}.{c.name}" for t, c in COLUMNS])
def test_an_extreme_number_of_a_table_is_refused_by_row_and_column_or_read(tmp_path, table, column):
    for text in EXTREMES:
        others = {c.name: "1" for c in TABLES[table] if c.required and c.name != column.name}
        header, cells = [*others, column.name], [*others.values(), text]
        (tmp_path / f"{table}.csv").write_text(f"{','.join(header)}\n{','.join(cells)}\n", encoding="utf-8")
        read, findings = read_table(tmp_path, table)
        said = "\n".join(map(str, findings))
        if text != "nan" and not inside(column.rule, text):
            assert re.search(rf"row 2( \(1\))?: column {column.name}: found", said), text
        elif text != "nan":
            assert read.frame[column.name].iloc[0] == float(text)


@pytest.mark.parametrize(
    ("table", "column", "value", "words"),
    [
        ("runs", "spindle_rpm", "0.5", 'found "0.5", expected 1 to 500000 rpm: from a large boring head'),
        ("runs", "order", "1e300", "expected 0 to 1e12: a number in a list, or a time stamp"),
        ("published", "measured", "1e300", "expected -1e15 to 1e15: the stiffest modulus"),
        ("stations", "kx_n_um", "9.3e5", "expected 0.001 to 100000 N/µm: from 1 N/mm"),
        ("published", "measured", "1e-300", "expected 0, or at least 1e-30 in size"),
    ],
)
def test_a_number_out_of_its_range_is_refused_with_the_range_its_unit_and_the_reason(
    tmp_path, table, column, value, words
):
    others = {c.name: "1" for c in TABLES[table] if c.required and c.name != column}
    text = f"{','.join([*others, column])}\n{','.join([*others.values(), value])}\n"
    (tmp_path / f"{table}.csv").write_text(text, encoding="utf-8")
    assert words in "\n".join(map(str, read_table(tmp_path, table)[1]))


@pytest.mark.parametrize(
    "tool",
    [
        "{diameter_mm: 0.1, teeth: 2, helix_deg: 30}",
        "{diameter_mm: 200, teeth: 10, helix_deg: 0}",
        "{diameter_mm: 63, teeth: 1, pitch_deg: [360], overhang_mm: 400}",
        "{diameter_mm: 160, teeth: 120}",
    ],
)
def test_tools_of_every_size_are_accepted(sound, tool):
    content, _ = read_yaml(sound / "batch.yaml", "batch.yaml")
    content["tool"] = yaml.safe_load(tool)
    assert schema_findings(content, "batch", "batch.yaml", lambda _p, _l: "error") == []


@pytest.mark.parametrize(
    ("diameter", "row"),
    [("0.1", "200000,0.0005,0.002,0.1"), ("200", "50,0.3,5,150"), ("0.05", "450000,0.0001,0.001,0.05")],
)
def test_cuts_from_micro_milling_to_large_face_mills_are_accepted(sound, diameter, row):
    manifest, runs = sound / "batch.yaml", sound / "runs.csv"
    before = manifest.read_text(), runs.read_text()
    manifest.write_text(before[0].replace("diameter_mm: 10", f"diameter_mm: {diameter}"))
    runs.write_text(before[1].replace("6000,0.05,1,5", row))
    try:
        assert errors(check(sound, sound).problems) == ()
    finally:
        manifest.write_text(before[0])
        runs.write_text(before[1])


TEXTS = st.text(st.characters(codec="utf-8"), max_size=60)
VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | TEXTS,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(TEXTS, inner, max_size=4),
    max_leaves=12,
)
KEYS = st.sampled_from([path for name, path, _ in ALL if name == "batch"]) | st.sampled_from(
    [(key,) for key in ranges.schema("batch")["properties"]]
)


@settings(max_examples=15, deadline=None)
@given(KEYS, VALUES)
def test_any_value_anywhere_in_a_manifest_is_read_or_refused(tmp_path_factory, path, value):
    """As YAML writes it: what comes back is a manifest or an error, and the messages can be printed."""
    content = yaml.safe_load(corpus_batches.MANIFEST)
    content[path[0]] = value if len(path) == 1 else {path[1]: value}
    folder = tmp_path_factory.mktemp("any") / "specimen"
    folder.mkdir()
    (folder / "batch.yaml").write_text(yaml.safe_dump(content, allow_unicode=True), encoding="utf-8")
    for finding in check(folder, folder).problems:
        str(finding).encode("utf-8")


@settings(max_examples=60, deadline=None)
@given(st.binary(max_size=400) | TEXTS.map(str.encode))
def test_any_bytes_are_a_document_or_an_error(tmp_path_factory, data):
    file = tmp_path_factory.mktemp("any") / "batch.yaml"
    file.write_bytes(data)
    content, findings = read_yaml(file, "batch.yaml")
    assert content or findings or not data.strip()
    "".join(map(str, findings)).encode("utf-8")


BOMB = "a: &a [x, x, x, x]\n" + "".join(
    f"{chr(98 + i)}: &{chr(98 + i)} [{', '.join([f'*{chr(97 + i)}'] * 4)}]\n" for i in range(8)
)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (BOMB, "found an alias"),
        ("title: " + "[" * 5000, "nested too deeply"),
        ("title: " + "[" * 150 + "]" * 150, "title: found"),
        ("title: " + "x" * 40_000, "expected text of at most 500 characters"),
        ('title: "a\\0b"', "found the character U+0000 (place 2 of the text)"),
        ('title: "\\ud800"', "found the character U+D800"),
        ('"ti\\0tle": a', "found the character U+0000"),
        ("teeth: " + "9" * 5000, "expected a decimal number"),
    ],
)
def test_texts_that_no_program_could_bear_are_refused(sound, text, words):
    before = (sound / "batch.yaml").read_text(encoding="utf-8")
    (sound / "batch.yaml").write_text(f"{before.replace('title: A sound little batch', '')}\n{text}\n")
    said = "\n".join(map(str, errors(check(sound, sound).problems)))
    (sound / "batch.yaml").write_text(before, encoding="utf-8")
    assert words in said
    assert len(said) < 2000


def test_texts_of_a_table_have_an_end_and_no_control_characters(tmp_path):
    (tmp_path / "runs.csv").write_text(f"run,plate\n{'r' * 201},a\nr2,b\x01c\n", encoding="utf-8")
    long, control = map(str, read_table(tmp_path, "runs")[1])
    assert "expected at most 200 characters" in long
    assert "column plate: found the character U+0001 (place 2 of the text), expected text" in control


def test_a_table_of_thousands_of_columns_is_refused_at_once(tmp_path):
    header = ",".join(f"c{i}" for i in range(20_000))
    (tmp_path / "runs.csv").write_text(f"run,{header}\nr1{',1' * 20_000}\n", encoding="utf-8")
    (finding,) = read_table(tmp_path, "runs")[1]
    assert "has 20001 columns, expected at most 1000" in str(finding)
