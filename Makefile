# All set-up happens here, in one virtual environment; a target that finds it current installs nothing.
VENV   := .venv
PYTHON := $(VENV)/bin/python
PORT   ?= 8000
TESTS  ?= tests

# From Debian: the proxy with TLS, its certificate, what runs the examples, and networks that are cut.
TEST_PACKAGES = nginx openssl octave curl postgresql chromium iproute2

# What `.venv` cannot hold, each in an environment of its own: what `make bench` measures against, and what generates a
# client in `make test`.
PEERS = tesseract nanite
GENERATOR = openapi-client

# Written from the service's models, and by a server that is asked for each operation; git ignores both.
DOCUMENTS = underskin/client/documents.py
EXAMPLES = service/routes/examples.json

# Two processes more than two cores, since tests of servers and pages also wait; tests/conftest.py says which tests stay
# together in one of them, and in which order they come.
PYTEST = $(PYTHON) -m pytest --numprocesses 4 --dist loadfile --no-loadscope-reorder

# Modules stay compiled: servers, workers and commands start some hundred times in the tests.
unexport PYTHONDONTWRITEBYTECODE

# What is imported is compiled then; the rest of a package never is.
PIP = -m pip install --quiet --disable-pip-version-check --no-compile
PIP_INSTALL = $(PYTHON) $(PIP)

.DEFAULT_GOAL := help

# Parts of the set-up that do not wait for each other run side by side.
MAKEFLAGS += --jobs=2
.PHONY: help serve unit test check docs tables paper tour real mechanisms ledger house proof bench soak lock clean

help: ## this list
	@awk -F ':.*## ' '/^[a-z]+:.*## / {printf "make %-8s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

serve: $(VENV)/.runtime $(EXAMPLES) ## serve on http://127.0.0.1:8000 (PORT=...)
	@$(VENV)/bin/underskin serve --port $(PORT)

# Two processes, since nothing waits and each has to collect; the service's own tests take half of that.
unit: $(VENV)/.dev ## run the quick tests of the library, without server, browser or database (TESTS=...)
	$(PYTEST) --numprocesses 2 -m unit --ignore tests/service --durations 5 $(TESTS)

test: $(VENV)/.dev $(VENV)-$(GENERATOR)/.installed ## run the tests at reduced counts (TESTS=tests/physics for some of them)
	@scripts/system-packages.sh $(TEST_PACKAGES)
	$(PYTEST) $(TESTS)

soak: $(VENV)/.dev $(VENV)-$(GENERATOR)/.installed ## run the tests at full counts, the long ones included (resumes)
	@scripts/system-packages.sh $(TEST_PACKAGES)
	UNDERSKIN_SOAK=1 $(PYTHON) -m pytest -m alone $(TESTS); \
	UNDERSKIN_SOAK=1 $(PYTEST) $(TESTS); status=$$?; $(PYTHON) -m bench soak && exit $$status

check: $(VENV)/.dev-packages $(DOCUMENTS) ## format, lint, strict types, import direction
	$(PYTHON) -m ruff format --check .
	$(PYTHON) -m ruff check .
	$(PYTHON) -m mypy
	$(VENV)/bin/lint-imports

# The variable silences a notice of the theme about its successor.
docs: $(VENV)/.dev ## build the pages as a site into build/site, and check every link
	NO_MKDOCS_2_WARNING=1 $(PYTHON) -m mkdocs build --strict

tables: $(VENV)/.runtime ## solve the shipped tables again
	$(VENV)/bin/underskin tablegen sigma --out tables/sigma.h5
	$(VENV)/bin/underskin tablegen influence --out tables/influence.h5
	$(VENV)/bin/underskin tablegen contact --out tables/contact.h5

paper: $(VENV)/.dev ## regenerate docs/paper.md and its figures
	$(PYTHON) -m docs.paper

tour: $(VENV)/.dev ## regenerate docs/tour.md, its screenshots and the picture of a report
	@scripts/system-packages.sh chromium
	$(PYTHON) -m docs.tour
	$(PYTHON) -m docs.reading

real: $(VENV)/.dev ## diagnose the open real recordings and write docs/real.md
	$(PYTHON) -m docs.real

mechanisms: $(VENV)/.dev ## regenerate docs/mechanisms.md and its figures
	$(PYTHON) -m docs.mechanisms

ledger: $(VENV)/.dev ## diagnose the ledger's campaigns and print which answers changed (KEEP=1 keeps the new ones; PARTS="frf real"; resumes)
	$(PYTHON) -m proof.ledger $(if $(KEEP),--keep) $(PARTS)

house: $(VENV)/.dev ## print the size and shape of the library: files, lines, constants, circles
	@$(PYTHON) -m scripts.house

proof: $(VENV)/.dev ## judge the diagnosis on concealed campaigns and real recordings (several hours; resumes)
	$(VENV)/bin/underskin prove

bench: $(VENV)/.dev $(PEERS:%=$(VENV)-%/.installed) ## measure speed, as ratios against peers in the same run
	@scripts/system-packages.sh wrk chromium
	$(PYTHON) -m bench

lock: $(VENV)/.dev ## resolve pyproject.toml into the lock files
	scripts/lock.sh $(PYTHON)

clean: ## remove the environment and all caches
	rm -rf $(VENV) $(PEERS:%=$(VENV)-%) $(VENV)-$(GENERATOR) build dist $(DOCUMENTS) $(EXAMPLES) .mypy_cache .pytest_cache .ruff_cache .import_linter_cache .hypothesis
	find . -name __pycache__ -prune -exec rm -rf {} +

$(VENV)/.created: scripts/make-venv.sh
	@scripts/make-venv.sh $(VENV)
	@touch $@

# Without an index, a package that the lock lacks is an error and not a download.
$(VENV)/.packages: $(VENV)/.created requirements.lock pyproject.toml
	@echo "Installing the locked packages into $(VENV) ..."
	@$(PIP_INSTALL) --require-hashes -r requirements.lock
	@$(PIP_INSTALL) --no-index --no-build-isolation -e '.[server,fem]'
	@touch $@

$(DOCUMENTS): scripts/client_documents.py $(wildcard service/schemas/*.py) | $(VENV)/.packages
	@$(PYTHON) -m scripts.client_documents
	@touch $@

$(VENV)/.runtime: $(VENV)/.packages | $(DOCUMENTS)
	@echo "Compiling functions (half a minute) ..."
	@$(PYTHON) -m underskin.compiled
	@touch $@

$(EXAMPLES): scripts/openapi_examples.py $(wildcard service/routes/*.py service/schemas/*.py) | $(VENV)/.runtime
	@echo "Asking a server for the examples of the OpenAPI document ..."
	@$(PYTHON) -m scripts.openapi_examples

$(VENV)/.dev-packages: $(VENV)/.packages requirements-dev.lock
	@echo "Installing the locked development packages into $(VENV) ..."
	@$(PIP_INSTALL) --require-hashes -r requirements-dev.lock
	@touch $@

$(VENV)/.dev: $(VENV)/.runtime $(VENV)/.dev-packages | $(EXAMPLES)
	@touch $@

$(VENV)-%/.installed: requirements-%.lock
	@scripts/make-venv.sh $(VENV)-$*
	@echo "Installing $* into $(VENV)-$* ..."
	@$(VENV)-$*/bin/python $(PIP) --require-hashes -r $<
	@touch $@
