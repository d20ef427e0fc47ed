"""Friction from a test of an isolator
===================================

For whoever has a loop from a laboratory: one test of a triple pendulum gives the friction of its surfaces, with
intervals of 95 %. A run with 2 % of noise stands for the laboratory here; ``fit`` takes CSV files as well.
"""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np

from msfp_gen import Measurement, fit, load_scene, simulate

scene = replace(load_scene("fenz-test3"), output_step=0.4)
laboratory = replace(scene, bearing=scene.bearing.replace(friction=[0.03, 0.017, 0.017, 0.107], contact_damping=1e-4))
data = simulate(laboratory).dataset.sel(axis="E1")
force = data["top_force"].values
force = force + 0.02 * np.abs(force).max() * np.random.default_rng(1).standard_normal(force.shape)
test = Measurement("test 3", data["time"].values, data["displacement"].values, force)

# %%
# The search starts at the values of the sheet. Inner surfaces slide together and share a value. A symmetric stack has
# the same loop upside down: that the upper dish is the rougher one is known from the start values alone.

start = replace(scene, bearing=scene.bearing.replace(friction=[0.04, 0.02, 0.02, 0.08], contact_damping=1e-4))
found = fit(start, [test], ["friction[0]", "friction[1]=friction[2]", "friction[3]"])
print(found)

# %%
# The measured loop and the fitted one.

fitted = found.tests[0]
figure, axes = plt.subplots()
axes.plot(1e3 * test.displacement, test.force / 1e3, ".", color="silver", label="test")
axes.plot(1e3 * fitted.measured.displacement, fitted.force / 1e3, label="fit")
axes.set(xlabel="displacement [mm]", ylabel="force [kN]")
axes.legend(markerscale=3)
