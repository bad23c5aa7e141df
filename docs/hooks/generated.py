"""Pages that the documentation build makes from the code: commands, the gallery and its figures."""

from __future__ import annotations

import argparse
import contextlib
import io
import os
import re
import runpy
from pathlib import Path

from mkdocs.structure.files import File, Files

DOCS = Path(__file__).resolve().parents[1]


def on_files(files: Files, config: object) -> Files:
    """Add what is made: MkDocs treats it like files that are there."""
    add = lambda uri, content: files.append(File.generated(config, uri, content=content))  # noqa: E731
    add("reference/commands.md", commands_page())
    changelog = (DOCS.parent / "CHANGELOG.md").read_text(encoding="utf-8")
    add("changelog.md", changelog.replace("](docs/", "]("))
    page, figures = gallery()
    add("gallery/index.md", page)
    for name, picture in figures.items():
        add(f"gallery/{name}", picture)
    return files


def on_page_markdown(markdown: str, **_: object) -> str:
    """Words beside a fence tell the tests what to do with it; a file's name is shown as title."""
    return re.sub(r"^```(\w+) ([^\n`{]+)$", _fence, markdown, flags=re.M)


def _fence(found: re.Match[str]) -> str:
    language, beside = found.groups()
    is_file = re.fullmatch(r"[\w./-]+\.\w+", beside) is not None
    return f'```{language} title="{beside}"' if is_file else f"```{language}"


def commands_page() -> str:
    """Every command with its help, as the console prints it."""
    from vinesexp.cli import COMMANDS, build_parser

    os.environ["COLUMNS"] = "100"
    lines = ["# Commands", "", "As `vinesexp COMMAND --help` prints them.", ""]
    for command, purpose in COMMANDS.items():
        parser = build_parser(command)
        subparsers = next(
            action for action in parser._actions if isinstance(action, argparse._SubParsersAction)
        )
        text = subparsers.choices[command].format_help()
        lines += [f"## vinesexp {command}", "", purpose[0].upper() + purpose[1:] + ".", ""]
        lines += ["```text", text.rstrip(), "```", ""]
    return "\n".join(lines)


def gallery() -> tuple[str, dict[str, bytes]]:
    """The gallery page, and the figures that its scripts draw, each run here."""
    os.environ.setdefault("MPLBACKEND", "Agg")
    lines = [
        "# Gallery",
        "",
        "Each figure is drawn by the lines under it when this site is built.",
        "",
    ]
    figures = {}
    for script in sorted((DOCS / "gallery").glob("*.py")):
        text = script.read_text(encoding="utf-8")
        title, _, rest = text.removeprefix('"""').partition("\n")
        about, _, code = rest.partition('"""')
        with contextlib.redirect_stdout(io.StringIO()):
            figure = runpy.run_path(str(script))["figure"]
        stream = io.BytesIO()
        figure.savefig(stream, format="png", dpi=110)
        name = f"{script.stem}.png"
        figures[name] = stream.getvalue()
        lines += [f"## {title.rstrip('.')}", "", about.strip(), "", f"![{title}]({name})", ""]
        lines += ["```python", code.strip(), "```", ""]
    return "\n".join(lines), figures
