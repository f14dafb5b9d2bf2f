"""The sentences that people read: strings of the program, and paragraphs of the pages; and words to avoid.

The words are those of a private dialect, which a reader outside this project does not understand at once.
``python -m tests.docs.prose`` lists where they occur, with counts.
"""

from __future__ import annotations

import ast
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
LONGEST_PARAGRAPH = 90  # words
# Pages that a program writes.
ELSEWHERE = ("protocol-board.md", "proof-tables.md")

DIALECT = {
    "tell, told": r"\b(?:un)?told\b|\btell(?:s|ing)?\b",
    "what is left": r"\bwhat (?:is|was) left\b|\b(?:is|are) left over\b|\bleaves? most\b",
    "the rest": r"\b(?:the|a|significant|no) rest\b(?! of)",
    "stands": r"\bstands?\b|\bstood\b",
    "off": r"\b(?:is|are|be|was|were|lies?) off\b|\boff by\b",
    "imitate": r"\bimitat\w+",
    "take up": r"\btak(?:es?|en|ing) up\b|\btook up\b",
    "nobody's": r"\bnobody's\b",
    "a lead": r"\ba lead\b|\bleads, not\b|\ba finding\b",
    "the same of": r"^the same of\b",
    "the verdict says": r"\bverdict (?:says|tells)\b",
    "what it hides": r"\bwhat it hides\b",
    "a step more": r"\ba step more\b",
    "parts from": r"\b(?:to|can|cannot|could|would|do not|does not) part\b",
    "likeness": r"\blikeness\b|\blooks? (?:alike|like it|like these|like that)\b",
    "bears witness": r"\bbears? witness\b",
    "there is none of": r"\bthere is none of\b|\bof those that no\b",
    "sd": r"\bof its sd\b",
    "as by": r"\bas (?:told )?by all\b",
}
PATTERNS = {name: re.compile(pattern, re.IGNORECASE) for name, pattern in DIALECT.items()}


class Text(NamedTuple):
    """A piece of text with the place where it begins."""

    file: str
    line: int
    text: str


class Found(NamedTuple):
    """A word of the dialect at its place."""

    file: str
    line: int
    name: str
    text: str


def strings(source: str, file: str) -> Iterator[Text]:
    """Yield the strings of a Python module that hold more than one word, docstrings aside.

    What a formatted string fills in is written as three dots.
    """
    tree = ast.parse(source)
    documented = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    passed = {
        id(node.body[0].value)
        for node in ast.walk(tree)
        if isinstance(node, documented) and node.body and isinstance(node.body[0], ast.Expr)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            passed |= {id(part) for part in node.values}
            text = "".join(str(part.value) if isinstance(part, ast.Constant) else "…" for part in node.values)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in passed:
            text = node.value
        else:
            continue
        if " " in text.strip():
            yield Text(file, node.lineno, text)


def blocks(source: str, file: str) -> Iterator[Text]:
    """Yield the paragraphs, items of lists and rows of tables of a Markdown page, code aside."""
    kept: list[str] = []
    begun, fenced, listed = 1, False, False
    for number, line in enumerate([*source.splitlines(), ""], start=1):
        bare = line.strip()
        fence = bare.startswith("```")
        item = re.match(r"(?:[-*]|\d+\.) ", bare) is not None
        own = item or bare.startswith(("|", "#"))
        # Inside a list four spaces continue an item, elsewhere they are code.
        listed = item or (listed and (not bare or line.startswith("  ")))
        code = fenced or fence or (line.startswith("    ") and not kept and not listed)
        if kept and (not bare or own or fence):
            yield Text(file, begun, " ".join(kept))
            kept = []
        fenced ^= fence
        if bare and not code:
            begun = begun if kept else number
            kept.append(bare)


def program(folder: str = "src/metro") -> list[Text]:
    """Return all strings of the program with more than one word."""
    modules = sorted((ROOT / folder).rglob("*.py"))
    return [text for module in modules for text in strings(module.read_text("utf-8"), _name(module))]


def pages() -> list[Text]:
    """Return all paragraphs of the pages that people read."""
    files = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
    own = [page for page in files if not page.name.startswith(ELSEWHERE)]
    return [text for page in own for text in blocks(page.read_text("utf-8"), _name(page))]


def dialect(texts: list[Text]) -> list[Found]:
    """Return each place at which a text has a word of the dialect; code in a page is none."""
    found = []
    for file, line, text in texts:
        prose = re.sub(r"`[^`]*`", "", text)
        for name, pattern in PATTERNS.items():
            found += [Found(file, line, name, text[:300]) for _ in pattern.findall(prose)]
    return found


def is_prose(text: str) -> bool:
    """Whether a block of a page is running text: no row of a table, no heading, no formula."""
    return not text.startswith(("|", "#", "$$"))


def _name(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


if __name__ == "__main__":
    everything = dialect([*program(), *pages()])
    for one in everything:
        print(f"{one.file}:{one.line}: {one.name}: {one.text}")
    for word, count in Counter(one.name for one in everything).most_common():
        print(f"{count:4} {word}")
    print(f"{len(everything):4} in all")
