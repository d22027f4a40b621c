# SPDX-License-Identifier: GPL-3.0-or-later
"""A Blender beside this one that renders and bakes: started with the first thing to do, on a copy of the file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ..probe.client import Probe, ProbeError


class BakeError(Exception):
    """Cycles could not be asked; the message is a sentence."""


class Baker:
    """Sends requests to another Blender and waits for its answers.

    It is the one of `shared`, which then must not be asked anything else meanwhile, or else an own one that `start`
    starts.
    """

    def __init__(self, scene: str, view_layer: str, shared: Probe | None = None) -> None:
        self._words = {"scene": scene, "view_layer": view_layer}
        self._shared = shared
        self._probe: Probe | None = None
        self._asked, self._answers = 0, list[dict[str, Any] | BakeError]()

    def start(self) -> None:
        """Start the other Blender if it does not run; it opens the file while this one goes on.

        Raises
        ------
        BakeError
            If the file cannot be copied or no Blender can be started.
        """
        if self._probe is not None:
            return
        try:
            self._probe = self._shared or Probe()
            painted = _painted(self._probe.folder)
        except (ProbeError, OSError) as problem:
            self.close()
            raise BakeError(str(problem)) from problem
        if painted:
            self.ask("paint", images=painted)

    def ask(self, command: str, **request: Any) -> int:
        """Send a request and return its number, without waiting; errors are those of `start`."""
        self.start()
        assert self._probe is not None
        self._asked += 1
        place = self._probe.folder / f"bake_{self._asked}"
        place.mkdir()
        self._probe.send(command, folder=str(place), **self._words, **request)
        return self._asked

    def wait(self, number: int, things: int = 1) -> tuple[dict[str, Any], Path]:
        """Wait for an answer about so many things; returns it and the folder its files lie in until `close`.

        Raises
        ------
        BakeError
            If the request failed, or the other Blender is gone.
        """
        assert self._probe is not None
        while len(self._answers) < number:
            try:
                self._answers.append(self._probe.receive(things))
            except ProbeError as problem:
                self._answers.append(BakeError(str(problem)))
        found = self._answers[number - 1]
        if isinstance(found, BakeError):
            raise found
        return found, self._probe.folder / f"bake_{number}"

    def is_ready(self) -> bool:
        """Whether nothing that was asked would have to be waited for."""
        return self._probe is None or self._probe.is_answered(self._asked - len(self._answers))

    def close(self) -> None:
        """End the other Blender and remove its files, unless it is shared."""
        if self._probe is not None and self._probe is not self._shared:
            self._probe.close()
        self._probe = None


def _painted(folder: Path) -> list[dict[str, Any]]:
    """Keep the pixels of images that were painted and not saved, which a copy of the file does not hold."""
    found = []
    for image in bpy.data.images:
        if image.type not in ("IMAGE", "UV_TEST") or not (image.is_dirty and image.has_data and min(image.size)):
            continue
        raw = np.empty(len(image.pixels), dtype=np.float32)
        image.pixels.foreach_get(raw)
        pixels = np.ones((len(raw) // image.channels, 4), dtype=np.float32)
        pixels[:, : image.channels] = raw.reshape(-1, image.channels)
        path = folder / f"painted_{len(found)}.npy"
        np.save(path, pixels)
        found.append({"name": image.name, "size": list(image.size), "pixels": str(path)})
    return found
