"""Frames on bearings in OpenSeesPy, in a process of their own: the JSON of the arguments of `frame` on standard input.

The last line of standard output is the JSON answer.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from typing import Any

if __package__ is None:
    sys.path.insert(0, str(Path(__file__).parents[1]))

from support.opensees_client import opensees, served

RIGID = 1e10  # of the springs of the native element that do not matter [N/m], [N m/rad]


def floors(ops: Any, given: list[dict[str, Any]]) -> None:
    """Masses at their centres, nodes 1, 2, ...; columns as springs at half height, with damping of their stiffness."""
    materials = 100
    for k, floor in enumerate(given, start=1):
        x, y = floor["mass_centre"]
        ops.node(k, x, y, floor["level"])
        ops.mass(k, *3 * [floor["mass"]], *floor["inertia"])
        if k == 1:
            continue
        lower, upper = 1000 + 2 * k, 1001 + 2 * k
        place = (*floor["stiffness_centre"], 0.5 * (floor["level"] + given[k - 2]["level"]))
        for node, master in ((lower, k - 1), (upper, k)):
            ops.node(node, *place)
            ops.rigidLink("beam", master, node)
        tags = []
        times = floor["damping_time"] if isinstance(floor["damping_time"], list) else 6 * [floor["damping_time"]]
        for spring, damping_time in zip(floor["springs"], times, strict=True):
            materials += 1
            ops.uniaxialMaterial("Elastic", materials, spring, damping_time * spring)
            tags.append(materials)
        ops.element("zeroLength", 1000 + k, lower, upper, "-mat", *tags, "-dir", 1, 2, 3, 4, 5, 6)


def native_bearing(ops: Any, tag: int, lower: int, upper: int, values: dict[str, Any]) -> None:
    """The triple pendulum of OpenSees; its vertical spring, and damper if there is one, are those of an interface."""
    friction, spring = 10 * tag, 10 * tag + 4
    for i, coefficient in enumerate(values["frictions"]):
        ops.frictionModel("Coulomb", friction + i, coefficient)
    for i, stiffness in enumerate((values["vertical_stiffness"], RIGID, RIGID, RIGID)):
        ops.uniaxialMaterial("Elastic", spring + i, stiffness)
    shape = (*values["lengths"], *values["capacities"], values["weight"], values["yield_displacement"])
    frictions, springs = (friction, friction + 1, friction + 2), (spring, spring + 1, spring + 2, spring + 3)
    ops.element("TripleFrictionPendulum", tag, lower, upper, *frictions, *springs, *shape, RIGID, 1e-3, 1e-8)
    if damping := values.get("vertical_damping"):
        ops.uniaxialMaterial("Viscous", spring + 4, damping, 1.0)
        ops.element("zeroLength", 7000 + tag, lower, upper, "-mat", spring + 4, "-dir", 3)


def bearings(ops: Any, given: list[dict[str, Any]]) -> None:
    """Bearings between fixed nodes 2000, ... and nodes 3000, ... of the base, which carry the loads at rest."""
    ops.timeSeries("Constant", 1)
    ops.pattern("Plain", 1, 1)
    for i, each in enumerate(given):
        lower, upper = 2000 + i, 3000 + i
        for node in (lower, upper):
            ops.node(node, *each["position"], 0.0)
        ops.fix(lower, 1, 1, 1, 1, 1, 1)
        ops.rigidLink("beam", 1, upper)
        if "port" in each:
            served(ops, 5000 + i, lower, upper, each["port"])
        else:
            native_bearing(ops, 5000 + i, lower, upper, each)
        ops.load(upper, 0.0, 0.0, -each["load"], 0.0, 0.0, 0.0)


def settle(ops: Any, load: float) -> None:
    """Put the loads on native bearings, which start without any: they compress their vertical springs."""
    ops.constraints("Transformation")
    ops.numberer("RCM")
    ops.system("UmfPack")
    ops.test("NormDispIncr", 1e-12, 50, 0)
    ops.algorithm("Newton")
    ops.integrator("LoadControl", 1.0)
    ops.analysis("Static")
    assert ops.analyze(1) == 0
    ops.loadConst("-time", 0.0)
    ops.wipeAnalysis()


def frame(
    floors_given: list[dict[str, Any]],
    bearings_given: list[dict[str, Any]],
    ground: list[list[float]],
    ground_step: float,
    step: float,
    count: int,
    every: int,
    tolerance: float,
) -> dict[str, Any]:
    """Run a frame under ground accelerations in three directions.

    Returns rows, one in `every` steps: relative accelerations of the highest floor [3], displacements of the upper ends
    and compressions of the bearings; the seconds of the analysis, and its status.
    """
    ops = opensees()
    ops.wipe()
    ops.model("basic", "-ndm", 3, "-ndf", 6)
    floors(ops, floors_given)
    bearings(ops, bearings_given)
    if "port" not in bearings_given[0]:
        settle(ops, bearings_given[0]["load"])
    for axis, values in enumerate(ground):
        # One more value: beyond the last, which rounding may reach, a path is zero.
        ops.timeSeries("Path", 10 + axis, "-dt", ground_step, "-values", *values, values[-1])
        ops.pattern("UniformExcitation", 10 + axis, axis + 1, "-accel", 10 + axis)
    ops.constraints("Transformation")
    ops.numberer("RCM")
    ops.system("UmfPack")
    ops.test("NormUnbalance", tolerance, 100, 0)
    ops.algorithm("Newton")
    ops.integrator("Newmark", 0.5, 0.25)
    ops.analysis("Transient")
    return rows(ops, len(floors_given), len(bearings_given), step, count, every)


def rows(ops: Any, roof: int, number: int, step: float, count: int, every: int) -> dict[str, Any]:
    found: dict[str, Any] = {"acceleration": [], "displacement": [], "compression": [], "status": 0}
    begin = time.process_time()
    for i in range(1, count + 1):
        found["status"] = ops.analyze(1, step)
        if found["status"]:
            break
        if i % every == 0:
            ops.reactions()
            found["acceleration"].append(ops.nodeAccel(roof)[:3])
            found["displacement"].append([ops.nodeDisp(3000 + k)[:3] for k in range(number)])
            found["compression"].append([ops.nodeReaction(2000 + k, 3) for k in range(number)])
    found["seconds"] = time.process_time() - begin
    ops.wipe()
    return found


if __name__ == "__main__":
    answer = frame(**json.loads(sys.stdin.read()))
    print("\n" + json.dumps(answer), flush=True)
