"""A bearing that lifts off
========================

For whoever has vertical motion near 1 g: a mass on a triple pendulum is shaken sideways and, a little beyond 1 g,
vertically. Its surfaces separate, transmit no force while they are open, and land.
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
# How far the top plate rises above its base, and with what force it lands. Only steel and liners are compliant here: a
# column or a footing below them lowers the force of a landing.

data = result.dataset
rise = (data["top_displacement"] - data["base_displacement"]).sel(axis="E3")
rise = rise - rise[0]
landing = data["normal_force"].max() / (11.4e3 * 9.8)
print(f"rise of the top plate above its base {1e3 * rise.max():.1f} mm")
print(f"largest normal force {landing:.1f} times the load at rest")

# %%
# The bearing lifts off twice, and bounces after each landing.

figure, axes = plt.subplots()
axes.plot(data["time"], 1e3 * rise)
axes.set(xlabel="time [s]", ylabel="rise above base [mm]", xlim=(0.3, 1.6))
