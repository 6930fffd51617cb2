# Everything works from a bare clone: each target first makes what it needs, and does so only once.
PYTHON ?= python3
VENV   := .venv
PEERS  := .venv-peers
BIN    := $(VENV)/bin
PIP    := $(BIN)/python -m pip --disable-pip-version-check -qq
# One BLAS thread per worker, because more only fight over the cores.
PYTEST_ARGS ?= -n 2
# What asks for the loops, ends and components that a pipeline finds, which no rounding may decide.
GRAPH_TESTS := $(addprefix tests/,curve samples editing filters data test_stability.py)
# See benchmarks/README.md for what else there is.
ACCURACY_ARGS ?= truth --builtin
PEERS_ARGS ?= run benchmarks/results
FUZZ_ARGS ?= both --minutes 1
BENCH_ARGS ?= all --builtin --pictures benchmarks/results -o benchmarks/results/speed.json

PYTHON_HINT = glsk-o3d needs Python 3.10 or newer: install it, or say 'make ... PYTHON=/path/to/python3'.

.DEFAULT_GOAL := help
.PHONY: help demo test test-dispatch docs figures accuracy bench fuzz peers lint format clean system-deps browser

help: ## show this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-12s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

demo: $(VENV)/.installed-demo ## skeletonise the built-in sample object; writes demo/skeleton.{ply,json,png}
	$(BIN)/glsk demo -o demo

test: $(VENV)/.installed-test | browser ## run the whole test suite (PYTEST_ARGS="-k name" for a part)
	OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MPLBACKEND=Agg $(BIN)/python -m pytest $(PYTEST_ARGS)

test-dispatch: $(VENV)/.installed-test ## run the tests of graphs as on an older processor, which rounds otherwise
	NPY_DISABLE_CPU_FEATURES="$$($(BIN)/python scripts/cpu_features.py)" OPENBLAS_CORETYPE=Haswell \
		OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MPLBACKEND=Agg $(BIN)/python -m pytest $(PYTEST_ARGS) $(GRAPH_TESTS)

docs: $(VENV)/.installed-docs ## build the site into build/docs/index.html (SPHINX_ARGS for sphinx-build)
	OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/sphinx-build -q -W --keep-going -c docs -d build/doctrees $(SPHINX_ARGS) . build/docs
	@echo "The site is build/docs/index.html"

figures: $(VENV)/.installed-test ## draw the pictures of the README and of the pages anew, into docs/images
	OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/python docs/_ext/figures.py docs/images
	$(BIN)/python benchmarks/leaderboard.py page README.md docs/comparison.md docs/comparison_tables.md

accuracy: $(VENV)/.installed-demo ## how far skeletons are from known axes (ACCURACY_ARGS="ablation --builtin" for more)
	$(BIN)/python benchmarks/accuracy.py $(ACCURACY_ARGS)

bench: $(VENV)/.installed-demo ## how fast skeletons are, stage by stage (BENCH_ARGS="stages --sizes 1048576" for more)
	@mkdir -p benchmarks/results
	OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/python benchmarks/speed.py $(BENCH_ARGS)

fuzz: $(VENV)/.installed-test ## a minute of degenerate clouds and damaged files (FUZZ_ARGS="arrays --runs 20000" for more)
	$(BIN)/python benchmarks/fuzz.py $(FUZZ_ARGS)

peers: $(PEERS)/.installed ## other tools on the public benchmark, 3 hours (PEERS_ARGS="run DIR --tool cgal" for one)
	@mkdir -p benchmarks/results
	$(PEERS)/bin/python benchmarks/leaderboard.py $(PEERS_ARGS)

lint: $(VENV)/.installed-test ## ruff and mypy
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

format: $(VENV)/.installed-test ## let ruff mend what it can
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

clean: ## remove what the other targets made, the virtual environment too
	rm -rf $(VENV) $(PEERS) demo docs/generated benchmarks/results build dist .pytest_cache .ruff_cache .mypy_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# Checked on every run (0.1 s), since the machine may have changed under an old .venv.
system-deps:
	@command -v $(PYTHON) >/dev/null || { echo "There is no '$(PYTHON)' here. $(PYTHON_HINT)" >&2; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 10))' || \
		{ echo "This is `$(PYTHON) -V 2>&1`. $(PYTHON_HINT)" >&2; exit 1; }
	@sh scripts/system-deps.sh $(PYTHON) $(VENV)

# Tests that need a browser are skipped, visibly, where there is none and none can be installed.
browser: | system-deps
	@sh scripts/browser.sh

$(BIN)/python: | system-deps
	$(PYTHON) -m venv $(VENV)

$(VENV)/.installed-demo: pyproject.toml benchmarks/pyproject.toml | $(BIN)/python
	@echo "Installing glsk-o3d and the packages it needs into $(VENV); the first time this takes a minute or more"
	@$(PIP) install --editable '.[pictures]' --editable benchmarks
	@touch $@

$(VENV)/.installed-test: pyproject.toml benchmarks/pyproject.toml | $(BIN)/python
	@echo "Installing glsk-o3d and what its tests need into $(VENV); the first time this takes a minute or more"
	@$(PIP) install --editable '.[test,lint]' --editable benchmarks
	@touch $@ $(VENV)/.installed-demo

$(VENV)/.installed-docs: pyproject.toml benchmarks/pyproject.toml | $(BIN)/python
	@echo "Installing glsk-o3d and what its site needs into $(VENV); the first time this takes a minute or more"
	@$(PIP) install --editable '.[docs]' --editable benchmarks
	@touch $@ $(VENV)/.installed-demo

# pc-skeletor alone: it asks for a mistree that needs a Fortran compiler, and for torch and dgl, which it never imports.
$(PEERS)/.installed: pyproject.toml benchmarks/pyproject.toml benchmarks/peers.txt | system-deps
	@echo "Installing glsk-o3d and other tools into $(PEERS); the first time this takes some minutes"
	@test -x $(PEERS)/bin/python || $(PYTHON) -m venv $(PEERS)
	@$(PEERS)/bin/python -m pip --disable-pip-version-check -qq install --editable ".[pictures]" --editable benchmarks -r benchmarks/peers.txt
	@$(PEERS)/bin/python -m pip --disable-pip-version-check -qq install --no-deps pc-skeletor==1.0.0
	@touch $@
