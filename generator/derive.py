"""Derivation: collects the programs of one model from its specification."""

from __future__ import annotations

from dataclasses import dataclass, replace

from msfp_gen.specification.layout import ModelSpec

from . import body, columns, contact, energy, laws, parameters, rows, top, two_port, unilateral
from .blocks import Blocks, make_blocks
from .program import Program


@dataclass(frozen=True)
class Equations:
    """The equations of one model.

    Attributes:
        spec: layout and effects.
        blocks: records that the programs exchange.
        programs: straight-line programs of one body, one surface and the top plate.
        value_blocks: the values from which their parameters are made.
        column_blocks: blocks of the tangent where an unknown moves all bodies above as one rigid body; None with
            uplift.
    """

    spec: ModelSpec
    blocks: Blocks
    programs: tuple[Program, ...]
    value_blocks: parameters.ValueBlocks
    column_blocks: columns.Columns | None = None

    @property
    def unknown_angles(self) -> tuple[str, ...]:
        """Names of the angles of one body whose accelerations are unknown."""
        return unknown_angles(self.spec)

    @property
    def separations(self) -> tuple[str, ...]:
        """Names of the separation components of one surface whose accelerations are unknown; empty without uplift."""
        if not self.spec.effects.uplift:
            return ()
        return ("dx", "dz") if self.spec.effects.dimension == "planar" else ("dx", "dy", "dz")


def unknown_angles(spec: ModelSpec) -> tuple[str, ...]:
    """Names of the angles of one body whose accelerations are unknown."""
    if spec.effects.dimension == "planar":
        return ("theta",)
    return ("psi", "theta") if spec.effects.spin == "locked" else ("psi", "theta", "phi")


def derive(spec: ModelSpec) -> Equations:
    """Derive the programs of one model. An effect that is off contributes neither fields nor statements."""
    effects = spec.effects
    blocks = make_blocks(planar=effects.dimension == "planar", uplift=effects.uplift)
    surface = laws.with_fields(blocks.surface_parameters, parameters.number_fields(effects))
    blocks = laws.add_law_fields(replace(blocks, surface_parameters=surface), effects.law)
    values = parameters.value_blocks(effects)
    friction_model = contact.FrictionModel(effects.bouc_wen, effects.drilling, effects.law, effects.uplift)
    massless = effects.sliders == "massless"
    programs = [
        *parameters.programs(blocks, values, effects),
        body.forward(blocks),
        body.named_points(blocks, values),
        body.surface_local(blocks, effects.uplift, effects.rims),
        contact.contact(blocks, friction_model),
        body.slip_rotation(blocks),
        contact.report_contact(blocks, friction_model),
        contact.report_wrench(blocks, effects.rims),
        contact.surface_results(blocks),
        contact.report_rates(blocks),
        contact.contact_stage(blocks),
        contact.surface_moment(blocks, effects.rims),
        body.moment_to_world(blocks),
        body.interface_force(blocks, massless),
        body.linear_balance(blocks, massless),
        body.angular_balance(blocks, massless),
        body.balances(blocks, effects.spin == "locked"),
        body.body_energy(blocks, massless),
        top.top_wrench(blocks, effects.top_rotation),
        top.spring_stage(blocks),
        top.resting_foot(blocks),
        top.foot(blocks),
        top.top_energy(blocks),
        contact.contact_angles(blocks),
        contact.gap(blocks),
        contact.gap_at(blocks),
        *energy.programs(blocks, effects.rims, effects.uplift, effects.top_rotation),
        *rows.programs(blocks),
        *(two_port.programs(blocks) if effects.permits_moving_ends else ()),
        *(laws.memory_programs(blocks, effects.law.memory) if effects.law and effects.law.memory else ()),
    ]
    if effects.top_rotation:
        programs.append(top.upright(blocks))
    if effects.permits_quasistatic_steps:
        programs += [laws.friction_after_slip(blocks, effects.bouc_wen), laws.slip_work(blocks, effects.bouc_wen)]
        programs += [energy.tilt(blocks), energy.load_end(blocks), energy.load_work(blocks)]
    if effects.rims:
        programs += [contact.rim_coordinates(blocks), contact.rim(blocks)]
    if effects.uplift:
        programs += unilateral.programs(blocks, effects.rims)
        return Equations(spec, blocks, tuple(programs), values)
    column_blocks = columns.column_blocks(blocks, effects.dimension == "planar", unknown_angles(spec))
    programs += columns.programs(blocks, column_blocks, massless, unknown_angles(spec))
    return Equations(spec, blocks, tuple(programs), values, column_blocks)
