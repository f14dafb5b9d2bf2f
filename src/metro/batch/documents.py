"""YAML files that people write: read, checked against a JSON Schema, and their faults in plain words."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import yaml

from metro.batch.findings import Finding, Severity, misspelt, shown
from metro.batch.ranges import KINDS, bounds, expected_for, number_in_words, schema, too_small
from metro.batch.texts import strange_character
from metro.spelling import resembling, suggestion

if TYPE_CHECKING:
    from jsonschema.exceptions import ValidationError

    from metro.units import (
        JSON,
    )  # which imports NumPy, and this module is imported at every call of snakemake

# What an unknown key is to the known ones: like none, like one, or a slip of the pen for one that is absent.
Likeness = Literal["", "like", "slip"]
# The severity of an unknown key: called with the path of keys to it, and with its resemblance to known ones.
UnknownKey = Callable[[tuple[str, ...], Likeness], Severity]

LARGEST = 1 << 20  # bytes: a description that people write has some thousands
THOUSAND = 3  # digits of a group
_BEFORE_COMMA = re.compile(r"[-+]?[0-9][0-9.]*")
_TRUTH = {"true": True, "yes": True, "on": True, "false": False, "no": False, "off": False}


class _Loader(yaml.SafeLoader):
    """PyYAML's safe loader, with numbers as everybody writes them (1e6), dates as text, and no key twice.

    Aliases are refused: a few lines of them unfold to any size. So is every tag but those of text, numbers,
    truth, lists and mappings.
    """

    yaml_constructors: ClassVar[dict[Any, Any]] = {
        tag: make
        for tag, make in yaml.SafeLoader.yaml_constructors.items()
        if tag is None or str(tag).rpartition(":")[2] in {"null", "seq", "str"}
    }

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        """Compose a node, unless it is an alias of another."""
        if self.check_event(yaml.AliasEvent):
            parser: Any = self  # its stubs leave this method without types
            mark = parser.peek_event().start_mark
            raise yaml.composer.ComposerError(
                None, None, "found an alias (*…), expected the value itself", mark
            )
        node: yaml.Node | None = super().compose_node(parent, index)
        return node


def _mapping(loader: _Loader, node: yaml.MappingNode) -> JSON:
    """Construct a mapping whose keys are text and appear once.

    In braces a comma ends a value: of ``{diameter_mm: 12,5}`` the 5 would be a key without one. It is put
    back, and the value is what was written, a text.
    """
    loader.flatten_mapping(node)
    content: JSON = {}
    before, number = "", ""  # the last key, and what was written as its value where that is a number
    for key_node, value_node in node.value:
        key = _text(loader, key_node)
        written = value_node.value if isinstance(value_node, yaml.ScalarNode) else None
        if number and key.isdecimal() and written == "":
            number = content[before] = f"{number},{key}"
            continue
        before, number = key, written if written and _BEFORE_COMMA.fullmatch(written) else ""
        if key in content:
            raise yaml.constructor.ConstructorError(
                None, None, f'key "{key}" appears twice', key_node.start_mark
            )
        content[key] = loader.construct_object(value_node, deep=True)
    return content


def _whole(_loader: _Loader, node: yaml.ScalarNode) -> int:
    """Construct a whole number as people write it: YAML 1.1 takes 010 for 8, and 1:30 for 90."""
    if not re.fullmatch(r"[-+]?(0|[1-9][0-9]{0,17})", node.value):
        message = (
            f"found {shown(node.value)}, expected a decimal number without leading noughts (text: in quotes)"
        )
        raise yaml.constructor.ConstructorError(None, None, message, node.start_mark)
    return int(node.value)


def _finite(loader: _Loader, node: yaml.ScalarNode) -> float:
    """Construct a number, and refuse the infinite and the undefined."""
    try:
        value = math.nan if re.search("[:_]", node.value) else loader.construct_yaml_float(node)
    except ValueError:
        value = math.nan
    expected = too_small(value) if math.isfinite(value) else "a finite number"
    if expected:
        message = f"found {shown(node.value)}, expected {expected}"
        raise yaml.constructor.ConstructorError(None, None, message, node.start_mark)
    return value


def _truth(_loader: _Loader, node: yaml.ScalarNode) -> bool:
    """Construct a truth value, under a tag, too."""
    if node.value.lower() not in _TRUTH:
        message = f"found {shown(node.value)}, expected true or false"
        raise yaml.constructor.ConstructorError(None, None, message, node.start_mark)
    return _TRUTH[node.value.lower()]


def _text(_loader: _Loader, node: yaml.Node) -> str:
    """Construct the text as written."""
    text = str(node.value)
    if fault := strange_character(text):
        raise yaml.constructor.ConstructorError(None, None, f"{fault}, expected text", node.start_mark)
    return text


_Loader.add_constructor("tag:yaml.org,2002:map", _mapping)
_Loader.add_constructor("tag:yaml.org,2002:int", _whole)
_Loader.add_constructor("tag:yaml.org,2002:float", _finite)
_Loader.add_constructor("tag:yaml.org,2002:bool", _truth)
_Loader.add_constructor("tag:yaml.org,2002:timestamp", _text)
_Loader.add_constructor("tag:yaml.org,2002:str", _text)
_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float", re.compile(r"[-+]?(\d+\.?\d*|\.\d+)[eE][-+]?\d+"), list("-+.0123456789")
)


def read_yaml(path: Path, file: str) -> tuple[JSON, list[Finding]]:
    """Read a YAML file that holds a mapping; empty, with the reason, where it cannot be read.

    Parameters
    ----------
    path : where the file is.
    file : its name in messages.
    """
    try:
        with path.open("rb") as stream:
            data = stream.read(LARGEST + 1)
        if len(data) > LARGEST:
            raise yaml.YAMLError(f"has more than {LARGEST} bytes, expected at most so many")
        content = yaml.load(data.decode("utf-8-sig"), _Loader)
    except OSError:
        what = "is a folder, expected a file" if path.is_dir() else "is not there, or cannot be read"
        return {}, [Finding("error", file, what)]
    except UnicodeDecodeError as fault:
        return {}, [Finding("error", file, f"is not UTF-8 text (byte {fault.start + 1}): save it as UTF-8")]
    except yaml.MarkedYAMLError as fault:
        mark = fault.problem_mark or fault.context_mark
        return {}, [
            Finding("error", file, fault.problem or "is not YAML", row=mark.line + 1 if mark else None)
        ]
    except (yaml.YAMLError, RecursionError) as fault:
        deep = "is nested too deeply, expected a few levels of keys"
        message = deep if isinstance(fault, RecursionError) else f"is not YAML: {fault}"
        return {}, [Finding("error", file, message)]
    if not isinstance(content, dict):
        return {}, [Finding("error", file, f"found {shown(content)}, expected keys with values")]
    return content, []


def schema_findings(content: JSON, name: str, file: str, unknown: UnknownKey) -> list[Finding]:
    """Check a document against a schema of this package; one finding a fault, each once."""
    from jsonschema import Draft202012Validator

    faults = Draft202012Validator(schema(name)).iter_errors(content)
    findings = (finding for fault in faults for finding in _in_words(fault, file, unknown))
    return list(dict.fromkeys(findings))


def expectation(rule: Mapping[str, Any]) -> str:
    """Describe in words what a schema asks for, e.g. "an integer, 1 to 120", "a list of 3 numbers"."""
    if "const" in rule or "enum" in rule:
        return " or ".join(shown(choice) for choice in rule.get("enum", [rule.get("const")]))
    kind = rule.get("type", "value")
    if isinstance(kind, str) and kind in KINDS:
        return number_in_words(rule)
    if "description" in rule:
        return str(rule["description"])
    if kind == "array":
        return f"a {_plural(rule).replace('lists', 'list', 1)}"
    if kind == "object":
        return "keys with values"
    most = f" of at most {rule['maxLength']} characters" if "maxLength" in rule else ""
    return f"text{most}" if kind == "string" else f"a {kind}"


def _plural(rule: Mapping[str, Any]) -> str:
    """Describe in words what several of a schema's values are."""
    if rule.get("type") == "array":
        least, most = rule.get("minItems"), rule.get("maxItems", math.inf)
        between = f"{least} to {most} " if (least or 0) > 1 else f"at most {most} "
        size = f"{least} " if least == most else between if most < math.inf else ""
        return f"lists of {size}{_plural(rule.get('items', {}))}"
    kind, limits = str(rule.get("type", "value")).replace("string", "text"), bounds(rule)
    return f"{kind}s, each {limits}" if limits else f"{kind}s"


def _in_words(fault: ValidationError, file: str, unknown: UnknownKey) -> Iterator[Finding]:
    """Turn a fault of the validator into findings: path, what was found, what was expected."""
    path = tuple(str(part) for part in fault.absolute_path)
    rule = fault.schema if isinstance(fault.schema, dict) else {}
    given: Any = fault.instance
    if fault.validator == "additionalProperties":
        known = list(rule.get("properties", {}))
        for key in given:
            if key not in known:
                message = f"is not a known key{suggestion(key, known)}"
                severity = unknown(path, likeness(key, known, given))
                yield Finding(severity, file, message, column=".".join((*path, key)))
    elif fault.validator == "required":
        for key in rule["required"]:
            if key not in given:
                expected = expectation(rule.get("properties", {}).get(key, {}))
                yield Finding(
                    "error", file, f"is missing, expected {expected}", column=".".join((*path, key))
                )
    else:
        number = rule.get("type") in [*KINDS]  # which a rule of several types is not
        expected = expected_for(rule, given) if number else expectation(rule)
        message = f"found {shown(given)}, expected {expected}{without_comma(given) if number else ''}"
        yield Finding("error", file, message, column=".".join(path))


def likeness(key: str, known: list[str], given: Mapping[str, Any]) -> Likeness:
    """Return how an unknown key of a mapping resembles the known ones."""
    if misspelt(key, [name for name in known if name not in given]):
        return "slip"
    return "like" if resembling(key, known) else ""


def without_comma(given: Any) -> str:
    """Return the end of a message: how to write a number that has a comma; "" for anything else."""
    if not isinstance(given, str) or not re.fullmatch(r"[-+]?[0-9]+(,[0-9]+)+", given):
        return ""
    whole, *groups = given.split(",")
    numbers = ["".join((whole, *groups))] if all(len(group) == THOUSAND for group in groups) else []
    numbers += [] if groups[1:] else [f"{whole}.{groups[0]}"]
    return f": write {' or '.join(numbers)}" if numbers else ""
