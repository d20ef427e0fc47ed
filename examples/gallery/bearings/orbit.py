"""A circular orbit
================

For whoever applies loops of tests along one axis to motion in two directions: on a circle friction acts along the
velocity, across the displacement, and only the curvature of the dish restores. The loop along one axis becomes an
ellipse.
"""

import matplotlib.pyplot as plt
import numpy as np

from msfp_gen import Motion, Scene, Top, presets, simulate

LOAD = 2e6  # [N]
machine = Top.rig(axial_load=LOAD, stiffness=1e10, damping=1e6, rotational_stiffness=1e10, rotational_damping=1e6)
motions = {
    "line": Motion.harmonic(amplitude="200 mm", frequency="0.05 Hz", cycles=3),
    "circle": Motion.circle(amplitude="200 mm", angular_frequency=2 * np.pi * 0.05, cycles=2, lead_in="20 s"),
}
data = {
    name: simulate(Scene(presets.bearing("double-fp"), motion, machine)).dataset.sel(
        time=slice(40, 60)
    )  # the last period
    for name, motion in motions.items()
}

# %%
# The largest force is smaller on the circle, where friction never acts along the displacement.

for name, each in data.items():
    along = (each["displacement"] * each["top_force"]).sel(axis=["E1", "E2"]).sum("axis") / 0.2
    force = np.hypot(*(each["top_force"].sel(axis=axis) for axis in ("E1", "E2")))
    print(
        f"{name:7} largest force {force.max() / LOAD:.3f} of the load, {along.max() / LOAD:.3f} along the displacement"
    )

# %%
# Force along E1 over displacement along E1.

figure, axes = plt.subplots()
for name, each in data.items():
    axes.plot(1e3 * each["displacement"].sel(axis="E1"), each["top_force"].sel(axis="E1") / LOAD, label=name)
axes.set(xlabel="displacement along E1 [mm]", ylabel="force along E1 / load")
axes.legend(loc="upper left")
