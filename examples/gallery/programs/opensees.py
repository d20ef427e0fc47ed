"""Beside the element of OpenSees
==============================

For whoever models in OpenSees: the loop of a triple pendulum by its element ``TripleFrictionPendulum`` and by the
equations of motion, from one data sheet. Along one axis both agree to 2 %, the share of friction that the elastic
displacement of the element takes, here 1 mm.
"""

import matplotlib.pyplot as plt
import numpy as np
import openseespy.opensees as ops

from msfp_gen import Bearing, Effects, Motion, Scene, Top, simulate

LOAD, DISPLACEMENT = 1.85e6, 0.5  # [N], [m]
radius, height, friction = [2.235, 0.406], [0.178, 0.045], [0.06, 0.02, 0.02, 0.09]
bearing = Bearing.from_sheet(
    device="triple", radius=radius, height=height, friction=friction, slider_diameter=[0.508, 0.2],
    dish_diameter=[1.22, 0.356], plate_height=0.07, axial_load=LOAD,
)  # fmt: skip
machine = Top.rig(axial_load=LOAD, stiffness=1e9, damping=1e5, rotational_stiffness=1e9, rotational_damping=1e5)
motion = Motion.harmonic(DISPLACEMENT, frequency=0.01, cycles=2)
data = simulate(Scene(bearing, motion, machine, effects=Effects(dimension="planar"))).dataset.sel(axis="E1")

# %%
# The element takes lengths, displacement limits and friction of its inner, lower and upper link.

lengths = np.subtract(radius, height)[[1, 0, 0]]
limits = [bearing.surfaces[i].capacity * (1 - height[j] / radius[j]) for i, j in ((1, 1), (0, 0), (3, 0))]
ops.wipe()
ops.model("basic", "-ndm", 3, "-ndf", 6)
for node, fixed in ((1, (1, 1, 1, 1, 1, 1)), (2, (0, 0, 0, 1, 1, 1))):
    ops.node(node, 0.0, 0.0, 0.0)
    ops.fix(node, *fixed)
for tag, surface in enumerate((1, 0, 3), start=1):
    ops.frictionModel("Coulomb", tag, friction[surface])
for tag in range(1, 5):
    ops.uniaxialMaterial("Elastic", tag, 1e10)
shape = (*lengths.tolist(), *limits)
ops.element("TripleFrictionPendulum", 1, 1, 2, 1, 2, 3, 1, 2, 3, 4, *shape, LOAD, 1e-3, 1e10, 0.1, 1e-5)


def analyse(steps, step):
    """A static analysis of some steps."""
    ops.wipeAnalysis()
    for name, *options in (
        ("constraints", "Transformation"), ("numberer", "RCM"), ("system", "FullGeneral"), ("algorithm", "Newton"),
        ("test", "NormDispIncr", 1e-9, 100), ("integrator", "LoadControl", step), ("analysis", "Static"),
    ):  # fmt: skip
        getattr(ops, name)(*options)
    assert ops.analyze(steps) == 0


ops.timeSeries("Linear", 1)
ops.pattern("Plain", 1, 1)
ops.load(2, 0.0, 0.0, -LOAD, 0.0, 0.0, 0.0)
analyse(10, 0.1)
ops.loadConst("-time", 0.0)
path = DISPLACEMENT * np.sin(np.linspace(0, 2.5 * np.pi, 251))
ops.timeSeries("Path", 2, "-dt", 1.0, "-values", *path.tolist(), 0.0)
ops.pattern("Plain", 2, 2)
ops.sp(2, 1, 1.0)
force = [0.0]
for _ in path[1:]:
    analyse(20, 0.05)
    ops.reactions()
    force.append(-ops.nodeReaction(1, 1))
ops.wipe()
there, here = max(force) / LOAD, float(data["top_force"].max()) / LOAD
print(f"largest force over load: OpenSees {there:.4f}, equations of motion {here:.4f}")

# %%
# A quarter of a cycle and a full one.

figure, axes = plt.subplots()
axes.plot(1e3 * data["displacement"], data["top_force"] / LOAD, label="equations of motion")
axes.plot(1e3 * path, np.array(force) / LOAD, "--", label="OpenSees")
axes.set(xlabel="displacement [mm]", ylabel="force / load")
axes.legend()
