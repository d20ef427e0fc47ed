#!/usr/bin/env bash
# Lines of Python and C that tests run, by coverage.py and gcovr: `tests/coverage.sh [PATHS OF TESTS]`, without paths the
# tests of units and physics, hours. Pages are left in build/coverage; without paths it fails where less than 95 % of the
# lines of Python or of the hand-written C of runs ran. Needs gcc with its gcov.
# Models are compiled in folders that are renamed or deleted. So the compiler below tells gcov that their sources lie in
# build/coverage/sources, the same for all models, and keeps its notes where libgcov will write the counts.
set -euo pipefail
cd "$(dirname "$0")/.."
bin=$PWD/.venv/bin
folder=$PWD/build/coverage
rm -rf "$folder"
mkdir -p "$folder"/{counts,python,sources}
cat >"$folder/cc" <<CC
#!/usr/bin/env bash
set -eu
output='' last='' words=()
for word; do
    if [ "\$last" = -o ]; then output=\$word; fi
    last=\$word
    case \$word in [!/]*.c) word=\$PWD/\$word ;; esac
    words+=("\$word")
done
kind=model
[ -f msfp_model.h ] || kind=building
[ -f msfp_model.h ] || [ -f msfp_building.pyx ] || exec gcc "\$@"  # programs of tests
case \$output in *.o) ;; *) exec gcc "\$@" --coverage ;; esac
mkdir -p "$folder/sources/\$kind" "$folder/counts\$PWD"
cp ./*.[ch] "$folder/sources/\$kind"
gcc "\${words[@]}" --coverage -fprofile-update=atomic -O0 -fprofile-prefix-map="\$PWD=$folder/sources/\$kind"
cp "\${output%.o}.gcno" "$folder/counts\$PWD"
CC
chmod +x "$folder/cc"
export CC=$folder/cc GCOV_PREFIX=$folder/counts MSFP_GEN_CACHE=$folder/models PYTHONPATH=$PWD
export COVERAGE_FILE=$folder/python/counts
unset MSFP_GEN_CFLAGS
least=(--fail-under 95) least_c=(--fail-under-line 95) tests=("$@")
if [ $# = 0 ]; then tests=(tests/unit tests/physics); else least=() least_c=(); fi
# In one process: workers of pytest-xdist end before libraries write their counts. The sanitizers take a compiler of their
# own, and an interrupted run that writes counts does not end in the time that its test allows.
"$bin/python" -m coverage run -m pytest -q -m "not slow" --ignore=tests/unit/runtime/test_sanitizers.py \
    --deselect=tests/unit/simulation/test_failures.py::test_interrupt_keeps_what_was_computed "${tests[@]}"
"$bin/python" -m coverage combine -q
"$bin/python" -m coverage html -q -d "$folder/python/html"
"$bin/python" -m coverage report "${least[@]}"
# Emitted files are left out: the sum over models that are built for one question says little.
"$bin/gcovr" --root "$folder/sources" --exclude '.*/msfp_(?!math|hash|time)' --merge-mode-functions=separate \
    --merge-lines --html-details "$folder/c.html" --txt - "${least_c[@]}" "$folder/counts"
