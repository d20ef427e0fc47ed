"""Sliders that meet their rims
============================

For whoever sizes the dishes: one record, stronger from run to run, on a triple pendulum. The force grows with the
displacement as the radii determine, until sliders meet the rims of their dishes, and then several times as fast.
"""

import matplotlib.pyplot as plt
import numpy as np

from msfp_gen import changed_scene, simulate_batch

factors = np.linspace(0.5, 1.4, 10)
shared = {"motion.components": ["E1", "E2"], "motion.duration": "20 s", "solver.rtol": 1e-3}
runs = simulate_batch([changed_scene("ridgecrest-ccc", {"motion.scale": factor, **shared}) for factor in factors])

# %%
# Which rims each run met; surfaces count from the bottom.

displacement = np.array([run.summary["peak_displacement"]["radial"] for run in runs])
force = np.array([run.summary["peak_force_ratio"] for run in runs])
met = np.array([bool(run.summary["rims_met"]) for run in runs])
for factor, u, f, run in zip(factors, displacement, force, runs, strict=True):
    print(f"record x {factor:.1f}: {1e3 * u:3.0f} mm, {f:.2f} of the load, rims {run.summary['rims_met']}")

# %%
# Each dot is one run.

figure, axes = plt.subplots()
axes.plot(1e3 * displacement, force, color="gray")
axes.plot(1e3 * displacement[~met], force[~met], "o", markersize=10, label="no rim met")
axes.plot(1e3 * displacement[met], force[met], "o", markersize=10, label="rims met")
axes.set(xlabel="peak displacement [mm]", ylabel="peak force / load", ylim=(0, None))
axes.legend()
