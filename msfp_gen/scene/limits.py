"""`Limits`: what the device may be asked to bear; the verdict of a run compares with them (docs/limits.md)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from msfp_gen.common.fields import Quantity, check_fields

_FORCE, _LENGTH, _TIME = Quantity("N", above=0.0), Quantity("m", above=0.0), Quantity("s", above=0.0)


@dataclass(frozen=True)
class Limits:
    """Limits of the device, of each bearing of a building. No number of a run depends on them, only its verdict.

    rim_force: of a rim [N]; None: a third of the axial load at rest, of the largest normal force where the load varies.
    rim_compression: of a rim [m]; None: none. uplift_height: clearance between the faces of a surface [m]; None: the
    height at which its rim acts, the rim_offset of its slider. uplift_duration: longest time for which a surface is
    open [s]. temperature: at the centre of a surface [degC]. axial_load: largest vertical force on what is carried [N];
    None: none. displacement: largest horizontal one across the bearing [m]; None: none. Raises InputError.
    """

    rim_force: Annotated[float | None, _FORCE] = None
    rim_compression: Annotated[float | None, _LENGTH] = None
    uplift_height: Annotated[float | None, _LENGTH] = None
    uplift_duration: Annotated[float, _TIME] = 0.1
    temperature: Annotated[float, Quantity("degC", above=-273.15)] = 250.0
    axial_load: Annotated[float | None, _FORCE] = None
    displacement: Annotated[float | None, _LENGTH] = None

    def __post_init__(self) -> None:
        check_fields(self, "limits")
