"""Fragility of a displacement capacity
====================================

For whoever asks how strong an earthquake a bearing withstands: four motions of the Ridgecrest earthquake of 2019 at
eight scales, and the probability that the displacement exceeds the capacity, by spectral acceleration.
"""

from tempfile import mkdtemp

import matplotlib.pyplot as plt
import numpy as np
from scipy.stats import norm

from msfp_gen import study
from msfp_gen.studies import fragility, read_study

CAPACITY = 0.22  # [m]
motions = [
    {"name": f"{site}-{axis}", "bundled": f"ridgecrest-2019-ci-{site}", "components": [axis], "duration": 30.0}
    for site in ("ccc", "clc")
    for axis in ("E1", "E2")
]
mass = {"kind": "mass", "mass": "11.4 t", "inertia": "300 kg m^2", "height": "0.5 m"}
mass |= {"rotational_stiffness": 1e7, "rotational_damping": 1e4}
table = {
    "scene": {"bearing": "prototype-tfp", "stop": {"displacement": 0.24}, "solver": {"rtol": 1e-3}, "top": mass},
    "records": {
        "motions": motions,
        "scales": [0.5, 1.0, 1.5, 2.0, 2.25, 2.5, 2.75, 3.0],
        "intensity": {"period": 2.5, "component": "rotd100"},
    },
    "keep": ["peak_displacement"],
}

# %%
# The 32 runs are a study, which keeps one number of each. A run that reaches 240 mm stops there.

folder = mkdtemp()
study(table, folder)
rows = read_study(folder)
curve = fragility(rows, "intensity", "peak_displacement", [CAPACITY]).states[0]
low, high = curve.median_interval
print(f"half exceed {1e3 * CAPACITY:.0f} mm at Sa(2.5 s) = {curve.median:.2f} m/s^2 ({low:.2f} to {high:.2f})")
print(f"dispersion {curve.dispersion:.2f}; {curve.exceeded} of {curve.runs} runs exceed it")

# %%
# Each dot is a run; it lies at 1 where the run exceeds the capacity.

intensity = np.linspace(1.0, 7.0, 200)
figure, axes = plt.subplots()
axes.plot(rows["intensity"], rows["peak_displacement"] >= CAPACITY, "o", alpha=0.4)
axes.plot(intensity, norm.cdf(np.log(intensity / curve.median) / curve.dispersion))
axes.set(xlabel="Sa(2.5 s) [m/s²]", ylabel="P(exceeded)")
