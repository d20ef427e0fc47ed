"""A bearing that lifts off
========================

For whoever has vertical motion near 1 g: a mass on a triple pendulum is shaken sideways and, a little beyond 1 g,
vertically. Its surfaces open, carry nothing, and land.
"""

import matplotlib.pyplot as plt
import numpy as np

from msfp_gen import Effects, Motion, Scene, Top, presets, simulate

time = np.linspace(0.0, 1.6, 641)
ramp = np.clip(time / 0.5, 0.0, 1.0)
growth = ramp**3 * (10 - 15 * ramp + 6 * ramp**2)  # a smooth start
path = np.zeros((len(time), 3))
path[:, 0] = 0.03 * growth * np.sin(2 * np.pi * time)  # 30 mm at 1 Hz
path[:, 2] = 1.1 * 9.8 / (4 * np.pi) ** 2 * growth * np.sin(4 * np.pi * time)  # 1.1 g at 2 Hz
mass = Top.mass("11.4 t", inertia="300 kg m^2", height="0.5 m", rotational_stiffness=1e7, rotational_damping=1e4)
effects = Effects(dimension="planar", uplift=True)
result = simulate(Scene(presets.bearing("prototype-tfp"), Motion.from_arrays(time, path), mass, effects=effects))

# %%
# How far the bearing opens, and with what force it lands. Steel on a liner has no vertical spring here: a column or a
# footing below it lowers the force of a landing.

opening = result.dataset["lift"].max("surface")
landing = result.dataset["normal_force"].max() / (11.4e3 * 9.8)
print(f"largest opening {1e3 * opening.max():.2f} mm, open for {result.summary['uplift']['duration']:.2f} s")
print(f"largest normal force {landing:.1f} times the load at rest")

# %%
# The surfaces open twice, and bounce when they land.

figure, axes = plt.subplots()
axes.fill_between(opening["time"], 1e3 * opening)
axes.set(xlabel="time [s]", ylabel="opening [mm]", xlim=(0.3, 1.6), ylim=(0, None))
