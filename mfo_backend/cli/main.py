# SPDX-License-Identifier: Apache-2.0
"""The `mfo` command: finds the sub-command, loads its module alone, and turns errors into one line and an exit code."""

from __future__ import annotations

import argparse
import importlib
import json
import sys
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import TextIO

from .. import __version__
from .. import one_blas_thread as one_blas_thread
from ..render.machine.cache_folder import use_kernel_cache
from ..render.machine.temporary_folder import remove_abandoned
from ..types.errors import MfoError
from ..types.status import Status

# module of the same name in this folder, and its line in `mfo --help`, which imports none of them
COMMANDS = {
    "doctor": "say what works on this machine and how to mend what does not",
    "demo": "fit a material in a scene that is built on the spot",
    "fit": "fit a material of a Mitsuba scene to a reference picture",
    "blend": "fit a material of a .blend file to a reference picture",
    "compare": "measure the difference between two pictures",
    "judge": "measure a picture against the reference of a job",
    "apply": "put the values of a result on a material of a .blend file",
    "batch": "run many job folders, several at a time or on a cluster",
    "bench": "measure speed against error on random scenes",
    "completion": "print what makes a shell complete mfo's words",
    "run": "run a job folder (what the Blender add-on starts)",
}
# of each command, shown below its help
EXAMPLES = {
    "doctor": ("mfo doctor",),
    "demo": ("mfo demo", "mfo demo --scene-seed 7 --size 128  # another material, a smaller picture"),
    "fit": (
        "mfo fit scene.xml --target vase --reference photo.exr",
        "mfo fit scene.xml --target vase --reference photo.png --parameters base_color,roughness",
    ),
    "blend": (
        "mfo blend shot.blend --object Vase --reference photo.png  # fit alone, nothing is changed",
        "mfo blend shot.blend --object Vase --reference ref.exr --apply --save-as matched.blend",
    ),
    "apply": (
        "mfo apply job/result.json shot.blend  # put the values on the material they were fitted for",
        "mfo apply job/result.json other.blend --material Glaze --save-as matched.blend",
    ),
    "compare": ("mfo compare reference.exr render.exr",),
    "judge": ("mfo judge job render.exr",),
    "batch": ("mfo batch jobs/*  # those that have a result are left alone",),
    "bench": (
        "mfo bench --scenario base --method balanced --scenes 2",
        "mfo bench  # everything: many hours, the paper's loop alone takes minutes a scene",
        "mfo bench report DIR",
    ),
    "completion": ('eval "$(mfo completion bash)"', "mfo completion fish > ~/.config/fish/completions/mfo.fish"),
    "run": ("mfo run job",),
}
_INTERRUPTED = "Interrupted."
_WIDTH = 100  # letters of a line of help
_EPILOG = "Exit codes: 0 done, 1 failed, 2 bad input, 3 something is not installed, 4 cancelled, 5 no match."


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code."""
    use_kernel_cache()
    remove_abandoned()
    words = list(sys.argv[1:] if arguments is None else arguments)
    stream = sys.stdout if "--json" in words else None
    try:
        parsed = _parser(words).parse_args(words)  # loads the command's module and what that needs: seconds
    except ImportError as error:
        return report_error(Status.SETUP, _not_importable(error), stream=stream)
    except KeyboardInterrupt:
        return report_error(Status.CANCELLED, _INTERRUPTED, stream=stream)
    stream = sys.stdout if getattr(parsed, "json", False) else None
    try:
        return parsed.func(parsed)
    except ImportError as error:
        return report_error(Status.SETUP, _not_importable(error), stream=stream)
    except MfoError as error:
        return report_error(error.status, str(error), stream=stream)
    except KeyboardInterrupt:
        return report_error(Status.CANCELLED, _INTERRUPTED, stream=stream)
    except BrokenPipeError:  # the reader of our output has closed it (`mfo doctor | head -1`)
        sys.stderr.close()
        return Status.FAILED.exit_code


def report_error(status: Status, sentence: str, *, stream: TextIO | None) -> int:
    """Write ``mfo: sentence`` to stderr and, for `--json`, one object to `stream`; returns the exit code."""
    print(f"mfo: {sentence}", file=sys.stderr)
    if stream is not None:
        print(json.dumps({"status": status.value, "sentence": sentence}, ensure_ascii=False), file=stream, flush=True)
    return status.exit_code


def _not_importable(error: ImportError) -> str:
    """The sentence for a package that is missing or cannot be loaded."""
    if isinstance(error, ModuleNotFoundError) and error.name:
        lock = Path(__file__).resolve().parents[2] / "requirements" / "backend.lock"
        what = f'-r "{lock}"' if lock.is_file() else error.name.partition(".")[0]
        return (
            f'{error.name} is not installed in {sys.executable}: run "{sys.executable}" -m pip install {what}, or '
            "choose the Python that has the backend's packages."
        )
    return f"A package cannot be loaded ({error}): run `mfo doctor`, which says what is missing."


def _parser(words: Sequence[str]) -> argparse.ArgumentParser:
    """The parser with the chosen sub-command's arguments; the others are only named."""
    parser = argparse.ArgumentParser(
        prog="mfo",
        description="Recover the Principled BSDF values that reproduce a reference picture.",
        epilog=_EPILOG,
    )
    parser.add_argument("--version", action="version", version=f"mfo {__version__}")
    subparsers = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    chosen = next((word for word in words if not word.startswith("-")), None)
    for name, summary in COMMANDS.items():
        if not (Path(__file__).parent / "commands" / f"{name}.py").is_file():
            continue
        if name == chosen:
            importlib.import_module(f"{__package__}.commands.{name}").add_parser(subparsers)
            _add_examples(subparsers.choices[name], EXAMPLES[name])
        else:
            subparsers.add_parser(name, help=summary)
    return parser


def _add_examples(parser: argparse.ArgumentParser, lines: Sequence[str]) -> None:
    """Put examples below the help of a command, as they are."""
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.description = textwrap.fill(parser.description or "", _WIDTH)
    parser.epilog = "\n".join(["examples:", *(f"  {line}" for line in lines)])
