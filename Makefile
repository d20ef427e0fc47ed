# `make demo` and `make test` each do their whole set-up: Python >= 3.11, a C compiler and make are all they need.
PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
STAMP  := $(VENV)/.installed
RUNS   := $(VENV)/.runs
SITE   := $(VENV)/.site
ZIG    := $(VENV)/.zig
PEERS  := $(VENV)/.peers
# uv installs in a tenth of the time that pip takes; where there is none for a machine, pip does.
install = $(BIN)/uv pip install -q --python $(BIN)/python -e "$(1)" || $(BIN)/python -m pip install -q --disable-pip-version-check -e "$(1)"
comma := ,
# Hundreds of processes of the tests import the same modules: they are compiled once, also where images forbid it.
export PYTHONDONTWRITEBYTECODE :=

.PHONY: demo test slow lint types analyse coverage package wheels processors bounds clang zig fuzz mutants figures docs clean

demo: $(RUNS)
	$(BIN)/msfp-gen demo -o out

test: $(STAMP)
	$(BIN)/python -m pytest -q -n auto --dist loadfile -m "not slow"

# With the programs that benchmarks compare with, where they exist for this machine, and what builds the site.
slow: $(PEERS) $(SITE)
	$(BIN)/python -m pytest -q -n auto --dist loadfile -m slow

lint: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(STAMP)
	$(BIN)/mypy

# gcc -fanalyzer, clang-tidy and cppcheck on the C code, as a compiler reads it. See docs/extending.md.
analyse: $(STAMP)
	$(BIN)/python tools/analyse.py

# Lines of Python and C that the tests of units and physics run: pages in build/coverage. Hours; needs gcc and its gcov.
coverage: $(STAMP)
	$(call install,.[test$(comma)coverage])
	tests/coverage.sh

# The sdist and the wheel, each built, installed and run outside the checkout.
package: $(STAMP)
	tests/packaging.sh

# The wheel with compiled models for Linux on x86-64, in dist/prebuilt: two minutes; downloads ziglang (100 MB).
wheels: $(STAMP)
	tests/wheels.sh

# The tests of the physics as on other processors, by what NumPy and BLAS can be told.
processors: $(STAMP)
	tests/processors.sh

# The lowest versions of the dependencies that pyproject.toml allows.
bounds: $(STAMP)
	tests/lower_bounds.sh

# One model by another compiler; a warning is an error.
clang: $(STAMP)
	CC=clang MSFP_GEN_CFLAGS=-Werror $(BIN)/msfp-gen generate 3 1 1 -o build/clang

# What needs ziglang (100 MB from PyPI): models without a C compiler, libraries for other platforms, the explorer.
zig: $(ZIG)
	$(BIN)/python -m pytest -q -n auto --dist loadfile tests/unit/jit/test_zig.py tests/unit/embedding/test_targets.py tests/unit/report/test_explorer_browser.py tests/unit/report/test_problem.py

# Random scenes against each other: half an hour. See docs/robustness.md.
fuzz: $(STAMP)
	$(BIN)/python tools/fuzz.py --scenes 10000 --seed 1
	$(BIN)/python tools/fuzz.py --combined --scenes 2000 --seed 127 --check 0

# A hundred small changes of the code, and whether the tests see them: hours. See tools/mutants.py.
mutants: $(STAMP)
	$(BIN)/python tools/mutants.py --count 100 --output build/mutants.json

# Figures of the pages, and all that docs/accuracy.md, effects.md and performance.md measure: an hour on a quiet machine.
figures: $(STAMP)
	$(BIN)/python benchmarks/report_figures.py
	$(BIN)/python docs/make_figures.py
	$(BIN)/python benchmarks/pages.py

# The documentation site in build/docs, examples run; a warning is an error.
docs: $(SITE)
	$(BIN)/python docs/site/make_site.py

# With what running needs; the tools of the tests and checks come on top.
$(RUNS): pyproject.toml
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "msfp-gen needs Python 3.11 or newer: make PYTHON=python3.11 test")'
	$(PYTHON) -m venv $(VENV)
	-$(BIN)/python -m pip install -q --disable-pip-version-check uv
	$(call install,.)
	touch $@

$(STAMP): $(RUNS)
	$(call install,.[test])
	touch $@

$(PEERS): $(STAMP)
	-$(call install,.[peers])
	touch $@

$(SITE): $(RUNS)
	$(call install,.[docs])
	touch $@

$(ZIG): $(STAMP)
	$(call install,.[compiler])
	touch $@

clean:
	rm -rf $(VENV) build/models build/clang out
