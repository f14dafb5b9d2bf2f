"""Every statement of the loop with its sentence."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from metro.wording import candidates, causes, experiments, labels, poses, residual
from metro.wording.candidates import Sentence

SENTENCES: Mapping[str, Sentence] = {
    **candidates.SENTENCES,
    **residual.SENTENCES,
    **experiments.SENTENCES,
    **labels.SENTENCES,
    **causes.SENTENCES,
    **poses.SENTENCES,
}


def worded(content: Any) -> Any:
    """Return JSON with every statement ``{"code", "values"}`` replaced by its sentence, inner ones first."""
    if isinstance(content, list):
        return [worded(each) for each in content]
    if not isinstance(content, dict):
        return content
    inner = {name: worded(value) for name, value in content.items()}
    if content.keys() != {"code", "values"}:
        return inner
    sentence = SENTENCES[content["code"]]
    return sentence if isinstance(sentence, str) else sentence(inner["values"])
