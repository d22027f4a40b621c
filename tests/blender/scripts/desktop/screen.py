# SPDX-License-Identifier: Apache-2.0
"""Mouse, keys and drops through an X server, as a hand and a file manager send them; no desktop has to run.

Events go through the extension XTEST (X11R6), drops by the XDND protocol, version 5
(https://www.freedesktop.org/wiki/Specifications/XDND). Places are pixels of the screen from its upper left.
"""

import ctypes
import sys
import time
from ctypes import byref, c_char_p, c_int, c_long, c_uint, c_ulong, c_void_p
from pathlib import Path

CLIENT_MESSAGE, SELECTION_NOTIFY, SELECTION_REQUEST = 33, 31, 30
BUTTONS = {"LEFTMOUSE": 1, "RIGHTMOUSE": 3, "WHEELUPMOUSE": 4, "WHEELDOWNMOUSE": 5}
KEYS = {"RET": "Return", "ESC": "Escape", "UP_ARROW": "Up", "COMMA": "comma", "BACK_SPACE": "BackSpace"}
VERSION = 5  # of XDND
PATIENCE = 10.0  # seconds until a window has taken what was dropped


class Message(ctypes.Structure):
    _fields_ = (
        ("type", c_int), ("serial", c_ulong), ("send_event", c_int), ("display", c_void_p), ("window", c_ulong),
        ("message_type", c_ulong), ("format", c_int), ("data", c_long * 5),
    )  # fmt: skip


class Request(ctypes.Structure):
    _fields_ = (
        ("type", c_int), ("serial", c_ulong), ("send_event", c_int), ("display", c_void_p), ("owner", c_ulong),
        ("requestor", c_ulong), ("selection", c_ulong), ("target", c_ulong), ("property", c_ulong), ("time", c_ulong),
    )  # fmt: skip


class Answer(ctypes.Structure):
    _fields_ = (
        ("type", c_int), ("serial", c_ulong), ("send_event", c_int), ("display", c_void_p), ("requestor", c_ulong),
        ("selection", c_ulong), ("target", c_ulong), ("property", c_ulong), ("time", c_ulong),
    )  # fmt: skip


class Event(ctypes.Union):
    _fields_ = (("type", c_int), ("message", Message), ("request", Request), ("answer", Answer), ("pad", c_long * 24))


class Screen:
    """A connection of its own to the X server that DISPLAY names."""

    def __init__(self):
        self.x11, self.test = ctypes.CDLL("libX11.so.6"), ctypes.CDLL("libXtst.so.6")
        self.x11.XOpenDisplay.restype = c_void_p
        for name in ("XInternAtom", "XStringToKeysym", "XDefaultRootWindow", "XCreateSimpleWindow", "XKeycodeToKeysym"):
            getattr(self.x11, name).restype = c_ulong
        self.display = c_void_p(self.x11.XOpenDisplay(None))
        assert self.display, "no X server"
        self.root = c_ulong(self.x11.XDefaultRootWindow(self.display))

    def move(self, x, y):
        self.test.XTestFakeMotionEvent(self.display, -1, int(x), int(y), c_ulong(0))
        self._send()

    def button(self, kind, *, down):
        self.test.XTestFakeButtonEvent(self.display, BUTTONS[kind], int(down), c_ulong(0))
        self._send()

    def key(self, name, *, down):
        """A key by what Blender or X calls it; a sign of the second row of a key with Shift."""
        code, is_upper = self._code(KEYS.get(name, name))
        if is_upper and down:
            self.test.XTestFakeKeyEvent(self.display, self._code("Shift_L")[0], 1, c_ulong(0))
        self.test.XTestFakeKeyEvent(self.display, code, int(down), c_ulong(0))
        if is_upper and not down:
            self.test.XTestFakeKeyEvent(self.display, self._code("Shift_L")[0], 0, c_ulong(0))
        self._send()

    def drop(self, path, x, y):
        """Drag a file to a place and let it go there; True where the window has said that it took it."""
        self.move(x, y)
        source = c_ulong(self.x11.XCreateSimpleWindow(self.display, self.root, 0, 0, 1, 1, 0, c_ulong(0), c_ulong(0)))
        self.x11.XSetSelectionOwner(self.display, self._atom("XdndSelection"), source, c_ulong(0))
        target, uris = self._window_at(x, y), self._atom("text/uri-list")
        time.sleep(0.2)
        self._tell(target, "XdndEnter", source.value, VERSION << 24, uris.value)
        for _ in range(3):  # over the place for a moment, as with a hand
            place = int(x) << 16 | int(y)
            self._tell(target, "XdndPosition", source.value, 0, place, 0, self._atom("XdndActionCopy").value)
            time.sleep(0.3)
        self._tell(target, "XdndDrop", source.value)
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            if self._answered(f"{Path(path).as_uri()}\r\n".encode()):
                return True
            time.sleep(0.05)
        return False

    def _answered(self, data):
        """Hand the data over to whoever asks for it; whether the target has said that it is done."""
        event, finished = Event(), False
        while self.x11.XPending(self.display):
            self.x11.XNextEvent(self.display, byref(event))
            if event.type == SELECTION_REQUEST:
                asked = event.request
                self.x11.XChangeProperty(
                    self.display, c_ulong(asked.requestor), c_ulong(asked.property), c_ulong(asked.target), 8, 0,
                    c_char_p(data), len(data),
                )  # fmt: skip
                answer = Event()
                answer.answer = Answer(
                    SELECTION_NOTIFY, 0, 1, None, asked.requestor, asked.selection, asked.target, asked.property,
                    asked.time,
                )  # fmt: skip
                self.x11.XSendEvent(self.display, c_ulong(asked.requestor), 0, c_long(0), byref(answer))
                self.x11.XFlush(self.display)
            elif event.type == CLIENT_MESSAGE:
                finished |= event.message.message_type == self._atom("XdndFinished").value
        return finished

    def _tell(self, window, name, *data):
        event = Event()
        values = (c_long * 5)(*data, *[0] * (5 - len(data)))
        event.message = Message(CLIENT_MESSAGE, 0, 1, None, window.value, self._atom(name).value, 32, values)
        self.x11.XSendEvent(self.display, window, 0, c_long(0), byref(event))
        self.x11.XFlush(self.display)

    def _send(self):
        """Wait for the server too: on busy cores a mouse that goes on would be seen here and there alone."""
        self.x11.XSync(self.display, 0)

    def _window_at(self, x, y):
        """The window of a program at a place, which is the root's child where no window manager runs."""
        child, found = c_ulong(), (c_int(), c_int())
        self.x11.XTranslateCoordinates(
            self.display, self.root, self.root, int(x), int(y), byref(found[0]), byref(found[1]), byref(child)
        )
        return child

    def _atom(self, name):
        return c_ulong(self.x11.XInternAtom(self.display, name.encode(), 0))

    def _code(self, name):
        if len(name) == 1 and not name.isalnum():
            symbol = ord(name)  # of Latin-1, whose signs have their own number
        else:
            symbol = self.x11.XStringToKeysym(name.encode())
        code = self.x11.XKeysymToKeycode(self.display, c_ulong(symbol)) & 0xFF
        assert code, f"no key for {name}"
        return code, self.x11.XKeycodeToKeysym(self.display, c_uint(code), 0) != symbol


if __name__ == "__main__":  # a program of its own, as whoever takes a drop waits for the data
    file, *where = sys.argv[1:]
    sys.exit(0 if Screen().drop(file, *map(int, where)) else 1)
