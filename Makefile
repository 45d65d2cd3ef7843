# Every target sets up what it needs. Python 3.11, git and make are enough: uv, which
# installs the locked dependencies, is put into .uv/ where it is missing.

UV := $(or $(shell command -v uv 2>/dev/null),.uv/bin/uv)
RUN := $(UV) run --no-sync
QUICK := tests/test_layers.py tests/test_house.py tests/test_words.py \
	tests/test_documentation.py tests/rewards
TWO := -n 2 --dist loadfile --max-worker-restart 0 # a crash ends it
DIAGNOSES := tests/sysid/diagnosis tests/benchmarks/diagnosis
# Where bits and numbers of worlds are what is tested, programs are those of users.
COMPUTING := tests/envs tests/rewards tests/fingers_mjx/ppo tests/fingers_mjx/training \
	tests/fingers_mjx/runs tests/fingers_mjx/evaluation tests/sysid/calibration
LOGGERS := tests/fingers_mjx/runs/loggers tests/fingers_mjx/training/test_logged_runs.py

# What one of the tests' processes compiled, the others read, and so does the next run.
check test test-slow: export JAX_COMPILATION_CACHE_DIR := $(CURDIR)/.jax_cache
check test test-slow: export JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS := 0.2

.DEFAULT_GOAL := help
.PHONY: help sync cuda12 cuda13 format check test test-loggers test-slow test-gpu test-versions demo \
	notebooks docs battery bench compare build release clean

# The ends of what pyproject.toml allows; a version, or the path of an interpreter.
OLDEST_PYTHON := 3.11
NEWEST_PYTHON := 3.12
VERSIONS := tests/envs tests/rewards tests/fingers_mjx/ppo tests/fingers_mjx/training \
	tests/fingers_mjx/runs tests/fingers_mjx/export tests/fingers_mjx/studies

help: ## List the targets
	@grep -E '^[a-z0-9-]+:.*## ' $(MAKEFILE_LIST) | awk -F ':.*## ' '{printf "%-13s %s\n", $$1, $$2}'

sync: $(filter .uv/bin/uv,$(UV)) ## Install the locked dependencies into .venv/
	@$(UV) sync --locked --inexact --quiet

# Exactly these: two CUDA plugins side by side would not start.
cuda12: $(filter .uv/bin/uv,$(UV)) ## As sync, with all for an NVIDIA GPU, driver 525 on
	@$(UV) sync --locked --quiet --extra cuda12

cuda13: $(filter .uv/bin/uv,$(UV)) ## As sync, with all for an NVIDIA GPU, driver 580 on
	@$(UV) sync --locked --quiet --extra cuda13

format: sync ## Rewrite the code in the project's style
	$(RUN) ruff check --fix .
	$(RUN) ruff format .

check: sync ## What CI runs first: style, types, quick tests; changes nothing
	$(RUN) ruff format --check .
	$(RUN) ruff check .
	$(RUN) pyright
	$(RUN) pytest -q -n 2 $(QUICK)

test: sync ## All tests for two CPU cores
	$(RUN) pytest $(COMPUTING) $(TWO)
	$(RUN) pytest tests $(COMPUTING:%=--ignore=%) $(DIAGNOSES:%=--ignore=%) --quick-compile $(TWO)
	$(RUN) pytest $(DIAGNOSES) --whole-loops $(TWO)
	$(RUN) pytest deploy/tests # alone: some of them run in real time

test-loggers: sync ## The tests of the extras wandb and rerun, which it installs (600 MB)
	$(UV) sync --locked --inexact --quiet --extra wandb --extra rerun
	$(RUN) pytest -q $(LOGGERS)

test-slow: sync ## The large versions of the tests; they print their seeds
	$(UV) sync --locked --inexact --quiet --extra ray
	$(RUN) pytest -m slow

test-gpu: sync ## The tests that need an NVIDIA GPU, after make cuda12 or cuda13
	$(RUN) pytest -m gpu

test-versions: $(filter .uv/bin/uv,$(UV)) ## Tests with the oldest and newest JAX allowed
	$(UV) venv --quiet --clear --python $(OLDEST_PYTHON) build/oldest
	$(UV) pip install --quiet --python build/oldest --resolution lowest-direct \
		--group dev --editable '.[viz,data]' --editable deploy
	build/oldest/bin/python -m pytest -q -n 2 --dist loadfile $(VERSIONS)
	$(UV) venv --quiet --clear --python $(NEWEST_PYTHON) build/newest
	$(UV) pip install --quiet --python build/newest \
		--group dev --editable '.[viz,data]' --editable deploy
	build/newest/bin/python -m pytest -q -n 2 --dist loadfile $(VERSIONS)

demo: sync ## The walking hand: evaluate, play, train, export, one report
	$(RUN) fingers demo

notebooks: sync ## Execute all notebooks and keep their outputs
	$(RUN) python -m notebooks.execute

docs: sync ## The documentation as a site, into build/site/
	$(RUN) python -m docs.stage
	NO_MKDOCS_2_WARNING=1 JUPYTER_PLATFORM_DIRS=1 $(RUN) mkdocs build --strict

battery: sync ## Hide effects, ask the diagnosis, count how often it is right (hours)
	$(RUN) python -m benchmarks.diagnosis.battery --out build/battery

bench: sync ## Speed of physics, environment and PPO on this machine
	$(RUN) python -m benchmarks.speed.throughput

compare: sync ## This project beside its peers, each in an environment of its own (an hour)
	$(RUN) python -m benchmarks.comparison --out build/comparison

build: sync ## Wheels, installed and tried in an environment of their own
	rm -rf dist build/trial
	$(UV) build --quiet --all-packages --wheel
	$(UV) venv --quiet --python 3.11 build/trial
	$(UV) pip install --quiet --python build/trial dist/fingers_deploy-*.whl \
		"$$(echo dist/fingers_mjx-*.whl)[viz]"
	cd build && trial/bin/fingers hand show --out trial/hand
	cd build && trial/bin/python -c 'import fingers_deploy, rewards, envs, sysid, fingers_mjx'

release: sync ## Wheels and source archives in dist/, checked for publication
	rm -rf dist
	$(UV) sync --locked --inexact --quiet --group release
	$(UV) build --quiet --all-packages
	$(RUN) twine check --strict dist/*

clean: ## Remove caches and builds; runs and the environment stay
	rm -rf .pytest_cache .ruff_cache .hypothesis .jax_cache build dist deploy/build
	find . -name __pycache__ -not -path './.venv/*' -prune -exec rm -rf {} +

.uv/bin/uv:
	@echo "uv is not installed; putting it into .uv/"
	@python3 -m venv .uv || { echo "python3 -m venv failed: install uv or Python's venv module"; exit 1; }
	@.uv/bin/python -m pip install --quiet 'uv>=0.8'
