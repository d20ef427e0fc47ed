#!/usr/bin/env bash
# What is published: sdist and wheel are built and checked, with the wheels that `make wheels` left in dist/prebuilt, and
# each of the two is installed in an empty environment. There, outside the checkout, a preset runs, which builds its model
# from the installed sources, and a study, with nothing installed beside the package. The second of the two finds the
# models of the first, since its sources are the same. Built again in another folder, from files with other times and
# permissions, they have the same bytes. What passed stands in dist.
set -euo pipefail
cd "$(dirname "$0")/.."
root=$PWD
bin=$root/.venv/bin
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

SOURCE_DATE_EPOCH=${SOURCE_DATE_EPOCH:-$(git log -1 --format=%ct)}
export SOURCE_DATE_EPOCH
build() {
    "$bin/python" -m build --installer uv --outdir "$1" "$2" >"$folder/build.log" 2>&1 ||
        { cat "$folder/build.log" >&2; exit 1; }
}
build "$folder/dist" .
(
    umask 077
    git ls-files -z | xargs -0 cp -P --parents -t "$(mktemp -d "$folder/again.XXXX")"
    find "$folder"/again.* -exec touch -h -d 2020-02-02 {} +
    build "$folder/second" "$folder"/again.*
)
for archive in "$folder"/dist/*; do
    cmp "$archive" "$folder/second/${archive##*/}"
done
echo "sdist and wheel, built twice, have the same bytes (SOURCE_DATE_EPOCH=$SOURCE_DATE_EPOCH)"
shopt -s nullglob
"$bin/python" -m twine check --strict "$folder"/dist/* dist/prebuilt/*.whl
for archive in "$folder"/dist/*; do
    place=$folder/${archive##*.}
    "$bin/uv" venv -q --python "$bin/python" "$place/venv"
    "$bin/uv" pip install -q --python "$place/venv" "$archive"
    cd "$place"
    MSFP_GEN_CACHE=$folder/models venv/bin/msfp-gen run fenz-test1 --json >summary.json
    venv/bin/msfp-gen study --example >study.toml
    MSFP_GEN_CACHE=$folder/models venv/bin/msfp-gen study study.toml -o study --shard 1/64 >study.log
    venv/bin/python - <<'PYTHON'
import json, pathlib, msfp_gen
from msfp_gen.studies import read_study
assert "site-packages" in msfp_gen.__file__, f"not the installed package: {msfp_gen.__file__}"
models = list(pathlib.Path("../models").glob("msfp_5_2_2-*/manifest.json"))
assert len(models) == 1, f"one model of the preset, built here for both archives: {models}"
summary = json.loads(pathlib.Path("summary.json").read_text())
assert summary["status"] == "ok", summary
rows = read_study("study")
assert len(rows) and set(rows["status"]) == {"ok"}, rows
PYTHON
    echo "${archive##*/}: installed, a preset and a study run"
done
cd "$root"
mkdir -p dist
rm -f dist/msfp_gen-*
cp "$folder"/dist/* dist
echo "dist: sdist and wheel"
