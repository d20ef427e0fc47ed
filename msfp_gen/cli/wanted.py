"""Options of `run` that ask for an error instead of a tolerance."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import typer

from msfp_gen.cli.console import Progress, number, read_as
from msfp_gen.cli.opening import build
from msfp_gen.errors import InputError
from msfp_gen.quantities import to_si

if TYPE_CHECKING:
    from msfp_gen.accuracy.within import Within
    from msfp_gen.scene import Scene


def _share(text: str) -> float:
    return to_si(text, "") if text.strip().endswith("%") else float(text)


WantedError = Annotated[
    float | None,
    typer.Option("--error", parser=read_as(_share, "share or percentage"), metavar="SHARE",
                 help="Meet this error, such as 0.5%, at the least cost, and say what this run is off by."),
]  # fmt: skip
Explain = Annotated[bool, typer.Option("--explain", help="With --error: say what was tried, and why.")]
Budget = Annotated[
    float | None, typer.Option(parser=number, metavar="SECONDS", help="With --error: give up after this time (120).")
]


@dataclass(frozen=True)
class Wanted:
    """An error that was asked for on the command line."""

    error: float
    explain: bool
    budget: float

    @classmethod
    def of(cls, error: float | None, explain: bool, budget: float | None, others: Mapping[str, Any]) -> Wanted | None:
        """What the options ask for, None without --error. InputError for options that do not go together."""
        from msfp_gen.accuracy.within import BUDGET

        if error is None:
            for name, given in (("--explain", explain), ("--budget", budget is not None)):
                if given:
                    raise InputError(f"{name} belongs to --error: give that too, such as --error 0.5%")
            return None
        for name, value in others.items():
            if value is not None:
                raise InputError(f"--error = {error:g} with {name}: it chooses that itself; give one of them")
        return cls(error, explain, BUDGET if budget is None else budget)

    def simulate(self, scene: Scene) -> Within:
        """The run, with its estimate."""
        from msfp_gen.accuracy import simulate_within
        from msfp_gen.accuracy.effects import full

        for each in (scene, full(scene)):  # what runs, and what judges it
            build(each)
        with Progress(scene.name or "run") as progress:
            return simulate_within(scene, self.error, budget=self.budget, explain=self.explain, progress=progress)
