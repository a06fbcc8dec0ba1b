"""Whether a vehicle that says nothing to a name has no such parameter, or only was not heard: judged by what it did
answer meanwhile."""

from __future__ import annotations

from dataclasses import dataclass

CERTAIN = 1e-4
"""A name is absent when the chance that all questions for it were lost is smaller."""


@dataclass(slots=True)
class LinkEvidence:
    """Questions that the vehicle had to answer: about what it surely has."""

    answered: int = 0
    missed: int = 0

    def chance_of_silence(self, questions: int) -> float:
        """That so many questions in a row are lost, whatever share the link loses.

        Beta-binomial: the mean over all shares, each as likely beforehand as any other, after what was answered and
        missed. A product instead of two beta functions, which cancel for small counts.
        """
        chance = 1.0
        for lost in range(questions):
            chance *= (self.missed + 1 + lost) / (self.missed + self.answered + 2 + lost)
        return chance

    def tells_absent(self, questions: int) -> bool:
        return self.chance_of_silence(questions) < CERTAIN
