# Two commands: `make demo` shows the whole transfer, `make test` checks the project. Both make the environment first.
# PYTHON chooses the interpreter (3.10 to 3.13): make setup PYTHON=python3.12

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
WORKERS ?= 2

.PHONY: help setup demo test lint types clean distclean
.DEFAULT_GOAL := help

help:
	@echo "make setup   the environment, in $(VENV)"
	@echo "make demo    samples, the whole pipeline on two targets, pictures; results in demo/"
	@echo "make test    style, types, tests; needs no display"
	@echo "make clean   remove results and caches; make distclean also $(VENV) and the downloaded samples"

setup: $(READY)

$(READY): pyproject.toml scripts/bootstrap.py
	@$(PYTHON) scripts/bootstrap.py --venv $(VENV)
	@touch $@

demo: $(READY)
	@$(BIN)/python scripts/demo.py

# Threads of one test process don't help the other: two workers, one BLAS thread each.
test: export OMP_NUM_THREADS ?= 1
test: export OPENBLAS_NUM_THREADS ?= 1
test: lint types
	@$(BIN)/python -m pytest -n $(WORKERS)

lint: $(READY)
	@$(BIN)/ruff check --quiet .
	@$(BIN)/ruff format --check --quiet .

# The types are kept against one NumPy's stubs (pyproject.toml); others judge the same code differently.
types: $(READY)
	@if $(BIN)/python -c 'import numpy, sys; sys.exit(not numpy.__version__.startswith("2.4."))'; \
	then $(BIN)/mypy --no-error-summary; \
	else echo "types: not checked, as this Python has no NumPy 2.4"; fi

clean:
	rm -rf demo benchmarks/out .mypy_cache .ruff_cache .pytest_cache
	find . -name __pycache__ -type d -not -path './.git/*' -not -path './$(VENV)/*' -prune -exec rm -rf {} +

distclean: clean
	rm -rf $(VENV) data/cache node_modules *.egg-info
