"""Files with damaged bytes, each read in a process that a loop in C cannot hold: how every one of them ends.

`python -m support.damaged_files FILE FIRST COUNT` prints a line before and after every reading.
"""

from __future__ import annotations

import random
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

SECONDS = 20  # for one file


def zeros(content: bytearray, dice: random.Random) -> None:
    """A run of 64 zeros."""
    at = dice.randrange(len(content))
    content[at : at + 64] = bytes(len(content[at : at + 64]))


def noise(content: bytearray, dice: random.Random) -> None:
    """A few random bytes."""
    at = dice.randrange(len(content))
    size = len(content[at : at + dice.choice([1, 8, 64])])
    content[at : at + size] = dice.randbytes(size)


def flip(content: bytearray, dice: random.Random) -> None:
    """One bit."""
    content[dice.randrange(len(content))] ^= 1 << dice.randrange(8)


def cut(content: bytearray, dice: random.Random) -> None:
    """The end is missing."""
    del content[dice.randrange(len(content)) :]


KINDS: list[Callable[[bytearray, random.Random], None]] = [zeros, zeros, zeros, noise, noise, flip, cut]


def damaged(whole: bytes, seed: int) -> bytes:
    """The bytes of a file after some damage, half of it where most of what describes the file lies."""
    dice = random.Random(seed)
    content = bytearray(whole)
    if dice.random() < 0.5:
        part = content[: max(4096, len(content) // 20)]
        dice.choice(KINDS[:-1])(part, dice)
        content[: len(part)] = part
    else:
        for _ in range(dice.choice([1, 1, 3])):
            dice.choice(KINDS)(content, dice) if content else None
    return bytes(content)


def read(path: Path) -> object:
    """What identifies the result in a file."""
    from msfp_gen.cli.console import load_source

    result = load_source(str(path))
    return result.dataset, result.provenance, result.status, repr(result.scene)


def same(one: object, other: object) -> bool:
    """Whether two results are identical."""
    return one[0].identical(other[0]) and one[1:] == other[1:]  # type: ignore[index]


def main(whole: Path, first: int, count: int) -> None:
    """Read a number of damaged files one after another."""
    from msfp_gen import InputError

    expected, content = read(whole), whole.read_bytes()
    path = whole.with_name(f"damaged-{whole.name}")
    for seed in range(first, first + count):
        path.write_bytes(damaged(content, seed))
        print(f"seed {seed}", flush=True)
        signal.alarm(SECONDS)  # ends the process, whatever it does
        try:
            end = "read" if same(read(path), expected) else "read as another result"
        except InputError as error:
            text = str(error)
            end = "refused" if text.isprintable() and text.startswith("path = ") else f"not in one line: {text!r}"
        except BaseException as error:
            end = f"{type(error).__name__}: {error}"
        signal.alarm(0)
        print(f"end {end}", flush=True)


def ends(whole: Path, first: int, count: int) -> dict[int, str]:
    """Number of the file -> how reading it ends; what is printed beside it is an end of its own."""
    found: dict[int, str] = {}
    seed, last = first, first + count
    while seed < last:
        words = [sys.executable, "-m", "support.damaged_files", str(whole), str(seed), str(last - seed)]
        done = subprocess.run(words, cwd=Path(__file__).parents[1], capture_output=True, text=True)
        for line in (done.stdout + done.stderr).splitlines():
            kind, _, text = line.partition(" ")
            if kind == "seed":
                seed = int(text)
                found[seed] = f"the process ended with {done.returncode}"
            elif kind == "end":
                found[seed] = text
            else:
                found[seed] = f"printed {line}"
        assert found, done.stderr
        seed += 1
    return found


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]))
