# SPDX-License-Identifier: Apache-2.0
"""What an ICC profile in a display picture calls itself (ICC.1:2022: 7.3, table of tags; 10.15, text in languages)."""

from __future__ import annotations

import struct

_TAGS = 128  # bytes of the header, behind which the table of tags stands
_MOST = 100  # tags, and characters of a name: real profiles have some 20
_SRGB = ("srgb", "iec61966", "iec 61966", "rec.709", "rec709", "bt.709", "gray", "grey")


def other_profile(profile: bytes) -> str:
    """The name of a colour profile that is none of sRGB's primaries, or nothing; a damaged one has no name."""
    try:
        name = _description(profile)
    except (struct.error, UnicodeDecodeError):
        return ""
    return "" if any(known in name.lower() for known in _SRGB) else name


def _description(profile: bytes) -> str:
    (count,) = struct.unpack_from(">I", profile, _TAGS)
    for i in range(min(count, _MOST)):
        tag, at, size = struct.unpack_from(">4sII", profile, _TAGS + 4 + 12 * i)
        if tag != b"desc":
            continue
        data = profile[at : at + size]
        if data.startswith(b"desc"):  # of version 2
            (length,) = struct.unpack_from(">I", data, 8)
            return data[12 : 12 + min(length, _MOST)].split(b"\0")[0].decode("latin-1").strip()
        if data.startswith(b"mluc"):
            length, start = struct.unpack_from(">II", data, 20)
            return data[start : start + min(length, 2 * _MOST)].decode("utf-16-be").strip("\0 ")
    return ""
