"""Solver options of a run: the method and its tolerances."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Literal

from msfp_gen.common.errors import InputError
from msfp_gen.common.fields import check_fields
from msfp_gen.specification import contract
from msfp_gen.specification.values import rules

_RUN = rules(contract.RUN)


@dataclass(frozen=True)
class Solver:
    """Settings of the integrator.

    method: "implicit" (TR-BDF2, L-stable, order 2), "esdirk4" (L-stable, order 4, for tight tolerances) or "dopri5"
    (explicit Dormand-Prince, the method of PEER 2017/07).
    rtol: relative tolerance, below 1. atol_angle: absolute tolerance of angles [rad]; None: a hundredth of rtol.
    max_step [s]; None: limited by the resolution of the motion. first_step [s]; None: determined by the method.
    max_steps: the run ends with the status `steps` beyond this number. Raises InputError.
    """

    method: Literal["implicit", "esdirk4", "dopri5"] = "implicit"
    rtol: Annotated[float, _RUN["rtol"]] = 1e-4
    atol_angle: Annotated[float | None, _RUN["atol_angle"]] = None
    max_step: Annotated[float | None, _RUN["max_step"]] = None
    first_step: Annotated[float | None, _RUN["first_step"]] = None
    max_steps: Annotated[int, replace(_RUN["max_steps"], whole=True)] = 10_000_000

    def __post_init__(self) -> None:
        check_fields(self, "solver")
        if self.max_step is not None and self.first_step is not None and self.first_step > self.max_step:
            raise InputError(f"solver.first_step = {self.first_step}: give at most max_step = {self.max_step} [s]")

    @property
    def angle_tolerance(self) -> float:
        """Absolute tolerance of angles [rad]: `atol_angle` or its default."""
        return 1e-2 * self.rtol if self.atol_angle is None else self.atol_angle

    def tightened(self, factor: float) -> Solver:
        """These options with tolerances divided by a factor."""
        angle = None if self.atol_angle is None else self.atol_angle / factor
        return replace(self, rtol=self.rtol / factor, atol_angle=angle)
