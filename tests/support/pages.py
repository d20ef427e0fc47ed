"""Comparison of what a page shows with what its commands print and draw."""

from __future__ import annotations

import re
from decimal import Decimal

from matplotlib.image import imread

NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
BLOCK = 24  # pixels: coarse enough for fonts and edges of other versions not to count


def rounds_to(printed, shown):
    """Whether a number that is printed is the one shown, to the digits that the page shows."""
    last_digit = Decimal(1).scaleb(Decimal(shown).as_tuple().exponent)
    return abs(Decimal(printed) - Decimal(shown)) <= last_digit / 2


def same(shown, printed):
    """Whether two lines say the same; the page may show fewer digits."""
    head, dots, _ = shown.partition("...")
    wanted, found = head.split(), printed.split()
    if NUMBER.sub("#", " ".join(wanted)) != NUMBER.sub("#", " ".join(found[: len(wanted)] if dots else found)):
        return False
    pairs = zip(NUMBER.findall(" ".join(wanted)), NUMBER.findall(" ".join(found)), strict=False)
    return all(rounds_to(b, a) for a, b in pairs)


def coarse(path):
    """Mean brightness of blocks of a picture."""
    grey = imread(path)[..., :3].mean(axis=-1)
    rows, columns = (length // BLOCK for length in grey.shape)
    return grey[: rows * BLOCK, : columns * BLOCK].reshape(rows, BLOCK, columns, BLOCK).mean(axis=(1, 3))
