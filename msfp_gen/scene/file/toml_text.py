"""Plain tables as TOML text: what `tomli_w` does not accept is left out or converted first."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np


def dumps(table: Mapping[str, Any]) -> str:
    """TOML text of a table of texts, numbers, booleans, lists and tables; numbers read back exactly.

    Entries that are None are left out: TOML has no null. Raises TypeError for any other type.
    """
    import tomli_w

    return tomli_w.dumps(plain_values(table))


def plain_values(value: Any) -> Any:
    """`value` without entries that are None, and with NumPy scalars as Python numbers."""
    if isinstance(value, Mapping):
        return {key: plain_values(item) for key, item in value.items() if item is not None}
    if isinstance(value, list | tuple):
        return [plain_values(item) for item in value]
    return value.item() if isinstance(value, np.generic) else value
