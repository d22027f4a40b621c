# SPDX-License-Identifier: Apache-2.0
"""What counts as a named number."""

from __future__ import annotations

from studies.census import Census, census

SOURCE = '''
"""A module."""
LIMIT = 3.5  # metres
# of the box
SHARES = (0.1, -2.0 * 0.3)
PLAIN = 7
NAMES = ("a", 1)
TABLE = [1, 2]

class Plan:
    starts: int = 3
    name: str = "x"

def f(x=0.25):
    y = 0.7 * x + 1.0
    return y > 1e-6
'''


def test_named_numbers_their_words_and_other_literals() -> None:
    lines = len(SOURCE.splitlines())
    assert census({"a.py": SOURCE}) == Census(files=1, lines=lines, module=3, fields=1, said=2, literals=1)
