# Every target makes what it needs. A machine needs Python 3.11 to 3.13, make and git.

FITS := import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))
PYTHON ?= $(shell for one in python3 python3.13 python3.12 python3.11; do \
	$$one -c '$(FITS)' 2>/dev/null && echo $$one && break; done)
VENV := .venv
BIN := $(VENV)/bin
# The peers of the benchmarks: what they pin would drag down what we stand on.
PEERS := .venv-peers
# Python compiles what it imports and keeps that, whatever the environment says; to compile all that is
# installed takes pip longer than to install it.
export PYTHONDONTWRITEBYTECODE :=
PIP_INSTALL := pip install --quiet --disable-pip-version-check --no-compile
# Tests go to a process more than there are cores, for some wait; a file of tests stays together, for what it
# prepares serves all of it.
SHARED_OUT := -n $(shell expr $$(getconf _NPROCESSORS_ONLN) + 1) --dist loadfile
SOURCES := $(shell find pipeline catalog workflows -name '*.py' -o -name 'py.typed' -o -name '*.toml' \
	-o -name '*.js' -o -name '*.css' -o -name '*.html' -o -name '*.svg')
PAGES := $(shell find README.md pipeline catalog workflows notebooks tests -name '*.md' -o -name '*.ipynb' -o -path '*/static/*')

.PHONY: help demo test test-all bench bench-alignment bench-ask scale torture docs lint clean

help:
	@echo "make demo      run the main job on the embedded library and show the result"
	@echo "make test      run the tests, without those marked slow"
	@echo "make test-all  run all tests"
	@echo "make bench     time the distances beside dtaidistance, aeon and tslearn, then the alignment,"
	@echo "               then questions to catalogs of up to 10,000 clips"
	@echo "make scale     run libraries of 300 to 10,000 clips; what each takes, and a model of 142,000"
	@echo "make torture   damage files, kill runs, fill disks, read while runs publish; an hour or more"
	@echo "make docs      build the documentation site, with the notebooks run; some minutes"
	@echo "make lint      check style, types and the direction of imports"
	@echo "make clean     remove the environments and what the targets made"

demo: $(VENV)/installed
	@echo "== The main job on the embedded library of made-up motions, in motionary-demo/"
	$(BIN)/motionary demo motionary-demo

test: $(VENV)/installed $(VENV)/tools
	@echo "== The tests, without those marked slow"
	$(BIN)/python -m pytest $(SHARED_OUT) -m "not slow"

test-all: $(VENV)/installed $(VENV)/tools
	@echo "== All tests"
	$(BIN)/python -m pytest $(SHARED_OUT)

bench: $(VENV)/installed $(VENV)/tools $(PEERS)/environment
	@echo "== The distances beside dtaidistance, aeon and tslearn: some minutes, best on a quiet machine"
	$(BIN)/python -m tests.benchmarks --peers $(PEERS)/bin/python --json motionary-bench/bench.json
	@$(MAKE) --no-print-directory bench-alignment bench-ask

bench-alignment: $(VENV)/installed $(VENV)/tools
	@echo "== The alignment beside a naive recursion, and on real clips: a minute or two, best on a quiet machine"
	$(BIN)/python -m tests.benchmarks.alignment --json motionary-bench/alignment.json

bench-ask: $(VENV)/installed $(VENV)/tools
	@echo "== Questions to catalogs of 300 to 10,000 embedded clips; making them takes a quarter of an hour, the first time"
	$(BIN)/python -m tests.benchmarks.ask --json motionary-bench/ask.json

scale: $(VENV)/installed $(VENV)/tools
	@echo "== Libraries of 300, 1,000, 3,000 and 10,000 embedded clips, run and measured: half an hour"
	$(BIN)/python -m tests.benchmarks.scale --json motionary-bench/scale.json

torture: $(VENV)/installed $(VENV)/tools
	@echo "== Damaged files, killed runs, readers under writing, full disks: an hour or more"
	$(BIN)/python -m tests.torture

docs: motionary-docs/built

lint: $(VENV)/installed $(VENV)/tools
	@echo "== Style, types, direction of imports"
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy -p motionary.pipeline -p motionary.catalog -p motionary.workflows
	$(BIN)/lint-imports

clean:
	rm -rf $(VENV) $(PEERS) build motionary-demo notebooks/motionary-demo motionary-docs motionary-bench .hypothesis .pytest_cache .mypy_cache .ruff_cache .import_linter_cache
	find . -name '*.egg-info' -o -name __pycache__ | xargs rm -rf

$(VENV)/environment: constraints.txt pyproject.toml
	@test -n "$(PYTHON)" || { echo "motionary needs Python 3.11 to 3.13; name one: make PYTHON=python3.12" >&2; exit 1; }
	@echo "== Making the environment $(VENV) with $$($(PYTHON) --version)"
	$(PYTHON) -m venv --clear $(VENV)
	$(BIN)/python -m $(PIP_INSTALL) -c constraints.txt pip setuptools wheel
	$(BIN)/python -m $(PIP_INSTALL) --no-build-isolation -c constraints.txt ".[all]"
	@touch $@

# By name, so that the installation stays what it is.
$(VENV)/tools: $(VENV)/environment | $(VENV)/installed
	@echo "== Adding the tools for tests, docs and style to $(VENV)"
	$(BIN)/python -m $(PIP_INSTALL) -c constraints.txt "motionary[test,lint]"
	@touch $@

$(PEERS)/environment: tests/benchmarks/constraints.txt
	@test -n "$(PYTHON)" || { echo "motionary needs Python 3.11 to 3.13; name one: make PYTHON=python3.12" >&2; exit 1; }
	@echo "== Making the peers' environment $(PEERS)"
	$(PYTHON) -m venv --clear $(PEERS)
	$(PEERS)/bin/python -m $(PIP_INSTALL) -c tests/benchmarks/constraints.txt \
		aeon dtaidistance tslearn
	@touch $@

# Installed as users have it, not in editable mode: a forgotten subpackage shows. The old installation goes
# first, since the kernels that numba keeps beside it would outlive a change in a module that they call.
$(VENV)/installed: $(VENV)/environment $(SOURCES)
	@echo "== Installing motionary into $(VENV)"
	@rm -rf build $(VENV)/lib/python*/site-packages/motionary
	$(BIN)/python -m $(PIP_INSTALL) --no-deps --no-build-isolation --force-reinstall .
	@rm -rf build
	@touch $@

motionary-docs/built: $(VENV)/installed $(VENV)/tools $(PAGES)
	@echo "== The documentation site, in motionary-docs/: some minutes"
	$(BIN)/python -m motionary.workflows.documentation motionary-docs
	@touch $@
