# Every target sets up what it needs in .venv and reuses it the next time: a stamp file for each set of extras,
# out of date only when pyproject.toml or constraints.txt change. Nothing but Python >= 3.11 is needed.
VENV := .venv
BIN := $(VENV)/bin
CANDIDATES := python3 python3.14 python3.13 python3.12 python3.11 python
NEW_ENOUGH := -c 'import sys; sys.exit(sys.version_info < (3, 11))' >/dev/null 2>&1
PYTHON ?= $(shell for python in $(CANDIDATES); do $$python $(NEW_ENOUGH) && echo $$python && break; done)

# pytest-xdist runs one worker a core, so a numerical library that starts its own threads only gets in the way
export OMP_NUM_THREADS := 1
export OPENBLAS_NUM_THREADS := 1
# glibc gives an array of megabytes back to the system at once, and asks for it again: a tenth of the time of a fit
export MALLOC_MMAP_THRESHOLD_ := 1073741824
export MALLOC_TRIM_THRESHOLD_ := 1073741824
export MALLOC_TOP_PAD_ := 67108864
# With this variable Python compiles every library again in every process: 6 s of processor for each report
unexport PYTHONDONTWRITEBYTECODE

# the newest Python at hand: ArviZ 1.x wants 3.12 or later
NEWEST ?= $(shell for python in python3.14 python3.13 python3.12 $(CANDIDATES); do $$python $(NEW_ENOUGH) && echo $$python && break; done)

.PHONY: help report test test-slow test-all test-oldest test-newest lint docs studies mutants gallery wheel lock clean
help:
	@echo "make report     two reports, on a simulated finger and a measured pad: report/index.html"
	@echo "make test       ruff, mypy and the tests"
	@echo "make test-slow  the tests that take seconds"
	@echo "make test-all   ruff, mypy and all tests, what .ci/run does"
	@echo "make test-oldest, make test-newest"
	@echo "                the tests on the oldest and the newest libraries allowed, in .venv-oldest and .venv-newest"
	@echo "make docs       the documentation, in docs/_build/html"
	@echo "make studies    every script in studies/ but the fuzzers and those of many hours, with its time"
	@echo "make mutants    whether the tests notice small changes to the core: an hour or more"
	@echo "make wheel      sdist and wheel, which is installed on two Pythons without constraints and tried"
	@echo "make gallery    the pictures of docs/gallery.md anew, by their studies"
	@echo "make lock       constraints.txt made anew (maintainers)"
	@echo "make clean      remove what make made, except .venv"

report: $(VENV)/.ready-runtime
	$(BIN)/python studies/first_reports.py report

test: lint
	$(BIN)/pytest -n 2 --dist worksteal -q

test-slow: $(VENV)/.ready-dev
	$(BIN)/pytest -n 2 -q -m slow

# One run for both, so that no core waits for the other's last test: the slow ones begin (conftest.py). mypy takes one
# core for a minute or more, so it runs beside them.
test-all: $(VENV)/.ready-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	@$(BIN)/mypy & types=$$!; \
	$(BIN)/pytest -n 2 --dist worksteal -q --durations=60 -m 'slow or not slow'; tests=$$?; \
	wait $$types && exit $$tests

# What old libraries say of newer ones beneath them is no fault of ours: warnings are no errors here.
test-oldest: .venv-oldest/.ready
	.venv-oldest/bin/pytest -n 2 -q -o filterwarnings=default

test-newest: .venv-newest/.ready
	.venv-newest/bin/pytest -n 2 -q

lint: $(VENV)/.ready-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

docs: $(VENV)/.ready-docs
	$(BIN)/sphinx-build -q -W --keep-going -b html docs docs/_build/html
	@echo "docs/_build/html/index.html"

# These take hours, or need an argument; gallery.py runs the others again.
LONG_STUDIES = blind_study.py causes.py causes_of_forms.py gallery.py harm.py mutants.py other_pads.py places_and_times.py

studies: $(VENV)/.ready-dev
	@for study in $(sort $(filter-out studies/fuzz_% $(addprefix studies/,$(LONG_STUDIES)),$(wildcard studies/[!_]*.py))); do \
		echo "== $$study"; start=$$(date +%s); \
		$(BIN)/python "$$study" || exit 1; \
		echo "== $$study: $$(($$(date +%s) - start)) s"; \
	done
	$(BIN)/python -m studies.nicolson_fearing

mutants: $(VENV)/.ready-mutants
	$(BIN)/python studies/mutants.py

gallery: $(VENV)/.ready-dev
	$(BIN)/python studies/gallery.py

# What a user gets: the newest libraries that pip finds, on the Python of .venv and on the newest one.
wheel: $(VENV)/.ready-dev
	rm -rf dist
	$(BIN)/python -m hatchling build -d dist
	@for python in $(BIN)/python $(NEWEST); do \
		rm -rf .venv-wheel && $$python -m venv .venv-wheel && .venv-wheel/bin/python --version && \
		.venv-wheel/bin/pip install -q --disable-pip-version-check dist/*.whl && \
		.venv-wheel/bin/bayestouch example fluid-oil-1.5 -o .venv-wheel/channel && \
		.venv-wheel/bin/bayestouch calibrate .venv-wheel/channel -o .venv-wheel/calibration.nc || exit 1; \
	done

# One file of exact versions with markers serves every Python and platform. hatchling and editables build the package
# itself, setuptools a dependency of cosmic-ray, and uv installs them all, so they are locked with the rest.
lock: $(VENV)/.created
	@$(UV)
	printf 'hatchling\neditables\nsetuptools\nuv\n' | $(BIN)/uv pip compile pyproject.toml - -o constraints.txt --upgrade -q \
		--universal --python-version 3.11 --all-extras --no-annotate --no-header --no-emit-index-url

clean:
	rm -rf report build dist .venv-wheel docs/_build .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find bayestouch tests studies -name __pycache__ -type d -prune -exec rm -rf {} +

# The pip of the Python that makes .venv puts uv in it, and uv puts pip in it: Python itself takes 6 s for that.
UV = test -x $(BIN)/uv || $(PYTHON) -m pip --python $(BIN)/python install -q --no-compile -c constraints.txt uv || \
	{ $(BIN)/python -m ensurepip && $(BIN)/python -m pip install -q -c constraints.txt uv; }

$(VENV)/.created:
	@$(or $(PYTHON),false) $(NEW_ENOUGH) || \
		{ echo "bayestouch needs Python 3.11 or newer on the path, or make PYTHON=/path/to/python3.11" >&2; exit 1; }
	@$(PYTHON) -m venv --without-pip $(VENV) || \
		{ echo "$(PYTHON) cannot make a virtual environment: install its venv module" >&2; exit 1; }
	@touch $@

.venv-oldest/.ready: INTERPRETER := $(BIN)/python
.venv-oldest/.ready: RESOLUTION := lowest-direct
.venv-newest/.ready: INTERPRETER := $(NEWEST)
.venv-newest/.ready: RESOLUTION := highest
.venv-oldest/.ready .venv-newest/.ready: $(VENV)/.created pyproject.toml
	@$(UV)
	$(BIN)/uv venv -q --clear --python $(INTERPRETER) $(@D)
	$(BIN)/uv pip install -q --python $(@D)/bin/python --resolution $(RESOLUTION) -e '.[dev]'
	@touch $@

# The releases of constraints.txt, also those that build the package. uv is four times as fast as pip but reads no
# pip.conf: where that names a private index, pip installs.
EXACT := -c constraints.txt --build-constraints constraints.txt
$(VENV)/.ready-runtime: EXTRAS :=
$(VENV)/.ready-dev: EXTRAS := [dev]
$(VENV)/.ready-docs: EXTRAS := [docs]
$(VENV)/.ready-mutants: EXTRAS := [mutants]
$(VENV)/.ready-%: $(VENV)/.created pyproject.toml constraints.txt
	@echo "setting up $(VENV) for bayestouch$(EXTRAS) (a few minutes, once)"
	@$(UV)
	@$(BIN)/uv pip install -q --python $(BIN)/python $(EXACT) pip -e '.$(EXTRAS)' || { \
		echo "uv cannot install it here; with pip, which takes longer"; \
		$(BIN)/python -m ensurepip && $(BIN)/python -m pip install -q -c constraints.txt -e '.$(EXTRAS)'; }
	@touch $@
