# make demo   a synthetic corpus becomes a library, measured, verified and exported
# make test   every test
# make lint   style, types and layers
# make bench  the figures: speed and size, on real clips where there are some
#
# Each makes the virtual environment that it needs. PYTHON names the interpreter to make it with,
# PYTEST holds further words for pytest: make test PYTEST='-m "not slow"'

PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin

.PHONY: demo test lint bench wheel clean

demo: $(VENV)/with-demo
	$(BIN)/mocapdb demo

test: $(VENV)/with-test
	$(BIN)/python -m pytest $(PYTEST)

lint: $(VENV)/with-lint
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

bench: $(VENV)/with-bench
	$(BIN)/python benchmarks/run_all.py

wheel: $(VENV)/with-test
	$(BIN)/python -m pip wheel --quiet --no-deps --wheel-dir dist .

$(VENV)/pyvenv.cfg:
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade pip

$(VENV)/with-demo: $(VENV)/pyvenv.cfg pyproject.toml
	$(BIN)/python -m pip install --quiet --editable .
	touch $@

$(VENV)/with-%: $(VENV)/pyvenv.cfg pyproject.toml
	$(BIN)/python -m pip install --quiet --editable '.[$*]'
	touch $@

clean:
	rm -rf $(VENV) demo dist .mypy_cache .pytest_cache .ruff_cache .hypothesis
	find . -name __pycache__ -prune -exec rm -rf {} +
