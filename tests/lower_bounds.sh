#!/usr/bin/env bash
# The lowest versions of the dependencies that pyproject.toml allows: a preset runs, and the tests that need no model pass.
# Warnings are no errors here: old versions warn of the newer packages that they themselves use.
set -euo pipefail
cd "$(dirname "$0")/.."
bin=$PWD/.venv/bin
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

"$bin/uv" venv -q --python "$bin/python" "$folder/venv"
"$bin/uv" pip install -q --python "$folder/venv" --resolution lowest-direct -r pyproject.toml
"$bin/uv" pip install -q --python "$folder/venv" --no-deps -e .
"$bin/uv" pip install -q --python "$folder/venv" pytest hypothesis pytest-benchmark pytest-xdist
MSFP_GEN_CACHE=$folder/models "$folder/venv/bin/msfp-gen" run fenz-test1 --json >/dev/null
# Its own log: the summary of pytest that CI ends with is the one of `make test`.
"$folder/venv/bin/python" -m pytest -q -n auto --dist loadfile -o filterwarnings= -m "not slow" \
    tests/unit/{common,specification,motions,scene,results} tests/unit/generator/test_golden.py \
    >"$folder/pytest.log" 2>&1 || { cat "$folder/pytest.log" >&2; exit 1; }
echo "lowest versions of the dependencies: a preset runs, the tests without models pass"
