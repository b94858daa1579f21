# Two commands do everything, set-up included: `make demo` and `make test`.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check --quiet
WORKERS ?= 2
PYTEST_OPTIONS ?=

.PHONY: help demo test coverage lint types layers check benchmarks clean

help:
	@echo "make demo        make a kit of the bundled cell nucleus in demo-kit/"
	@echo "make test        run the tests"
	@echo "make check       lint, types and layers, then the tests: what CI runs"
	@echo "make benchmarks  print the benchmark tables"

$(BIN)/python:
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "drkid needs Python 3.11 or newer, this is " + sys.version)'
	$(PYTHON) -m venv $(VENV)

$(VENV)/.run: $(BIN)/python pyproject.toml constraints.txt
	@echo "installing drkid into $(VENV) (once)"
	$(PIP) install -c constraints.txt -e .
	@touch $@

$(VENV)/.test: $(BIN)/python pyproject.toml constraints.txt
	@echo "installing drkid and its tests into $(VENV) (once)"
	$(PIP) install -c constraints.txt -e ".[test]"
	@touch $@ $(VENV)/.run

$(VENV)/.lint: $(BIN)/python pyproject.toml constraints.txt
	$(PIP) install -c constraints.txt -e ".[test,lint]"
	@touch $@ $(VENV)/.test $(VENV)/.run

# Rounds in place of a time: the same kit on every machine, though the first run compiles while the clock ticks.
# Exit status 3 would be no failure: the kit is there, and the table says how good it is.
demo: $(VENV)/.run
	$(BIN)/drkid make --rounds 40 --out demo-kit --force || test $$? -eq 3

test: $(VENV)/.test
	$(BIN)/python -m pytest -n $(WORKERS) $(PYTEST_OPTIONS)

lint: $(VENV)/.lint
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(VENV)/.lint
	$(BIN)/basedpyright

layers: $(VENV)/.lint
	$(BIN)/lint-imports --no-logo

check: lint types layers test

# Measured, the tests take half as long again.
coverage:
	$(MAKE) test PYTEST_OPTIONS="--cov --cov-report=term:skip-covered"

benchmarks: $(VENV)/.run
	$(BIN)/python benchmarks/paper_table.py
	$(BIN)/python benchmarks/pressure_choices.py
	$(BIN)/python benchmarks/congruence.py --classes 2
	$(BIN)/python benchmarks/remesh.py

clean:
	rm -rf $(VENV) demo-kit .pytest_cache .ruff_cache .hypothesis .coverage
