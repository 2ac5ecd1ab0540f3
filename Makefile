# Two commands do everything on a fresh machine: `make demo` and `make test`.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
# This needs Python 3.11 or later; a requirement that is already met installs nothing.

.PHONY: firmware setup demo test test-all check bench docs clean

setup: $(STAMP)

$(STAMP): pyproject.toml constraints.txt scripts/setup.sh scripts/debian-packages.txt
	PYTHON="$(PYTHON)" VENV="$(VENV)" sh scripts/setup.sh
	@touch $@

demo: setup
	$(BIN)/tubefoot demo --out out/demo

test: setup check firmware
	$(BIN)/pytest -m "not slow and not hardware"

test-all: setup check firmware
	$(BIN)/pytest -m "not hardware"

check: setup
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports

bench: setup firmware
	$(BIN)/python -m benchmarks

firmware: setup
	@$(MAKE) --no-print-directory -s -C firmware

docs: setup
	$(BIN)/sphinx-build -q -j auto -W --keep-going -d build/doctrees docs build/docs
	@echo "documentation: build/docs/index.html"

clean:
	rm -rf build out dist firmware/build $(VENV)
