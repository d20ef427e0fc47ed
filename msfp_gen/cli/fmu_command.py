"""Command that writes a bearing as a Functional Mock-up Unit: fmu."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from msfp_gen.cli.console import building, note, scenes, show, whole_number
from msfp_gen.errors import InputError

app = typer.Typer()
TYPES = ("cs", "me")


@app.command(
    epilog="Examples:\n\n\b\n  msfp-gen fmu bearing.toml -o bearing.fmu            # a rig: motion in, wrench out\n"
    "  msfp-gen fmu isolated.toml -o isolated.fmu --fmi 3 --type me  # a mass: force in, motion out"
)
def fmu(
    source: Annotated[
        str,
        typer.Argument(metavar="SCENE", help="A scene file or preset with a rig or a mass.", autocompletion=scenes),
    ],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FILE.fmu", help="The file to write.")],
    fmi: Annotated[int, typer.Option(metavar="2|3", parser=whole_number, help="Version of FMI.")] = 2,
    kind: Annotated[
        str,
        typer.Option(
            "--type", metavar="|".join(TYPES), help="cs: Co-Simulation; me: also Model Exchange, of a supported mass."
        ),
    ] = "cs",
) -> None:
    """Write a bearing as a unit (FMU) for Co-Simulation: a rig takes motion and gives wrenches, a mass takes forces."""
    from msfp_gen.buildings.load import load_bearing_scene
    from msfp_gen.common.tables import Table
    from msfp_gen.fmu import write_fmu

    if kind not in TYPES:
        raise InputError(f"--type = {kind!r}: give one of {', '.join(TYPES)}")
    with building(kept=False) as progress:
        unit = write_fmu(load_bearing_scene(source), output, version=fmi, exchange=kind == "me", progress=progress)
    counts = {block.name.lower(): 0 for block in dict.fromkeys(each.block for each in unit.variables)}
    for variable in unit.variables:
        counts[variable.block.name.lower()] += 1
    rows = [("model", unit.model), ("kinds", ", ".join(unit.kinds))]
    rows += [(name, str(counts[name])) for name in ("inputs", "outputs", "parameters", "states") if name in counts]
    show([Table(f"FMI {fmi}.0 unit {output.stem}", (), rows)])
    note(f"wrote {unit.path}")
