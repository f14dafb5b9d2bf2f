"""What the loop states, in the words that reach a reader."""

import json

from metro.loop.statement import to_json
from metro.wording.statements import worded


def in_words(content):
    """Return content with every statement as its sentence, by way of the text of a JSON file."""
    return worded(json.loads(json.dumps(to_json(content), allow_nan=False)))
