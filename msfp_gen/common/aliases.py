"""Types that several packages name: the tables of scene files, and the functions that are told of progress."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

SceneTable = dict[str, Any]
"""A table of a scene file or of the definition of a study, as TOML gives it."""

Progress = Callable[[float, float], None]
"""Called with what is done and with all: the time reached and the end of the run [s], or numbers of things."""

BuildProgress = Callable[[str, float], None]
"""Called with the task of a build, and with the share that is done [-]."""

Say = Callable[[str], None]
"""Called with a line of text about what is done."""

FitProgress = Callable[[int, float, float], None]
"""Called with the number of the evaluation, the share of it that is done [-], and the last deviation [N]."""
