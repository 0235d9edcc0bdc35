# Everything from a fresh clone: `make demo` or `make test`. Needs make and Python 3.11 or 3.12 with venv, nothing else.
.DEFAULT_GOAL := help
SHELL := /bin/bash
.SHELLFLAGS := -eu -o pipefail -c

PYTHON ?= $(firstword $(foreach p,python3.11 python3.12 python3,$(shell command -v $(p) 2>/dev/null)))
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
OUT ?= out
WHEELS ?= out/wheelhouse
PYTEST_ARGS ?=
NOTEBOOKS := $(filter-out notebooks/execute.py,$(wildcard notebooks/*.py))
# tests that read the source alone: `make check` runs them, `make test` does not run them again
SOURCE_TESTS := tests/test_complexity.py tests/test_constants.py tests/test_imports.py tests/test_words.py

.PHONY: help
help: ## this list
	@echo "usage: make TARGET"; echo
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "  %-17s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

# The stamp follows the lock, so a changed pin reaches an existing .venv with the next command.
$(READY): requirements.lock pyproject.toml
	@[ -n "$(PYTHON)" ] || { echo "no python3 found: install Python 3.11 (Debian: apt-get install python3 python3-venv)"; exit 2; }
	@"$(PYTHON)" -c 'import sys; sys.exit(not (3, 11) <= sys.version_info < (3, 13))' || { \
	    echo "$(PYTHON) is not Python 3.11 or 3.12; name one: make PYTHON=/path/to/python3.11 ..."; exit 2; }
	@[ -x $(BIN)/python ] || "$(PYTHON)" -m venv $(VENV) || { \
	    rm -rf $(VENV); echo "cannot make .venv (Debian: apt-get install python3-venv)"; exit 2; }
	@echo "installing the pinned dependencies into $(VENV) (some hundred MB of downloads the first time)"
	@$(BIN)/python -m pip install -qq --disable-pip-version-check --require-hashes -r requirements.lock
	@$(BIN)/python -m pip install -qq --disable-pip-version-check --no-deps --no-build-isolation -e .
	@touch $@

.PHONY: setup
setup: $(READY) ## make .venv with the pinned dependencies and this package
	@echo "ready: $(BIN)/twin --help"

.PHONY: check
check: $(READY) ## style, format, types, the import rules, the size of functions, constants and words
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports --cache-dir .cache/import_linter
	$(BIN)/python -m pytest -q -n 2 $(SOURCE_TESTS)

.PHONY: test
test: $(READY) ## every behaviour, quickly (6 min on two cores); LONG=1 with test-long, which shares what both set up
	$(BIN)/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder $(addprefix --ignore=,$(SOURCE_TESTS)) \
	    $(if $(LONG),-m "not slow and (long or not trials)") $(PYTEST_ARGS)

.PHONY: test-long
test-long: $(READY) ## the rest of what continuous integration runs: hidden effects, exports, servers
	$(BIN)/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder -m "long and not slow" $(PYTEST_ARGS)

.PHONY: test-slow
test-slow: $(READY) ## what continuous integration has no time for: before a release, and after a change to what it covers
	$(BIN)/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder -m "slow and not trials" $(PYTEST_ARGS)

.PHONY: test-hidden
test-hidden: $(READY) ## effects hidden in the five-axis machine, its stored diagnoses, planned experiments: after a change to what decides
	$(BIN)/python -m pytest -m "trials and not slow" $(PYTEST_ARGS)

.PHONY: test-all
test-all: $(READY) ## every test, the slow ones too
	$(BIN)/python -m pytest -m "slow or not slow" $(PYTEST_ARGS)

.PHONY: bench
bench: $(READY) ## what is claimed about speed, memory and accuracy, measured here
	$(BIN)/python -m benchmarks

.PHONY: campaign
campaign: $(READY) ## hide effects in the five-axis machine and look for them (MINUTES=60 stops earlier, FIRST=4400 are other trials)
	@$(BIN)/python -c 'import gmsh' 2>/dev/null || { echo "installing gmsh, for the other mesh of the trials"; \
	    $(BIN)/python -m pip install -qq --disable-pip-version-check --no-build-isolation -e '.[mesh]'; }
	OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1 $(BIN)/python -m benchmarks.campaign $(or $(MINUTES),inf) $(FIRST)

.PHONY: campaign-machines
campaign-machines: $(READY) ## the same in drawn and in other shipped machines (KINDS="lumped nodes"; SCHEDULER=tcp://HOST:PORT)
	@$(BIN)/python -c 'import gmsh' 2>/dev/null || { echo "installing gmsh, for the other mesh of the trials"; \
	    $(BIN)/python -m pip install -qq --disable-pip-version-check --no-build-isolation -e '.[mesh]'; }
	OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1 $(BIN)/python -m benchmarks.machines_campaign $(or $(MINUTES),inf) $(or $(FIRST),531) $(KINDS)

.PHONY: fuzz
fuzz: $(READY) ## 2,000 damaged descriptions, artefacts and run folders, 1,000 flipped bits (FIRST=4000 are others; 4 min)
	TWIN_FUZZ=500 TWIN_FUZZ_FIRST=$(or $(FIRST),0) $(BIN)/python -m pytest -m "" tests/cli/test_fuzz.py
	TWIN_FLIPS=1000 $(BIN)/python -m pytest -m "" tests/rom/test_hostile_artefact.py -k flip

.PHONY: wheelhouse
wheelhouse: $(READY) ## wheels of twin and all that `twin live` needs, for pip install --no-index beside the machine
	@mkdir -p .cache && sed -e '/--hash/d' -e 's/ *\\$$//' requirements.lock > .cache/constraints.txt
	$(BIN)/python -m pip wheel -q --disable-pip-version-check -c .cache/constraints.txt -w $(WHEELS) '.[live,mqtt]'
	@$(BIN)/python -V | xargs echo "$(WHEELS): $$(ls $(WHEELS) | wc -l) wheels, $$(du -sh $(WHEELS) | cut -f1), for"

.PHONY: demo
demo: $(READY) ## build, verify and run the shipped five-axis machine; leaves out/ with pictures
	@$(BIN)/twin demo -o "$(OUT)"

.PHONY: notebooks $(NOTEBOOKS)
notebooks: $(NOTEBOOKS) ## execute the notebooks and check the numbers they assert (make -j 2: side by side)

$(NOTEBOOKS): $(READY)
	$(BIN)/python notebooks/execute.py $@

.PHONY: lock
lock: ## resolve requirements.lock anew (keeps pins that still hold; UPGRADE=1 moves them)
	@[ -x .cache/lock/bin/uv ] || { "$(PYTHON)" -m venv .cache/lock && .cache/lock/bin/pip install --quiet uv; }
	.cache/lock/bin/uv pip compile pyproject.toml --extra build --extra dev --extra compare --extra cluster --extra live --extra mqtt --extra serve --universal \
	    --python-version 3.11 --generate-hashes --no-config --no-emit-index-url --quiet \
	    --custom-compile-command "make lock" $(if $(UPGRADE),--upgrade) -o requirements.lock

.PHONY: clean
clean: ## remove what was made here: .venv, caches, out/
	rm -rf $(VENV) .cache out build *.egg-info .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .hypothesis
	find twin tests models benchmarks notebooks -name __pycache__ -type d -prune -exec rm -rf {} +
