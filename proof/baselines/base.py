"""The base model alone: names nothing, corrects nothing."""

from __future__ import annotations

from dataclasses import dataclass

from metro.observables.labelled import Labelled
from metro.observables.problem import Problem, Refusal
from metro.units import JSON
from proof.baselines.program import TOO_FEW, Given, held_out_rows, said


@dataclass(frozen=True)
class Base:
    """Handler: the answer of a program that believes its model."""

    given: Given

    def sampled(self, problem: Problem) -> JSON:
        """Predict the held-out runs."""
        base = self.given.base
        return said("clean", held_out_rows(problem, base)) if base else TOO_FEW

    def labelled(self, problem: Labelled) -> JSON:
        """Predict the held-out labels."""
        return said("clean", problem.comparison())

    def refused(self, _refusal: Refusal) -> JSON:
        """Say that there is nothing to tell from."""
        return TOO_FEW
