"""Commands with hostile numbers: an answer, or one line, soon and in little memory."""

from __future__ import annotations

import contextlib
import io
import random
from pathlib import Path

from vinesexp.cli import main

RIG = {
    "--mass": "4.7 kg",
    "--damping": "3.02 N s/m",
    "--stiffness": "1.147e4 N/m",
    "--nes-mass": "32 g",
    "--restitution": "0.6",
    "--base-amplitude": "0.25 mm",
    "--frequency": "7.86 Hz",
}
NUMBERS = (
    "0", "-1", "1", "2", "1e9", "1e300", "-1e-300", "nan", "inf", "1_0", "\u0663", "", " ", "1.5",
    "9" * 20, "9" * 5000, "0" * 5000 + "3", "1000000000000", "0x10", "2;3", "1:2", "+-",
    "4.7 +- nan", "1/0", "100000x100000", "2x2", "9" * 5000 + "x2", "\x00", "3" * 60 + "x",
)  # fmt: skip
UNITS = {"--mass": "kg", "--damping": "N s/m", "--stiffness": "N/m", "--nes-mass": "g",
         "--restitution": "", "--base-amplitude": "mm", "--frequency": "Hz"}  # fmt: skip
#: What the commands take besides, and a value with which they are quick.
MORE = {
    "map": {"--cells": "2x2", "--starts": "1", "--seed": "1", "--rows": "1/1"},
    "basins": {"--cells": "2", "--starts": "1", "--seed": "1"},
    "design": {"--seed": "1"},
}


def command(rng: random.Random, folder: Path) -> str:
    """One command whose numbers are hostile in one place or two."""
    name = rng.choice(list(MORE))
    options = {**RIG, **MORE[name]}
    if name == "map":
        options |= {"--clearance": "20:30 mm", "--base-amplitude": "0.2:0.25 mm",
                    "--out": str(folder / "map.nc")}  # fmt: skip
    elif name == "basins":
        options |= {"--clearance": "25 mm"}
    changeable = [key for key in options if key != "--out"]
    for key in rng.sample(changeable, rng.choice((1, 1, 2))):
        number = rng.choice(NUMBERS)
        options[key] = number if key in MORE[name] else f"{number} {UNITS.get(key, 'mm')}".strip()
    if name == "design" and rng.random() < 0.9:
        options["--theory-only"] = None  # type: ignore[assignment]
    words = [name] + [key if value is None else f"{key}={value}" for key, value in options.items()]
    said, errors = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(errors):
        try:
            code = main(words)
        except SystemExit as error:  # argparse
            code = int(error.code or 0)
    if code == 0:
        return "ok"
    last = [line for line in errors.getvalue().splitlines() if line.startswith("vinesexp")]
    assert last, f"no word of what is wrong: {errors.getvalue()[:500]!r}"
    assert len(last[-1]) < 2000, f"a message of {len(last[-1])} characters: {words}"
    return "refused"
