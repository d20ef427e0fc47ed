"""A study of cheap runs for the tests: 5 to 10 ms each, with a model that other tests use."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pandas as pd


def cheap_study(**changes: Any) -> dict[str, Any]:
    """The table of a study of 12 runs in chunks of 4, with these keys changed; None leaves one out."""
    table = {
        "name": "cheap",
        "scene": "fenz-test1",
        "axes": {
            "rtol": {"sets": "solver.rtol", "values": [1e-2, 5e-3]},
            "friction": {"multiplies": "bearing.friction", "distribution": "uniform", "low": 0.8, "high": 1.2},
        },
        "sampling": {"samples": 6, "seed": 3},
        "keep": ["peak_displacement", "peak_force", "peak_sliding", "rims_met"],
        "chunk": 4,
        **changes,
    }
    return {key: value for key, value in table.items() if value is not None}


def rows_of(folder: Path) -> pd.DataFrame:
    """All rows of a study, sorted by run."""
    parts = [pd.read_parquet(path) for path in sorted(folder.glob("part-*.parquet"))]
    return pd.concat(parts).sort_values("run", ignore_index=True)


def write_record(path: Path, peak: float) -> Path:
    """A second of a sine of acceleration along E1, of that peak [m/s^2]."""
    rows = "".join(f"{0.02 * k:.2f},{peak * math.sin(math.pi * k / 25):.6f}\n" for k in range(51))
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"time [s], a1 [m/s^2]\n{rows}", encoding="utf-8")
    return path
