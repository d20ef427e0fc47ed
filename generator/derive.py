"""Derive: all programs of one model from its specification."""

from __future__ import annotations

from dataclasses import dataclass

from msfp_gen.layout import ModelSpec

from . import body, columns, contact, laws, seat, top
from .blocks import Blocks, make_blocks
from .program import Program


@dataclass(frozen=True)
class Equations:
    """The straight-line programs of one body, one surface and the top, and the blocks between them."""

    spec: ModelSpec
    blocks: Blocks
    programs: tuple[Program, ...]
    column_blocks: columns.Columns | None = None
    """Blocks of the tangent's columns, where they are those of rigid bodies on each other."""

    @property
    def unknowns(self) -> tuple[str, ...]:
        """Coordinates of one body whose accelerations are unknown."""
        return unknowns(self.spec)

    @property
    def separations(self) -> tuple[str, ...]:
        """Components of one surface's separation that are unknown."""
        if not self.spec.effects.uplift:
            return ()
        return ("dx", "dz") if self.spec.effects.dimension == "planar" else ("dx", "dy", "dz")


def unknowns(spec: ModelSpec) -> tuple[str, ...]:
    """Coordinates of one body whose accelerations are unknown."""
    if spec.effects.dimension == "planar":
        return ("theta",)
    return ("psi", "theta") if spec.effects.spin == "locked" else ("psi", "theta", "phi")


def derive(spec: ModelSpec) -> Equations:
    """Derive the programs; what an effect leaves out never enters them."""
    effects = spec.effects
    blocks = laws.with_law(make_blocks(planar=effects.dimension == "planar", uplift=effects.uplift), effects.law)
    patch = effects.spin == "patch" and effects.dimension == "spatial"
    law = contact.Law(effects.bouc_wen, patch, effects.law)
    massless = effects.sliders == "massless"
    programs = [
        body.arms(blocks),
        body.forward(blocks),
        body.named_points(blocks),
        body.to_local(blocks, effects.uplift),
        contact.contact(blocks, law),
        contact.report_contact(blocks, law),
        body.to_world(blocks),
        body.force_to_world(blocks),
        body.interface_force(blocks, massless),
        body.linear_balance(blocks, massless),
        body.angular_balance(blocks, massless),
        body.body_energy(blocks, massless),
        top.top_wrench(blocks, effects.top_rotation),
        top.top_energy(blocks),
        contact.gap(blocks),
    ]
    if effects.top_rotation:
        programs.append(top.upright(blocks))
    if effects.rims:
        programs.append(contact.rim(blocks))
    if effects.uplift:
        programs += [seat.seat_inside(blocks), seat.seat_edge(blocks)]
        return Equations(spec, blocks, tuple(programs))
    column_blocks = columns.column_blocks(blocks, effects.dimension == "planar", unknowns(spec))
    programs += columns.programs(blocks, column_blocks, massless, unknowns(spec))
    return Equations(spec, blocks, tuple(programs), column_blocks)
