"""Programs that this one is compared with, where they are installed."""

from __future__ import annotations

import subprocess
import sys
from functools import cache
from importlib.util import find_spec


@cache
def opensees_runs() -> bool:
    """Whether OpenSeesPy is installed and can be imported, which it cannot where a library of the system is missing."""
    names = [name for name in ("openseespy", "openseespylinux") if find_spec(name)]
    words = [sys.executable, "-c", f"import {names[0]}.opensees"] if names else []
    return bool(words) and subprocess.run(words, capture_output=True, check=False).returncode == 0
