"""Friction that heats
===================

For whoever tests bearings at the speed of an earthquake: ten cycles at up to 0.9 m/s heat the dish of a single pendulum
above 200 degrees, and friction falls from cycle to cycle.
"""

import matplotlib.pyplot as plt

from msfp_gen import Effects, Motion, Scene, Top, presets, simulate

bearing = presets.bearing("single-articulated-fp").replace(
    friction=0.06,  # in fast sliding, at the reference pressure and 20 degrees
    reference_pressure="44.2 MPa",  # 2 MN on a slider of 120 mm radius
    velocity_rate="100 s/m",
    conductivity="18 W/(m K)",  # of the stainless steel of the dish
    diffusivity="4.44 mm^2/s",
    start_temperature="20 degC",
)
machine = Top.rig(axial_load="2 MN", stiffness=1e10, damping=1e6, rotational_stiffness=1e10, rotational_damping=1e6)
motion = Motion.harmonic(amplitude="300 mm", frequency="0.5 Hz", cycles=10)
result = simulate(
    Scene(bearing, motion, machine, effects=Effects(dimension="planar", friction="pvt"), output_step="10 ms")
)

# %%
# The energy dissipated in every cycle, over the energy of the first cycle.

energy = [cycle.loop.energy_dissipated for cycle in result.characterise().cycles]
print("loss of every cycle over the loss of the first:", [round(one / energy[0], 2) for one in energy])
print(f"largest temperature at the centre of the dish: {result.dataset['temperature'].max():.0f} degC")

# %%
# The force falls as the dish heats.

data = result.dataset.sel(axis="E1", surface=1)
figure, axes = plt.subplots()
dots = axes.scatter(1e3 * data["displacement"], data["top_force"] / 1e3, 9, data["temperature"], cmap="inferno_r")
figure.colorbar(dots, label="temperature [°C]")
axes.set(xlabel="displacement [mm]", ylabel="force [kN]")
