"""Commands that measure error against cost on a scene: bench work-precision, bench model-error."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from msfp_gen.cli.console import SceneName, answer, note, note_written, number, numbers

if TYPE_CHECKING:
    from msfp_gen.scene.scene import Scene
    from msfp_gen.studies.accuracy.study import Study

app = typer.Typer()
bench = typer.Typer(
    help="Measure error against cost on a scene: of methods and tolerances, and of simplified models.",
    epilog="Examples:\n\n\b\n  msfp-gen bench work-precision fenz-monotonic -o study\n"
    "  msfp-gen bench model-error fenz-test2 -o study",
)
app.add_typer(bench, name="bench")


Tolerances = Annotated[
    str | None, typer.Option(metavar="LIST", help="Tolerances, such as 1e-2,1e-4, instead of the default list.")
]
Limit = Annotated[float, typer.Option(parser=number, metavar="SECONDS", help="Cut off a run after this wall time.")]
Duration = Annotated[
    float | None, typer.Option(parser=number, metavar="SECONDS", help="End the scene after this simulated time.")
]
Folder = Annotated[
    Path | None,
    typer.Option("-o", "--output", metavar="DIR", help="Write CSV, JSON, Markdown, SVG and PNG to this folder."),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON, and nothing else.")]


@bench.command(
    "work-precision",
    epilog="Examples:\n\n\b\n  msfp-gen bench work-precision fenz-monotonic -o study\n"
    "  msfp-gen bench work-precision scene.toml --methods implicit,Radau --tolerances 1e-2,1e-4 --limit 5",
)
def work_precision(
    scene: SceneName,
    methods: Annotated[
        str | None, typer.Option(metavar="LIST", help="Methods, such as implicit,dopri5, instead of all.")
    ] = None,
    tolerances: Tolerances = None,
    limit: Limit = 10.0,
    duration: Duration = None,
    output: Folder = None,
    as_json: AsJson = False,
) -> None:
    """Error against cost of every method and tolerance; a second method confirms the reference."""
    from msfp_gen.studies.accuracy.study import TOLERANCES
    from msfp_gen.studies.accuracy.study import work_precision as study

    _report(
        scene,
        duration,
        output,
        as_json,
        lambda chosen: study(
            chosen,
            methods=methods.split(",") if methods else None,
            tolerances=TOLERANCES if tolerances is None else numbers(tolerances),
            limit=limit,
            say=note,
        ),
    )


@bench.command(
    "model-error",
    epilog="Examples:\n\n\b\n  msfp-gen bench model-error fenz-test2 -o study\n"
    "  msfp-gen bench model-error scene.toml --tolerances 1e-2,1e-3,1e-4",
)
def model_error(
    scene: SceneName,
    tolerances: Tolerances = None,
    limit: Limit = 10.0,
    duration: Duration = None,
    output: Folder = None,
    as_json: AsJson = False,
) -> None:
    """Error against cost of simplified models: planar, massless, without rims, linearised, OpenSees."""
    from msfp_gen.studies.accuracy.models import TOLERANCES, model_errors

    _report(
        scene,
        duration,
        output,
        as_json,
        lambda chosen: model_errors(
            chosen, tolerances=TOLERANCES if tolerances is None else numbers(tolerances), limit=limit, say=note
        ),
    )


def _report(
    name: str, duration: float | None, folder: Path | None, as_json: bool, study: Callable[[Scene], Study]
) -> None:
    """Load the scene, run the study, print it and write its files."""
    from msfp_gen.buildings.file import load_bearing_scene
    from msfp_gen.common.output import make_folder
    from msfp_gen.studies.accuracy.output import as_dict, tables, write

    scene = load_bearing_scene(name)
    if duration is not None:
        scene = replace(scene, duration=duration)
    if folder is not None:
        make_folder(folder, "--output")
    result = study(scene)
    answer(as_dict(result), tables(result), as_json)
    note_written(write(result, folder) if folder is not None else ())
