"""Runs the code cells of a notebook, one after another, in one namespace."""

import json


def executed(path):
    """Return the namespace that the cells leave behind; an error names the cell that it comes from."""
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    namespace = {"__name__": "__main__"}
    for number, cell in enumerate(cells):
        if cell["cell_type"] == "code":
            exec(compile("".join(cell["source"]), f"{path.name}, cell {number}", "exec"), namespace)
    return namespace
