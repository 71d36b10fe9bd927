# Every target sets itself up: a fresh machine needs only git, make and Python >= 3.11.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready

LOWEST := out/lowest
WHEEL := out/wheel
PYTHONS := out/newer
# the newer Pythons that are tested, as far as they are at hand: in the search path, or of pyenv
NEWER = $(shell for minor in 12 13; do for python in python3.$$minor $$HOME/.pyenv/versions/3.$$minor.*/bin/python3; do \
	"$$python" --version >/dev/null 2>&1 && echo "$$python" && break; done; done)
# of the suite, what touches every dependency
PARTS := tests/test_layers.py tests/test_bounds.py tests/test_docs.py tests/colour tests/spectral tests/image tests/measuring \
	tests/denoising tests/figures tests/view tests/scene tests/staged/emitters tests/cluster tests/studies/test_batch_on_workers.py \
	tests/cli/test_bad_option.py tests/cli/test_compare_commands.py tests/cli/test_materials_commands.py
DOCS := out/docs
# Two processes: much of a test waits or computes in one thread.
TWO := --numprocesses 2 --dist loadfile

.PHONY: render view paper docs test test-browser test-blender test-wheel test-lowest test-pythons fuzz lint types bench clean

view: $(READY)
	$(BIN)/fluorspar view cornell-box --size 256x256 --spp 64

render: $(READY)
	mkdir -p out
	$(BIN)/fluorspar render cornell-box -o out/cornell-box.nc -o out/cornell-box.exr -o out/cornell-box.png --pictures out/components

# The figures and numbers of the paper, in kind: small, in minutes. At full size, in hours: make paper SIZE=
SIZE := --quick
paper: $(READY)
	$(BIN)/python examples/paper.py $(SIZE) -o out/paper

test: lint types
	$(BIN)/python -m pytest $(TWO) --quiet --doctest-modules src
	$(BIN)/python -m pytest $(TWO)

# The site, into out/docs/html: without network, and every warning is an error. Sphinx works on a copy, in which it makes
# the pages of the reference; the cells of tutorials and gallery are run, and an error in one fails the build.
docs: $(READY) $(VENV)/.docs
	rm -rf $(DOCS)
	mkdir -p $(DOCS)/source
	cp -R docs examples CHANGELOG.md $(DOCS)/source
	$(BIN)/sphinx-build --fail-on-warning --keep-going --quiet --jobs 2 $(DOCS)/source/docs $(DOCS)/html
	$(BIN)/python tools/check_site.py $(DOCS)/html

# Opens the report of a comparison and the window in a headless browser; on Debian, as root, it installs one.
test-browser: $(READY)
	command -v chromium >/dev/null || command -v google-chrome >/dev/null || test -n "$$CHROMIUM" || test "$$(id -u)" != 0 || \
		{ apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends chromium; }
	$(BIN)/python -m pytest -m browser tests/figures tests/view

# Cycles against Mitsuba, in the Blender that BLENDER names (or a Python with bpy); on Debian, as root, it installs one.
test-blender: $(READY)
	test -n "$$BLENDER" || command -v blender >/dev/null || test "$$(id -u)" != 0 || \
		{ apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends blender; }
	test -n "$$BLENDER" || command -v blender >/dev/null || \
		{ echo "no Blender: install it, or set BLENDER to it or to a Python that has bpy" >&2; exit 1; }
	$(BIN)/python -m pytest -m blender tests/blender

# The oldest versions that are allowed, and the source distribution: its own tests on the package made of it. All of
# the suite would take as long again as 'make test'.
test-lowest:
	rm -rf $(LOWEST)
	$(PYTHON) -m venv $(LOWEST)/venv
	$(LOWEST)/venv/bin/python -m pip install --quiet --disable-pip-version-check build
	$(LOWEST)/venv/bin/python -m build --sdist --outdir $(LOWEST) . >$(LOWEST)/build.log
	tar --extract --gzip --strip-components 1 --file $(LOWEST)/fluorspar-*.tar.gz --directory $(LOWEST)
	$(LOWEST)/venv/bin/python -m pip install --quiet --disable-pip-version-check --constraint constraints-lowest.txt \
		'$(LOWEST)[view,denoise,cluster]' pytest hypothesis httpx openimageio
	cd $(LOWEST) && venv/bin/python -m pytest --quiet $(PARTS)

# The same parts, and the doctests, with each newer Python that is at hand.
test-pythons:
	@for python in $(NEWER); do \
		"$$python" --version && \
		rm -rf $(PYTHONS) && "$$python" -m venv $(PYTHONS) && \
		$(PYTHONS)/bin/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable '.[test]' && \
		$(PYTHONS)/bin/python -m pytest $(TWO) --quiet --doctest-modules src && \
		$(PYTHONS)/bin/python -m pytest $(TWO) --quiet $(PARTS) || exit 1; \
	done

# A wheel, made of the source distribution, in an environment of its own and outside of the repository: one of the newest
# Python at hand, so that more than the oldest is tried where 'make test-pythons' takes too long.
test-wheel: $(READY)
	rm -rf $(WHEEL)
	mkdir -p $(WHEEL)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check build
	$(BIN)/python -m build --outdir $(WHEEL) . >$(WHEEL)/build.log
	$(BIN)/python tools/check_wheel.py $(WHEEL) --constraint constraints.txt --python $(or $(lastword $(NEWER)),$(BIN)/python)

# Two minutes of damaged scenes, tables, images and light paths; see docs/reliability.md.
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

$(VENV)/.docs: $(READY)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable '.[docs]'
	touch $@

clean:
	rm -rf $(VENV) out build
