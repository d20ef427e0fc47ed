"""What runs are computed from is the same to 1e-12 on every processor; docs/robustness.md says what of rows is."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from support.processors import inputs, rows, wide_features

from msfp_gen.jit.compiler import x86_64_level


@pytest.mark.slow
def test_inputs_and_rows_do_not_depend_on_the_vectors_of_the_processor(tmp_path: Path) -> None:
    """NumPy without its versions for wide vectors, and BLAS as on a processor of 2013."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    environment["NPY_DISABLE_CPU_FEATURES"] = " ".join(wide_features())
    if (x86_64_level() or 0) >= 3:
        environment["OPENBLAS_CORETYPE"] = "Haswell"
    command = [sys.executable, "-m", "support.processors", str(tmp_path / "there.npz")]
    subprocess.run(command, env=environment, check=True, capture_output=True)
    made, found = inputs(), rows()
    with np.load(tmp_path / "there.npz") as there:
        assert len(made) > 15 and {*made, *found} == set(there.files)
        for name, values in made.items():
            limit = 1e-12 * float(np.abs(values).max())
            np.testing.assert_allclose(there[name], values, rtol=0.0, atol=limit, err_msg=name)
        for name in ("space displacement", "space top_force", "plane displacement", "plane top_force"):
            peaks = (float(np.linalg.norm(each, axis=1).max()) for each in (there[name], found[name]))
            assert next(peaks) == pytest.approx(next(peaks), rel=1e-3), name
