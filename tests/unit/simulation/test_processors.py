"""What runs are computed from, and their rows, are the same on every processor (docs/robustness.md)."""

from __future__ import annotations

import json
import os
import subprocess
import sys

from support.digests import digests, wide_features

from msfp_gen.jit.compiler import x86_64_level


def test_inputs_and_rows_do_not_depend_on_the_vectors_of_the_processor() -> None:
    """NumPy without its versions for wide vectors, and BLAS as on a processor of 2013."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    environment["NPY_DISABLE_CPU_FEATURES"] = " ".join(wide_features())
    if (x86_64_level() or 0) >= 3:
        environment["OPENBLAS_CORETYPE"] = "Haswell"
    command = [sys.executable, "-m", "support.digests"]
    done = subprocess.run(command, env=environment, text=True, check=True, capture_output=True)
    here, there = digests(), json.loads(done.stdout)
    assert len(here) > 15 and [name for name in here if there[name] != here[name]] == []
