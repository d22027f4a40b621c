# SPDX-License-Identifier: Apache-2.0
"""One target under atheris: ``python -m tests.fuzz.fuzz_one TARGET FOLDER SECONDS``, run by `tests.fuzz.campaign`.

An unexpected exception is written to FOLDER/crashes once per place in the code and the search goes on; a killed
process leaves its input there too (libFuzzer's own report).
"""

from __future__ import annotations

import hashlib
import sys
import tempfile
import traceback
from pathlib import Path

import atheris

with atheris.instrument_imports(include=["mfo_backend", "blender_addon", "PIL", "json", "xml"]):
    from tests.fuzz.targets import Target, checksummed_png, make_targets


def main() -> None:
    """Fuzz until the time is over; libFuzzer ends the process."""
    name, folder, seconds = sys.argv[1], Path(sys.argv[2]), int(sys.argv[3])
    memory = "/dev/shm" if Path("/dev/shm").is_dir() else None
    target = make_targets(Path(tempfile.mkdtemp(prefix="mfo-fuzz-", dir=memory)))[name]
    corpus, crashes = folder / "corpus" / name.replace(" ", "_"), folder / "crashes"
    corpus.mkdir(parents=True, exist_ok=True)
    crashes.mkdir(parents=True, exist_ok=True)
    for index, seed in enumerate(target.seeds):
        (corpus / f"seed_{index}").write_bytes(seed)
    dictionary = folder / f"{name.replace(' ', '_')}.dict"
    quoted = ("".join(f"\\x{byte:02x}" for byte in word) for word in target.words)
    dictionary.write_text("".join(f'"{word}"\n' for word in quoted))
    options = [
        f"-max_total_time={seconds}", "-max_len=4096", "-timeout=120", "-rss_limit_mb=3000", "-print_final_stats=1",
        f"-artifact_prefix={crashes}/{name.replace(' ', '_')}_", "-verbosity=0",
        *([f"-dict={dictionary}"] if target.words else []),
    ]  # fmt: skip
    atheris.Setup([sys.argv[0], str(corpus), *options], lambda data: _try(target, data, crashes))
    atheris.Fuzz()


def _try(target: Target, data: bytes, crashes: Path) -> None:
    if target.name == "png":
        data = checksummed_png(data)
    try:
        target.run(data)
    except target.refusals:
        return
    except Exception as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        mark = hashlib.sha1(f"{type(error)}{place.filename}{place.lineno}".encode()).hexdigest()[:12]
        file = crashes / f"{target.name.replace(' ', '_')}-{type(error).__name__}-{mark}"
        if not file.exists():
            file.write_bytes(data)
            file.with_suffix(".txt").write_text(traceback.format_exc())


if __name__ == "__main__":
    main()
