# SPDX-License-Identifier: Apache-2.0
"""A stand-in for the backend's Python: takes the same command line, tells the same events, computes nothing.

Run as a program it reads request.json and writes pictures and result.json. MFO_FAKE steers it: `seconds` it takes,
`end` (finished, failed, crash, deaf; cancelled: before it began; killed: by SIGKILL half way). Only the standard
library, so that any Python of any machine can run it.
"""

from __future__ import annotations

import json
import os
import signal
import struct
import sys
import threading
import time
import zlib
from functools import cache
from pathlib import Path

STAGES = ("mse-hdr", "flip-hdr")
STEPS = 20
RECOVERED = {"base_color": [0.25, 0.5, 0.0625], "roughness": 0.3125, "metallic": 0.125}
INITIAL = {"base_color": [0.8, 0.8, 0.8], "roughness": 0.5, "metallic": 0.0}


def write_interpreter(path: Path) -> Path:
    """A program at `path` that runs this file in place of a backend's Python."""
    path.write_text(f"#!/bin/sh\nexec python3 '{Path(__file__).resolve()}' \"$@\"\n")
    path.chmod(0o755)
    return path


@cache  # each fit of the tests draws some forty
def _inside(width: int, height: int) -> list[tuple[int, int]]:
    """For each row how many pixels are beside the disc, to its left, and how many are inside."""
    rows = []
    for y in range(height):
        square = (min(width, height) * 0.4) ** 2 - (y - height / 2) ** 2
        columns = [x for x in range(width) if (x - width / 2) ** 2 < square]
        rows.append((columns[0] if columns else 0, len(columns)))
    return rows


def disc(colour: tuple[int, int, int], width: int, height: int) -> list[bytes]:
    """Rows of a picture with a disc of one 8-bit sRGB colour on grey."""
    grey, own = bytes((90, 90, 90)), bytes(colour)
    spans = _inside(width, height)
    return [grey * beside + own * inside + grey * (width - beside - inside) for beside, inside in spans]


def thumbnail(pictures: Path, name: str, colour: tuple[int, int, int], size: tuple[int, int] = (96, 64)) -> str:
    """The same as a thumbnail in a job's folder of pictures; returns its path from the job's."""
    path = pictures / "thumbnails" / f"{name}.ppm"
    path.parent.mkdir(exist_ok=True)
    path.with_suffix(".tmp").write_bytes(b"P6 %d %d 255\n" % size + b"".join(disc(colour, *size)))
    os.replace(path.with_suffix(".tmp"), path)
    return f"pictures/thumbnails/{name}.ppm"


def png(path: Path, colour: tuple[int, int, int], width: int = 96, height: int = 64) -> None:
    """A PNG with a disc of one 8-bit sRGB colour on grey."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    rows = b"".join(b"\0" + row for row in disc(colour, width, height))
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    data = chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(bytes(rows))) + chunk(b"IEND", b"")
    temporary = path.with_suffix(".tmp")
    temporary.write_bytes(b"\x89PNG\r\n\x1a\n" + data)
    os.replace(temporary, path)


def say(**event: object) -> None:
    """One event on stdout."""
    print(json.dumps(event), flush=True)


def main(arguments: list[str]) -> int:
    """Act as `python -m mfo_backend run JOB ...`, as `judge`, or as `doctor --json` where all is well."""
    if arguments[:3] == ["-m", "mfo_backend", "judge"]:
        return judge(Path(arguments[3]), Path(arguments[4]))
    if arguments[2:] == ["doctor", "--json"]:
        found = {"Python": "3.12.0 on Linux", "mitsuba": "0.0", "drjit": "0.0", "Mitsuba variant": "llvm_ad_rgb"}
        checks = [{"name": name, "state": "ok", "found": text, "cure": ""} for name, text in found.items()]
        print(json.dumps({"works": True, "checks": checks}))
        return 0
    assert arguments[:3] == ["-m", "mfo_backend", "run"], arguments
    folder = Path(arguments[3]) if arguments[3] != "--wait" else wait_for_job()
    control = json.loads(os.environ.get("MFO_FAKE", "{}"))
    request = json.loads((folder / "request.json").read_text("utf-8"))
    cancelled = threading.Event()

    def listen() -> None:
        for line in sys.stdin:
            if json.loads(line).get("cmd") == "cancel":
                cancelled.set()
        os._exit(5) if not cancelled.is_set() else None

    if control.get("end") != "deaf":
        threading.Thread(target=listen, daemon=True).start()
    print("fake backend at work", file=sys.stderr, flush=True)
    pictures = folder / "pictures"
    pictures.mkdir(exist_ok=True)
    if control.get("end") == "failed":
        say(
            event="failed",
            status="bad_input",
            sentence="Reference is 128x128 but the scene renders 256x256: render it anew.",
        )
        return 2
    if control.get("end") == "cancelled":
        cancelled.wait(60.0)
        say(event="failed", status="cancelled", sentence="Cancelled before the fit had begun; nothing was changed.")
        return 4
    if control.get("end") == "crash":
        print("Illegal instruction in a far away library", file=sys.stderr, flush=True)
        os.abort()
    png(pictures / "reference.png", (180, 60, 40))
    say(event="started", stages=STAGES, parameters=list(RECOVERED), seconds=0.1)
    pause, steps = control.get("seconds", 0.05) / (STEPS * len(STAGES)), STEPS * len(STAGES)
    for i in range(steps):
        stage = STAGES[i // STEPS]
        fraction = (i + 1) / steps
        loss = 0.2 * 0.9**i
        say(
            event="progress", stage=stage, stage_index=i // STEPS, stage_count=2, iteration=i % STEPS, loss=loss * 1.1,
            best=loss, fraction=fraction, seconds=i * pause, remaining_seconds=(steps - i - 1) * pause,
        )  # fmt: skip
        if i % 4 == 0:
            shown = (int(120 + 60 * fraction), int(120 - 60 * fraction), int(120 - 80 * fraction))
            say(
                event="preview", path=thumbnail(pictures, "current", shown),
                reference=thumbnail(pictures, "reference", (180, 60, 40)),
                difference=thumbnail(pictures, "current_difference", (int(200 - 180 * fraction), 20, 60)),
            )  # fmt: skip
        if i % STEPS == STEPS - 1:
            say(
                event="stage_end", stage=stage, status="stale", iterations=STEPS, loss_start=0.2, loss_best=loss,
                sentence="The best loss did not improve for ten iterations.",
            )  # fmt: skip
        if control.get("end") == "killed" and i == steps // 2:
            write_result(folder, "partial", "failed", "The fit ended by itself.", request, partial=True)
            os.kill(os.getpid(), signal.SIGKILL)
        time.sleep(pause)
        if cancelled.is_set():
            break
    for name, colour in (("start", (120, 120, 120)), ("result", (178, 62, 42)), ("difference", (20, 10, 60))):
        png(pictures / f"{name}.png", colour)
        thumbnail(pictures, name, colour)
    png(pictures / "curve.png", (86, 156, 240))
    (folder / "index.html").write_text("<!doctype html><title>report</title>")
    partial = cancelled.is_set()
    status = "cancelled" if partial else "stale"
    sentence = (
        "Cancelled; the best values so far were kept." if partial else "The result looks the same as the reference."
    )
    write_result(folder, "result", status, sentence, request, partial=partial)
    write_materials(folder, status, control.get("different", []))
    say(event="finished", status=status, sentence=sentence, result="result.json")
    return 4 if partial else 0


def wait_for_job() -> Path:
    """Act as `python -m mfo_backend run --wait SECONDS`."""
    say(event="waiting", memory_mb=210)
    line = sys.stdin.readline()
    if not line:
        sys.exit(0)
    folder = Path(json.loads(line)["job"])
    os.dup2(os.open(folder / "backend.log", os.O_WRONLY | os.O_CREAT | os.O_TRUNC), 2)
    say(event="accepted")
    return folder


def write_result(folder: Path, name: str, status: str, sentence: str, request: dict, *, partial: bool) -> None:
    """result.json or partial.json, by rename."""
    result = {
        "schema_version": 1, "status": status, "sentence": sentence, "model": "mitsuba_principled", "partial": partial,
        "initial": INITIAL, "recovered": RECOVERED, "bounds": {}, "stages": [], "seconds": 1.0, "passes": 1.0,
        "errors": {"flip": [0.21, 0.012], "hdr_flip": [0.3, 0.05], "mse": [0.1, 0.0004]},
        "weak_combinations": [{"parameters": ["metallic"], "step": {}, "sentence": "Metallic and roughness."}],
        "certainty": {"roughness": {"sd": [0.01], "level": "determined"}, "metallic": {"sd": [0.2], "level": "weak"}},
        "verdict": "same", "verdict_sentence": sentence, "verdict_cause": None,
        "notes": ["Light 'Sun': specular factor is ignored."], "versions": {}, "request_fit": request["fit"],
    }  # fmt: skip
    (folder / f"{name}.tmp").write_text(json.dumps(result))
    os.replace(folder / f"{name}.tmp", folder / f"{name}.json")


def write_materials(folder: Path, status: str, different: list[str]) -> None:
    """The results of a job's several materials, of which those named `different` do not match."""
    job = json.loads((folder / "request.json").read_text("utf-8"))
    materials = []
    for path in job.get("targets", []):
        request = json.loads((folder / path / "request.json").read_text("utf-8"))
        name = request["target"]["material"]
        write_result(folder / path, "result", status, f"{name} is found.", request, partial=False)
        file = folder / path / "result.json"
        result = json.loads(file.read_text())
        if name in different:
            result["verdict"] = "different"
            file.write_text(json.dumps(result))
        materials.append({"folder": path, "material": name, **result})
    if materials:
        whole = json.loads((folder / "result.json").read_text()) | {"materials": materials, "recovered": {}}
        (folder / "result.json").write_text(json.dumps(whole))


def judge(folder: Path, picture: Path) -> int:
    """Act as `python -m mfo_backend judge JOB PICTURE --json`."""
    assert picture.stat().st_size > 0
    for name, colour in (("cycles", (175, 64, 44)), ("cycles_difference", (24, 12, 64))):
        png(folder / "pictures" / f"{name}.png", colour)
        thumbnail(folder / "pictures", name, colour)
    print(json.dumps({"status": "ok", "metrics": {"flip": 0.0234}, "notes": []}), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
