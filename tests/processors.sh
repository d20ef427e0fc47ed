#!/usr/bin/env bash
# The tests of the physics once more as on other processors: NumPy without its versions for vectors of 512 bits, and BLAS
# with its kernels for a processor of 2013. Models are those in the cache, so that single evaluations and the orders of
# the methods, which C computes from numbers in the tests, are left out.
set -euo pipefail
cd "$(dirname "$0")/.."
bin=$PWD/.venv/bin
log=$(mktemp)
trap 'rm -f "$log"' EXIT

export NPY_DISABLE_CPU_FEATURES
NPY_DISABLE_CPU_FEATURES=$(PYTHONPATH=tests "$bin/python" -c 'import support.processors as d; print(*d.wide_features())')
if grep -qw avx2 /proc/cpuinfo 2>/dev/null; then export OPENBLAS_CORETYPE=Haswell; fi
# Its own log: the summary of pytest that CI ends with is the one of `make test`.
"$bin/python" -m pytest -q -n auto --dist loadfile -m "not slow" tests/physics \
    --ignore tests/physics/test_equations.py --ignore tests/physics/test_tangents.py \
    --ignore tests/physics/test_manufactured.py \
    tests/unit/buildings/test_building_extremes.py >"$log" 2>&1 || { cat "$log" >&2; exit 1; }
echo "without $NPY_DISABLE_CPU_FEATURES, BLAS for ${OPENBLAS_CORETYPE:-this processor}: the tests of the physics pass"
