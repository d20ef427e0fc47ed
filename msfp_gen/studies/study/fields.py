"""Tables inside a study file: known keys, and the fields of a dataclass."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from msfp_gen.common.fields import ruled_fields
from msfp_gen.errors import InputError
from msfp_gen.scene.file.catalogue import suggestion


def known_keys(table: Mapping[str, Any], keys: Iterable[str], where: str) -> None:
    """Raise InputError for a key of a table, which lies at `where`, that is not one of `keys`."""
    for key in table:
        if key not in keys:
            hint = suggestion(key, list(keys)) or f"; the keys here are {', '.join(keys)}"
            raise InputError(f"{where}{key}: unknown key{hint}")


def fields_of(table: Mapping[str, Any], key: str, kind: type, where: str = "") -> dict[str, Any]:
    """The table at `key`, whose keys are fields of `kind`; empty if it is not there. Raises InputError."""
    given = table.get(key, {})
    if not isinstance(given, Mapping):
        raise InputError(f"{where}{key} = {given!r}: give a table")
    known_keys(given, [name for name, _, _ in ruled_fields(kind)], f"{where}{key}.")
    return dict(given)
