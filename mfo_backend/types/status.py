# SPDX-License-Identifier: Apache-2.0
"""One vocabulary of outcomes for command line, JSON and panel."""

from __future__ import annotations

from enum import Enum


class Status(Enum):
    """How a stage or a whole fit ended; the value is the code in JSON, `sentence` is what a user reads."""

    CONVERGED = "converged"
    STALE = "stale"
    UNCHANGED = "unchanged"
    MAX_ITERATIONS = "max_iterations"
    CANCELLED = "cancelled"
    BAD_INPUT = "bad_input"
    SETUP = "setup"
    FAILED = "failed"
    DIFFERENT = "different"

    @property
    def sentence(self) -> str:
        """What this outcome means, as one sentence for the user."""
        return _SENTENCES[self]

    @property
    def exit_code(self) -> int:
        """Exit code of the `mfo` command: 0 done, 1 failed, 2 bad input, 3 something is not installed, 4 cancelled,
        5 the result does not match the reference.
        """
        return _EXIT_CODES.get(self, 0)


_SENTENCES = {
    Status.CONVERGED: "The fit converged.",
    Status.STALE: "The best loss did not improve for ten iterations.",
    Status.UNCHANGED: "The loss did not change for ten iterations.",
    Status.MAX_ITERATIONS: "The maximum number of iterations was reached; more iterations may improve the result.",
    Status.CANCELLED: "Cancelled; the best values so far were kept.",
    Status.BAD_INPUT: "The input cannot be used.",
    Status.SETUP: "Something the backend needs is missing; run `mfo doctor`.",
    Status.FAILED: "The fit failed.",
    Status.DIFFERENT: "The result does not match the reference.",
}
_EXIT_CODES = {Status.FAILED: 1, Status.BAD_INPUT: 2, Status.SETUP: 3, Status.CANCELLED: 4, Status.DIFFERENT: 5}
