"""`vinesexp completion`: what a shell needs to complete commands and options with the tab key."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

_HOW = {
    "bash": 'add to ~/.bashrc:  eval "$(vinesexp completion bash)"',
    "zsh": 'add to ~/.zshrc, after compinit:  eval "$(vinesexp completion zsh)"',
    "fish": "type once:  vinesexp completion fish > ~/.config/fish/completions/vinesexp.fish",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The shell."""
    parser.add_argument("shell", choices=list(_HOW), help="; ".join(_HOW.values()))


def run(args: argparse.Namespace) -> int:
    """Print the script of a shell."""
    import shtab

    from vinesexp.cli import COMMANDS, build_parser

    whole = build_parser(*COMMANDS)
    commands: Any = next(a for a in whole._actions if isinstance(a.choices, dict))
    for command in commands.choices.values():
        for action in command._actions:
            if action.type is Path:
                action.complete = shtab.FILE
    print(shtab.complete(whole, shell=args.shell))
    return 0
