# `make demo` renders a first picture, `make test` checks everything; both set up what they need and reuse it.

PICTURE := out/teapot.png
SITE := build/site
# Processes that run tests side by side; each renders with all cores.
JOBS ?= 2
# How often a search runs each property test, with other examples each time.
ROUNDS ?= 20
# Else all programs that tests start, and both their workers, would compile every module anew.
export PYTHONDONTWRITEBYTECODE :=
OPEN := $(if $(filter Darwin,$(shell uname -s)),open,xdg-open)

.DEFAULT_GOAL := help
.PHONY: addon audit check dist docs help setup setup-dev demo test test-long test-oldest search lint clean

help:
	@echo 'make demo    set up and render a teapot for a lenticular display into $(PICTURE)'
	@echo 'make setup   set up only: virtual environment, package, LLVM runtime'
	@echo 'make test    set up, lint and run the tests (JOBS=2 PYTEST="-k replay")'
	@echo 'make test-long  run the tests that take longest, half an hour of them'
	@echo 'make check   the same in a few minutes: lint, types and the quick tests'
	@echo 'make search  look for random examples that break a property test (ROUNDS=20)'
	@echo 'make test-oldest  run the tests of picture files with the oldest libraries that are allowed'
	@echo 'make lint    set up, check style and types'
	@echo 'make addon   pack the add-on for Blender into dist/'
	@echo 'make dist    set up, build the wheel and the source archive into dist/'
	@echo 'make docs    set up, build the documentation into $(SITE)'
	@echo 'make audit   set up, look installed packages up in the list of known vulnerabilities'
	@echo 'make clean   remove what set-up and tests made; pictures in out/ stay'

setup:
	@scripts/setup.sh

setup-dev:
	@scripts/setup.sh --dev

demo: setup
	@mkdir -p $(dir $(PICTURE))
	.venv/bin/lippmann render teapot --display seed-lenticular -o $(PICTURE)
	.venv/bin/lippmann view $(PICTURE) --export $(PICTURE:.png=.html)
	@echo 'The native pixels lie in $(PICTURE). Move before the display on the page:'
	@echo '  $(OPEN) $(CURDIR)/$(PICTURE:.png=.html)'

docs: setup-dev
	NO_MKDOCS_2_WARNING=1 .venv/bin/python -m mkdocs build --strict --site-dir $(SITE)
	@echo 'The site lies in $(CURDIR)/$(SITE). Read it with:'
	@echo '  $(OPEN) $(SITE)/index.html'

addon: setup
	.venv/bin/python scripts/pack_addon.py

dist: setup-dev
	.venv/bin/python -m build --no-isolation --outdir dist

audit: setup-dev
	.venv/bin/python scripts/audit.py

lint: setup-dev
	.venv/bin/ruff check
	.venv/bin/ruff format --check
	.venv/bin/mypy

test: lint
	.venv/bin/python -m pytest -n $(JOBS) --dist worksteal -m 'not long' $(PYTEST)

test-long: setup-dev
	.venv/bin/python -m pytest -n $(JOBS) --dist worksteal -m long $(PYTEST)

check: lint
	.venv/bin/python -m pytest -n $(JOBS) -m 'not slow and not long' $(PYTEST)

search: setup-dev
	.venv/bin/python -m pytest -n auto -m hypothesis --hypothesis-profile search --rounds $(ROUNDS) $(PYTEST)

test-oldest:
	@scripts/test-oldest.sh -q $(PYTEST)

clean:
	rm -rf .venv build dist src/*.egg-info .pytest_cache .ruff_cache .mypy_cache .hypothesis .coverage
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
