# SPDX-License-Identifier: Apache-2.0
"""The names of the files in a job folder, and the rule that its paths may not leave it."""

from __future__ import annotations

import os
import re
import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from ...types.errors import BadInputError

PICTURES = ("reference.png", "start.png", "result.png", "difference.png", "result.exr")


@dataclass(frozen=True)
class JobFolder:
    """One job; `root` is an absolute path with symlinks resolved."""

    root: Path

    @classmethod
    def open(cls, folder: str | os.PathLike[str]) -> JobFolder:
        """The existing folder as a job.

        Raises
        ------
        BadInputError
            If it does not exist or is not a folder.
        """
        path = Path(folder)
        if not path.is_dir():
            what = "is not a folder" if path.exists() else "does not exist"
            raise BadInputError(f"The job folder {path} {what}: give a folder that holds a request.json.")
        return cls(path.resolve())

    @property
    def request(self) -> Path:
        """What to do."""
        return self.root / "request.json"

    @property
    def progress(self) -> Path:
        """One event a line."""
        return self.root / "progress.jsonl"

    @property
    def cancel(self) -> Path:
        """Its existence asks the backend to stop."""
        return self.root / "cancel"

    @property
    def result(self) -> Path:
        """The outcome; complete when it exists."""
        return self.root / "result.json"

    @property
    def partial(self) -> Path:
        """The best values so far; complete when it exists, gone when there is a result."""
        return self.root / "partial.json"

    @property
    def pictures(self) -> Path:
        """Folder of the pictures."""
        return self.root / "pictures"

    @property
    def thumbnails(self) -> Path:
        """Folder of the same pictures, small, for a panel; during a fit of those that change, too."""
        return self.pictures / "thumbnails"

    @property
    def counted(self) -> Path:
        """White where the errors of the result are taken."""
        return self.pictures / "counted.png"

    @property
    def report(self) -> Path:
        """The report for a browser."""
        return self.root / "index.html"

    def file(self, relative: str, *, what: str) -> Path:
        """The existing file at a job-relative path; `what` names the place in the request for messages.

        Raises
        ------
        BadInputError
            If the path is absolute, leaves the folder (also by a symlink), or names no file.
        """
        parts = PurePosixPath(relative).parts
        absolute = relative.startswith("/") or re.match(r"[A-Za-z]:", relative) is not None
        if absolute or "\\" in relative or "\0" in relative:
            kind = "an absolute path" if absolute else "not a path with forward slashes"
            raise BadInputError(
                f"{what} is {relative!r}, {kind}: give it relative to the job folder, like 'scene.xml'."
            )
        if ".." in parts or not parts:
            raise BadInputError(f"{what} is {relative!r}, which leaves the job folder: put the file inside it.")
        path = self.root.joinpath(*parts)
        try:
            inside, there = path.resolve().is_relative_to(self.root), path.is_file()
        except (OSError, RuntimeError, ValueError):  # too long, links in a circle, or not encodable
            inside, there = True, False
        if not inside:
            raise BadInputError(f"{what} is {relative!r}, a link out of the job folder: put the file itself inside it.")
        if not there:
            raise BadInputError(f"{what} is {relative!r}, which is not in the job folder {self.root}: put it there.")
        return path

    def require_space(self, needed_bytes: int) -> None:
        """Check that results can be written before the time of a fit is spent.

        Raises
        ------
        BadInputError
            If no file can be created in the folder, or its disk has less than `needed_bytes` left.
        """
        try:
            with tempfile.TemporaryFile(dir=self.root):
                free = shutil.disk_usage(self.root).free
        except OSError as error:
            raise unwritable(self.root, error) from error
        if free < needed_bytes:
            raise BadInputError(
                f"The disk of the job folder {self.root} has {free / 1e6:.1f} MB left and the results need "
                f"{needed_bytes / 1e6:.1f} MB: free some space or choose another folder."
            )


def clear_outputs(folder: JobFolder) -> None:
    """Remove what an earlier run left and make the folders of pictures.

    Links go too: a stranger's folder may hold ``progress.jsonl`` as a link to a file of the user.

    Raises
    ------
    OSError
        If the folder cannot be written.
    """
    for path in (folder.result, folder.partial, folder.progress, folder.report):
        path.unlink(missing_ok=True)
    for pictures in (folder.pictures, folder.thumbnails):
        if pictures.is_symlink():
            pictures.unlink()
        pictures.mkdir(exist_ok=True)
        for path in pictures.iterdir():
            if path.name in PICTURES or path.name.endswith(".tmp") or pictures == folder.thumbnails:
                path.unlink()
    for path in folder.root.glob(".*.tmp"):  # left by a process that was killed while it wrote
        path.unlink()


def unwritable(folder: Path, error: OSError) -> BadInputError:
    """The sentence for a job folder that refuses a write."""
    reason = error.strerror or str(error)
    return BadInputError(
        f"The job folder {folder} cannot be written ({reason}): free some space, change its permissions or choose "
        "another folder."
    )
