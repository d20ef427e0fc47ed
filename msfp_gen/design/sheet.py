"""A data sheet and what follows from it, as tables: `msfp-gen sheet` (docs/bearing.md)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import isclose
from typing import Any

from msfp_gen.common.tables import Table
from msfp_gen.design.effective import Effective, characteristic, effective, published_backbone, regimes
from msfp_gen.scene.bearing import Bearing
from msfp_gen.scene.explain import body_table
from msfp_gen.scene.fidelity import Backbone
from msfp_gen.scene.sheet import Sheet

CASES = {"lower": "friction_lower", "nominal": "friction", "upper": "friction_upper"}
SHARES = (0.25, 0.5, 0.75, 1.0)  # of the displacement capacity, where effective properties are given
# Ends of the regimes of a triple pendulum, by the names of Fenz and Constantinou (2008).
NAMES = {5: ("u*", "u**", "u_dr1", "u_dr4"), 3: ("u* = u**", "u_dr1 = u_dr4")}  # three: of a symmetric stack


@dataclass(frozen=True)
class SheetReport:
    """A data sheet, its bearing and the displacements at which effective properties are wanted [m].

    displacements: empty for quarters of the capacity.
    """

    name: str
    sheet: Sheet
    bearing: Bearing
    displacements: Sequence[float] = ()

    @cached_property
    def backbones(self) -> dict[str, Backbone]:
        """Case of friction -> published backbone; "nominal" alone where the sheet has no bounds."""
        found = {}
        for case, name in CASES.items():
            values = [s.friction for s in self.bearing.surfaces] if case == "nominal" else getattr(self.bearing, name)
            if values is not None:
                found[case] = published_backbone(self.bearing.replace(friction=values))
        return found

    @cached_property
    def effective(self) -> dict[str, list[Effective]]:
        """Case of friction -> effective properties at the displacements. Raises InputError for one beyond the rims."""
        capacity = self.backbones["nominal"].capacity
        wanted = self.displacements or [share * capacity for share in SHARES]
        gravity = self.bearing.gravity
        return {case: [effective(b, u, gravity) for u in wanted] for case, b in self.backbones.items()}

    @property
    def tables(self) -> list[Table]:
        """Surfaces, bodies, backbone and effective properties."""
        return [self._surfaces(), body_table(self.bearing), self._backbone(), self._effective()]

    def as_dict(self) -> dict[str, Any]:
        """Plain data in SI units, ready for JSON; forces are over the axial load."""
        return {
            "name": self.name,
            "sheet": vars(self.sheet),
            "capacity": self.backbones["nominal"].capacity,
            "cases": {
                case: {
                    "zero_displacement_force": characteristic(backbone)[0],
                    "radius": characteristic(backbone)[1],
                    "regimes": regimes(backbone),
                    "effective": [vars(found) for found in self.effective[case]],
                }
                for case, backbone in self.backbones.items()
            },
        }

    def _surfaces(self) -> Table:
        sheet, rows = self.sheet, []
        assert sheet.radius and sheet.height and sheet.effective_radius and sheet.capacity and sheet.dish_diameter
        lengths = (
            sheet.radius, sheet.height, sheet.effective_radius, sheet.slider_diameter, sheet.dish_diameter,
            sheet.capacity,
        )  # fmt: skip
        pivot = [getattr(sheet, name) for name in CASES.values() if getattr(sheet, name) is not None]
        for index in range(sheet.surfaces):
            cells = [f"{column[index] * 1e3:.4g}" for column in lengths]
            bounds = " / ".join(f"{values[index]:.4g}" for values in pivot)
            rows.append((str(index + 1), *cells, bounds, f"{self.bearing.surfaces[index].friction:.4g}"))
        columns = ("surface", "R [mm]", "h [mm]", "R_eff [mm]", "slider [mm]", "dish [mm]", "capacity [mm]")
        cases = " / ".join(self.backbones)
        title = (
            f"{self.name}: {sheet.device} pendulum, axial load {sheet.axial_load / 1e3:.4g} kN; displacement capacity "
            f"{self.backbones['nominal'].capacity * 1e3:.4g} mm; friction {cases}"
        )
        return Table(title, (*columns, "friction at pivot", "friction at surface"), rows)

    def _backbone(self) -> Table:
        rows, load = [], self.sheet.axial_load
        for case, backbone in self.backbones.items():
            drawn = regimes(backbone)
            in_order = isclose(drawn[0][3], drawn[-1][3])  # the inner slider slides first and last
            names = NAMES.get(len(drawn)) if self.sheet.device == "triple" and in_order else None
            for index, (start, end, force, slope) in enumerate(drawn):
                last = index == len(drawn) - 1
                word = "capacity" if last else names[index] if names else ""
                ends = force + slope * (end - start)
                stiffness = f"{slope * load / 1e6:.4g}"
                cells = (f"{start * 1e3:.4g}", f"{end * 1e3:.4g}", word, f"{force:.4f}", f"{ends:.4f}", stiffness)
                rows.append((case if not index else "", str(index + 1), *cells))
        columns = ("friction", "regime", "from [mm]", "to [mm]", "", "F/W", "to F/W", "stiffness [kN/mm]")
        return Table("published backbone", columns, rows)

    def _effective(self) -> Table:
        rows, load = [], self.sheet.axial_load
        for case, found in self.effective.items():
            friction, radius = characteristic(self.backbones[case])
            for index, at in enumerate(found):
                cells = (
                    f"{at.displacement * 1e3:.4g}", f"{at.force * load / 1e3:.4g}", f"{at.stiffness * load / 1e6:.4g}",
                    f"{at.period:.3f}", f"{at.damping * 100:.2f}",
                )  # fmt: skip
                own = (case, f"{friction:.4f}", f"{radius * 1e3:.4g}") if not index else ("", "", "")
                rows.append((*own, *cells))
        columns = ("friction", "Q/W", "R_eff [mm]", "D [mm]", "F [kN]", "k_eff [kN/mm]", "T_eff [s]", "damping [%]")
        return Table("effective properties; Q and R_eff belong to the longest sliding regime", columns, rows)
