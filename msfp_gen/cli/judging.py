"""Commands about what engineers sign off: characterise, bound."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from msfp_gen.cli.console import Progress, note, say, show

if TYPE_CHECKING:
    from msfp_gen.result import Result

app = typer.Typer()
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON, every number in SI, and nothing else.")]


@app.command(
    epilog="Examples:\n\n\b\n  msfp-gen characterise fenz-test5\n"
    "  msfp-gen characterise out.nc --json\n  msfp-gen characterise scene.toml -o cycles.csv"
)
def characterise(
    source: Annotated[
        str, typer.Argument(metavar="SCENE", help="A scene file, the name of a preset, or a result (.nc).")
    ],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE.csv", help="Write one row a cycle as CSV.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Effective stiffness, damping, stages, capacity left, velocity and heat of a run, per cycle and envelope."""
    from msfp_gen.characterise import characterise as judge
    from msfp_gen.characterise.tables import CSV_SUFFIXES, characterisation_tables, write_csv
    from msfp_gen.output import check_output

    if output is not None:
        check_output(output, CSV_SUFFIXES, "--output")
    found = judge(_result(source))
    if as_json:
        say(json.dumps(found.as_dict(), indent=2, allow_nan=False))
    else:
        show(characterisation_tables(found))
    if output is not None:
        note(f"wrote {write_csv(found, output)}")


def _result(source: str) -> Result:
    """A saved result, or the run of a scene."""
    if source.lower().endswith(".nc"):
        from msfp_gen.dataset import read_result

        return read_result(source)
    from msfp_gen.build import build_model
    from msfp_gen.scenefile import load_scene
    from msfp_gen.simulation import simulate

    scene = load_scene(source)
    build_model(scene.bearing.layout, scene.effects, progress=note)
    with Progress(scene.name or "run") as progress:
        return simulate(scene, progress=progress)
