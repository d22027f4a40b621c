# SPDX-License-Identifier: Apache-2.0
"""The progress of a fit as one line of a terminal."""

from __future__ import annotations

from ..types.event import Event, Progress, StageEnd


class ProgressBar:
    """A bar where stderr is a terminal, with stage, loss and remaining time; each ended stage leaves a line."""

    def __init__(self) -> None:
        self._bar = None

    def show(self, event: Event) -> None:
        """Draw what the event tells; events without a place in the bar do nothing."""
        from tqdm import tqdm  # not at the top: `mfo --help` does not need it

        if isinstance(event, Progress):
            if self._bar is None:
                style = "{desc} {percentage:3.0f}%|{bar:24}| {postfix}"
                self._bar = tqdm(total=1.0, bar_format=style, leave=False, dynamic_ncols=True, disable=None)
            self._bar.set_description_str(f"{event.stage} ({event.stage_index + 1}/{event.stage_count})", refresh=False)
            left = f"{event.remaining_seconds:.0f} s left"
            self._bar.set_postfix_str(f"loss {event.best:.3g}, iteration {event.iteration}, {left}", refresh=False)
            self._bar.update(max(0.0, min(1.0, event.fraction) - self._bar.n))
        elif isinstance(event, StageEnd):
            tqdm.write(
                f"{event.stage}: {event.loss_start:.4g} -> {event.loss_best:.4g} "
                f"in {event.iterations} iterations. {event.sentence}",
                file=_stderr(),
            )

    def close(self) -> None:
        """Remove the bar from the terminal."""
        if self._bar is not None:
            self._bar.close()
            self._bar = None


def _stderr():  # type: ignore[no-untyped-def]  # looked up at the time of writing, tests replace it
    import sys

    return sys.stderr
