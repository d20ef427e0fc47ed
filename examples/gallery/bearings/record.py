"""An earthquake on one bearing
============================

For whoever has a record and wants peaks and histories in Python: a mass of 11.4 t on a triple pendulum under the M7.1
Ridgecrest earthquake of 2019. ``Motion.from_record(read_record("yours.at2"))`` takes a file in its place.
"""

import matplotlib.pyplot as plt
import numpy as np

from msfp_gen import Motion, Scene, Top, presets, simulate
from msfp_gen.motions.records import bundled

motion = Motion.from_record(bundled("ridgecrest-2019-ci-ccc"), duration="30 s")
mass = Top.mass(
    "11.43 t", inertia="300 kg m^2", height="0.5 m", rotational_stiffness=1e7, rotational_damping=1e4,
    vertical_stiffness="67 kN/mm", vertical_damping="175 kN s/m",
)  # fmt: skip
result = simulate(Scene(presets.bearing("prototype-tfp"), motion, mass))

# %%
# The summary has the extremes over all steps; the dataset has every quantity over time, with names and units.

peak = result.summary["peak_displacement"]["radial"]
print(f"peak displacement {1e3 * peak:.0f} mm, peak force {result.summary['peak_force']['radial'] / 1e3:.1f} kN")
print("largest sliding of the surfaces [mm]:", np.round(1e3 * result.dataset["sliding"].max("time").values))
print(result.verdict.text)

# %%
# The path of the base below the mass, in plan.

path = 1e3 * result.dataset["displacement"]
figure, axes = plt.subplots()
axes.plot(path.sel(axis="E1"), path.sel(axis="E2"), linewidth=1.5)
axes.axis("equal")
axes.set(xlabel="along E1 [mm]", ylabel="along E2 [mm]")
