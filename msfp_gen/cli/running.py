"""Commands that simulate: run, demo."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from msfp_gen.cli.console import Output, SceneName, note, number, say, show, words
from msfp_gen.cli.keeping import NOT_KEPT, CheckpointFile, Every, Keep, ResumeFile
from msfp_gen.cli.opening import simulated
from msfp_gen.cli.wanted import Budget, Explain, Wanted, WantedError
from msfp_gen.errors import RunError
from msfp_gen.output import FIGURE_SUFFIXES, check_output
from msfp_gen.solver import Solver

if TYPE_CHECKING:
    from msfp_gen.result import Result
    from msfp_gen.scene import Scene

DEMO = ("ridgecrest-clc", "fenz-test5")

app = typer.Typer()


@app.command(
    epilog="Example:\n\n\b\n  msfp-gen run fenz-test2 -o test2.nc --plot test2.png\n  msfp-gen run scene.toml --json\n"
    "  msfp-gen run scene.toml --error 0.5%   # say what this run is off by, and what less would cost\n"
    "  msfp-gen run scene.toml -o out.mat   # or .nc, .csv, .parquet\n"
    "  msfp-gen run scene.toml -o out.nc --checkpoint run.ck\n  msfp-gen run scene.toml -o out.nc --resume run.ck"
)
def run(
    scene: SceneName,
    output: Output = None,
    plot: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw loops and sliding: .png, .svg or .pdf.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON, and nothing else.")] = False,
    method: Annotated[str | None, typer.Option(metavar=words(Solver, "method"), help="Instead of the scene's.")] = None,
    rtol: Annotated[
        float | None, typer.Option(parser=number, metavar="NUMBER", help="Relative tolerance, instead of the scene's.")
    ] = None,
    max_step: Annotated[
        float | None, typer.Option(parser=number, metavar="SECONDS", help="Longest step, instead of the scene's.")
    ] = None,
    duration: Annotated[
        float | None, typer.Option(parser=number, metavar="SECONDS", help="End after this time.")
    ] = None,
    strict: Annotated[
        bool, typer.Option("--strict", help="Stop where what the model leaves out would matter.")
    ] = False,
    error: WantedError = None,
    explain: Explain = False,
    budget: Budget = None,
    checkpoint: CheckpointFile = None,
    every: Every = None,
    resume: ResumeFile = None,
) -> None:
    """Simulate a scene."""
    keep = Keep.of(checkpoint, every, resume)
    others = {"--rtol": rtol, "--method": method, "--checkpoint": checkpoint, "--resume": resume}
    wanted = Wanted.of(error, explain, budget, others)
    if output is not None:
        from msfp_gen.export import check_result_path

        check_result_path(output, "--output")
    if plot is not None:
        check_output(plot, FIGURE_SUFFIXES, "--plot")
    from msfp_gen.scenefile import load_scene

    chosen = _changed(load_scene(scene), duration, method=method, rtol=rtol, max_step=max_step)
    for path in _run(chosen, output, plot, as_json, keep, wanted, strict):
        note(f"wrote {path}")


@app.command(epilog="Example:\n\n\b\n  msfp-gen demo -o out")
def demo(
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Where figures and data go.")] = Path(
        "out"
    ),
) -> None:
    """Run an earthquake and a laboratory test; write figures and data."""
    from msfp_gen.output import make_folder
    from msfp_gen.scenefile import load_scene

    scenes = [load_scene(name) for name in DEMO]
    make_folder(output, "--output")
    for name, scene in zip(DEMO, scenes, strict=True):
        written = _run(scene, output / f"{name}.nc", output / f"{name}.png")
        say("\n".join(["", *(f"wrote {path}" for path in written), ""]))


def _changed(scene: Scene, duration: float | None, **solver: Any) -> Scene:
    """`scene` with what the options gave."""
    given = {name: value for name, value in solver.items() if value is not None}
    scene = replace(scene, solver=replace(scene.solver, **given)) if given else scene
    return scene if duration is None else replace(scene, duration=duration)


def _run(
    scene: Scene, output: Path | None, plot: Path | None, as_json: bool = False, keep: Keep = NOT_KEPT,
    wanted: Wanted | None = None, strict: bool = False,
) -> list[Path]:  # fmt: skip
    """Simulate, report and save; the paths written. A run that failed is reported and saved too, then raised."""
    found = None if wanted is None else wanted.simulate(scene)
    result, failure = simulated(scene, strict=strict, **keep.arguments) if found is None else (found.result, None)
    saved: list[Path] = []
    if result is not None:
        _report(result, as_json, {} if found is None else {"accuracy": found.as_dict()})
        if found is not None and not as_json:
            show(found.tables)
        with keep.while_saving():
            saved = _save(result, output, plot)
    if failure is not None:
        kept = f"; what was computed until then is in {' and '.join(map(str, saved))}" if saved else ""
        raise RunError(f"{failure}{kept}{keep.hint(failure)}", status=failure.status, result=result) from failure
    keep.done()
    return saved


def _report(result: Result, as_json: bool, more: dict[str, Any] | None = None) -> None:
    if as_json:
        say(json.dumps(result.summary | (more or {}), indent=2, allow_nan=False))
        return
    from msfp_gen.tables import summary_tables

    show(summary_tables(result))
    for line in (entry.line for entry in result.notes):
        note(line)


def _save(result: Result, output: Path | None, plot: Path | None) -> list[Path]:
    """Write what was asked for; the paths written."""
    if output is not None:
        result.save(output)
    if plot is not None:
        from msfp_gen.figures import plot_result

        plot_result(result, plot)
    return [path for path in (output, plot) if path is not None]
