# SPDX-License-Identifier: Apache-2.0
"""The further pictures of a job: each is a job folder of its own inside of the first one's."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ...metrics.display.tone_mapping import View
from ...render.sheet.contact_sheet import ContactSheet
from ...types.errors import BadInputError
from ...types.event import Event, Listener, Preview
from ...types.image import Image
from ..folder.job_folder import JobFolder
from ..folder.request import Request

SAME_PICTURE = "Picture {second} is picture {first} again, with the same scene: it was left out."
SAME_PIXELS = "Pictures {first} and {second} are the same, but their scenes differ: one of them has a wrong file."


@dataclass(frozen=True)
class JobPicture:
    """A picture of a job: its folder, what this asks for, the checked reference and the view it is seen through."""

    folder: JobFolder
    request: Request
    reference: Image
    view: View

    @property
    def label(self) -> str:
        """Number and name for messages."""
        return label(self.request)


def label(request: Request) -> str:
    """Number and name of a request's picture for messages."""
    return f"{request.picture.number} ({request.picture.name})" if request.picture.name else str(request.picture.number)


def in_order(folder: JobFolder, request: Request) -> Iterator[tuple[JobFolder, Request]]:
    """Folder and request of each picture of a job, the first one's first."""
    yield folder, request
    for path, more in request.more_pictures:
        yield JobFolder((folder.root / path).resolve()), more


def without_repeats(pictures: Sequence[JobPicture]) -> tuple[list[JobPicture], list[str]]:
    """The pictures that are not there before, and sentences on those that look alike.

    Raises
    ------
    BadInputError
        If all pictures are one, which is a job of one picture.
    """
    kept: list[JobPicture] = []
    notes = []
    for picture in pictures:
        twin = next((k for k in kept if np.array_equal(k.reference.pixels, picture.reference.pixels)), None)
        names = {} if twin is None else {"first": twin.label, "second": picture.label}
        if twin is not None and _scene(twin) == _scene(picture):
            notes.append(SAME_PICTURE.format(**names))
            continue
        if twin is not None:
            notes.append(SAME_PIXELS.format(**names))
        kept.append(picture)
    if len(kept) == 1 and len(pictures) > 1:
        raise BadInputError("All pictures are the same one in the same scene: give one, or pictures that differ.")
    return kept, notes


def told_of_first(listener: Listener, sheet: ContactSheet, event: Event) -> None:
    """Tell an event; of a sheet's picture the first of its pictures."""
    listener(Preview(sheet.picture(event.image, 0)) if isinstance(event, Preview) else event)


def _scene(picture: JobPicture) -> bytes:
    return (picture.folder.root / picture.request.scene).read_bytes()
