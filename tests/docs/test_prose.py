"""The language of the program and of the pages: no private dialect, no paragraph that nobody finishes."""

import pytest

from tests.docs.prose import (
    DIALECT,
    LONGEST_PARAGRAPH,
    Text,
    blocks,
    dialect,
    is_prose,
    pages,
    program,
    strings,
)

SENTENCES = {
    "tell, told": "frequency x not told",
    "what is left": "What is left: throughout",
    "the rest": "a significant rest remains",
    "stands": "an effect that stands in batch.yaml",
    "off": "these are off by up to 91 N",
    "imitate": "the base parameters imitate all of it",
    "take up": "coefficients take up the factor",
    "nobody's": "is nobody's effect",
    "a lead": "this is a lead, not a finding",
    "the same of": "The same of r10",
    "the verdict says": "What that means, the verdict says.",
    "what it hides": "What it hides is listed there",
    "a step more": "a step more would move a parameter",
    "parts from": "the test that would part them",
    "likeness": "a chipped tooth looks alike",
    "bears witness": "the wall bears witness of it",
    "there is none of": "a name that there is none of",
    "sd": "by 9.4 of its sd",
    "as by": "the error of each as told by all others",
}


@pytest.mark.parametrize("texts", [program, pages], ids=["program", "pages"])
def test_sentences_are_written_in_the_terms_of_the_field(texts):
    found = dialect(texts())
    assert not found, "\n".join(f"{one.file}:{one.line}: {one.name}: {one.text}" for one in found)


def test_a_paragraph_can_be_read_at_once():
    long = [
        f"{file}:{line}: {len(text.split())} words"
        for file, line, text in pages()
        if is_prose(text) and len(text.split()) > LONGEST_PARAGRAPH
    ]
    assert long == []


@pytest.mark.parametrize("name", DIALECT)
def test_each_word_of_the_dialect_is_found(name):
    assert name in {one.name for one in dialect([Text("a", 1, SENTENCES[name])])}


def test_code_in_a_page_is_no_prose():
    assert dialect([Text("a", 1, 'In `"told": false` a key has its name.')]) == []


def test_strings_of_a_module_are_read_as_they_are_put_together_but_not_its_docstrings():
    source = """'What is told.'
def f(x):
    'Tell it.'
    return "one " "two" + f"{x} three" + "four"
"""
    assert [text.text for text in strings(source, "a")] == ["one two", "… three"]


def test_paragraphs_items_and_rows_are_blocks_of_their_own_and_code_is_none():
    page = """# Title

one
two

- three
  four

    five
- six

| a | b |

end

    code
"""
    found = [text.text for text in blocks(page, "a")]
    assert found == ["# Title", "one two", "- three four", "five", "- six", "| a | b |", "end"]
