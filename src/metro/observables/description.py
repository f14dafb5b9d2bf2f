"""What is said of an observable, without what computes it: for lists, titles, checks and file names."""

from __future__ import annotations

from dataclasses import dataclass

from metro.batch.capabilities import Needs


@dataclass(frozen=True)
class Description:
    """An observable as the command line, the checks and the report know it.

    Attributes
    ----------
    name : the contract's. title : as an engineer says it, for headings.
    assumes : what its base model assumes, in sentences.
    tables : the observed tables that it may write; ``shown`` those of them that a report reads, ``drawn``
        those that the page of all batches draws.
    needs : what a batch has and lacks for it.
    """

    name: str
    title: str
    assumes: str
    tables: tuple[str, ...]
    needs: Needs
    shown: tuple[str, ...] = ()
    drawn: tuple[str, ...] = ()
