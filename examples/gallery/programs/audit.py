"""A second opinion on a foreign result
====================================

For whoever receives histories that another program computed: the published results of a plant on seventy bearings, by
MASTODON, are checked against mechanics and the data of the bearing. Nothing is run. Inertia acts twice in them.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from msfp_gen import audit

FOLDERS = Path("examples/basemat"), Path("../../basemat")  # from the repository, from the folder of this example
FOLDER = next(folder for folder in FOLDERS if folder.is_dir())
found = audit(FOLDER / "case1.csv", FOLDER / "bearing.toml", FOLDER / "map.toml")
print(found.text)
for finding in found.findings:
    if finding.verdict == "inconsistent":
        print(f"{finding.title}: {finding.sentence}")

# %%
# The evidence: only the bearings hold the plant, so that their force over its acceleration is its mass.

data = pd.read_csv(FOLDER / "case1.csv", comment="#")
force, acceleration = 70 * data["iso1_fb_shear1"], data["basemat_accel_x"]  # [GN], [m/s^2]
strongest = np.array([-1.0, 1.0]) * acceleration.abs().max()
figure, axes = plt.subplots()
axes.plot(acceleration, force, ".", color="silver", label="published")
axes.plot(strongest, 74.95e-3 * strongest, label="stated mass")
axes.plot(strongest, 2 * 74.95e-3 * strongest, "--", label="twice the mass")
axes.set(xlabel="acceleration [m/s²]", ylabel="force [GN]")
axes.legend(markerscale=3)
