# SPDX-License-Identifier: Apache-2.0
"""The `mfo` command: start-up, errors and exit codes."""

from __future__ import annotations

import json
import runpy
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from mfo_backend import __version__
from mfo_backend.cli import main as command
from mfo_backend.types.errors import BadInputError, MfoError, SetupError

ROOT = Path(__file__).resolve().parents[2]
HELP = "from mfo_backend.cli.main import main\ntry: main(['--help'])\nexcept SystemExit: pass"
SLOW = {"numpy", "mitsuba", "drjit", "scipy", "PIL", "OpenEXR", "tqdm", "matplotlib"}


def python(code: str) -> subprocess.CompletedProcess:
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, timeout=60)


@pytest.mark.parametrize("action", ["import mfo_backend", HELP])
def test_help_loads_no_heavy_package(action: str) -> None:
    # without them start-up is that of Python itself, about 30 ms; a time limit would fail on a busy machine
    done = python(f"import sys\n{action}\nprint(sorted({SLOW} & set(sys.modules)))")
    assert done.stdout.splitlines()[-1] == "[]", done.stderr


def test_help_names_every_command(capsys: pytest.CaptureFixture) -> None:
    with pytest.raises(SystemExit) as ended:
        command.main(["--help"])
    assert ended.value.code == 0
    shown = capsys.readouterr().out
    for name in ("doctor", "fit", "run"):
        assert f"    {name} " in shown
    assert "Exit codes: 0 done, 1 failed, 2 bad input, 3 something is not installed, 4" in shown


@pytest.mark.parametrize("name", ["doctor", "fit", "run"])
def test_every_command_has_help(name: str, capsys: pytest.CaptureFixture) -> None:
    with pytest.raises(SystemExit) as ended:
        command.main([name, "--help"])
    assert ended.value.code == 0
    assert f"usage: mfo {name}" in capsys.readouterr().out


@pytest.mark.parametrize("name", sorted(command.COMMANDS))
def test_every_help_has_an_example_that_parses(name: str, capsys: pytest.CaptureFixture) -> None:
    with pytest.raises(SystemExit):
        command.main([name, "--help"])
    shown = capsys.readouterr().out.split("examples:\n")[1].splitlines()
    for line in shown:
        words = shlex.split(line.partition(" > ")[0].replace('eval "$(', "").replace(')"', ""), comments=True)
        assert words[:2] == ["mfo", name]
        assert command._parser(words[1:]).parse_args(words[1:]).command == name


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_a_shell_completes_commands_and_options(shell: str, capsys: pytest.CaptureFixture) -> None:
    assert command.main(["completion", shell]) == 0
    script = capsys.readouterr().out
    assert all(name in script for name in command.COMMANDS)
    assert "save-as" in script
    assert "bake-view" not in script  # an old name, kept and not shown


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash here")
def test_bash_completes(capsys: pytest.CaptureFixture) -> None:
    command.main(["completion", "bash"])
    ask = "COMP_WORDS=(mfo blend --ob); COMP_CWORD=2; _mfo; echo ${COMPREPLY[@]}"
    first = "COMP_WORDS=(mfo bl); COMP_CWORD=1; _mfo; echo ${COMPREPLY[@]}"
    words = ["bash", "-c", f"{capsys.readouterr().out}\n{ask}\n{first}"]
    assert subprocess.run(words, capture_output=True, text=True, check=True).stdout.split() == ["--object", "blend"]


def test_the_version(capsys: pytest.CaptureFixture) -> None:
    with pytest.raises(SystemExit):
        command.main(["--version"])
    assert capsys.readouterr().out == f"mfo {__version__}\n"


@pytest.mark.parametrize("name", ["fit", "blend", "run", "compare", "demo", "bench"])
def test_a_python_without_packages_is_one_sentence(name: str, tmp_path: Path) -> None:
    # -S leaves out the packages of this Python, as a fresh one is
    words = [sys.executable, "-S", "-m", "mfo_backend", name, str(tmp_path), str(tmp_path)]
    done = subprocess.run(words, capture_output=True, text=True, cwd=ROOT, env={"PYTHONPATH": str(ROOT)})
    assert done.returncode == 3, done.stderr
    assert done.stdout == ""
    (line,) = done.stderr.splitlines()
    assert line.startswith(f"mfo: numpy is not installed in {sys.executable}: run ")
    assert "-m pip install -r" in line


def test_a_library_that_cannot_be_loaded_is_one_sentence(monkeypatch: pytest.MonkeyPatch, capsys) -> None:
    def broken(words: list[str]) -> None:
        raise ImportError("libatomic.so.1: cannot open shared object file")

    monkeypatch.setattr(command, "_parser", broken)
    assert command.main(["fit", "--json"]) == 3
    shown = capsys.readouterr()
    assert "libatomic.so.1" in shown.err
    assert "mfo doctor" in shown.err
    assert json.loads(shown.out)["status"] == "setup"


def test_an_old_python_is_one_sentence(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture) -> None:
    monkeypatch.setattr(sys, "version_info", (2, 7, 18))
    with pytest.raises(SystemExit) as ended:
        runpy.run_module("mfo_backend", run_name="__main__")
    assert ended.value.code == 3
    assert "is Python 2.7 and the backend needs 3.10 to 3.14: choose another" in capsys.readouterr().err


@pytest.mark.parametrize("words", [[], ["dance"], ["fit"], ["run"], ["run", "x", "--progress", "loud"]])
def test_wrong_words_exit_with_2(words: list[str], capsys: pytest.CaptureFixture) -> None:
    with pytest.raises(SystemExit) as ended:
        command.main(words)
    assert ended.value.code == 2
    assert "usage: mfo" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("error", "code", "sentence", "status"),
    [
        (BadInputError("No shape 'x': choose one."), 2, "No shape 'x': choose one.", "bad_input"),
        (SetupError("No LLVM: get one."), 3, "No LLVM: get one.", "setup"),
        (MfoError("It failed."), 1, "It failed.", "failed"),
        (KeyboardInterrupt(), 4, "Interrupted.", "cancelled"),
    ],
)
@pytest.mark.parametrize("as_json", [False, True])
def test_an_error_is_one_line_and_a_code(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture,
    error: BaseException,
    code: int,
    sentence: str,
    status: str,
    as_json: bool,
) -> None:
    def fail(arguments):
        raise error

    parsed = SimpleNamespace(func=fail, json=as_json)
    monkeypatch.setattr(command, "_parser", lambda words: SimpleNamespace(parse_args=lambda words: parsed))
    assert command.main(["anything"]) == code
    shown = capsys.readouterr()
    assert shown.err == f"mfo: {sentence}\n"
    assert shown.out == "" or json.loads(shown.out) == {"status": status, "sentence": sentence}
    assert bool(shown.out) == as_json


@pytest.mark.parametrize("words", [["compare"], ["compare", "--json"]])
def test_an_interrupt_while_modules_load_is_one_line_and_a_code(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture, words: list[str]
) -> None:
    def load(_words):
        raise KeyboardInterrupt

    monkeypatch.setattr(command, "_parser", load)
    assert command.main(words) == 4
    shown = capsys.readouterr()
    assert shown.err == "mfo: Interrupted.\n"
    assert bool(shown.out) == ("--json" in words)


def test_the_module_is_the_command() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "mfo_backend", "run", "/no/such/job", "--progress", "json"],
        capture_output=True,
        text=True,
        cwd=ROOT,
        timeout=60,
    )
    assert done.returncode == 2
    assert json.loads(done.stdout) == {
        "event": "failed",
        "status": "bad_input",
        "sentence": "The job folder /no/such/job does not exist: give a folder that holds a request.json.",
    }


def test_a_closed_pipe_is_no_traceback() -> None:
    done = subprocess.run(
        f'"{sys.executable}" -m mfo_backend --help | head -0', shell=True, capture_output=True, text=True, cwd=ROOT
    )
    assert "Traceback" not in done.stderr
