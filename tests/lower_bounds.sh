#!/usr/bin/env bash
# The lowest versions of the dependencies that pyproject.toml allows: a preset runs, and the tests pass that call every
# library: SymPy and Jinja2 (the public header), pint and tomli-w (scenes), SciPy (records and spectra), xarray, HDF5,
# pandas and pyarrow (results), matplotlib (figures).
# Warnings are no errors here: old versions warn of the newer packages that they themselves use.
set -euo pipefail
cd "$(dirname "$0")/.."
bin=$PWD/.venv/bin
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

"$bin/uv" venv -q --python "$bin/python" "$folder/venv"
"$bin/uv" pip install -q --python "$folder/venv" --resolution lowest-direct -r pyproject.toml
"$bin/uv" pip install -q --python "$folder/venv" --no-deps -e .
"$bin/uv" pip install -q --python "$folder/venv" pytest hypothesis pytest-xdist
MSFP_GEN_CACHE=$folder/models "$folder/venv/bin/msfp-gen" run fenz-test1 --json >/dev/null
# Its own log: the summary of pytest that CI ends with is the one of `make test`.
"$folder/venv/bin/python" -m pytest -q -n auto --dist loadfile -o filterwarnings= -m "not slow" \
    tests/unit/{common,specification,scene} tests/unit/generator/test_golden.py \
    tests/unit/motions/{test_motion,records/test_records,records/test_spectrum,records/test_target_spectra}.py \
    tests/unit/results/{test_result,test_outputs,test_shape}.py tests/unit/figures/test_figures.py \
    >"$folder/pytest.log" 2>&1 || { cat "$folder/pytest.log" >&2; exit 1; }
echo "lowest versions of the dependencies: a preset runs, tests of every library pass"
