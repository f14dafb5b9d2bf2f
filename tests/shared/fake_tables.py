"""Canonical tables that a function makes, where those of a folder are expected."""


class FakeTables:
    """``make(name, run)`` returns the rows."""

    def __init__(self, make):
        self._make = make

    def __call__(self, name, run=None):
        return self._make(name, run)

    def pieces(self, name, run):
        table = self._make(name, run)
        yield table.iloc[: len(table) // 3]
        yield table.iloc[len(table) // 3 :]
