"""Beside the element of OpenSees
==============================

For whoever models in OpenSees: the loop of a triple pendulum by its element ``TripleFrictionPendulum`` and by the
equations of motion, from one data sheet. Along one axis both agree to 2 %, the share of friction that the elastic
displacement of the element takes, here 1 mm.
"""

import matplotlib.pyplot as plt
import openseespy.opensees as ops

from msfp_gen import Bearing, Effects, Motion, Scene, Top, simulate

# Load [N]; radii and heights [m], outer and inner; friction, bottom first.
LOAD, radius, height, friction = 1.85e6, [2.235, 0.406], [0.178, 0.045], [0.06, 0.02, 0.02, 0.09]
bearing = Bearing.from_sheet(
    device="triple", radius=radius, height=height, friction=friction, slider_diameter=[0.508, 0.2],
    dish_diameter=[1.22, 0.356], plate_height=0.07, axial_load=LOAD,
)  # fmt: skip
machine = Top.rig(axial_load=LOAD, stiffness=1e9, damping=1e5, rotational_stiffness=1e9, rotational_damping=1e5)
motion = Motion.harmonic(amplitude="500 mm", frequency="0.01 Hz", cycles=1.25)
data = simulate(Scene(bearing, motion, machine, Effects(dimension="planar"), output_step=1.0)).dataset.sel(axis="E1")
path = data["displacement"].values.tolist()

# %%
# The element takes lengths, displacement limits and friction of its inner, lower and upper link.

lengths = [radius[j] - height[j] for j in (1, 0, 0)]
limits = [bearing.surfaces[i].capacity * (1 - height[j] / radius[j]) for i, j in ((1, 1), (0, 0), (3, 0))]
ops.wipe()
ops.model("basic", "-ndm", 3, "-ndf", 6)
for node, fixed in ((1, (1, 1, 1, 1, 1, 1)), (2, (0, 0, 0, 1, 1, 1))):
    ops.node(node, 0.0, 0.0, 0.0)
    ops.fix(node, *fixed)
for tag, surface in enumerate((1, 0, 3), start=1):
    ops.frictionModel("Coulomb", tag, friction[surface])
ops.uniaxialMaterial("Elastic", 1, 1e10)
ops.element("TripleFrictionPendulum", 1, 1, 2, 1, 2, 3, 1, 1, 1, 1, *lengths, *limits, LOAD, 1e-3, 1e10, 0.1, 1e-5)

# %%
# A load that stays, the displacements of the run, one a second, and twenty static steps from one to the next.

for command, *values in (
    ("timeSeries", "Constant", 1), ("pattern", "Plain", 1, 1), ("load", 2, 0.0, 0.0, -LOAD, 0.0, 0.0, 0.0),
    ("timeSeries", "Path", 2, "-dt", 1.0, "-values", *path, 0.0), ("pattern", "Plain", 2, 2), ("sp", 2, 1, 1.0),
    ("constraints", "Transformation"), ("numberer", "RCM"), ("system", "FullGeneral"), ("algorithm", "Newton"),
    ("test", "NormDispIncr", 1e-9, 100), ("integrator", "LoadControl", 0.05), ("analysis", "Static"),
):  # fmt: skip
    getattr(ops, command)(*values)
force = [0.0]
for _ in path[1:]:
    assert ops.analyze(20) == 0
    force.append(ops.eleForce(1, 7) / LOAD)  # at the upper node
there, here = max(force), float(data["top_force"].max()) / LOAD
print(f"largest force over load: OpenSees {there:.4f}, equations of motion {here:.4f}")

# %%
# A quarter of a cycle and a full one.

figure, axes = plt.subplots()
axes.plot(1e3 * data["displacement"], data["top_force"] / LOAD, 1e3 * data["displacement"], force, "--")
axes.set(xlabel="displacement [mm]", ylabel="force / load")
axes.legend(["equations of motion", "OpenSees"])
