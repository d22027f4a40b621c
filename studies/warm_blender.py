# SPDX-License-Identifier: Apache-2.0
"""Second Blenders that need no start: processes with bpy loaded, each of which answers one export after another.

    python -m studies.warm_blender serve SOCKET
    python -m studies.warm_blender relay PLACE WORD ...

Loading bpy takes a second of each small scene. Each export opens a file of its own in them, as a new one would. The
study starts both parts.
"""

from __future__ import annotations

import argparse
import contextlib
import functools
import json
import os
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from unittest import mock

LONGEST = 1 << 20  # bytes of a request: arguments, environment and folder of a process
STREAMS = 3  # stdin, stdout, stderr
LOOK_SECONDS = 1.0  # between two looks whether the study is still there
AT_ONCE = 2  # an export asks one for values of nodes while another bakes


@contextlib.contextmanager
def warm_blenders() -> Iterator[None]:
    """Exports within ask Blenders that run already."""
    from blender_addon.probe import client

    with tempfile.TemporaryDirectory() as folder, socket.socket(socket.AF_UNIX) as listener:
        place = Path(folder) / "socket"
        listener.bind(str(place))
        listener.listen()
        file = listener.fileno()
        words = [sys.executable, "-m", __name__, "serve", str(file)]
        servers = [_KeptServer(words, folder, [file]) for _ in range(AT_ONCE)]
        relay = [sys.executable, "-I", "-S", __file__, "relay", str(place)]
        try:
            with mock.patch.object(client, "own_blender", lambda _, arguments: [*relay, *arguments]):
                yield
        finally:
            for server in servers:
                server.end()


class _KeptServer:
    """A process that is started again where it ends, as a Blender may in an export."""

    def __init__(self, words: list[str], folder: str, files: list[int]) -> None:
        self._start = functools.partial(subprocess.Popen, words, pass_fds=files, env=os.environ | {"TMPDIR": folder})
        self._wanted, self._process = True, self._start()
        self._thread = threading.Thread(target=self._keep, daemon=True)
        self._thread.start()

    def end(self) -> None:
        self._wanted = False
        self._process.kill()
        self._thread.join()

    def _keep(self) -> None:
        while True:
            self._process.wait()
            if not self._wanted:
                return
            self._process = self._start()


def serve(listener: socket.socket) -> None:
    """Be the second Blender of one connection after another, until this process is killed."""
    from blender_addon.probe import server

    threading.Thread(target=_end_with, args=(os.getppid(),), daemon=True).start()
    own = [os.dup(stream) for stream in range(STREAMS)]
    while True:
        connection, _ = listener.accept()
        with connection:
            text, files, _, _ = socket.recv_fds(connection, LONGEST, STREAMS)
            _put_streams(files)
            for file in files:
                os.close(file)
            request = json.loads(text)
            words = request["words"]
            at = words.index("--parent")  # that of the relay, whose end says nothing
            sys.stdin = open(0, encoding="utf-8", closefd=False)  # noqa: SIM115 - as long as the connection
            os.chdir(request["folder"])
            answered = threading.Event()
            watch = threading.Thread(target=_end_unless, args=(answered, connection), daemon=True)
            watch.start()
            try:
                server.main([*words[:at], *words[at + 2 :]])
            finally:
                os.chdir("/")
                _put_streams(own)
                answered.set()
                connection.shutdown(socket.SHUT_RDWR)
                watch.join()


def _end_with(parent: int) -> None:
    """End this process when the study is gone."""
    while os.getppid() == parent:
        time.sleep(LOOK_SECONDS)
    os._exit(1)


def _end_unless(answered: threading.Event, connection: socket.socket) -> None:
    """End this process if its relay is killed before all is answered, as a second Blender would be."""
    connection.recv(1)  # nothing is sent: it returns at the end of either side
    if not answered.is_set():
        os._exit(1)


def _put_streams(files: list[int]) -> None:
    sys.stdout.flush()
    sys.stderr.flush()
    for stream, file in enumerate(files):
        os.dup2(file, stream)


def relay(place: str, words: list[str]) -> None:
    """Stand for the second Blender in the process that asks: its streams and words go to one that runs."""
    with socket.socket(socket.AF_UNIX) as connection:
        connection.connect(place)
        request = {"words": words, "folder": os.getcwd()}
        socket.send_fds(connection, [json.dumps(request).encode()], range(STREAMS))
        for stream in range(STREAMS):
            os.close(stream)
        connection.recv(1)  # nothing is sent: it returns when the export asks no more


def main() -> None:
    """What a process of its own is for: to serve, or to relay."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("part", choices=("serve", "relay"))
    parser.add_argument("place", help="the number of a socket that listens, or the path of one")
    parser.add_argument("words", nargs=argparse.REMAINDER, help="those of a second Blender")
    given = parser.parse_args()
    if given.part == "serve":
        serve(socket.socket(fileno=int(given.place)))
    else:
        relay(given.place, given.words)


if __name__ == "__main__":
    main()
