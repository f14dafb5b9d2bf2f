"""One reader per file format, each giving a table with the contract's columns."""

from metro.formats.errors import FormatError

__all__ = ["FormatError"]
