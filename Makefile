# Every target sets itself up: a fresh machine needs only git, make and Python >= 3.11.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready

.PHONY: render test test-browser fuzz lint types bench clean

render: $(READY)
	mkdir -p out
	$(BIN)/fluorspar render cornell-box -o out/cornell-box.nc -o out/cornell-box.exr -o out/cornell-box.png --pictures out/components

test: lint types
	$(BIN)/python -m pytest --quiet --doctest-modules src
	$(BIN)/python -m pytest

# Opens the report of a comparison in a headless browser; on Debian, as root, it installs one.
test-browser: $(READY)
	command -v chromium >/dev/null || command -v google-chrome >/dev/null || test -n "$$CHROMIUM" || test "$$(id -u)" != 0 || \
		{ apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends chromium; }
	$(BIN)/python -m pytest -m browser tests/figures

# Two minutes of damaged scenes, tables and images; see docs/reliability.md.
fuzz: $(READY)
	$(BIN)/python tools/fuzz.py --seconds 120

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(READY)
	$(BIN)/mypy

bench: $(READY)
	$(BIN)/python benchmarks/run.py

$(READY): pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable '.[test]'
	touch $@

clean:
	rm -rf $(VENV) out build
