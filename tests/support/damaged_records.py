"""A small record, and ways to damage the text of any record."""

from __future__ import annotations

import gzip
import random
from collections.abc import Callable

import numpy as np

T = np.arange(40) * 0.01
WAVES = [np.sin(9 * T) * np.exp(-T), 0.7 * np.cos(7 * T), 0.2 * np.sin(21 * T)]
CSV = "# made\ntime [s], a1 [g], a2 [m/s^2], a3 [cm/s^2]\n" + "".join(f"{t:.2f}, {t * t}, {t}, {9 * t}\n" for t in T)
HOSTILE = [
    "nan",
    "inf",
    "-inf",
    "1e999",
    "-1e999",
    "1e-400",
    "0",
    "-1",
    "99999999",
    "999999999999999999999",
    "1e308",
    "0x10",
    "1_000",
    "\u0661\u0662",
    "\x00",
    "\x1b[2J",
    "\ufeff",
    "%s%n",
    "../../etc/passwd",
    "__import__('os')",
    "=cmd()",
    ",",
    "1,5",
    "(0f0.0)",
    "(999f999.9)",
    "9" * 400,
    "-",
    "+",
    ".",
    "e",
    "1e",
    "",
    " ",
    "\t",
    "\r",
    "\u2028",
    "\x0c",
    "\x1a",
]


def cut(content: bytes, dice: random.Random) -> bytes:
    return content[: dice.randrange(len(content))]


def flip(content: bytes, dice: random.Random) -> bytes:
    at = dice.randrange(len(content))
    return content[:at] + bytes([content[at] ^ (1 << dice.randrange(8))]) + content[at + 1 :]


def remove(content: bytes, dice: random.Random) -> bytes:
    at = dice.randrange(len(content))
    return content[:at] + content[at + dice.randrange(1, 40) :]


def insert(content: bytes, dice: random.Random) -> bytes:
    at = dice.randrange(len(content))
    return content[:at] + dice.choice(HOSTILE).encode() + content[at:]


def replace_number(content: bytes, dice: random.Random) -> bytes:
    """A whole word of the file, most often a number of its header, becomes something that is none."""
    lines = content.split(b"\n")
    top = min(len(lines), 60) if dice.random() < 0.7 else len(lines)
    where = dice.randrange(top)
    parts = lines[where].split(b" ")
    parts[dice.randrange(len(parts))] = dice.choice(HOSTILE).encode()
    lines[where] = b" ".join(parts)
    return b"\n".join(lines)


def shuffle_lines(content: bytes, dice: random.Random) -> bytes:
    lines = content.split(b"\n")
    one, two = dice.randrange(len(lines)), dice.randrange(len(lines))
    change: Callable[[], object] = dice.choice(
        [
            lambda: lines.pop(one),
            lambda: lines.insert(two, lines[one]),
            lambda: lines.__setitem__(slice(None), lines[one:] + lines[:one]),
            lambda: lines.extend(lines[one:]),
        ]
    )
    change()
    return b"\n".join(lines)


def digits(content: bytes, dice: random.Random) -> bytes:
    """Every appearance of one digit becomes another: counts, steps and data all lie at once."""
    old, new = (str(dice.randrange(10)).encode() for _ in range(2))
    return content.replace(old, new, dice.randrange(1, 50))


def zipped(content: bytes, dice: random.Random) -> bytes:
    return dice.choice([cut, flip, lambda c, _: c])(gzip.compress(content, mtime=0), dice)


MUTATIONS = [cut, flip, remove, insert, replace_number, replace_number, shuffle_lines, digits, zipped]
