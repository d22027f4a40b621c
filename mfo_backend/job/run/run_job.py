# SPDX-License-Identifier: Apache-2.0
"""One job from its request to pictures, report and result; every failure is one sentence and a status."""

from __future__ import annotations

import sys
import traceback
from dataclasses import replace
from pathlib import Path

from ...render.machine.memory import require_memory
from ...render.pictures.renderer import Interrupted
from ...report.live_pictures import LivePictures
from ...scene.image_file import check_reference, read_image
from ...types.errors import BadInputError, MfoError, first_line
from ...types.event import BestValues, Event, Progress
from ...types.image import Image
from ...types.status import Status
from ..folder.graph_request import COPY
from ..folder.job_folder import JobFolder, unwritable
from ..folder.picture_part import with_part
from ..folder.request import Request, read_request
from ..folder.view_request import view_of
from ..output.progress import EventWriter
from ..output.result import write_partial
from .fit_scene import Fitter, fit_scene
from .more_pictures import JobPicture, in_order, label, without_repeats
from .outputs import bytes_needed, write_outputs
from .stop import StopSignal

# Measured on Linux (docs/reference/reliability.md): Mitsuba, LLVM and the first kernels; libraries and stacks that are
# mapped but not used; pictures and what the metrics make of them. Rays come on top, see `render.paths.recorded_scene`.
_STARTUP_BYTES, _MAPPED_BYTES = 150_000_000, 380_000_000
_BYTES_PER_PIXEL = {"fast": 430, "balanced": 500, "best": 500, "paper": 500}
_CANCELLED_EARLY = "Cancelled before the fit had begun; nothing was changed."


def run_job(
    path: Path, events: EventWriter, stop: StopSignal, *, fitter: Fitter = fit_scene, trusted: bool = False
) -> Status:
    """Run the job in folder `path` and report its events; the last one is always `finished` or `failed`.

    Only a `trusted` job may name files that Mitsuba reads unchecked (docs/user/threats.md). A request that cannot be
    used leaves the folder as it was. Tracebacks go to stderr only.
    """
    try:
        status, sentence = _run(path, events, stop, fitter, trusted)
    except MfoError as error:
        return _fail(events, error.status, str(error))
    except Interrupted:
        return _fail(events, Status.CANCELLED, _CANCELLED_EARLY)
    except OSError as error:
        traceback.print_exc(file=sys.stderr)
        refused = unwritable(path, error)
        return _fail(events, refused.status, str(refused))
    except ImportError as error:  # a package is missing, or there was no memory for its library
        traceback.print_exc(file=sys.stderr)
        what = first_line(error)
        sentence = f"A package cannot be loaded ({what}): run `mfo doctor`, or free some memory."
        return _fail(events, Status.SETUP, sentence)
    except MemoryError:
        traceback.print_exc(file=sys.stderr)
        return _fail(events, Status.FAILED, "The fit ran out of memory: lower the resolution or the samples per pixel.")
    except Exception as error:
        traceback.print_exc(file=sys.stderr)
        what = first_line(error) or "no message"
        return _fail(
            events, Status.FAILED, f"The fit failed ({type(error).__name__}: {what}): the log holds the details."
        )
    events.finished(status, sentence)
    return status


def _run(path: Path, events: EventWriter, stop: StopSignal, fitter: Fitter, trusted: bool) -> tuple[Status, str]:
    stop.loading(lambda: events.failed(Status.CANCELLED, _CANCELLED_EARLY))
    folder = JobFolder.open(path)
    request = read_request(folder, trusted=trusted)
    pixels = sum(each.width * each.height for _, each in in_order(folder, request))
    together = f" in {len(request.more_pictures) + 1} pictures" if request.more_pictures else ""
    size = f"{pixels}" if together else f"{request.width}x{request.height}"
    require_memory(
        _STARTUP_BYTES + pixels * _BYTES_PER_PIXEL[request.fit.preset],
        mapped=_MAPPED_BYTES,
        what=f"A fit of {size} pixels{together}",
        cure="lower the resolution, or free some memory or raise its limit",
    )
    reference, notes = read_reference(folder, request)
    view = view_of(folder, request.view, request.view_table, reference)
    more, said_of_more = _read_more(JobPicture(folder, request, reference, view))
    folder.require_space(bytes_needed(request))
    events.attach(folder, LivePictures(reference, view))

    # the export may have said the same of the reference
    said = tuple(dict.fromkeys((*request.notes, *notes, *said_of_more)))

    def listener(event: Event) -> None:
        if isinstance(event, BestValues):
            write_partial(folder, event.result, notes=said)
            return
        if isinstance(event, Progress):
            stop.loaded()
        events(event)

    outcome = fitter(folder, request, reference, view, listener=listener, should_stop=stop.requested, more=more)
    stop.loaded()
    write_outputs([JobPicture(folder, request, reference, view), *more], outcome, notes=said)
    folder.cancel.unlink(missing_ok=True)  # it has been answered
    (folder.root / COPY).unlink(missing_ok=True)  # a whole .blend: with the result its end has come
    return outcome.result.status, outcome.result.message


def _read_more(first: JobPicture) -> tuple[list[JobPicture], list[str]]:
    """The further pictures of a job, and notes on them with their numbers."""
    pictures, said = [first], []
    for inner, more in list(in_order(first.folder, first.request))[1:]:
        try:
            reference, notes = read_reference(inner, more)
            pictures.append(JobPicture(inner, more, reference, view_of(inner, more.view, more.view_table, reference)))
        except BadInputError as error:
            raise BadInputError(f"Picture {label(more)}: {error}") from error
        fresh = [note for note in (*more.notes, *notes) if note not in first.request.notes]
        said += [f"Picture {label(more)}: {note}" for note in fresh]
    (_, *others), repeated = without_repeats(pictures)
    return others, [*repeated, *said]


def read_reference(folder: JobFolder, request: Request) -> tuple[Image, tuple[str, ...]]:
    """The checked reference with the request's encoding, and notes on what was changed in it.

    Raises
    ------
    BadInputError
        If it cannot be read, has another size than the scene, is all black or holds NaN or infinite pixels.
    """
    path = folder.file(request.reference, what="request.json: reference.path")
    image = read_image(path, (request.width, request.height))
    image, notes = check_reference(replace(image, encoding=request.encoding), request.width, request.height)
    image, said = with_part(image, request.part, folder)
    return image, (*notes, *said)


def _fail(events: EventWriter, status: Status, sentence: str) -> Status:
    events.failed(status, sentence)
    return status
