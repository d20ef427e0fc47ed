"""Sobol' indices with SALib
=========================

Which of three numbers decides the peak force in test 1 of PEER 2017/07: friction, radii, or the load.
SALib draws the values and computes the indices; the study between them runs all rows, and goes on where it was
interrupted.
"""

from pathlib import Path
from tempfile import mkdtemp

import matplotlib.pyplot as plt
from SALib.analyze import sobol as analysis
from SALib.sample import sobol as sampling

from msfp_gen import study
from msfp_gen.studies import read_study

AXES = {
    "friction": {"multiplies": "bearing.friction", "distribution": "uniform", "low": 0.7, "high": 1.3},
    "radius": {"multiplies": "bearing.radius", "distribution": "uniform", "low": 0.9, "high": 1.1},
    "load": {"multiplies": "top.axial_load", "distribution": "uniform", "low": 0.8, "high": 1.2},
}
problem = {
    "num_vars": len(AXES),
    "names": list(AXES),
    "bounds": [[axis["low"], axis["high"]] for axis in AXES.values()],
}
values = sampling.sample(problem, 32, calc_second_order=False, seed=1)
folder = Path(mkdtemp())
table = {"scene": "fenz-test1", "axes": AXES, "sampling": {"method": "listed", "values": values.tolist()}}
study({**table, "keep": ["peak_force"]}, folder)
rows = read_study(folder, ["peak_force"])
indices = analysis.analyze(problem, rows["peak_force"].to_numpy(), calc_second_order=False, seed=1)
for name, first, total in zip(AXES, indices["S1"], indices["ST"], strict=True):
    print(f"{name:10} first order {first:.2f}, total {total:.2f}")

figure, axes = plt.subplots()
axes.barh(list(AXES), indices["ST"], xerr=indices["ST_conf"])
axes.set_xlabel("share of the variance of the peak force, total effect")
