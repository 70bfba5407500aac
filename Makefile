# Two commands do everything: `make run` shows the bar, `make test` proves the package right.
PYTHON ?= python3
BIN := .venv/bin
BUILD_REQUIRES := scikit-build-core==1.1.2 nanobind==3.1.0
NATIVE := CMakeLists.txt pyproject.toml $(shell find native -type f)
WEB := scripts/build-web.sh $(shell find web -type f -not -path '*/node_modules/*')
FORMATTED := src tests benchmarks examples docs scripts fuzz
FUZZ_SECONDS ?= 60

.PHONY: run test wheel quick sanitize coverage fuzz lint format stubs bench docs site links setup clean

run: setup  ## Run the bar; leaves a picture, a plot and a report below runs/
	$(BIN)/qlb run bar

test: setup lint  ## Lint, type check and every test
	$(BIN)/pytest -n 2

quick: setup lint  ## Lint, type check and the fast tests
	$(BIN)/pytest -n 2 -m "not slow"

sanitize: setup  ## The fast tests of the native module under sanitizers: address and undefined behaviour, then threads
	./scripts/sanitize.sh address
	./scripts/sanitize.sh thread

coverage: setup  ## Line coverage of Python and C++ by the fast tests; pages in build/coverage
	./scripts/coverage.sh

fuzz: setup  ## Scene and mesh files at random, FUZZ_SECONDS each
	$(BIN)/python fuzz/scenes.py -max_total_time=$(FUZZ_SECONDS)
	$(BIN)/python fuzz/meshes.py -max_total_time=$(FUZZ_SECONDS)

lint: setup
	$(BIN)/ruff format --check --quiet $(FORMATTED)
	$(BIN)/ruff check --quiet $(FORMATTED)
	find native -name '*.?pp' | xargs $(BIN)/clang-format --dry-run --Werror
	$(BIN)/mypy
	npm run --prefix web --silent check

format: setup  ## Format Python, C++ and TypeScript
	$(BIN)/ruff check --quiet --fix-only $(FORMATTED)
	$(BIN)/ruff format --quiet $(FORMATTED)
	find native -name '*.?pp' | xargs $(BIN)/clang-format -i
	npm run --prefix web --silent format

stubs: setup  ## Write the type stub of the compiled module again
	$(BIN)/python -m nanobind.stubgen -q -m qlb._native -o src/qlb/_native.pyi

bench: setup  ## Benchmarks of a step and of the kernels; tables on the terminal
	$(BIN)/python -m benchmarks

docs: setup site  ## Build the site into build/docs, and check that every snippet in README and docs runs
	$(BIN)/pytest -n 2 tests/docs

site: setup  ## Build the site alone; a warning, such as a link within it that leads nowhere, is an error
	$(BIN)/python -m sphinx -W --keep-going -q -b html docs build/docs

links: setup  ## Check links out of the site and the README; needs the network
	$(BIN)/python -m sphinx -q -b linkcheck docs build/links

wheel: setup  ## Build a wheel that needs no system packages, into dist/, and check it in a clean environment
	./scripts/build-wheel.sh
	$(BIN)/python scripts/check_wheel.py dist/qlb-*.whl

setup: .venv/.installed

# An editable install, with CHOLMOD for the tests to compare with; it is made again when native sources, web sources or
# requirements change.
.venv/.installed: $(NATIVE) $(WEB) scripts/install-system.sh
	./scripts/install-system.sh
	test -x $(BIN)/python || $(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --upgrade pip
	$(BIN)/python -m pip install --quiet $(BUILD_REQUIRES)
	$(BIN)/python -m pip install --quiet --no-build-isolation --editable '.[dev]' \
		--config-settings=cmake.define.QLB_CHOLMOD=ON
	touch $@

clean:
	rm -rf .venv build web/node_modules src/qlb/results/static
