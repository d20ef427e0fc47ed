"""Commands that simulate: run, with its options of checkpoints and of a requested error; demo."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from msfp_gen.cli.console import (
    Force,
    Output,
    SceneName,
    ShownProgress,
    SignOption,
    build,
    choices_of,
    note,
    note_exceeded,
    note_written,
    number,
    parser_of,
    run_scene,
    say,
    show,
    with_field,
)
from msfp_gen.common.errors import InputError, RunError
from msfp_gen.common.fields import to_si
from msfp_gen.common.output import FIGURE_SUFFIXES, check_output
from msfp_gen.results.sign import DEFAULT, sign_of, using_sign
from msfp_gen.scene.solver import Solver

if TYPE_CHECKING:
    from msfp_gen.results.result import AnyResult
    from msfp_gen.scene.system import System
    from msfp_gen.studies.accuracy.error_target import Within

CheckpointFile = Annotated[
    Path | None,
    typer.Option("--checkpoint", metavar="FILE", help="Save the state of the run to this file at intervals."),
]
Every = Annotated[
    float | None, typer.Option(parser=number, metavar="SECONDS", help="Wall time between two checkpoints; default 60.")
]
ResumeFile = Annotated[
    Path | None, typer.Option("--resume", metavar="FILE", help="Continue the run from this checkpoint.")
]


@dataclass(frozen=True)
class CheckpointOptions:
    """Options of checkpoints.

    Attributes:
        path: file of the checkpoint; None without checkpoints.
        every: wall time between two checkpoints [s]; None for the default.
        resume: whether the run continues from the file.
    """

    path: Path | None = None
    every: float | None = None
    resume: bool = False

    @classmethod
    def of(cls, checkpoint: Path | None, every: float | None, resume: Path | None) -> CheckpointOptions:
        """From the command line. Raises InputError for options that contradict each other."""
        if checkpoint is not None and resume is not None:
            raise InputError(f"--checkpoint = {str(checkpoint)!r}: --resume continues to write its own file; give one")
        if every is not None and checkpoint is None and resume is None:
            raise InputError(f"--every = {every:g}: there is no checkpoint to write; give --checkpoint FILE")
        return cls(checkpoint if resume is None else resume, every, resume is not None)

    @property
    def arguments(self) -> dict[str, Any]:
        """Keyword arguments for `simulate`."""
        if self.path is None:
            return {}
        return {"checkpoint": self.path, "resume": self.resume} | ({} if self.every is None else {"every": self.every})

    def hint(self, failure: RunError) -> str:
        """Text for the message of an interrupted run: how to continue it."""
        return f"; continue with --resume {self.path}" if failure.status == "interrupted" and self._exists else ""

    @contextmanager
    def hint_on_write_error(self) -> Iterator[None]:
        """Add to an error of writing, such as a full disk, that the checkpoint still holds the run."""
        try:
            yield
        except OSError as error:
            if not self._exists:
                raise
            raise RunError(f"{error}; the run is not lost: make room and give --resume {self.path}") from error

    def remove_file(self) -> None:
        """Remove the checkpoint, after all output is written."""
        if self.path is not None:
            self.path.unlink(missing_ok=True)

    @property
    def _exists(self) -> bool:
        return self.path is not None and self.path.is_file()


NO_CHECKPOINT = CheckpointOptions()


def _share(text: str) -> float:
    return to_si(text, "") if text.strip().endswith("%") else float(text)


TargetError = Annotated[
    float | None,
    typer.Option(
        "--error",
        parser=parser_of(_share, "share or percentage"),
        metavar="SHARE",
        help="Bound of the relative error, such as 0.5%: take the cheapest tolerance that meets it.",
    ),
]
Explain = Annotated[bool, typer.Option("--explain", help="With --error: print the tolerances tried, and the reasons.")]
Budget = Annotated[
    float | None,
    typer.Option(parser=number, metavar="SECONDS", help="With --error: wall time of the search; default 120."),
]


@dataclass(frozen=True)
class ErrorTarget:
    """Options of a run to a requested error: relative error [-], explanation, wall time of the search [s]."""

    error: float
    explain: bool
    budget: float

    @classmethod
    def of(
        cls, error: float | None, explain: bool, budget: float | None, others: Mapping[str, Any]
    ) -> ErrorTarget | None:
        """From the command line; None without --error. Raises InputError for options that contradict each other.

        others: values of the options that cannot be combined with --error.
        """
        if error is None:
            for name, present in (("--explain", explain), ("--budget", budget is not None)):
                if present:
                    raise InputError(f"{name} belongs to --error: give both, such as --error 0.5%")
            return None
        from msfp_gen.studies.accuracy.error_target import BUDGET, check_target

        for name, value in others.items():
            if value is not None:
                raise InputError(f"--error = {error:g}: cannot be combined with {name}; give one of them")
        target = cls(error, explain, BUDGET if budget is None else budget)
        check_target(target.error, target.budget)
        return target

    def simulate(self, scene: System) -> Within:
        """Run the scene to the requested error."""
        from msfp_gen.studies.accuracy import simulate_within

        for needed in (scene, scene.with_all_effects()):  # of the run, and of its reference run
            build(needed)
        with ShownProgress(scene.name or "run") as progress:
            return simulate_within(scene, self.error, budget=self.budget, explain=self.explain, progress=progress)


DEMO = ("ridgecrest-ccc", "fenz-test5")
DEMO_METHODS = ("implicit", "esdirk4")  # two families: each confirms the reference of the other
DEMO_TOLERANCES = (1e-2, 1e-3, 3e-4, 1e-4)  # of the first scene, whose own one is the third

app = typer.Typer()


@app.command(
    epilog="Example:\n\n\b\n  msfp-gen run fenz-test2 -o test2.nc --plot test2.png\n  msfp-gen run scene.toml --json\n"
    "  msfp-gen run scene.toml --error 0.5%   # estimate the error of the run, and the cost of a smaller one\n"
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
    method: Annotated[
        str | None, typer.Option(metavar=choices_of(Solver, "method"), help="Method, instead of the scene's.")
    ] = None,
    rtol: Annotated[
        float | None, typer.Option(parser=number, metavar="NUMBER", help="Relative tolerance, instead of the scene's.")
    ] = None,
    max_step: Annotated[
        float | None, typer.Option(parser=number, metavar="SECONDS", help="Longest step, instead of the scene's.")
    ] = None,
    duration: Annotated[
        float | None, typer.Option(parser=number, metavar="SECONDS", help="End after this simulated time.")
    ] = None,
    strict: Annotated[
        bool, typer.Option("--strict", help="Stop where an effect that the model leaves out becomes significant.")
    ] = False,
    error: TargetError = None,
    explain: Explain = False,
    budget: Budget = None,
    checkpoint: CheckpointFile = None,
    every: Every = None,
    resume: ResumeFile = None,
    sign: SignOption = DEFAULT,
    force: Force = False,
) -> None:
    """Simulate a scene."""
    sign_of(sign, "--sign")
    checkpoints = CheckpointOptions.of(checkpoint, every, resume)
    others = {"--rtol": rtol, "--method": method, "--checkpoint": checkpoint, "--resume": resume}
    target = ErrorTarget.of(error, explain, budget, others)
    if output is not None:
        from msfp_gen.results.files import check_result_path

        check_result_path(output, "--output")
    if plot is not None:
        check_output(plot, FIGURE_SUFFIXES, "--plot")
    from msfp_gen.scene.file.source import load_scene

    chosen = _with_options(load_scene(scene), duration, method=method, rtol=rtol, max_step=max_step)
    with using_sign(sign):
        written = _run(chosen, output, plot, as_json, checkpoints, target, strict, force)
    note_written(written)


@app.command(epilog="Example:\n\n\b\n  msfp-gen demo -o out")
def demo(
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Folder for figures and data.")] = Path(
        "out"
    ),
) -> None:
    """Run an earthquake and a laboratory test; write figures and data, and what accuracy costs."""
    from msfp_gen.common.output import make_folder
    from msfp_gen.scene.file.source import load_scene
    from msfp_gen.studies.accuracy.study import cost_table, draw_summary, work_precision

    scenes = [load_scene(name) for name in DEMO]
    make_folder(output, "--output")
    for name, scene in zip(DEMO, scenes, strict=True):
        written = _run(scene, output / f"{name}.nc", output / f"{name}.png")
        say("\n".join(["", *(f"wrote {path}" for path in written), ""]))
    study = work_precision(scenes[0], methods=DEMO_METHODS, tolerances=DEMO_TOLERANCES)
    show([cost_table(study)])
    draw_summary(study, output / "accuracy.png")
    say(f"\nwrote {output / 'accuracy.png'}")


def _with_options(scene: Any, duration: float | None, **solver: Any) -> Any:
    """`scene` with the duration and solver options of the command line."""
    changes = {name: value for name, value in solver.items() if value is not None}
    scene = with_field(scene, "solver", lambda solver: replace(solver, **changes)) if changes else scene
    return scene if duration is None else with_field(scene, "duration", lambda _: duration)


def _run(
    scene: System,
    output: Path | None,
    plot: Path | None,
    as_json: bool = False,
    checkpoints: CheckpointOptions = NO_CHECKPOINT,
    target: ErrorTarget | None = None,
    strict: bool = False,
    force: bool = False,
) -> list[Path]:
    """Simulate, print and save; returns the paths. A failed run is printed and saved before its error is raised."""
    within = None
    if target is not None:
        from msfp_gen.scene.plausibility import require_meant

        require_meant(scene, force=force)
        within = target.simulate(scene)
    options = {"strict": strict} | checkpoints.arguments
    with checkpoints.hint_on_write_error():
        result, failure = run_scene(scene, force, **options) if within is None else (within.result, None)
    saved: list[Path] = []
    if result is not None:
        _report(result, as_json, {} if within is None else {"accuracy": within.as_dict()})
        if within is not None and not as_json:
            show(within.tables)
        with checkpoints.hint_on_write_error():
            saved = _save(result, output, plot)
    if failure is not None:
        files = f"; what was computed until then is in {' and '.join(map(str, saved))}" if saved else ""
        message = f"{failure}{files}{checkpoints.hint(failure)}"
        raise RunError(message, status=failure.status, result=result) from failure
    checkpoints.remove_file()
    return saved


def _report(result: AnyResult, as_json: bool, more: dict[str, Any] | None = None) -> None:
    """Print the summary of a run, as JSON with the keys `more` added, or as tables and notes."""
    if as_json:
        say(json.dumps(result.summary | (more or {}), indent=2, allow_nan=False))
        return
    show(result.tables())
    lines, others = result.first_notes
    for line in lines:
        note(line)
    if others:
        note(f"{others} more note{'s' * (others > 1)}: --json prints all of them, and `msfp-gen report` shows them")
    note_exceeded({"": result.verdict})


def _save(result: AnyResult, output: Path | None, plot: Path | None) -> list[Path]:
    """Write the result and the figure to the given paths; returns them."""
    if output is not None:
        result.save(output)
    if plot is not None:
        from msfp_gen.figures import figures_of

        figures_of(result)["overview"](result, plot)
    return [path for path in (output, plot) if path is not None]
