"""The bearing of the examples of an exported library."""

from __future__ import annotations

from msfp_gen import Bearing, Body, Effects, Layout, Surface
from msfp_gen.embedding import values
from msfp_gen.specification import contract
from msfp_gen.specification.layout import ModelSpec


def example_bearing() -> Bearing:
    """A triple pendulum."""
    found = values.example(ModelSpec(Layout.tfp(), Effects()))
    bodies = [dict(zip(contract.names(contract.BODY), row, strict=True)) for row in found.bodies]
    surfaces = [dict(zip(contract.names(contract.SURFACE), row, strict=True)) for row in found.surfaces]
    inertia = ("inertia_transverse", "inertia_axial")
    return Bearing(
        layout=Layout.tfp(),
        base_height=bodies[0]["height"],
        gravity=values.GRAVITY,
        surfaces=[Surface(**row) for row in surfaces],
        bodies=[
            Body(**{k: v for k, v in row.items() if k not in inertia}, inertia=(row[inertia[0]], row[inertia[1]]))
            for row in bodies[1:]
        ],
    )
