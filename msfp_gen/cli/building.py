"""Commands about models and the installation: generate, explain, presets, doctor."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from msfp_gen.cli.console import SceneName, building, show, whole, with_effects
from msfp_gen.layout import Effects, Layout, ModelSpec

app = typer.Typer()


@app.command(epilog="Example:\n\n\b\n  msfp-gen generate 5 2 2 -o models   # then: import msfp_5_2_2")
@with_effects
def generate(
    n: Annotated[int, typer.Argument(parser=whole, metavar="N", help="Bodies, base and top plate included.")],
    m: Annotated[int, typer.Argument(parser=whole, metavar="M", help="Surfaces that are concave up; they lie below.")],
    p: Annotated[int, typer.Argument(parser=whole, metavar="P", help="Surfaces that are concave down; n = m + p + 1.")],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="DIR", help="Put sources and module here.")
    ] = None,
    *,
    effects: Effects,
) -> None:
    """Derive, emit and compile the equations of a layout."""
    spec = ModelSpec(Layout(n, m, p), effects)
    from msfp_gen.build import generate_to, prepare
    from msfp_gen.tables import build_table

    with building() as progress:
        info = prepare(spec, progress) if output is None else generate_to(spec, output, progress)
    show([build_table(info)])


@app.command(epilog="Example:\n\n\b\n  msfp-gen explain fenz-test2\n  msfp-gen explain scene.toml")
def explain(scene: SceneName) -> None:
    """Say in plain words what a scene computes."""
    from msfp_gen.explain import explain as describe
    from msfp_gen.scenefile import load_scene

    show(describe(load_scene(scene)))


@app.command(epilog="Example:\n\n\b\n  msfp-gen presets")
def presets() -> None:
    """List the scenes and bearings that come with msfp-gen."""
    from msfp_gen import presets as catalogue
    from msfp_gen.tables import Table

    show(Table(f"preset {kind}s", (), list(catalogue.names(kind).items())) for kind in ("scene", "bearing"))


@app.command(epilog="Example:\n\n\b\n  msfp-gen doctor")
def doctor() -> None:
    """Check Python, libraries, compiler and cache."""
    from msfp_gen.doctor import diagnose
    from msfp_gen.tables import check_table

    checks = diagnose()
    show([check_table(checks)])
    if not all(check.ok for check in checks):
        raise typer.Exit(1)
