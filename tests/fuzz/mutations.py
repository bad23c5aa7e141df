"""Damage: of bytes as disks and transfers do it, of words as people and programs do it."""

from __future__ import annotations

import random
import re
from collections.abc import Sequence

#: Cells and values that should not be there.
WORDS = (
    "nan", "inf", "-inf", "1e37", "9.9E+37", "9.91E+37", "3.4028235e38", "1e308", "-1e-320", "0",
    "-0", "1e999", "9" * 400, "1,5", "1.5.2", "--", "+-", "=cmd|' /C calc'!A0", '"', '""', "'",
    "x" * 5000, "é", "\0", "\n", "\r\n", ",,,,", ";", "\t", "[", "{", "}", "{record}", "#", "*",
    ": ", "- ", "&a", "*a", "!!python/object:os.system", "|", "%", "\u2028", "\ufeff", "../..",
    "/etc/passwd", "/dev/zero", "~", "null", "yes", "1 kg", "-4.7 kg", "1e300 mm", "0 Hz",
    "4.7 +- 1e9 kg", "2:1", "::", ";;", "con", "a" * 101, "\\", "\x1b[31m", "NaN NaN", "1_000",
    "0x10", "1e", "e5", ".", "-", "+", "12:61:61", "2024-02-31 25:00:00", "True", "[]", "{a: }",
)  # fmt: skip
_TOKEN = re.compile(r"[\w.+-]+")
_NUMBERS = (0, 1, 0x7F, 0x80, 0xFF, 0x7FFF, 0x8000, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF)


def damaged(raw: bytes, rng: random.Random, others: Sequence[bytes] = ()) -> bytes:
    """A few changes at random places, as bytes."""
    data = bytearray(raw)
    for _ in range(rng.choice((1, 1, 1, 2, 3, 8))):
        _change(data, rng, others)
    return bytes(data)


def _change(data: bytearray, rng: random.Random, others: Sequence[bytes]) -> None:
    # Headers are where the meaning is.
    reach = len(data) if rng.random() < 0.5 else min(len(data), 512)
    at = rng.randrange(reach + 1)
    length = min(rng.choice((1, 2, 4, 8, 64, 1000)), len(data) - at)
    match rng.randrange(9):
        case 0 if at < len(data):
            data[at] ^= 1 << rng.randrange(8)
        case 1:
            del data[at:]
        case 2:
            del data[at : at + length]
        case 3:
            data[at:at] = data[at : at + length] * rng.choice((1, 2, 50))
        case 4:
            data[at : at + length] = bytes(length)
        case 5:
            data[at : at + length] = rng.randbytes(length)
        case 6:
            width = rng.choice((1, 2, 4, 8))
            number = rng.choice(_NUMBERS) % (1 << 8 * width)
            data[at : at + width] = number.to_bytes(width, rng.choice(("little", "big")))
        case 7 if others:
            other = rng.choice(others)
            begin = rng.randrange(len(other) + 1)
            data[at:at] = other[begin : begin + length]
        case _:
            data += rng.choice((bytes(1000), b"\n" * 100, rng.randbytes(100)))


def reworded(text: str, rng: random.Random) -> str:
    """A few words, lines or characters changed; the rest is still what it was."""
    for _ in range(rng.choice((1, 1, 2, 4))):
        text = _reworded_once(text, rng)
    return text


def _reworded_once(text: str, rng: random.Random) -> str:
    head = rng.random() < 0.5
    tokens = list(_TOKEN.finditer(text, 0, 600 if head else len(text)))
    lines = text.splitlines(keepends=True)
    if not tokens or not lines:
        return text + rng.choice(WORDS)
    token = rng.choice(tokens)
    line = rng.randrange(len(lines))
    match rng.randrange(7):
        case 0 | 1:
            return text[: token.start()] + rng.choice(WORDS) + text[token.end() :]
        case 2:
            return text[: token.end()] + rng.choice(WORDS) + text[token.end() :]
        case 3:
            other = rng.choice(tokens)
            return text[: token.start()] + other.group() + text[token.end() :]
        case 4:
            del lines[line]
        case 5:
            lines.insert(line, rng.choice(lines) * rng.choice((1, 1, 30)))
        case _:
            step = rng.choice((1, 2, 4, 8))
            lines[line] = " " * step + lines[line]
    return "".join(lines)
