"""What the loop states, as a code and numbers: :mod:`metro.wording` puts it into a sentence.

A sentence can so be edited without a fit being run again: the code of the loop does not change with it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Statement:
    """Something that the loop states.

    Attributes
    ----------
    code : which sentence it will be.
    values : what the sentence holds: numbers, names, further statements, and lists and mappings of these.
    """

    code: str
    values: Mapping[str, Any] = field(default_factory=dict)


def to_json(content: Any) -> Any:
    """Return content with every statement in it as JSON: ``{"code", "values"}``, lists for tuples.

    JSON has no infinity: a statement's number that is not finite becomes the text that ``float`` reads.
    """
    if isinstance(content, Statement):
        values = {name: _finite(to_json(value)) for name, value in content.values.items()}
        return {"code": content.code, "values": values}
    if isinstance(content, Mapping):
        return {name: to_json(value) for name, value in content.items()}
    return [to_json(each) for each in content] if isinstance(content, list | tuple) else content


def _finite(value: Any) -> Any:
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value
