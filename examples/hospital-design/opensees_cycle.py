"""The loop of a triple pendulum by the element TripleFrictionPendulum of OpenSees, for design.py.

OpenSeesPy (`pip install openseespy`) is for research and education only; design.py leaves the line out without
it. OpenSees keeps its model in the process.
"""

from __future__ import annotations

from contextlib import suppress
from importlib import import_module
from typing import Any

import numpy as np

from msfp_gen import Bearing
from msfp_gen.scene.sheet import Sheet

ROWS, STEPS = 400, 20  # in a cycle; of the analysis from row to row
YIELD, STIFF, LEAST, TOLERANCE = 1e-3, 1e10, 0.1, 1e-5  # [m], [N/m], [N], relative; as small as the element follows


def opensees() -> Any:
    """The module of OpenSeesPy, under either of its names. Raises ImportError where neither can be loaded."""
    for name in ("openseespy.opensees", "openseespylinux.opensees"):
        with suppress(ImportError, RuntimeError):  # RuntimeError: a library of the system is missing, as libblas3
            return import_module(name)
    raise ImportError("OpenSeesPy is not installed, or a library that it needs, such as libblas3")


def cycle(sheet: Sheet, bearing: Bearing, displacement: float) -> tuple[np.ndarray, np.ndarray]:
    """Displacements [m] and forces [N] of the second of two cycles under the axial load of the sheet, shape (k,)."""
    ops = opensees()
    assert sheet.radius is not None and sheet.height is not None
    lengths = np.subtract(sheet.radius, sheet.height)
    limits = [
        surface.capacity * length / surface.radius for surface, length in zip(bearing.surfaces, lengths, strict=True)
    ]
    order = (1, 0, 3)  # of the element: inner, lower, upper
    ops.wipe()
    ops.model("basic", "-ndm", 3, "-ndf", 6)
    for node, fixed in ((1, (1, 1, 1, 1, 1, 1)), (2, (0, 0, 0, 1, 1, 1))):
        ops.node(node, 0.0, 0.0, 0.0)
        ops.fix(node, *fixed)
    for tag, surface in enumerate(order, start=1):
        ops.frictionModel("Coulomb", tag, sheet.friction[surface])
    for tag in range(1, 5):
        ops.uniaxialMaterial("Elastic", tag, STIFF)
    shape = (*(float(lengths[i]) for i in order), *(float(limits[i]) for i in order))
    ops.element("TripleFrictionPendulum", 1, 1, 2, 1, 2, 3, 1, 2, 3, 4, *shape, sheet.axial_load, YIELD, STIFF, LEAST,
                TOLERANCE)  # fmt: skip
    ops.timeSeries("Linear", 1)
    ops.pattern("Plain", 1, 1)
    ops.load(2, 0.0, 0.0, -sheet.axial_load, 0.0, 0.0, 0.0)
    _advance(ops, 10, 0.1)
    ops.loadConst("-time", 0.0)
    path = displacement * np.sin(2 * np.pi * np.arange(2 * ROWS + 1) / ROWS)
    ops.timeSeries("Path", 2, "-dt", 1.0, "-values", *path.tolist(), 0.0)
    ops.pattern("Plain", 2, 2)
    ops.sp(2, 1, 1.0)
    force = [0.0]
    for _ in path[1:]:
        _advance(ops, STEPS, 1.0 / STEPS)
        ops.reactions()
        force.append(-ops.nodeReaction(1, 1))
    ops.wipe()
    return path[ROWS:], np.array(force[ROWS:])


def _advance(ops: Any, steps: int, step: float) -> None:
    """A static analysis of some steps. Raises RuntimeError where OpenSees finds no solution."""
    ops.wipeAnalysis()
    ops.constraints("Transformation")
    ops.numberer("RCM")
    ops.system("FullGeneral")
    ops.test("NormDispIncr", 1e-9, 100)
    ops.algorithm("Newton")
    ops.integrator("LoadControl", step)
    ops.analysis("Static")
    if ops.analyze(steps) != 0:
        raise RuntimeError("OpenSees found no solution")
