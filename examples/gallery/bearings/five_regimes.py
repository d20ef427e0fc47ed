"""The five sliding regimes of a triple pendulum
=============================================

For whoever wants to see how the stiffness of a triple pendulum changes with the displacement: it is pushed slowly
until its outer sliders are at their rims, and different surfaces slide one after the other.
"""

import matplotlib.pyplot as plt
import numpy as np

from msfp_gen import Effects, Motion, Scene, Stop, Top, presets, simulate

bearing = presets.bearing("building-tfp").replace(friction=[0.07, 0.01, 0.01, 0.11])  # bottom first
machine = Top.rig(axial_load="1200 kN", stiffness=1e10, damping=1e6, rotational_stiffness=1e10, rotational_damping=1e6)
result = simulate(
    Scene(
        bearing,
        Motion.ramp(acceleration=0.002, duration=25.0),
        machine,
        effects=Effects(dimension="planar"),
        stop=Stop(displacement=0.56),
    )
)

# %%
# The characterisation of the run has the surfaces that slide in each regime (1 is the lowest). A regime ends where the
# next one begins; the load over the stiffness is a length.

stages = result.characterise().first_loading.stages
ends = [0.0, *(stage.start for stage in stages[1:]), stages[-1].end]
for name, stage, end in zip(["I", "II", "III", "IV", "V"], stages, ends[1:], strict=True):
    length = result.axial_load / stage.stiffness
    print(f"{name:4} surfaces {stage.surfaces} to {1e3 * end:3.0f} mm, stiffness = load / {length:.2f} m")

# %%
# First the inner surfaces slide (I), then one outer surface after the other (II, III); at the rims of the outer
# surfaces the inner ones slide again (IV, V).

data = result.dataset.sel(axis="E1")
u, ratio = data["displacement"].values, data["top_force"].values / result.axial_load
figure, axes = plt.subplots()
for name, start, end in zip(["I", "II", "III", "IV", "V"], ends, ends[1:], strict=False):
    part = (u >= start) & (u <= end)
    axes.plot(1e3 * u[part], ratio[part], linewidth=5)
    axes.annotate(
        name,
        (5e2 * (start + end), np.interp((start + end) / 2, u, ratio)),
        (-4, 14),
        textcoords="offset points",
        ha="right",
    )
axes.set(xlabel="displacement [mm]", ylabel="force / load", ylim=(0, None))
