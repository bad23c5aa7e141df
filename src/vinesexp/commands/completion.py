"""`vinesexp completion`: what a shell needs to complete commands and options with the tab key."""

from __future__ import annotations

import argparse
from importlib import import_module

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
    print({"bash": _bash, "zsh": _zsh, "fish": _fish}[args.shell](_words()))
    return 0


#: Of each command: its purpose, and its options with what each is.
Words = dict[str, tuple[str, dict[str, str]]]


def _words() -> Words:
    from vinesexp.cli import COMMANDS

    found: Words = {}
    for name, purpose in COMMANDS.items():
        parser = argparse.ArgumentParser(prog=name)
        import_module(f"vinesexp.commands.{name}").add_arguments(parser)
        options = {
            option: (action.help or "").replace("%%", "%").partition("%(")[0]
            for action in parser._actions
            for option in action.option_strings
        }
        found[name] = (purpose, options)
    return found


def _bash(words: Words) -> str:
    cases = "\n".join(
        f"    {name}) options='{' '.join(options)}';;" for name, (_, options) in words.items()
    )
    return f"""\
# {_HOW["bash"]}
_vinesexp() {{
  local word="${{COMP_WORDS[COMP_CWORD]}}" options=''
  if [ "$COMP_CWORD" -eq 1 ]; then
    COMPREPLY=($(compgen -W '{" ".join(words)} --help --version' -- "$word"))
    return
  fi
  case "${{COMP_WORDS[1]}}" in
{cases}
  esac
  case "$word" in
    -*) COMPREPLY=($(compgen -W "$options" -- "$word"));;
    *) local IFS=$'\n'; COMPREPLY=($(compgen -f -- "$word"));;
  esac
}}
complete -o filenames -F _vinesexp vinesexp"""


def _zsh(words: Words) -> str:
    commands = "\n".join(f"    {_zsh_word(name, purpose)}" for name, (purpose, _) in words.items())
    cases = "\n".join(
        f"    {name}) options=(\n"
        + "\n".join(f"      {_zsh_word(option, told)}" for option, told in options.items())
        + "\n    );;"
        for name, (_, options) in words.items()
    )
    return f"""\
# {_HOW["zsh"]}
_vinesexp() {{
  local -a commands options
  commands=(
{commands}
  )
  if (( CURRENT == 2 )); then
    _describe 'command' commands
    return
  fi
  case "$words[2]" in
{cases}
  esac
  if [[ "$words[CURRENT]" == -* ]]; then
    _describe 'option' options
  else
    _files
  fi
}}
compdef _vinesexp vinesexp"""


def _zsh_word(name: str, purpose: str) -> str:
    return "'" + f"{name}:{purpose}".replace("'", "'\\''") + "'"


def _fish(words: Words) -> str:
    names = " ".join(words)
    lines = [f"# {_HOW['fish']}"]
    for name, (purpose, options) in words.items():
        first = f"not __fish_seen_subcommand_from {names}"
        lines.append(f"complete -c vinesexp -f -n '{first}' -a {name} -d {_fish_text(purpose)}")
        for option, told in options.items():
            form = f"-l {option[2:]}" if option.startswith("--") else f"-s {option[1:]}"
            lines.append(
                f"complete -c vinesexp -n '__fish_seen_subcommand_from {name}' {form} "
                f"-d {_fish_text(told)}"
            )
    return "\n".join(lines)


def _fish_text(text: str) -> str:
    """Text between quotes, as fish reads it back.

    Examples
    --------
    >>> print(_fish_text("a ball's mass"))
    'a ball\\'s mass'
    """
    return "'" + text.replace("\\", "\\\\").replace("'", "\\'") + "'"
