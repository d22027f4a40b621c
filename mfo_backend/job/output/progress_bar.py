# SPDX-License-Identifier: Apache-2.0
"""The progress of a fit as one line of a terminal."""

from __future__ import annotations

import math
import os
import sys

from ...types.event import Event, Progress, StageEnd, Started

_STYLE = "{desc} {percentage:3.0f}%|{bar:24}| {postfix}"


class ProgressBar:
    """A bar where stderr is a terminal, with stage, loss and remaining time; each ended stage leaves a line.

    A fit that begins again, from another material, has a bar of its own.
    """

    def __init__(self) -> None:
        self._bar = None

    def show(self, event: Event) -> None:
        """Draw what the event tells; events without a place in the bar do nothing."""
        from tqdm import tqdm  # not at the top: `mfo --help` does not need it

        if isinstance(event, Started):
            self.close()
        elif isinstance(event, Progress):
            if self._bar is None:
                self._bar = tqdm(
                    total=1.0,
                    bar_format=_STYLE,
                    leave=False,
                    disable=None,  # shown on a terminal only
                    miniters=0,
                    ncols=terminal_columns(),
                    nrows=20,  # tqdm would ask the terminal, and draw nothing where it reports no rows
                )
            self._bar.set_description_str(f"{event.stage} ({event.stage_index + 1}/{event.stage_count})", refresh=False)
            left = f"{event.remaining_seconds:.0f} s left"
            self._bar.set_postfix_str(f"loss {event.best:.3g}, iteration {event.iteration}, {left}", refresh=False)
            self._bar.update(max(0.0, min(1.0, event.fraction) - self._bar.n))
        elif isinstance(event, StageEnd) and math.isfinite(event.loss_best):  # not one that ended before its first step
            tqdm.write(
                f"{event.stage}: {event.loss_start:.4g} -> {event.loss_best:.4g} "
                f"in {event.iterations} iterations. {event.sentence}",
                file=sys.stderr,
            )

    def close(self) -> None:
        """Remove the bar from the terminal."""
        if self._bar is not None:
            self._bar.close()
            self._bar = None


def terminal_columns() -> int:
    """Width of the terminal at stderr; some report none, and tqdm would draw nothing there."""
    try:
        return os.get_terminal_size(2).columns or 100
    except OSError:
        return 100
