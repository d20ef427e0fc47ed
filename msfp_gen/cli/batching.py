"""Command for many scenes: batch."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from msfp_gen.cli.console import Progress, note, say, scenes, show, whole_number
from msfp_gen.errors import RunError

if TYPE_CHECKING:
    from msfp_gen.result import Result

app = typer.Typer()


@app.command(
    epilog="Examples:\n\n\b\n  msfp-gen batch fenz-test1 fenz-test2 scene.toml -o runs\n"
    "  msfp-gen batch ridgecrest-clc --vary motion.scale=0.5,0.75,1,1.25,1.5\n"
    "  msfp-gen batch scene.toml --vary top.axial_load=1e6,2e6 --vary solver.rtol=1e-3,1e-4 --workers 4 -o study"
)
def batch(
    sources: Annotated[
        list[str],
        typer.Argument(metavar="SCENE...", help="Scene files (TOML) or names of presets.", autocompletion=scenes),
    ],
    vary: Annotated[
        list[str] | None,
        typer.Option(metavar="FIELD=VALUES", help="Run the scene once for each value of a field; may be repeated."),
    ] = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="DIR", help="Write every run to this folder, as netCDF-4.")
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(parser=whole_number, metavar="NUMBER", help="Runs at the same time; default: one for each core."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the summaries as JSON, and nothing else.")] = False,
) -> None:
    """Simulate many scenes, or one with fields varied, on all cores."""
    from msfp_gen.common.output import make_folder
    from msfp_gen.scene.file.parameter_sweep import varied_field, varied_scenes
    from msfp_gen.simulation.batch import simulate_batch

    fields = [varied_field(text) for text in vary or ()]
    chosen = [scene for source in sources for scene in varied_scenes(source, fields)]
    if output is not None:
        make_folder(output, "--output")
    with Progress(f"{len(chosen)} scenes") as progress:
        results = simulate_batch(chosen, workers=workers, progress=progress)
    if as_json:
        say(json.dumps([result.summary for result in results], indent=2, allow_nan=False))
    else:
        from msfp_gen.analysis.tables import batch_table

        show([batch_table(results)])
    for path in _save(results, output):
        note(f"wrote {path}")
    if failed := [result for result in results if not result.succeeded]:
        first = f"{failed[0].scene.name}: {failed[0].message}"
        raise RunError(f"{len(failed)} of {len(results)} runs did not reach their end; the first: {first}")


def _save(results: list[Result], folder: Path | None) -> list[Path]:
    """Write one file per run, named by the number and the name of its scene; returns the paths."""
    if folder is None:
        return []
    digits = len(str(len(results)))
    names = ((result.scene.name or "scene").replace(" = ", "=") for result in results)
    stems = (re.sub(r"[^A-Za-z0-9.=_-]+", "-", name).strip("-.")[:80] for name in names)
    return [
        result.save(folder / f"{index:0{digits}d}-{stem}.nc")
        for index, (result, stem) in enumerate(zip(results, stems, strict=True), start=1)
    ]
