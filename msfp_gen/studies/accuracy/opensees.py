"""Run a scene by the element `TripleFrictionPendulum` of OpenSees, if openseespy is installed."""

from __future__ import annotations

import time
from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.errors import InputError
from msfp_gen.scene.backbone import Link, series_links
from msfp_gen.scene.top import MassTop, RigTop
from msfp_gen.specification.layout import Layout
from msfp_gen.studies.accuracy.timed_run import OK, Trial, comparison_times, require_base_motion_only

if TYPE_CHECKING:
    from msfp_gen.scene.scene import Scene

BASE, TOP, ELEMENT = 1, 2, 1
STIFF, TOLERANCE = 1e10, 1e-10
YIELD = 1e-4  # [m]: least yield displacement passed to the element, whose manual recommends 0.25 to 1 mm


def run_opensees(scene: Scene, steps: int) -> Trial:
    """Run `scene` by OpenSees in `steps` equal steps. The element gives no sliding of surfaces, so the trial has none.

    Raises InputError if OpenSees is not installed, or the element cannot represent this bearing under this load.
    """
    require_base_motion_only(scene)
    if find_spec("openseespy") is None:
        raise InputError("TripleFrictionPendulum needs openseespy; pip install 'msfp-gen[opensees]'")
    lower, upper, inner = _links(scene)
    try:
        ops = import_module("openseespy.opensees")
    except (ImportError, RuntimeError) as error:
        raise InputError(
            f"openseespy cannot be imported ({error}): see its page for the libraries that it needs"
        ) from None
    times = np.linspace(0.0, scene.end, steps + 1)
    begin = time.perf_counter()
    try:
        _define_model(ops, scene, lower, upper, inner)
        reached, force = _integrate(ops, scene, times)
    finally:
        ops.wipe()
    seconds, at = time.perf_counter() - begin, comparison_times(scene.end)
    at = at[at <= times[reached] * (1 + 1e-12)]
    rows = np.column_stack([np.interp(at, times[: reached + 1], column) for column in force.T])
    status, message = (OK, "") if reached == steps else ("failed", f"analyze failed at t = {times[reached]:.4g} s")
    return Trial(
        "OpenSees",
        scene.end / steps,
        status,
        seconds,
        float(times[reached]),
        scene.end,
        0,
        0,
        reached,
        rows,
        np.zeros((len(rows), 0)),
        message,
        stepped=True,
    )


def _links(scene: Scene) -> tuple[Link, Link, Link]:
    """Outer lower, outer upper and inner surface; the element takes one friction and radius for both inner ones."""
    if scene.bearing.layout != Layout.tfp():
        raise InputError("bearing.layout: TripleFrictionPendulum has four surfaces, (5, 2, 2)")
    if not _load(scene):
        raise InputError("top: TripleFrictionPendulum needs a rig, or a mass with weight, for its axial load; give one")
    links = {link.surface: link for link in series_links(scene.bearing, rims=True, arms=False)}
    if links[1].friction != links[2].friction or abs(links[1].effective / links[2].effective - 1) > 1e-9:
        raise InputError("bearing.surfaces: TripleFrictionPendulum needs equal inner surfaces")
    return links[0], links[3], links[1]


def _load(scene: Scene) -> float:
    """Axial load [N]; zero for a prescribed top."""
    top = scene.top
    if isinstance(top, RigTop):
        return top.axial_load
    return top.mass * scene.bearing.gravity if isinstance(top, MassTop) else 0.0


def _define_model(ops: Any, scene: Scene, lower: Link, upper: Link, inner: Link) -> None:
    """Define two nodes at the same point and the element between them."""
    load = _load(scene)
    ops.wipe()
    ops.model("basic", "-ndm", 3, "-ndf", 6)
    ops.node(BASE, 0.0, 0.0, 0.0)
    ops.node(TOP, 0.0, 0.0, 0.0)
    ops.fix(BASE, 1, 1, 1, 1, 1, 1)
    ops.fix(TOP, 0, 0, 0, 1, 1, 1)
    for tag, link in enumerate((inner, lower, upper), start=1):
        ops.frictionModel("Coulomb", tag, link.friction)
    for tag in range(1, 5):
        ops.uniaxialMaterial("Elastic", tag, STIFF)
    capacities = [link.limit * link.effective for link in (inner, lower, upper)]
    yielding = max(YIELD, min(link.yielding for link in (inner, lower, upper)))
    radii = [link.effective for link in (inner, lower, upper)]
    ops.element(
        "TripleFrictionPendulum",
        ELEMENT,
        BASE,
        TOP,
        1,
        2,
        3,
        1,
        2,
        3,
        4,
        *radii,
        *capacities,
        load,
        yielding,
        STIFF,
        0.1,
        1e-5,
    )
    if isinstance(scene.top, MassTop):
        ops.mass(TOP, *(scene.top.mass,) * 3, 0.0, 0.0, 0.0)


def _integrate(ops: Any, scene: Scene, times: Array) -> tuple[int, Array]:
    """Apply the axial load, then the motion; number of steps taken, and horizontal force after each [N], (k, 2)."""
    ops.timeSeries("Linear", 1)
    ops.pattern("Plain", 1, 1)
    ops.load(TOP, 0.0, 0.0, -_load(scene), 0.0, 0.0, 0.0)
    _settings(ops, "Transformation")
    ops.integrator("LoadControl", 0.1)
    ops.analysis("Static")
    ops.analyze(10)
    ops.loadConst("-time", 0.0)
    ops.wipeAnalysis()
    forces, rig = np.zeros((len(times), 2)), isinstance(scene.top, RigTop)
    (_static if rig else _dynamic)(ops, scene, times)
    # With a rig the top is moved instead of the base, so displacement and force change sign.
    sign, step = (1.0, ()) if rig else (-1.0, (float(times[1]),))
    for row in range(1, len(times)):
        if ops.analyze(1, *step):
            return row - 1, forces[:row]
        forces[row] = sign * np.array(ops.eleForce(ELEMENT))[6:8]  # at the upper node
    return len(times) - 1, forces


def _padded(values: Array) -> list[float]:
    """`values` with the last one repeated: OpenSees takes zero after the end, where rounding may put the last step."""
    return [*values.tolist(), float(values[-1])]


def _static(ops: Any, scene: Scene, times: Array) -> None:
    """Impose the displacements of the base on the top node, with opposite sign of the relative displacement."""
    motion = scene.motion.displacement(times)
    for axis in (0, 1):
        tag = 10 + axis
        ops.timeSeries("Path", tag, "-dt", float(times[1]), "-values", *_padded(motion[:, axis] - motion[0, axis]))
        ops.pattern("Plain", tag, tag)
        ops.sp(TOP, axis + 1, 1.0)
    _settings(ops, "Transformation")
    ops.integrator("LoadControl", float(times[1]))
    ops.analysis("Static")


def _dynamic(ops: Any, scene: Scene, times: Array) -> None:
    """Impose base accelerations on a supported mass; HHT damps frequencies that the steps do not resolve."""
    ground = scene.motion.acceleration(times)
    for axis in range(3):
        tag = 10 + axis
        ops.timeSeries("Path", tag, "-dt", float(times[1]), "-values", *_padded(ground[:, axis]))
        ops.pattern("UniformExcitation", tag, axis + 1, "-accel", tag)
    _settings(ops, "Transformation")
    ops.integrator("HHT", 0.67)
    ops.analysis("Transient")


def _settings(ops: Any, constraints: str) -> None:
    ops.constraints(constraints)
    ops.numberer("Plain")
    ops.system("FullGeneral")
    ops.test("NormUnbalance", 1e-3, 50, 0)
    ops.algorithm("Newton")
