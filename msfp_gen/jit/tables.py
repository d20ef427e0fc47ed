"""Tables of the result of a build and of the checks of an installation."""

from __future__ import annotations

from collections.abc import Iterable

from msfp_gen.common.tables import Table
from msfp_gen.jit.build import BuildInfo
from msfp_gen.jit.doctor import Check


def build_table(info: BuildInfo) -> Table:
    """Build times, size and location of a compiled model."""
    stages = ", ".join(f"{name} {seconds:.2f} s" for name, seconds in info.stages.items())
    origin = "found in the cache" if info.cached else "built now"
    return Table(
        info.spec,
        (),
        [
            ("stages", stages),
            ("this call", f"{info.seconds:.2f} s, {origin}"),
            ("kernels", f"{info.statements} statements, {info.operations} operations"),
            ("module", info.module),
            ("folder", str(info.folder)),
            ("extension", info.path.name),
        ],
    )


def check_table(checks: Iterable[Check]) -> Table:
    """Result of `msfp-gen doctor`, one row per check."""
    rows = [
        (check.name, *(("ok", check.detail) if check.ok else ("MISSING", f"{check.detail}; {check.remedy}")))
        for check in checks
    ]
    return Table("msfp-gen doctor", (), rows)
