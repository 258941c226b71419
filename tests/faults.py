"""What does not hold, in words: for checks that several tests share, each of which then asserts that there is none."""

from __future__ import annotations


def faults(*claims: tuple[object, str]) -> list[str]:
    """Words of the claims that are false; a claim is whether something holds, and what it is, with its figure."""
    return [words for holds, words in claims if not holds]
