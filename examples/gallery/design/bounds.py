"""Upper and lower bounds of friction
==================================

For whoever designs by a code: friction that ages and differs from device to device is multiplied by factors, here the
factors of ASCE 7, and the same earthquake runs three times. The lower bound decides the displacement, the upper bound
the force.
"""

import matplotlib.pyplot as plt
import numpy as np

from msfp_gen import bound, changed_scene
from msfp_gen.studies.bounding import load_factors

scene = changed_scene("ridgecrest-ccc", {"motion.duration": "30 s"})
found = bound(scene, load_factors("asce7"))

# %%
# Which case governs which demand. A rim that is met has no capacity left.

values, governing = found.quantities(), found.governing()
units = {"peak_displacement": ("mm", 1e3), "peak_force": ("kN", 1e-3), "capacity_left_1": ("mm", 1e3)}
for name, (unit, factor) in units.items():
    each = ", ".join(f"{case} {factor * value:.1f}" for case, value in values[name].items())
    print(f"{name:18}{each} {unit}; {governing[name]} governs")

# %%
# The distance of the top plate from the centre.

figure, axes = plt.subplots()
for case in found.cases:
    u = case.result.dataset["displacement"]
    axes.plot(u["time"], 1e3 * np.hypot(u.sel(axis="E1"), u.sel(axis="E2")), label=case.name)
axes.set(xlabel="time [s]", ylabel="displacement [mm]", xlim=(0, 20))
axes.legend()
