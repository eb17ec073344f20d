# Two commands from a fresh clone: `make demo` runs the whole workflow at demo scale, `make test` the tests.
# Everything they need goes into .venv, and results into results/. Outside this folder pip keeps downloads in its cache, and
# nothing else is touched.

PYTHON ?= python3
CORES ?= 2
# Processes of pytest; 0 runs the tests one after the other.
WORKERS ?= 2
BIN := .venv/bin

# What is set for other programs: where Python looks for modules, and what pip installs where. Only how pip reaches packages
# counts here too.
unexport $(filter-out PYTHON,$(filter PYTHON%,$(.VARIABLES))) \
	$(filter-out $(addprefix PIP_,INDEX_URL PYPI_URL EXTRA_INDEX_URL NO_INDEX FIND_LINKS TRUSTED_HOST CERT CLIENT_CERT PROXY \
	KEYRING_PROVIDER TIMEOUT DEFAULT_TIMEOUT RETRIES CACHE_DIR NO_CACHE_DIR CONFIG_FILE),$(filter PIP_%,$(.VARIABLES)))
INSTALL := -m pip install --quiet --disable-pip-version-check --no-user
# A container may run under a number without name or home folder.
ifeq ($(strip $(HOME)),)
HOME := $(CURDIR)/.venv
endif
export HOME

# Why an environment has to be made anew, if it has: its programs hold the path that it was made with, which venv notes.
# Other tools, such as uv, do not note it: what they made is kept.
stale = $(shell [ ! -d $(1) ] || [ -x $(1)/bin/python ] || { echo its Python is gone; exit; }; \
	path=$$(sed -n 's|^command = .* /|/|p' $(1)/pyvenv.cfg 2>/dev/null); \
	[ -z "$$path" ] || [ "$$path" -ef $(1) ] || echo it was made in another folder)
environment = $(if $(call stale,$(1)),echo "$(1) is made anew: $(call stale,$(1))" && )$\
	$(PYTHON) -m venv $(if $(call stale,$(1)),--clear) $(1)
.PHONY: $(if $(call stale,.venv),.venv/installed) $(if $(call stale,.venv-slurm),.venv-slurm/installed)

.PHONY: demo test test-full test-slurm torture lint reference tables clean-venv

demo: .venv/installed
	$(BIN)/snakemake --cores $(CORES) --quiet rules reason

# At most 10 minutes on two idle cores. test-full adds the tests marked `full`, which repeat what others show.
test: .venv/installed-test
	$(BIN)/python -m pytest -n $(WORKERS) --dist loadfile --no-loadscope-reorder -m "not full"

test-full: .venv/installed-test
	$(BIN)/python -m pytest -n $(WORKERS) --dist loadfile --no-loadscope-reorder

# The workflow on a real Slurm of one node, which is there for the test alone. Its environment is another one: see
# envs/requirements-slurm.txt.
test-slurm:
	@missing=$$($(PYTHON) tests/slurm/cluster.py) || exit 1; \
	if [ -n "$$missing" ]; then echo "test-slurm: skipped: $$missing"; else \
		$(MAKE) .venv-slurm/installed && .venv-slurm/bin/python -m pytest tests/slurm; fi

# Kills, damaged files and full disks: docs/reliability.md. Some 20 minutes; test-full has a short version.
torture: .venv/installed
	$(BIN)/python tests/torture/campaign.py --table results/torture.csv

lint: .venv/installed-test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/snakefmt --check Snakefile workflow
	PYTHONPATH=scripts $(BIN)/lint-imports --no-cache --no-logo
	$(BIN)/snakemake --lint
	for python in 3.11 3.12 3.13; do \
		$(BIN)/python -m pip install --quiet --disable-pip-version-check --dry-run --ignore-installed --no-deps \
			--only-binary :all: --python-version $$python --target .venv/none -r envs/requirements-test.txt || exit 1; \
	done

# The tracked copy of a run with its evaluation: tables, learning curves, effective configuration, versions, the figures that
# the README shows or is read with, and one slurry's last input and target frame, from which a test recomputes a figure
# (none with SLURRY=).
RUN ?= reduced
FROM := results/$(RUN)
REFERENCE := results/reference/$(RUN)
SLURRY := 2
FIGURES := workflow densification verdicts learning_curves_vgg16 learning_curves_vgg16_standardised coordinates_6 \
	density rdf costs slurry_vgg16_4 skill front relaxation uncertainty
reference:
	rm -rf $(REFERENCE)
	mkdir -p $(REFERENCE)/figures
	cp -r $(FROM)/tables $(FROM)/config.yaml $(FROM)/versions.json $(REFERENCE)
	rm -rf $(REFERENCE)/tables/.checksums
	[ ! -f $(FROM)/dataset/packing_fraction.json ] || cp $(FROM)/dataset/packing_fraction.json $(REFERENCE)
	for file in $$(cd $(FROM) && ls models/*/history.csv models/*/model.json models/*/calibration.json $(FIGURES:%=figures/%.png) 2>/dev/null); do \
		mkdir -p $(REFERENCE)/$$(dirname $$file); cp $(FROM)/$$file $(REFERENCE)/$$file; done
	if [ -n "$(SLURRY)" ]; then mkdir -p $(REFERENCE)/frames; \
		PYTHONPATH=scripts $(BIN)/python -c 'from slurrycast.data.frames import *; store = read_frames("$(FROM)/frames/$(SLURRY).h5"); \
		write_frames("$(REFERENCE)/frames/$(SLURRY).h5", store.particles, [store.frame(10), store.frame(120)], store.attributes)'; \
		rm -rf $(REFERENCE)/frames/.checksums; fi

# The tables of README.md, docs/ and results/reference/README.md, from results/reference.
tables: .venv/installed
	PYTHONPATH=scripts $(BIN)/python docs/tables.py

.venv/installed: envs/requirements.txt envs/constraints.txt pyproject.toml
	@command -v $(PYTHON) >/dev/null || { \
		echo "error: $(PYTHON) is not on PATH; Python 3.11 to 3.13 is needed: make PYTHON=/path/to/python3.12" >&2; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))' || { \
		echo "error: $(PYTHON) is $$($(PYTHON) --version 2>&1); Python 3.11 to 3.13 is needed: make PYTHON=/path/to/python3.12" >&2; \
		exit 1; }
	@$(call environment,.venv)
	$(BIN)/python $(INSTALL) -r envs/requirements.txt
	@[ -x $(BIN)/snakemake ] || { \
		echo "error: pip did not install into .venv: its configuration says elsewhere ($(BIN)/pip config list)" >&2; exit 1; }
	$(BIN)/python $(INSTALL) --no-deps --no-build-isolation --editable .
	@# Relative: Python reads the path in the encoding of the locale, in which it may have no name.
	@echo ../../../../scripts | tee .venv/lib/python3*/site-packages/__editable__.slurrycast-*.pth >/dev/null
	@touch $@

.venv/installed-test: .venv/installed envs/requirements-test.txt
	$(BIN)/python $(INSTALL) -r envs/requirements-test.txt
	@touch $@

.venv-slurm/installed: envs/requirements.txt envs/requirements-test.txt envs/requirements-slurm.txt envs/constraints.txt
	@$(call environment,.venv-slurm)
	.venv-slurm/bin/python $(INSTALL) -r envs/requirements-test.txt -r envs/requirements-slurm.txt
	@touch $@

clean-venv:
	rm -rf .venv .venv-slurm
