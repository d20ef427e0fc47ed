"""Commands for models and the installation: generate, explain, presets, doctor, cache."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from msfp_gen.cli.console import SceneName, building, note, number, say, show, whole_number, with_effects
from msfp_gen.errors import InputError
from msfp_gen.specification.layout import Effects, Layout, ModelSpec

if TYPE_CHECKING:
    from msfp_gen.jit.cache import CachedModel

app = typer.Typer()


@app.command(epilog="Example:\n\n\b\n  msfp-gen generate 5 2 2 -o models   # then: import msfp_5_2_2")
@with_effects
def generate(
    n: Annotated[
        int, typer.Argument(parser=whole_number, metavar="N", help="Number of bodies, with base and top plate.")
    ],
    m: Annotated[
        int, typer.Argument(parser=whole_number, metavar="M", help="Number of concave-up surfaces, the lower ones.")
    ],
    p: Annotated[
        int, typer.Argument(parser=whole_number, metavar="P", help="Number of concave-down surfaces; n = m + p + 1.")
    ],
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="DIR", help="Write the module, its sources and a README there."),
    ] = None,
    *,
    effects: Effects,
) -> None:
    """Derive and compile the equations of a stack layout (a library for C and Fortran: export)."""
    spec = ModelSpec(Layout(n, m, p), effects)
    from msfp_gen.embedding import check_guide, write_guide
    from msfp_gen.jit.build import build_table, generate_to, prepare

    if output is not None:
        check_guide(output)
    with building() as progress:
        info = prepare(spec, progress) if output is None else generate_to(spec, output, progress)
    show([build_table(info)])
    if output is not None:
        note(f"start with {write_guide(spec, info.folder, info.module)}; for C and Fortran: msfp-gen export")


@app.command(epilog="Example:\n\n\b\n  msfp-gen explain fenz-test2\n  msfp-gen explain scene.toml")
def explain(scene: SceneName) -> None:
    """Describe a scene: bearing, motion, top, or building; what is modelled and how it is solved."""
    from msfp_gen.buildings.explain import explain as describe
    from msfp_gen.buildings.file import load_scene

    show(describe(load_scene(scene)))


@app.command(epilog="Example:\n\n\b\n  msfp-gen presets")
def presets() -> None:
    """List the scenes, buildings and bearings that come with msfp-gen."""
    from msfp_gen.common.tables import Table
    from msfp_gen.scene.file import presets as catalogue

    show(Table(f"preset {kind}s", (), list(catalogue.names(kind).items())) for kind in ("scene", "building", "bearing"))


@app.command(epilog="Example:\n\n\b\n  msfp-gen doctor")
def doctor() -> None:
    """Check Python, libraries, compiler and cache."""
    from msfp_gen.jit.doctor import check_table, diagnose

    checks = diagnose()
    show([check_table(checks)])
    if not all(check.ok for check in checks):
        raise typer.Exit(1)


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
    from msfp_gen.jit import cache

    if clear and prune is not None:
        raise InputError(f"--prune = {prune:g}: --clear removes everything; give one of them")
    if not clear and prune is None:
        _list(cache.cached_models())
        return
    removed, held = cache.prune(0.0 if clear or prune is None else prune)
    say(f"removed {_count(removed)}, {_megabytes(cache.total(removed))}")
    if held:
        say(f"kept {_count(held)} in use by another process")


def _list(items: list[CachedModel]) -> None:
    """Print one row per model of this version, and one row per kind of other entries."""
    from msfp_gen.common.tables import Table
    from msfp_gen.jit.cache import cache_root, total

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
