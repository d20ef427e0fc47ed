"""Options of the user for the C compiler: the environment variables CC and MSFP_GEN_CFLAGS."""

from __future__ import annotations

import os
import shlex

from msfp_gen.errors import InputError

COMPILER, CFLAGS = "CC", "MSFP_GEN_CFLAGS"
# With these a compiler assumes that no number is infinite or NaN and drops the checks for them.
FORBIDDEN = ("-Ofast", "-ffast-math", "-ffinite-math-only")


def words(name: str) -> tuple[str, ...]:
    """The words of an environment variable. Raises InputError where a quote is not closed, or a flag is forbidden."""
    text = os.environ.get(name, "")
    try:
        found = tuple(shlex.split(text))
    except ValueError as error:
        raise InputError(f"{name} = {text!r}: {str(error).lower()}; quote it as for a shell") from None
    if bad := [flag for flag in found if flag in FORBIDDEN]:
        raise InputError(
            f"{name} = {text!r}: {bad[0]} removes the checks that every number is finite; leave it out "
            "(-O3 and -march=native may stay)"
        )
    return found


def user_flags() -> tuple[str, ...]:
    """The words of MSFP_GEN_CFLAGS; none where these are refused, which `find_compiler` then reports."""
    try:
        return words(CFLAGS)
    except InputError:
        return ()
