# Everything a fresh machine needs: git, make and Python 3.11 or later.
PYTHON ?= python3
CORES ?= 2
BIN := .venv/bin

# Snakemake writes files under HOME. In a container HOME may be unset, or a folder that cannot be written.
ifneq ($(shell test -w "$$HOME" && echo writable),writable)
export HOME := $(CURDIR)/.home
endif

.PHONY: help env report test test-all test-slow faults browser cluster-test check docs format clean

help:            ## list these targets
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*##/\t/'

# With LOCKED=yes every package must have the hash in requirements.lock, which `uv pip compile` wrote (its first lines).
env: .venv/.ready  ## make the Python environment in .venv (LOCKED=yes checks hashes)

.venv/.ready: pyproject.toml constraints.txt
	@echo "Making the environment in .venv: PyTorch, Snakemake, SciPy and their dependencies. It takes 2 GB of disk."
	test -x $(BIN)/python || $(PYTHON) -m venv .venv
	$(if $(LOCKED),$(BIN)/python -m pip install --disable-pip-version-check --require-hashes -r requirements.lock)
	$(BIN)/python -m pip install --disable-pip-version-check --constraint constraints.txt --editable ".[dev]"
	touch $@

report: env      ## train a character that can be hurt and make its report
	$(BIN)/snakemake -c$(CORES) results/limp/report.html

test: env browser  ## run the tests of everything that a change can break
	$(BIN)/python -m pytest -n $(CORES) --dist loadfile --durations=10 -m "not slow"

test-all: test test-slow cluster-test  ## run these tests, then the slow ones: killed trainings, random faults, long play, SLURM

# MINUTES=20: after 20 minutes no further slow test begins.
test-slow: env browser
	$(BIN)/python -m pytest -n $(CORES) --dist loadfile --durations=10 -m slow

faults: env      ## test the workflow with N random faults (make faults N=200 SEED=7), see docs/faults.md
	N=$(or $(N),100) SEED=$(SEED) $(BIN)/python -m pytest -n 0 -q -s tests/faults/test_throws.py -k random

cluster-test: env ## run the test configuration on a SLURM cluster of one node (needs root on Debian)
	tests/cluster/run.sh || test $$? = 77

# The tests that open the report need a browser; without one they are skipped. This target asks before it installs Chromium with
# apt-get as root. BROWSER=yes or BROWSER=no answers, for machines without a person.
BROWSER ?= ask
browser:         ## find the browser for the tests, or ask whether to install one (BROWSER=yes, BROWSER=no)
	@for name in chromium chromium-browser google-chrome; do command -v $$name >/dev/null && exit 0; done; \
	answer=$(BROWSER); \
	if [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; then \
	  if [ $$answer = ask ] && [ -t 0 ]; then printf "Install chromium for the tests that open the report? [y/N] "; read answer; fi; \
	  case $$answer in y|yes) \
	    { apt-get update && DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends chromium; } >/dev/null 2>&1 && exit 0 ;; \
	  esac; \
	fi; \
	echo "no chromium here: the tests that open the report will be skipped (make browser BROWSER=yes installs it, as root on Debian)"

check: env       ## check lint, format and types
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/snakefmt --check Snakefile workflow/Snakefile workflow/rules
	$(BIN)/snakemake --lint >/dev/null || $(BIN)/snakemake --lint
	$(BIN)/mypy

docs: env        ## build the documentation site in site/, with loops of the limps of results/limp
	$(BIN)/snakemake -c$(CORES) results/limp/stimuli
	$(BIN)/python -m pip install --quiet --editable ".[docs]"
	$(BIN)/mkdocs build --strict --quiet

format: env      ## format all files
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .
	$(BIN)/snakefmt Snakefile workflow/rules

clean:           ## remove results, keep the environment
	rm -rf results/* .snakemake
