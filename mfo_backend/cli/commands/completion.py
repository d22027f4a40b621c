# SPDX-License-Identifier: Apache-2.0
"""`mfo completion SHELL`: a script that completes the commands and options of `mfo`, made from their parsers."""

from __future__ import annotations

import argparse
import importlib

from ..main import COMMANDS

SHELLS = ("bash", "zsh", "fish")


def add_parser(subparsers) -> None:  # type: ignore[no-untyped-def]  # argparse names its class with an underscore
    """Add `mfo completion`."""
    parser = subparsers.add_parser(
        "completion",
        help="print what makes a shell complete mfo's words",
        description="Print a script for a shell: with it the Tab key completes commands, options and their choices.",
    )
    parser.add_argument("shell", choices=SHELLS)
    parser.set_defaults(func=run)


def run(arguments: argparse.Namespace) -> int:
    """Print the script."""
    print({"bash": _bash, "zsh": _zsh, "fish": _fish}[arguments.shell](words_of_commands()))
    return 0


def words_of_commands() -> dict[str, list[str]]:
    """The options of each command, those that are no secret."""
    found = {}
    for name in COMMANDS:
        subparsers = argparse.ArgumentParser(prog="mfo").add_subparsers()
        importlib.import_module(f"{__package__}.{name}").add_parser(subparsers)
        shown = [action for action in subparsers.choices[name]._actions if action.help != argparse.SUPPRESS]
        options = [option for action in shown for option in action.option_strings if option.startswith("--")]
        choices = [str(word) for action in shown if not action.option_strings for word in action.choices or ()]
        found[name] = [*options, *choices]
    return found


def _bash(words: dict[str, list[str]]) -> str:
    cases = "\n".join(f'    {name}) words="{" ".join(options)}" ;;' for name, options in words.items())
    return f"""_mfo() {{
  local words word="${{COMP_WORDS[COMP_CWORD]}}"
  case "${{COMP_WORDS[1]}}" in
{cases}
  esac
  [ "$COMP_CWORD" = 1 ] && words="{" ".join(words)}"
  COMPREPLY=($(compgen -W "$words" -- "$word"))
  [[ "$word" == -* || "$COMP_CWORD" = 1 ]] || COMPREPLY+=($(compgen -f -- "$word"))
}}
complete -o filenames -F _mfo mfo"""


def _zsh(words: dict[str, list[str]]) -> str:
    return f"autoload -U +X bashcompinit && bashcompinit\n{_bash(words)}"


def _fish(words: dict[str, list[str]]) -> str:
    lines = [f"complete -c mfo -n __fish_use_subcommand -f -a {name} -d '{COMMANDS[name]}'" for name in words]
    lines = [line.replace("mfo's", "the") for line in lines]
    for name, options in words.items():
        seen = f"-n '__fish_seen_subcommand_from {name}'"
        lines += [f"complete -c mfo {seen} -l {option[2:]}" for option in options if option.startswith("--")]
        choices = " ".join(option for option in options if not option.startswith("--"))
        lines += [f"complete -c mfo {seen} -a '{choices}'"] if choices else []
    return "\n".join(lines)
