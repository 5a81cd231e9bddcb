# Two commands matter: `make demo` and `make test`. Both build .venv first.
PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin

.PHONY: demo test lint docs bench proof calibrate rigs motions plates fuzz clean

demo: $(VENV)/.base
	$(BIN)/cvxupdate run problems/structure_a/problem.toml
	@echo "Open out/structure_a/run/report.html"

# Byte code is kept, whatever the shell says: tests start Python some fifty times.
test: $(VENV)/.test
	PYTHONDONTWRITEBYTECODE= $(BIN)/python -m pytest -n auto --dist worksteal

lint: $(VENV)/.test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

# Into out/docs; a warning is an error.
docs: $(VENV)/.docs
	$(BIN)/python -m mkdocs build --quiet
	@echo "Open out/docs/index.html"

bench: $(VENV)/.test
	$(BIN)/python -m pytest tests/benchmarks --override-ini=addopts= -q --import-mode=importlib -s

proof: $(VENV)/.test
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m validation.proof
	$(BIN)/python -m pytest -n auto --dist worksteal -m proof

# Interrupt it and start it again: finished cases are kept. ARGS="--seed 0 --count 60 --cases" develops.
calibrate: $(VENV)/.test
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m validation.calibrate $(ARGS)

# Likewise, with a laboratory of its own. ARGS="--laboratory rigs --cases" develops; --evaluation evaluates.
rigs: $(VENV)/.test
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m validation.rigs $(ARGS)

# Time histories of structures that touch, rub, harden or drift. ARGS="--seed 0 --count 24 --cases" develops.
motions: $(VENV)/.test
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m validation.motions $(ARGS)

# Plates and frames computed by CalculiX beforehand. ARGS="--cases" develops; --evaluation evaluates.
plates: $(VENV)/.test
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m validation.plates $(ARGS)

# Random input by the hundred thousand; goes on where it stopped. ARGS="--kind readers --seconds 600"
fuzz: $(VENV)/.test
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m validation.fuzz $(ARGS)

$(VENV)/bin/python:
	$(PYTHON) -c "import sys; sys.exit('cvxupdate needs Python 3.11 or newer; run make PYTHON=python3.11') if sys.version_info < (3, 11) else None"
	$(PYTHON) -m venv $(VENV)

$(VENV)/.base: $(VENV)/bin/python pyproject.toml
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e ".[formats]"
	touch $@

$(VENV)/.test: $(VENV)/bin/python pyproject.toml
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e ".[test]"
	touch $@ $(VENV)/.base

$(VENV)/.docs: $(VENV)/bin/python pyproject.toml
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e ".[docs]"
	touch $@

clean:
	rm -rf $(VENV) out .pytest_cache .mypy_cache .ruff_cache
