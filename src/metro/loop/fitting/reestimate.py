"""The noise of a candidate, estimated from what its prediction leaves of the blocks."""

from __future__ import annotations

from collections.abc import Sequence

from metro.loop.fitting import noise as noise_room
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.expectation import updated
from metro.loop.fitting.noise import Noise
from metro.loop.fitting.system import State, designs, linearised
from metro.observables.problem import Block
from metro.units import Array

EM_STEPS = 8  # of expectation and maximisation, at most


def reestimated(
    candidate: Candidate, blocks: Sequence[Block], prior: Noise, noise: Noise, state: State
) -> Noise:
    """Estimate the noise from the residual: from what it was, or from no misfit on, whichever is likelier.

    A misfit hides from what whole runs share what that would explain, and may then never come down.
    """
    starts = [noise, noise.sound] if noise_room.misses(noise) else [noise]
    parts = [
        (
            block,
            block.measured - offset - matrix @ state.beta,
            noise_room.columns(block, noise, matrix, state.beta),
        )
        for block, (matrix, offset) in zip(blocks, designs(candidate, blocks, state), strict=True)
    ]
    reached = [_expected(start, prior, parts) for start in starts]
    if len(reached) == 1:
        return reached[0]
    return min(reached, key=lambda one: linearised(candidate, blocks, one, state, derivatives="none").cost)


def _expected(noise: Noise, prior: Noise, parts: Sequence[tuple[Block, Array, Array]]) -> Noise:
    """Take some steps of expectation–maximisation for the noise."""
    for _ in range(EM_STEPS):
        before, noise = noise, updated(noise, prior, parts)
        if noise_room.alike(before, noise):
            break
    return noise
