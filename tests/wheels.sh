#!/usr/bin/env bash
# The wheel with compiled models: built, checked, and installed in an empty environment of each Python that there is.
# Presets of a bearing and of a building run there without a compiler, without a cache and without SymPy. A second build,
# in other folders and with empty caches, must give the same bytes.
set -euo pipefail
cd "$(dirname "$0")/.."
bin=$PWD/.venv/bin
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

"$bin/uv" venv -q --python "$bin/python" "$folder/tools"
"$bin/uv" pip install -q --python "$folder/tools" "$PWD[wheels]"
export SOURCE_DATE_EPOCH=${SOURCE_DATE_EPOCH:-$(git log -1 --format=%ct)}
"$folder/tools/bin/python" -m build --wheel --outdir "$folder" . >"$folder/build.log" 2>&1 || { cat "$folder/build.log" >&2; exit 1; }
rm -rf dist/prebuilt
(cd "$folder" && tools/bin/python "$OLDPWD/tools/prebuilt_wheel.py" msfp_gen-*-any.whl -o "$OLDPWD/dist/prebuilt")
(cd "$folder" && ZIG_GLOBAL_CACHE_DIR=$folder/zig ZIG_LOCAL_CACHE_DIR=$folder/zig tools/bin/python "$OLDPWD/tools/prebuilt_wheel.py" msfp_gen-*-any.whl -o again)
cmp dist/prebuilt/*.whl "$folder"/again/*.whl
echo "the wheel with compiled models: built twice, bit-identical"
"$bin/python" -m twine check --strict dist/prebuilt/*
tested=0
for version in 3.11 3.12 3.13 3.14; do
    place=$folder/$version
    "$bin/uv" venv -q --no-python-downloads --python "$version" "$place" 2>/dev/null || continue
    "$bin/uv" pip install -q --python "$place" dist/prebuilt/*.whl
    env -i HOME="$folder" PATH="$place/bin" MSFP_GEN_CACHE="$place/models" msfp-gen run fenz-test1 --json >"$place/summary.json"
    env -i HOME="$folder" PATH="$place/bin" MSFP_GEN_CACHE="$place/models" msfp-gen run hospital-clc --json >"$place/hospital.json"
    "$place/bin/python" - "$place" <<'PYTHON'
import json, pathlib, sys
place = pathlib.Path(sys.argv[1])
assert not (place / "models").exists(), "a model was built"
for run in ("summary", "hospital"):
    assert json.loads((place / f"{run}.json").read_text())["status"] == "ok"
PYTHON
    echo "Python $version: a bearing and a building run without a compiler"
    tested=$((tested + 1))
done
[ "$tested" -gt 0 ] || { echo "no Python to test the wheel with" >&2; exit 1; }
