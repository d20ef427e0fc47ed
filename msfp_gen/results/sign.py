"""Sign of the displacement across the bearing, and of its force, in everything that goes out: figures, pages, files.

Results have one sign: u is base less top, F the force of the bearing on the top support, so that F has the sign of u in
a loop. Reports of tests often give top less base; then F is the force of the support on the bearing. Both change, so
that loops look the same and turn the same way round. Results in memory keep their sign, a result file says which it
has, and peaks in a summary are magnitudes.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import NamedTuple

from msfp_gen.common.errors import InputError

SIGNED = ("displacement", "bearing_displacement", "top_force", "top_moment")  # variables that change their sign


class Sign(NamedTuple):
    """word: of `SIGNS`. factor: of the values of a result. difference: definition of u. force: body on which F acts."""

    word: str
    factor: float
    difference: str
    force: str

    @property
    def words(self) -> str:
        """The definition of u in words: "base less top"."""
        return self.difference.replace("−", "less")


SIGNS = {
    "base-top": Sign("base-top", 1.0, "base − top", "on the top support"),
    "top-base": Sign("top-base", -1.0, "top − base", "on the bearing"),
}
DEFAULT = "base-top"
_current: ContextVar[Sign] = ContextVar("sign", default=SIGNS[DEFAULT])


def sign_of(word: str, name: str = "sign") -> Sign:
    """The sign of this name; raises InputError for another word."""
    if word not in SIGNS:
        raise InputError(f"{name} = {word!r}: give one of {', '.join(SIGNS)}")
    return SIGNS[word]


def shown_sign() -> Sign:
    """The sign in which figures are drawn and files are written now."""
    return _current.get()


@contextmanager
def using_sign(word: str) -> Iterator[None]:
    """Draw and write in the block with this sign of u: "base-top" (the default) or "top-base". Raises InputError."""
    token = _current.set(sign_of(word))
    try:
        yield
    finally:
        _current.reset(token)
