"""A design by gradients
=====================

For whoever looks for a friction and a radius: the least base shear of a triple pendulum that stays within 200 mm under a
record. Every run gives its derivatives too, so that SciPy needs about ten of them.
"""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import minimize

from msfp_gen import changed_scene, simulate

