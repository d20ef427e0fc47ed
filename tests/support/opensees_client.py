"""Analyses by OpenSeesPy that use served bearings, run in a process of their own: NAME, JSON of the arguments.

OpenSees keeps its model in the process and prints as it likes; the last line of standard output is the JSON answer.
"""

from __future__ import annotations

import json
import sys
from importlib import import_module
from typing import Any

import numpy as np

HOST = "127.0.0.1"


def opensees() -> Any:
    """The module of OpenSeesPy, under either of its names."""
    try:
        return import_module("openseespy.opensees")
    except ImportError:
        return import_module("openseespylinux.opensees")


def settings(ops: Any, integrator: tuple[object, ...], analysis: str, tolerance: float) -> None:
    ops.wipeAnalysis()
    ops.constraints("Transformation")
    ops.numberer("RCM")
    ops.system("FullGeneral")
    ops.test("NormUnbalance", tolerance, 20, 0)
    ops.algorithm("Newton")
    ops.integrator(*integrator)
    ops.analysis(analysis)


def served(ops: Any, tag: int, lower: int, upper: int, port: int) -> None:
    freedoms = [1, 2, 3, 4, 5, 6]
    nodes = ("-node", lower, upper, "-dof", *freedoms, "-dof", *freedoms)
    ops.element("genericClient", tag, *nodes, "-server", port, HOST)


def pair(ops: Any, fixed: tuple[int, ...] = (0, 0, 0, 1, 1, 1)) -> None:
    """A fixed node and one above it, at the same place."""
    ops.wipe()
    ops.model("basic", "-ndm", 3, "-ndf", 6)
    for node in (1, 2):
        ops.node(node, 0.0, 0.0, 0.0)
    ops.fix(1, 1, 1, 1, 1, 1, 1)
    ops.fix(2, *fixed)


def vertical(port: int, mass: float, stiffness: float, load: float, step: float, count: int) -> Any:
    """Vertical motion of a mass on a bearing and on a native spring, under a half sine of force, shape (2, count)."""
    ops, found = opensees(), []
    for element in ("served", "native"):
        pair(ops, (1, 1, 0, 1, 1, 1))
        ops.mass(2, mass, mass, mass, 0.0, 0.0, 0.0)
        weight = 0.0
        if element == "served":
            served(ops, 1, 1, 2, port)
            weight = -load  # the bearing presses back with its axial load from the start
        else:
            ops.uniaxialMaterial("Elastic", 1, stiffness)
            ops.element("zeroLength", 1, 1, 2, "-mat", 1, "-dir", 3)
        ops.timeSeries("Constant", 1)
        ops.pattern("Plain", 1, 1)
        ops.load(2, 0.0, 0.0, weight, 0.0, 0.0, 0.0)
        ops.timeSeries("Trig", 2, 0.0, 0.1, 0.2)
        ops.pattern("Plain", 2, 2)
        ops.load(2, 0.0, 0.0, -0.5 * load, 0.0, 0.0, 0.0)
        settings(ops, ("Newmark", 0.5, 0.25), "Transient", 1e-7 * load)
        rows = []
        for _ in range(count):
            assert ops.analyze(1, step) == 0
            rows.append(ops.nodeDisp(2, 3))
        found.append(rows)
    ops.wipe()
    return found


def path(
    port: int, native: list[object] | None, frictions: list[float], load: float, rows: list[list[float]], parts: int = 1
) -> Any:
    """Horizontal forces, shape (rows, 2), under imposed displacements, of a served or a native triple pendulum.

    Vertically the served one is held, with a soft interface that keeps its load; the native one has the load itself.
    parts: steps of the analysis from row to row.
    """
    ops = opensees()
    pair(ops)
    if native is None:
        served(ops, 1, 1, 2, port)
        ops.uniaxialMaterial("Elastic", 1, 1e10)
        ops.element("zeroLength", 2, 1, 2, "-mat", 1, "-dir", 3)
    else:
        for tag, friction in enumerate(frictions, start=1):
            ops.frictionModel("Coulomb", tag, friction)
        for tag in range(1, 5):
            ops.uniaxialMaterial("Elastic", tag, 1e10)
        ops.element("TripleFrictionPendulum", 1, 1, 2, 1, 2, 3, 1, 2, 3, 4, *native)
    if native is not None:
        ops.timeSeries("Linear", 1)
        ops.pattern("Plain", 1, 1)
        ops.load(2, 0.0, 0.0, -load, 0.0, 0.0, 0.0)
        settings(ops, ("LoadControl", 0.1), "Static", 1e-6 * load)
        assert ops.analyze(10) == 0
        ops.loadConst("-time", 0.0)
    for axis in (0, 1):
        values = [0.0, *(row[axis] for row in rows), rows[-1][axis]]
        ops.timeSeries("Path", 10 + axis, "-dt", 1.0, "-values", *values)
        ops.pattern("Plain", 10 + axis, 10 + axis)
        ops.sp(2, axis + 1, 1.0)
    settings(ops, ("LoadControl", 1.0 / parts), "Static", 1e-6 * load)
    found = []
    for _ in rows:
        assert ops.analyze(parts) == 0
        ops.reactions()
        found.append([-ops.nodeReaction(1, axis) for axis in (1, 2)])
    ops.wipe()
    return found


def frame(ports: list[int], load: float, step: float, ground: list[list[float]], height: float, period: float) -> Any:
    """A rigid floor on four bearings with columns and a roof, under ground accelerations in two directions.

    Returns the status of the analysis, displacements of the four bearings, shape (steps, 4, 2), and vertical reactions.
    """
    ops = opensees()
    ops.wipe()
    ops.model("basic", "-ndm", 3, "-ndf", 6)
    corners = [(0.0, 0.0), (6.0, 0.0), (6.0, 6.0), (0.0, 6.0)]
    mass = load / 9.81
    for i, (x, y) in enumerate(corners):
        ops.node(10 + i, x, y, 0.0)
        ops.fix(10 + i, 1, 1, 1, 1, 1, 1)
        ops.node(20 + i, x, y, 0.0)
        ops.node(30 + i, x, y, height)
        for node, share in ((20 + i, 0.4), (30 + i, 0.6)):
            m = share * mass
            ops.mass(node, m, m, m, m * 1e-2, m * 1e-2, m * 1e-2)
    ops.geomTransf("Linear", 1, 1.0, 0.0, 0.0)
    ops.geomTransf("Linear", 2, 0.0, 0.0, 1.0)
    inertia = 0.6 * mass * (2 * np.pi / period) ** 2 * height**3 / (12 * 2.1e11)  # of a column
    for i in range(4):
        column, beam = (0.05, 2.1e11, 8e10, 2 * inertia, inertia, inertia), (0.1, 2.1e11, 8e10, 1e-2, 1e-2, 1e-2)
        served(ops, 100 + i, 10 + i, 20 + i, ports[i])
        ops.element("elasticBeamColumn", 200 + i, 20 + i, 30 + i, *column, 1)
        for level in (20, 30):
            ops.element("elasticBeamColumn", 10 * level + 100 + i, level + i, level + (i + 1) % 4, *beam, 2)
    ops.timeSeries("Constant", 1)
    ops.pattern("Plain", 1, 1)
    for i in range(4):
        for node, share in ((20 + i, 0.4), (30 + i, 0.6)):
            ops.load(node, 0.0, 0.0, -share * load, 0.0, 0.0, 0.0)
    for axis, values in enumerate(ground):
        ops.timeSeries("Path", 10 + axis, "-dt", step, "-values", *values)
        ops.pattern("UniformExcitation", 10 + axis, axis + 1, "-accel", 10 + axis)
    ops.rayleigh(0.3, 0.0, 0.0, 0.0)
    settings(ops, ("Newmark", 0.5, 0.25), "Transient", 1e-3 * load)
    moved, reactions, status = [], [], 0
    for _ in range(len(ground[0]) - 1):
        status = ops.analyze(1, step)
        if status:
            break
        ops.reactions()
        moved.append([ops.nodeDisp(20 + i)[:2] for i in range(4)])
        reactions.append([ops.nodeReaction(10 + i, 3) for i in range(4)])
    ops.wipe()
    return status, moved, reactions


if __name__ == "__main__":
    answer = globals()[sys.argv[1]](**json.loads(sys.argv[2]))
    print("\n" + json.dumps(answer), flush=True)
