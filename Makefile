# Everything a checkout needs: `make help` lists the targets. Each one makes the environment it
# needs, in .venv, from nothing but Python 3.11+, git and make.

VENV := .venv
BIN := $(VENV)/bin
OUT ?= out/demo

# What notebooks say of themselves.
KEPT := {'kernelspec', ('language_info', 'name')}

# Test processes; each begins with half of the files, in order, and the first that is done takes
# tests from the end of what the other has left. 0 runs the tests in this one.
WORKERS ?= 2

# The first Python that is new enough; `make PYTHON=/path/to/python3 ...` overrides.
PYTHON ?= $(shell for name in python3 python3.14 python3.13 python3.12 python3.11; do \
	$$name -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null \
	&& echo $$name && break; done)

PIP := $(BIN)/python -m pip --disable-pip-version-check
INSTALL := $(PIP) install --quiet --require-hashes

# A shell set up for ROS, say, would put other packages before the pinned ones.
unexport PYTHONPATH PYTHONHOME

# Processes of the tests would each compile all of the package.
unexport PYTHONDONTWRITEBYTECODE

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help demo test lint format record mutants mutation-score bench peers interop irsim docs links tutorials pictures tools venv lock clean

help:  ## list the targets
	@awk -F ':.*##  *' '/^[a-z-]+:.*##/ { printf "make %-14s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

demo: $(VENV)/run.stamp  ## track evaders through the thesis's arena; watch it in a browser
	$(BIN)/sightfield track thesis_3v4 --out $(OUT) --meshcat

test: $(VENV)/dev.stamp  ## lint and run every test
	@sh tests/install_tools.sh
	@$(MAKE) --no-print-directory -j2 lint $(if $(ARGS),,build/kernels.stamp)
	$(BIN)/pytest -n $(WORKERS) --dist worksteal --durations 25 $(ARGS)

# Numba's kernels, compiled while one core checks style: test processes would compile them each.
# Numba compiles a kernel again if its own file has changed, not if one that it calls has.
build/kernels.stamp: $(shell find systems -name '*.py') | $(VENV)/dev.stamp
	@find systems -name '*.nb[ic]' -delete
	@$(BIN)/python tests/compile_kernels.py
	@mkdir -p build && touch $@

lint: $(VENV)/dev.stamp  ## check style, format and types
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/basedpyright --pythonpath $(BIN)/python

format: $(VENV)/dev.stamp  ## rewrite the sources in the house format, clear the notebooks
	$(BIN)/python -m nbconvert --log-level=ERROR --clear-output \
		--ClearMetadataPreprocessor.enabled=True \
		"--ClearMetadataPreprocessor.preserve_nb_metadata_mask=$(KEPT)" tutorials/*.ipynb tutorials/solutions/*.ipynb
	$(BIN)/ruff check --fix
	$(BIN)/ruff format

record: $(VENV)/dev.stamp  ## write anew what tests have recorded; look at the diff
	SIGHTFIELD_RECORD=1 $(BIN)/pytest -q -k recorded $(ARGS)

mutants: $(VENV)/dev.stamp  ## make faults on purpose in copies of the tree; the tests are to find all
	$(BIN)/python tests/mutants/run.py $(ARGS)

mutation-score: $(VENV)/dev.stamp  ## the share of faults drawn at random that the tests find (hours)
	$(BIN)/python tests/mutants/sample.py $(ARGS)

bench: $(VENV)/dev.stamp  ## run the timings, printed as ratios
	$(BIN)/pytest benchmarks -m benchmarks -s -q $(ARGS)

peers: $(VENV)/dev.stamp  ## install what benchmarks compare with, apart (needs swig and a C++ compiler)
	$(BIN)/python -m venv build/peers/visilibity
	build/peers/visilibity/bin/python -m pip install --quiet -r benchmarks/peers/visilibity.txt
	$(BIN)/python -m venv build/peers/hj_reachability
	build/peers/hj_reachability/bin/python -m pip install --quiet -r benchmarks/peers/hj_reachability.txt

interop: $(VENV)/dev.stamp  ## exchange messages with Debian's Cyclone DDS and Fast DDS, play against ir-sim
	@sh tests/interop/install.sh
	@$(MAKE) --no-print-directory -C tests/interop
	$(BIN)/python tests/interop/exchange.py
	@$(MAKE) --no-print-directory irsim

irsim: $(VENV)/dev.stamp build/peers/irsim/installed.stamp  ## play the station against ir-sim, a simulator in a process of its own
	$(BIN)/python tests/interop/play_irsim.py

build/peers/irsim/installed.stamp: benchmarks/peers/irsim.txt | $(VENV)/dev.stamp
	$(BIN)/python -m venv build/peers/irsim
	build/peers/irsim/bin/python -m pip install --quiet -r $<
	@touch $@

docs: $(VENV)/dev.stamp  ## build the documentation into build/docs; warnings are errors
	$(BIN)/python -m sphinx -q -W --keep-going -b html -d build/doctrees docs build/docs
	@echo "build/docs/index.html"

links: $(VENV)/dev.stamp  ## look whether the documentation's links to other sites lead somewhere
	$(BIN)/python -m sphinx -q -b linkcheck -d build/doctrees docs build/links

tutorials: $(VENV)/dev.stamp  ## open the tutorials in JupyterLab
	$(BIN)/python -m jupyterlab --notebook-dir=tutorials $(ARGS)

pictures: $(VENV)/dev.stamp  ## make the README's pictures again (needs Chromium)
	$(BIN)/python docs/make_pictures.py $(ARGS)

tools:  ## install what the tests need beyond pip
	@sh tests/install_tools.sh

venv: $(VENV)/dev.stamp  ## make the environment for development

clean:  ## remove the environment, caches and everything generated
	rm -rf $(VENV) build dist out *.egg-info .pytest_cache .ruff_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# The environment. A stamp is younger than the lock file it was installed from.

$(VENV)/pyvenv.cfg:
	@test -n "$(PYTHON)" || { \
		echo "Sightfield needs Python 3.11 or newer, and finds none. On Debian or Ubuntu, type:"; \
		echo "    sudo apt-get install python3 python3-venv"; \
		echo "or name one: make PYTHON=/path/to/python3"; exit 1; } >&2
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null || { \
		echo "Sightfield needs Python 3.11 or newer; got $$($(PYTHON) --version 2>&1)"; \
		echo "    from PYTHON=$(PYTHON)"; exit 1; } >&2
	@$(PYTHON) -c 'import venv, ensurepip' 2>/dev/null || { \
		echo "$(PYTHON) cannot make environments. On Debian or Ubuntu, type:"; \
		echo "    sudo apt-get install python3-venv"; exit 1; } >&2
	$(PYTHON) -m venv --clear $(VENV)

$(VENV)/run.stamp: requirements/run.txt requirements/build.txt pyproject.toml | $(VENV)/pyvenv.cfg
	@echo "Installing Sightfield into $(VENV): a download of about 410 MB"
	$(INSTALL) -r requirements/run.txt -r requirements/build.txt
	$(PIP) install --quiet --no-deps --no-build-isolation --editable .
	@touch $@

$(VENV)/dev.stamp: requirements/dev.txt $(VENV)/run.stamp
	@echo "Installing what the tests need into $(VENV): a download of about 230 MB"
	$(INSTALL) -r requirements/dev.txt
	@touch $@

# The lock: `make lock` follows pyproject.toml and keeps the pins that still fit;
# `make lock UPGRADE=--upgrade` takes the newest. Every Python and platform gets the same versions.
COMPILE := build/lock/bin/uv --no-config pip compile --quiet --universal --python-version 3.11 \
	--fork-strategy fewest --generate-hashes --no-header --no-annotate \
	--no-emit-index-url --no-emit-find-links $(UPGRADE)

lock: $(VENV)/pyvenv.cfg  ## pin the requirements again after a change of pyproject.toml
	$(BIN)/python -m venv build/lock
	build/lock/bin/python -m pip install --quiet uv
	$(COMPILE) --extra dev pyproject.toml -o requirements/dev.txt
	$(COMPILE) --constraint requirements/dev.txt pyproject.toml -o requirements/run.txt
	$(BIN)/python -c 'import tomllib; \
		print(*tomllib.load(open("pyproject.toml", "rb"))["build-system"]["requires"], sep="\n")' \
		| $(COMPILE) - -o requirements/build.txt
