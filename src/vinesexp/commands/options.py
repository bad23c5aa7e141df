"""What commands share: values of a rig, one value an option, files to write, and progress."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from threading import Event, Thread
from typing import TYPE_CHECKING, Any

from vinesexp.errors import ParameterError, VinesexpError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from vinesexp.design.inputs import Option


#: Digits of a whole number on the command line; what is exact as a float needs no more.
DIGITS = 15
#: Functions that a template calls by name.
Filters = Mapping[str, Callable[..., Any]]
#: Endings of the pictures that can be drawn.
PICTURES = (".svg", ".pdf", ".png")


# How far a command has come, for a person who waits.
class Bar:
    """A progress bar on standard error, where a person looks at it."""

    def __init__(self, what: str) -> None:
        self.what, self.begin, self.shown = what, time.monotonic(), sys.stderr.isatty()

    def __call__(self, done: int, total: int) -> None:
        """Show how many are done, and for how long the rest will take."""
        if self.shown:
            spent = time.monotonic() - self.begin
            full = 40 * done // total
            _in_line(
                f"[{'#' * full}{' ' * (40 - full)}] {done}/{total} {self.what}, {spent:.0f} s, "
                f"{spent / done * (total - done):.0f} s left "
            )

    def clear(self) -> None:
        """Empty the line, for another one."""
        if self.shown:
            _in_line(_EMPTY)

    def end(self) -> None:
        """Leave the line."""
        if self.shown:
            print(file=sys.stderr)


@contextmanager
def clock(what: str, expected: float) -> Iterator[None]:
    """Show for how long a piece of work has run, beside what was expected, where a person looks.

    Parameters
    ----------
    what : str
        The work, in two words.
    expected : float
        s.
    """
    if not sys.stderr.isatty():
        yield
        return
    begin, ended = time.monotonic(), Event()

    def tick() -> None:
        while not ended.wait(_TICK):
            spent = time.monotonic() - begin
            _in_line(f"{what}: {spent:.0f} s of about {max(expected, spent):.0f} s ")

    thread = Thread(target=tick, daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()
        _in_line(_EMPTY)


#: s between two looks of a person.
_TICK = 0.5
_EMPTY = "\x1b[K"  # what a terminal takes for: nothing from here to the end of the line


def _in_line(text: str) -> None:
    """Text in place of what stands in the line."""
    print(f"\r{text}", end="", file=sys.stderr, flush=True)


#: What the value of an option is called where it is the path of something.
_PATHS = ("FILE", "FOLDER", "DIR", "PATH", "PICTURE")


def add_options(parser: argparse.ArgumentParser, *options: tuple[str, str], **more: Any) -> None:
    """An option for each pair of form and meaning, as the help shows them.

    Parameters
    ----------
    options : pairs of str
        ``("--out FILE", "where the table goes")``; a form without a value is a switch.
    more
        For `argparse` of each that takes a value, such as ``action=Once``.
    """
    for form, meaning in options:
        flag, _, name = form.partition(" ")
        given: dict[str, Any] = {"metavar": name, **({"type": Path} if name in _PATHS else {})}
        parser.add_argument(
            flag, help=meaning, **(given | more if name else {"action": "store_true"})
        )


def add_values(
    parser: argparse.ArgumentParser, options: Iterable[Option], *, before: str = ""
) -> None:
    """An option for each value, written with its unit."""
    for option in options:
        parser.add_argument(
            option.flag,
            dest=option.symbol,
            metavar="VALUE",
            action=Once,
            help=f"{before}such as '{option.example}'{option.note}".replace("%", "%%"),
        )


def add_identified(parser: argparse.ArgumentParser) -> None:
    """Values of a campaign in place of numbers."""
    meaning = (
        "results folder or identified.csv of a campaign, in place of numbers (its rows with "
        "method 'combined')"
    )
    add_options(parser, ("--identified PATH", meaning), action=Once)


def add_map_values(parser: argparse.ArgumentParser, *, cells: tuple[str, str], starts: str) -> None:
    """What `map` and `basins` share: values or ranges, cells, starts of each, seed.

    Parameters
    ----------
    cells : form and meaning of the option, with the default in brackets.
    starts : meaning, likewise.
    """
    from vinesexp.maps.map_options import OPTIONS

    add_values(parser, OPTIONS)
    add_identified(parser)
    seed = "seed of the random starts (1)"
    add_options(parser, cells, ("--starts N", starts), ("--seed N", seed), action=Once)
    add_force(parser)


def map_values(args: argparse.Namespace) -> tuple[dict[str, float], dict[str, tuple[float, float]]]:
    """Values and ranges of `add_map_values`, SI, by symbol."""
    from vinesexp.maps.map_options import OPTIONS, gather_values

    given = {option.symbol: getattr(args, option.symbol) for option in OPTIONS}
    return gather_values(given, args.identified)


def add_force(parser: argparse.ArgumentParser) -> None:
    """Leave to write over files; without it nothing that is there is touched."""
    add_options(parser, ("--force", "overwrite existing files"))


class Once(argparse.Action):
    """An option that a person can give once; argparse itself would take the last."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: Any,
        option_string: str | None = None,
    ) -> None:
        before = getattr(namespace, self.dest)
        if before is not self.default:
            raise ParameterError(
                f"given 2 times ({before}, {values}); give it once", where=option_string
            )
        setattr(namespace, self.dest, values)


def whole_option(text: str | None, flag: str, default: int) -> int:
    """The whole number of an option, 1 or more (0 for a seed), of at most `DIGITS` digits.

    Examples
    --------
    >>> whole_option("9" * 5000, "--seed", 1)
    Traceback (most recent call last):
    vinesexp.errors.ParameterError: --seed: found a number of 5000 digits, expected at most 15
    """
    if text is None:
        return default
    least, written = 0 if flag == "--seed" else 1, text.strip()
    digits, whole = written.lstrip("0") or "0", text.isascii() and written.isdecimal()
    if whole and len(digits) > DIGITS:
        raise ParameterError(
            f"found a number of {len(digits)} digits, expected at most {DIGITS}", where=flag
        )
    if not whole or int(digits) < least:
        expected = f"a whole number above {least - 1}" if least else "a whole number, 0 or above"
        raise ParameterError(f"found '{text}', expected {expected}", where=flag)
    return int(digits)


def refuse_existing(*paths: Path | None, force: bool = False, picture: Path | None = None) -> None:
    """Refuse to write over a file, and a picture that cannot be drawn, before anything is computed.

    Raises
    ------
    VinesexpError
        One of them is there, and `force` was not said; or the ending of `picture`.
    """
    if picture is not None and picture.suffix.lower() not in PICTURES:
        raise VinesexpError(
            f"cannot draw '{picture.suffix}'; name a file that ends in {', '.join(PICTURES)}",
            file=picture,
        )
    for path in (*paths, picture):
        if path is not None and path.exists() and not force:
            raise VinesexpError(
                "is there already; name another file, or write over it with --force", file=path
            )


def draw(figure: Figure, path: Path) -> None:
    """Draw a picture that a person named."""
    from vinesexp.figures.style import write_figure

    with writing(path, "be drawn"):
        write_figure(figure, path)


def text_of(template: str, filters: Filters, **content: Any) -> str:
    """What a command says at length, by a template of `commands/templates`."""
    from vinesexp.report.rendering import environment

    texts = environment("vinesexp.commands")
    texts.filters.update(filters)
    return texts.get_template(template).render(**content).rstrip("\n")


@contextmanager
def writing(path: Path, what: str = "be written") -> Iterator[None]:
    """A file that a person named: its folder is made, and what goes wrong is one line."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield
    except OSError as error:
        reason = error.strerror or str(error)
        raise VinesexpError(f"cannot {what} there ({reason}); name another", file=path) from None
