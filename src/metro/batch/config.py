"""The configuration of the workflow: read, overridden section by section, validated."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from metro.batch.documents import read_yaml, schema_findings
from metro.batch.findings import ConfigError, errors
from metro.units import JSON


def load_config(path: Path, overrides: Mapping[str, Any] | None = None) -> JSON:
    """Return the configuration that is in effect.

    Parameters
    ----------
    path : the YAML file.
    overrides : sections that replace those of the file. A section is replaced whole: what it does not name is
        missing, not taken from the file, so that no mixture of the two can arise.

    Raises
    ------
    ConfigError
        Not YAML (with the line), an unknown key (with the nearest known one), a value out of its range, or a
        section that lacks a key. All that is wrong is named at once.
    """
    file = str(path)
    content, findings = read_yaml(path, file)
    if not findings:
        content |= dict(overrides or {})
        findings = schema_findings(content, "config", file, lambda _path, _like: "error")
    if errors(findings):
        raise ConfigError(findings)
    return content
