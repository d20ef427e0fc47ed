"""Sensitivity with SALib
======================

For whoever asks which tolerance of a sheet matters: Sobol' indices of friction, radii and load for the peak force of a
test. SALib draws the values and computes the indices; the study between them runs all rows.
"""

from tempfile import mkdtemp

import matplotlib.pyplot as plt
from SALib.analyze import sobol as analysis
from SALib.sample import sobol as sampling

from msfp_gen import study
from msfp_gen.studies import read_study

AXES = {
    "friction": {"multiplies": "bearing.friction", "distribution": "uniform", "low": 0.7, "high": 1.3},
    "radii": {"multiplies": "bearing.radius", "distribution": "uniform", "low": 0.9, "high": 1.1},
    "load": {"multiplies": "top.axial_load", "distribution": "uniform", "low": 0.8, "high": 1.2},
}
bounds = [[axis["low"], axis["high"]] for axis in AXES.values()]
problem = {"num_vars": len(AXES), "names": list(AXES), "bounds": bounds}
values = sampling.sample(problem, 64, calc_second_order=False, seed=1)

# %%
# All rows of values are one study: it runs on all cores, and goes on where it was interrupted.

folder = mkdtemp()
table = {"scene": "fenz-test2", "axes": AXES, "sampling": {"method": "listed", "values": values.tolist()}}
study({**table, "keep": ["peak_force"]}, folder)
force = read_study(folder, ["peak_force"])["peak_force"].to_numpy()
indices = analysis.analyze(problem, force, calc_second_order=False, seed=1)
for name, first, total in zip(AXES, indices["S1"], indices["ST"], strict=True):
    print(f"{name:8} first order {first:.2f}, total {total:.2f}")

# %%
# The share of each quantity in the variance of the peak force, with all interactions.

figure, axes = plt.subplots()
axes.barh(list(AXES), 100 * indices["ST"], xerr=100 * indices["ST_conf"])
axes.set(xlabel="share of the peak force's variance [%]")
