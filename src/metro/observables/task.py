"""What an observable makes of a batch: samples to fit, labels to weigh, or a refusal; and who handles which.

The stages treat every observable alike: they hand the task a handler, and the task calls the method of its
own kind. A new kind of task needs one more method here, and mypy names every handler that lacks it.
"""

from __future__ import annotations

from typing import Protocol, TypeVar

from metro.observables.labelled import Labelled
from metro.observables.problem import Problem, Refusal

Task = Problem | Labelled | Refusal
Result_co = TypeVar("Result_co", covariant=True)


class Handler(Protocol[Result_co]):
    """What is done with a task of each kind."""

    def sampled(self, problem: Problem) -> Result_co:
        """Handle a problem whose measurements are samples, which a model is fitted to."""
        ...

    def labelled(self, problem: Labelled) -> Result_co:
        """Handle a problem whose measurements are labels, to which nothing is fitted."""
        ...

    def refused(self, refusal: Refusal) -> Result_co:
        """Handle an observable that the batch does not support."""
        ...
