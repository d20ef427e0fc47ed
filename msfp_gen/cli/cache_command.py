"""Command for compiled models on disk: cache."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from msfp_gen.cli.console import number, say, show
from msfp_gen.errors import InputError

if TYPE_CHECKING:
    from msfp_gen.jit.pruning import CachedModel

app = typer.Typer()


@app.command(
    epilog="Example:\n\n\b\n  msfp-gen cache\n"
    "  msfp-gen cache --prune 30   # remove models not used for 30 days\n  msfp-gen cache --clear"
)
def cache(
    prune: Annotated[
        float | None,
        typer.Option(parser=number, metavar="DAYS", help="Remove models not used for this many days."),
    ] = None,
    clear: Annotated[
        bool, typer.Option("--clear", help="Remove all models; they are built again when needed.")
    ] = False,
) -> None:
    """List the compiled models, their size and last use; remove old ones."""
    from msfp_gen.jit import pruning

    if clear and prune is not None:
        raise InputError(f"--prune = {prune:g}: --clear removes everything; give one of them")
    if not clear and prune is None:
        _list(pruning.cached_models())
        return
    removed, held = pruning.prune(0.0 if clear or prune is None else prune)
    say(f"removed {_count(removed)}, {_megabytes(pruning.total(removed))}")
    if held:
        say(f"kept {_count(held)} in use by another process")


def _list(items: list[CachedModel]) -> None:
    """Print one row per model of this version, and one row per kind of other entries."""
    from msfp_gen.common.tables import Table
    from msfp_gen.jit.cache import cache_root
    from msfp_gen.jit.pruning import total

    rows = [
        (item.spec, item.state, _megabytes(item.size), f"{item.days:.1f}") for item in items if item.state == "current"
    ]
    for state in ("other version", "damaged or old", "unfinished"):
        others = [item for item in items if item.state == state]
        if others:
            days = min(item.days for item in others)
            rows.append((_count(others), state, _megabytes(total(others)), f"{days:.1f}"))
    title = f"cache of models: {cache_root()} ({_count(items)}, {_megabytes(total(items))})"
    show([Table(title, ("model", "state", "size", "days since use"), rows)])


def _count(items: list[CachedModel]) -> str:
    return f"{len(items)} model{'' if len(items) == 1 else 's'}"


def _megabytes(size: int) -> str:
    return f"{size / 1e6:.1f} MB"
