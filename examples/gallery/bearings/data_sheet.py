"""A bearing by its data sheet
===========================

For whoever has only the sheet of the manufacturer: radii, heights, diameters and friction as they are printed there.
The published formulas for the backbone, and a run of the equations of motion, are drawn over each other.
"""

import matplotlib.pyplot as plt

from msfp_gen import Bearing, Effects, Motion, Scene, Top, simulate
from msfp_gen.design.effective import effective, published_backbone, regimes

LOAD, DISPLACEMENT = 1.85e6, 0.5  # [N], [m]
bearing = Bearing.from_sheet(
    device="triple",
    radius=["2235 mm", "406 mm"],  # outer, inner
    height=["178 mm", "45 mm"],  # from the surface to the middle of the inner slider
    friction=[0.06, 0.02, 0.02, 0.06],  # at the pivot, bottom first
    slider_diameter=["508 mm", "200 mm"],
    dish_diameter=["1220 mm", "356 mm"],
    plate_height="70 mm",
    axial_load=LOAD,
)
backbone = published_backbone(bearing)
hand = effective(backbone, DISPLACEMENT, bearing.gravity)
print(f"formulas: stiffness {hand.stiffness * LOAD / 1e3:.0f} kN/m, damping {hand.damping:.1%}")

# %%
# The same by a run: two slow cycles in a test machine.

machine = Top.rig(axial_load=LOAD, stiffness=1e9, damping=1e5, rotational_stiffness=1e9, rotational_damping=1e5)
motion = Motion.harmonic(DISPLACEMENT, frequency=0.01, cycles=2)
result = simulate(Scene(bearing, motion, machine, effects=Effects(dimension="planar")))
run = result.characterise().envelope
stiffness, damping = run["effective_stiffness"].mean, run["effective_damping"].mean
print(f"run:      stiffness {stiffness / 1e3:.0f} kN/m, damping {damping:.1%}")

# %%
# Straight parts of the backbone end at the dots.

points = [(start, force) for start, _, force, _ in regimes(backbone) if start < DISPLACEMENT]
points.append((DISPLACEMENT, hand.force))
data = result.dataset.sel(axis="E1")
figure, axes = plt.subplots()
axes.plot(1e3 * data["displacement"], data["top_force"] / LOAD, label="run")
axes.plot(*zip(*[(1e3 * u, force) for u, force in points], strict=True), "o--", label="formulas")
axes.set(xlabel="displacement [mm]", ylabel="force / load", title="Triple pendulum")
axes.legend()
