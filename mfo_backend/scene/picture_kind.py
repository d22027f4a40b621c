# SPDX-License-Identifier: Apache-2.0
"""What a picture file is by its first bytes, whatever it is called, and how its EXIF data want it shown."""

from __future__ import annotations

from pathlib import Path

from ..types.errors import BadInputError

# orientation of EXIF 2.3, 4.6.4, in words; 1 is as stored
SHOWN = {
    2: "mirrored",
    3: "turned by 180 degrees",
    4: "mirrored and turned by 180 degrees",
    5: "mirrored and turned by 90 degrees to the left",
    6: "turned by 90 degrees to the right",
    7: "mirrored and turned by 90 degrees to the right",
    8: "turned by 90 degrees to the left",
}
_DISPLAY = "display"
_READ = {".exr": "an OpenEXR", ".hdr": "a Radiance HDR"}
_STARTS = (
    (0, b"\x76\x2f\x31\x01", "an OpenEXR"),
    (0, b"#?", "a Radiance HDR"),
    (0, b"\x89PNG", _DISPLAY),
    (0, b"\xff\xd8\xff", _DISPLAY),
    (0, b"II*\0", _DISPLAY),
    (0, b"MM\0*", _DISPLAY),
    (8, b"WEBP", _DISPLAY),
    (0, b"GIF8", "a GIF"),
    (0, b"8BPS", "a Photoshop"),
    (0, b"DDS ", "a DDS"),
    (0, b"\xff\x0a", "a JPEG XL"),
    (4, b"JXL ", "a JPEG XL"),
    (4, b"jP  ", "a JPEG 2000"),
    (4, b"ftyp", "an HEIC, AVIF or film"),
    (0, b"SDPX", "a DPX"),
    (0, b"XPDS", "a DPX"),
)


def refuse_another_kind(path: Path) -> None:
    """Refuse a file that is a picture of another kind than its name says, so that it is not called damaged.

    Raises
    ------
    BadInputError
        If it is.
    """
    with path.open("rb") as file:
        start = file.read(16)
    suffix = path.suffix.lower()
    found = next((kind for at, mark, kind in _STARTS if start[at : at + len(mark)] == mark), None)
    if found is None or found == _READ.get(suffix, _DISPLAY):
        return  # not known here: its reader says more
    ending = {kind: name for name, kind in _READ.items()}.get(found, ".png, .jpg or .tif")
    if found == _DISPLAY or found in _READ.values():
        what = "a PNG, JPEG, TIFF or WebP" if found == _DISPLAY else found
        raise BadInputError(f"Image {path.name!r} is {what} file that is called {suffix}: rename it to {ending}.")
    raise BadInputError(f"Image {path.name!r} is {found} file, which is not read: save it as PNG or OpenEXR.")
