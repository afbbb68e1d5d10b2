# make demo   sets up everything and runs the main job on what ships with the project
# make test   sets up everything and passes the tests; make test-ci: those that only CI needs with every change
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check install --quiet --constraint constraints.txt
WORKERS ?= 2
ESLINT := 10.15.0

.PHONY: demo test test-ci test-all lint bench docs clean

# Byte code is made here: where PYTHONDONTWRITEBYTECODE is set, every command would compile 250 files again.
$(VENV)/.installed: pyproject.toml constraints.txt
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(PIP) --editable .
	$(BIN)/python -m compileall -q workbench recorders replayers dashboards
	touch $@

$(VENV)/.installed-test: $(VENV)/.installed
	$(PIP) --editable '.[test]'
	touch $@

$(VENV)/.installed-docs: $(VENV)/.installed
	$(PIP) --editable '.[docs]'
	touch $@

$(VENV)/.installed-all: $(VENV)/.installed-test
	$(PIP) --editable '.[test,docs,notebooks]' build
	touch $@

demo: $(VENV)/.installed
	$(BIN)/lios demo $(DEMO_OPTIONS)

test: $(VENV)/.installed-test
	bash .ci/chromium
	$(BIN)/pytest -W error -n $(WORKERS) -m "not slow and not ci"

test-ci: $(VENV)/.installed-test
	bash .ci/chromium
	$(BIN)/pytest -W error -n $(WORKERS) -m "ci and not slow"

test-all: $(VENV)/.installed-all
	bash .ci/chromium
	LIOS_EXPLORE=1 $(BIN)/pytest -W error -n $(WORKERS)

typings/.written: $(VENV)/.installed-test .ci/spot_stubs.py
	rm -rf typings
	$(BIN)/python .ci/spot_stubs.py typings
	touch $@

lint: typings/.written
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/pyright
	$(BIN)/lint-imports
	PATH="$(CURDIR)/$(BIN):$$PATH" npx --yes eslint@$(ESLINT) --max-warnings 0 dashboards

bench: $(VENV)/.installed-test
	$(BIN)/pytest tests/benchmarks --benchmark-enable --benchmark-only --benchmark-columns=min,median,max,rounds

docs: $(VENV)/.installed-docs
	$(BIN)/mkdocs build --strict

clean:
	rm -rf $(VENV) build dist site demo typings *.egg-info
