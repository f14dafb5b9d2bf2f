"""What was judged, kept in a file: after a kill nothing is judged twice, and nothing is lost."""

from __future__ import annotations

import json
from pathlib import Path

from metro.batch.findings import ContractError, Finding
from metro.batch.processed import write_json
from metro.watch.judgement import Judgement

FILE = "watch.json"


class Journal:
    """The judgements on the files of a batch, the oldest first.

    A judgement is written before it is shown: who is killed in between finds it when the watch begins again.
    """

    def __init__(self, path: Path, batch: str) -> None:
        self.path, self.batch = path, batch
        self.judgements = _read(path)
        self._keys = {each.key for each in self.judgements}

    def has(self, key: str) -> bool:
        """Return whether a file with this content and this row was judged."""
        return key in self._keys

    def add(self, judgement: Judgement) -> None:
        """Keep a judgement."""
        judged = [*self.judgements, judgement]
        content = {"format": 1, "batch": self.batch, "judged": [each.content for each in judged]}
        write_json(self.path, content)
        self.judgements = judged
        self._keys.add(judgement.key)


def _read(path: Path) -> list[Judgement]:
    if not path.is_file():
        return []
    try:
        rows = json.loads(path.read_text(encoding="utf-8"))["judged"]
        return [
            Judgement(**{**row, **{name: tuple(row[name]) for name in ("reasons", "causes")}}) for row in rows
        ]
    except (ValueError, KeyError, TypeError):
        message = "is no journal of metro watch: move it away, and all files are judged anew"
        raise ContractError([Finding("error", str(path), message)]) from None
