"""Commands that measure: what accuracy costs on a scene."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from msfp_gen.cli.console import SceneName, note, number, read_as, say, show

if TYPE_CHECKING:
    from msfp_gen.accuracy.study import Study
    from msfp_gen.scene import Scene

app = typer.Typer()
bench = typer.Typer(
    help="Measure what accuracy costs on a scene: by method, and by what is modelled.",
    epilog="Examples:\n\n\b\n  msfp-gen bench work-precision fenz-monotonic -o study\n"
    "  msfp-gen bench model-error fenz-test2 -o study",
)
app.add_typer(bench, name="bench")


def _numbers(text: str | None, otherwise: Sequence[float]) -> Sequence[float]:
    """A list of numbers, or what holds without one."""
    parse = read_as(lambda given: [float(part) for part in given.split(",")], "list of numbers")
    return otherwise if text is None else parse(text)


Tolerances = Annotated[str | None, typer.Option(metavar="LIST", help="Such as 1e-2,1e-4 instead of 1e-2 to 1e-9.")]
Limit = Annotated[
    float, typer.Option(parser=number, metavar="SECONDS", help="Cut off a run that takes longer than this.")
]
Duration = Annotated[
    float | None, typer.Option(parser=number, metavar="SECONDS", help="End the scene after this time.")
]
Folder = Annotated[
    Path | None, typer.Option("-o", "--output", metavar="DIR", help="Write CSV, JSON, Markdown, SVG and PNG here.")
]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON, and nothing else.")]


@bench.command(
    "work-precision",
    epilog="Examples:\n\n\b\n  msfp-gen bench work-precision fenz-monotonic -o study\n"
    "  msfp-gen bench work-precision scene.toml --methods implicit,Radau --tolerances 1e-2,1e-4 --limit 5",
)
def work_precision(
    scene: SceneName,
    methods: Annotated[str | None, typer.Option(metavar="LIST", help="Such as implicit,dopri5 instead of all.")] = None,
    tolerances: Tolerances = None,
    limit: Limit = 10.0,
    duration: Duration = None,
    output: Folder = None,
    as_json: AsJson = False,
) -> None:
    """Error against cost for every method and tolerance, against a reference that a second method confirms."""
    from msfp_gen.accuracy.study import TOLERANCES
    from msfp_gen.accuracy.study import work_precision as study

    _report(
        scene, duration, output, as_json,
        lambda chosen: study(chosen, methods=methods.split(",") if methods else None,
                             tolerances=_numbers(tolerances, TOLERANCES), limit=limit, say=note),
    )  # fmt: skip


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
    """Error against cost of models that leave something out: planar, massless, no rims, linearised, OpenSees."""
    from msfp_gen.accuracy.models import TOLERANCES, model_errors

    _report(
        scene, duration, output, as_json,
        lambda chosen: model_errors(chosen, tolerances=_numbers(tolerances, TOLERANCES), limit=limit, say=note),
    )  # fmt: skip


def _report(
    name: str, duration: float | None, folder: Path | None, as_json: bool, study: Callable[[Scene], Study]
) -> None:
    """Load, measure, print and write."""
    from msfp_gen.accuracy.output import as_dict, tables, write
    from msfp_gen.output import make_folder
    from msfp_gen.scenefile import load_scene

    scene = load_scene(name)
    if duration is not None:
        scene = replace(scene, duration=duration)
    if folder is not None:
        make_folder(folder, "--output")
    found = study(scene)
    if as_json:
        say(json.dumps(as_dict(found), indent=2, allow_nan=False))
    else:
        show(tables(found))
    written: Sequence[Path] = write(found, folder) if folder is not None else ()
    for path in written:
        note(f"wrote {path}")
