# make demo   a synthetic corpus becomes a library, measured, verified and exported
# make test   every test
# make lint   style, types and layers
# make blender       the Blender extension as a zip, with the wheels that it needs
# make test-blender  files by way of Blender, and the extension, with Python's bpy (800 MB)
# make docs   the manual, into build/manual; warnings are errors
# make bench  mocapdb beside what one would pick instead: one table, on real clips where there are some
# make bench-all  every other benchmark, one after another
#
# Each makes the virtual environment that it needs. PYTHON names the interpreter to make it with,
# PYTEST holds further words for pytest: make test PYTEST='-m "not slow"'

PYTHON ?= python3
VENV ?= .venv
PEERS ?= .venv-peers
BIN := $(VENV)/bin

# Blender as a module is there for one Python: 4.5 and 5.0 are for 3.11
BLENDER ?= 4.5
BLENDER_PYTHON ?= python3.11
BLENDER_VENV ?= .venv-blender

.PHONY: demo test blender test-blender lint docs peers bench bench-all wheel clean

demo: $(VENV)/with-demo
	$(BIN)/mocapdb demo

test: $(VENV)/with-test
	$(BIN)/python -m pytest $(PYTEST)

blender: $(VENV)/pyvenv.cfg
	$(BIN)/python scripts/build_blender.py

test-blender: $(BLENDER_VENV)/with-blender-$(BLENDER)
	$(BLENDER_VENV)/bin/python -m pytest -m blender tests/blender $(PYTEST)

lint: $(VENV)/with-lint
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

docs: $(VENV)/with-docs
	$(BIN)/sphinx-build --quiet --fail-on-warning --keep-going --jobs auto -c docs . build/manual
	@echo build/manual/index.html

bench: $(VENV)/with-bench peers
	$(BIN)/python benchmarks/peers.py --python $(PEERS)/bin/python -o bench-results

bench-all: $(VENV)/with-bench
	$(BIN)/python benchmarks/run_all.py

# what others wrote has an environment of its own; dreimac is left out where it does not install
peers: $(PEERS)/with-peers

$(PEERS)/with-peers: benchmarks/peers.txt
	$(PYTHON) -m venv $(PEERS)
	$(PEERS)/bin/python -m pip install --quiet --upgrade pip
	$(PEERS)/bin/python -m pip install --quiet --requirement benchmarks/peers.txt
	$(PEERS)/bin/python -m pip install --quiet 'dreimac>=0.3' || echo "dreimac does not install here"
	touch $@

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

$(BLENDER_VENV)/with-blender-%: pyproject.toml
	test -d $(BLENDER_VENV) || $(BLENDER_PYTHON) -m venv $(BLENDER_VENV)
	$(BLENDER_VENV)/bin/python -m pip install --quiet --editable . hypothesis pytest 'bpy==$*.*'
	touch $@

clean:
	rm -rf $(VENV) $(BLENDER_VENV) build $(PEERS) demo dist .mypy_cache .pytest_cache .ruff_cache .hypothesis
	find . -name __pycache__ -prune -exec rm -rf {} +
