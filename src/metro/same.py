"""An object that stands for itself in the key of a cache."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, TypeVar

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class Same(Generic[T]):
    """Stands for an object that cannot be hashed, such as an array: equal to what holds the very same one.

    It keeps the object alive, so that no other one takes its identity. Nobody may change the object.
    """

    value: T

    def __hash__(self) -> int:
        """Return that of the object's identity."""
        return id(self.value)

    def __eq__(self, other: object) -> bool:
        """Whether it is the same object."""
        return isinstance(other, Same) and other.value is self.value
