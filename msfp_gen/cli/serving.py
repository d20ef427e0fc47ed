"""Command that serves bearings to other programs: serve."""

from __future__ import annotations

from functools import partial
from typing import Annotated

import typer

from msfp_gen.cli.console import note, say, scenes, whole_number
from msfp_gen.errors import RunError

app = typer.Typer()
AXES = ("Y", "Z")


@app.command(
    epilog="Examples:\n\n\b\n  msfp-gen serve bearing.toml --port 7000\n"
    "  msfp-gen serve outer.toml inner.toml --port 7000 --bearings 4"
)
def serve(
    sources: Annotated[
        list[str],
        typer.Argument(metavar="SCENE...", help="Scene files or presets, each with a rig.", autocompletion=scenes),
    ],
    port: Annotated[
        int,
        typer.Option(metavar="N", parser=whole_number, help="Port of the first scene; the others have the next ones."),
    ],
    bearings: Annotated[
        int | None,
        typer.Option(metavar="N", parser=whole_number, help="End after N bearings have ended; else at Ctrl-C."),
    ] = None,
    up: Annotated[str, typer.Option(metavar="|".join(AXES), help="Vertical axis of the client in space.")] = "Z",
    host: Annotated[str, typer.Option(metavar="ADDRESS", help="Address to listen on.")] = "127.0.0.1",
) -> None:
    """Serve bearings to `element genericClient` of OpenSees: every element is a bearing of its own."""
    from msfp_gen.buildings.load import load_bearing_scene
    from msfp_gen.coupling.server import Server
    from msfp_gen.coupling.two_port import TwoPort

    if up not in AXES:
        raise typer.BadParameter(f"--up = {up!r}: give one of {', '.join(AXES)}")
    if bearings is not None and bearings < 1:
        raise typer.BadParameter(f"--bearings = {bearings}: give at least 1")
    if port < 1:
        raise typer.BadParameter(f"--port = {port}: give at least 1")
    makers = []
    for source in sources:
        make = partial(TwoPort.of_scene, load_bearing_scene(source))
        make()  # what is wrong with a scene is said before anybody connects
        makers.append((source, make))
    with Server(makers, port, report=note, host=host, up=up) as server:
        for source, each in zip(sources, server.ports, strict=True):
            say(f"serving {source} at {host}:{each}")
        failed = server.serve(bearings)
    if failed:
        raise RunError(f"{failed} of {bearings} bearings failed; see the messages above", status="failed")
