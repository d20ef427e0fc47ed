"""Command for the explorer, a page that runs a bearing in the browser: explore."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from msfp_gen.cli.console import Progress, note

app = typer.Typer()


@app.command(
    epilog="Examples:\n\n\b\n  msfp-gen explore -o explorer.html   # presets\n"
    "  msfp-gen explore scene.toml -o scene.html"
)
def explore(
    scene: Annotated[
        str | None, typer.Argument(metavar="[SCENE]", help="A scene file (.toml) or preset; default: a set of presets.")
    ] = None,
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="FILE.html", help="The file to write.", show_default=True)
    ] = Path("explorer.html"),
) -> None:
    """Write one HTML file in which sliders change a bearing and its motion, and the response is computed at once."""
    from msfp_gen.buildings.load import load_bearing_scene
    from msfp_gen.common.output import check_output
    from msfp_gen.explorer import write_explorer
    from msfp_gen.explorer.page import SUFFIXES

    path = check_output(output, SUFFIXES, "--output")
    given = None if scene is None else load_bearing_scene(scene)
    with Progress("explorer") as progress:
        write_explorer(path, given, progress)
    note(f"wrote {path}")
