"""Options of `run` that give an error instead of a tolerance: --error, --explain, --budget."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import typer

from msfp_gen.cli.console import Progress, number, parser_of
from msfp_gen.cli.inputs import build
from msfp_gen.common.quantities import to_si
from msfp_gen.errors import InputError

if TYPE_CHECKING:
    from msfp_gen.scene.scene import Scene
    from msfp_gen.studies.accuracy.error_target import Within


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
        from msfp_gen.studies.accuracy.error_target import BUDGET, check_target

        if error is None:
            for name, given in (("--explain", explain), ("--budget", budget is not None)):
                if given:
                    raise InputError(f"{name} belongs to --error: give both, such as --error 0.5%")
            return None
        for name, value in others.items():
            if value is not None:
                raise InputError(f"--error = {error:g}: cannot be combined with {name}; give one of them")
        found = cls(error, explain, BUDGET if budget is None else budget)
        check_target(found.error, found.budget)
        return found

    def simulate(self, scene: Scene) -> Within:
        """Run the scene to the requested error."""
        from msfp_gen.studies.accuracy import simulate_within
        from msfp_gen.studies.accuracy.error_target import with_all_effects

        for each in (scene, with_all_effects(scene)):  # of the run, and of its reference run
            build(each)
        with Progress(scene.name or "run") as progress:
            return simulate_within(scene, self.error, budget=self.budget, explain=self.explain, progress=progress)
