# These targets run on a fresh machine and include the set-up:
#   make demo      check the spec, regenerate all code, run all worked examples, move a virtual stage
#   make test      formatting, types, import rules, and the tests of all folders: ten minutes on two cores
#   make test-all  make test, then the matrices: every compiler and machine, hostile input, walkthroughs, packages;
#                  then make proofs
#   make proofs    all interruptions of all faulty controllers, all wrong facts in the spec, and runs in real time:
#                  half an hour on a quiet machine
# These targets take longer or need a quiet machine:
#   make coverage  the coverage of the library and the virtual controllers, compared with its floor
#   make bench     speed and memory, compared with their limits
#   make soak      256 virtual controllers for a minute, and 256 sessions; a day of ten axes; eight threads;
#                  the conformance suite on every unit in real time; 100,000 puts to an IOC
#   make fuzz      thirty million executions of the codecs, all kinds of user input for the command, and all kinds
#                  of bytes for the virtual controllers
# For a release, make archives builds the sdist, the wheel and the C archive in dist/.
#   make interop   third-party clients drive virtual controllers, among them the vendor's XA SDK; not part of make test
# The targets use separate virtual environments below .venv/.

PYTHON ?= python3
SPEC := spec
OUT := generated
# make test runs the unit tests first, so that most failures appear within two minutes.
UNITS := structure runtime generator
PYTEST = .venv/test/bin/python -m pytest -q -n $(WORKERS) --dist worksteal
# One worker more than the number of cores, since some tests only wait.
WORKERS := $(shell $(PYTHON) -c "import os; print((os.cpu_count() or 1) + 1)")
# Limit in seconds of the processor time of make test on two cores. make budget and make test-all fail above it.
BUDGET ?= 540

BENCHMARKS := codec_speed framing_speed commands columns start_up round_trip opening stop_latency panel_stop silent framing_time \
	capture_memory framing_experiment c_speed ioc_load
SOAKS := virtual_soak many_sessions threads endurance conformance_time ioc_soak
EXECUTIONS := 10000000
C_EXECUTIONS := 20000000
SECONDS := 60
SEED := 1

# Tests whose coverage has a floor: the code of every message and motion, in three minutes of processor time.
COVERED := tests/runtime tests/virtual --ignore=tests/runtime/devices

# The tests start hundreds of short processes. Without bytecode, each of them would compile the packages again.
unexport PYTHONDONTWRITEBYTECODE

# Steps run one after the other; pytest uses all cores.
.NOTPARALLEL:

.PHONY: demo test test-all checks units others matrix proofs budget coverage tools generate format archives c-sizes bench soak fuzz interop clean

demo: .venv/demo/ready
	@echo "== the spec: schemas, layouts, witness, errata"
	@.venv/demo/bin/stagewire check $(SPEC)
	@echo "== all generated code: regenerated in memory and compared byte by byte"
	@.venv/demo/bin/stagewire generate --spec $(SPEC) --out $(OUT) --check
	@echo "== all worked examples of the documents, in both directions; to list them:"
	@echo "   .venv/demo/bin/stagewire conformance examples"
	@.venv/demo/bin/stagewire conformance examples --summary
	@echo "== a virtual controller in real time: the library connects, homes and moves the stage"
	@.venv/demo/bin/python examples/python/home_and_move.py
	@echo "== the same bytes by hand, on the clock of the virtual controller"
	@.venv/demo/bin/python examples/python/in_memory.py

test: .venv/test/ready tools
	@.venv/test/bin/python tests/run_report.py --measure build/test.json \
		$(MAKE) --no-print-directory checks units others
	@.venv/test/bin/python tests/run_report.py build/junit-units.xml build/junit-others.xml

test-all: test matrix proofs budget

# The seconds of each folder, after make test and any of the other tests.
budget: .venv/test/ready
	@.venv/test/bin/python tests/run_report.py --measured build/test.json --budget $(BUDGET) build/junit-*.xml

# The separate steps of make test and make test-all.
checks: .venv/test/ready
	.venv/test/bin/ruff check .
	.venv/test/bin/ruff format --check .
	.venv/test/bin/codespell
	.venv/test/bin/lint-imports
	.venv/test/bin/mypy

units: .venv/test/ready
	$(PYTEST) -m "not matrix" --junitxml=build/junit-units.xml $(UNITS:%=tests/%)

others: .venv/test/ready
	$(PYTEST) -m "not matrix" --junitxml=build/junit-others.xml $(UNITS:%=--ignore=tests/%)

matrix: .venv/test/ready
	$(PYTEST) -m "matrix and not proof" --junitxml=build/junit-matrix.xml

proofs: .venv/test/ready
	$(PYTEST) -m proof --junitxml=build/junit-proofs.xml

# Line and branch coverage of the library and the virtual controllers. The floor is fail_under in pyproject.toml.
coverage: .venv/test/ready
	.venv/test/bin/python -m pytest -q -n $(WORKERS) -m "not matrix" --cov --cov-report=term $(COVERED)

# Install compilers, emulators and checkers for C if no password is needed. Otherwise list the missing ones.
tools:
	@$(PYTHON) tests/generated/c/tools.py install

generate: .venv/test/ready
	.venv/test/bin/stagewire generate --spec $(SPEC) --out $(OUT)

format: .venv/test/ready
	.venv/test/bin/ruff check --fix .
	.venv/test/bin/ruff format .

archives: .venv/test/ready
	.venv/test/bin/python tools/archives.py --out dist

# Update the committed table of code sizes. REASON states why they change, and is kept in the table.
c-sizes: .venv/test/ready tools
	.venv/test/bin/python tests/generated/c/sizes.py --renew "$(REASON)"

bench: .venv/bench/ready tools
	$(call programs,bench,$(BENCHMARKS))

soak: .venv/test/ready
	$(call programs,test,$(SOAKS))
	.venv/test/bin/python tests/runtime/devices/motion_guard.py --examples 20000
	.venv/test/bin/python tests/runtime/devices/proof_faults.py --requests 100000 --seed $(SEED)

fuzz: .venv/fuzz/ready tools
	.venv/fuzz/bin/python tests/fuzz/atheris_codec.py --executions $(EXECUTIONS) --seed $(SEED)
	.venv/fuzz/bin/python tests/fuzz/memory_growth.py
	.venv/fuzz/bin/python tests/generated/c/libfuzzer.py --executions $(C_EXECUTIONS) --seed $(SEED)
	.venv/fuzz/bin/python tests/fuzz/user_input.py --seconds $(SECONDS) --seed $(SEED)
	.venv/fuzz/bin/python tests/fuzz/virtual_controllers.py --seconds $(SECONDS) --seed $(SEED)

# Third-party software is never needed by the product: a package that cannot be installed is only reported.
interop: .venv/interop/ready
	.venv/interop/bin/python interop/run.py

.venv/demo/ready: pyproject.toml
	$(call environment,demo,generator)

.venv/test/ready: pyproject.toml
	$(call environment,test,dev)

.venv/bench/ready: pyproject.toml
	$(call environment,bench,bench)

.venv/fuzz/ready: pyproject.toml
	$(call environment,fuzz,fuzz)

.venv/interop/ready: pyproject.toml interop/requirements.txt
	$(call environment,interop,conformance)
	@grep -v '^ *\(#\|$$\)' interop/requirements.txt | while read -r package; do \
		.venv/interop/bin/python -m pip install -qq --disable-pip-version-check "$$package" \
			|| echo "not installed: $$package"; \
	done

# $(1) is the environment, $(2) the extra. The environment is recreated when pyproject.toml changes.
define environment
@echo "== setting up .venv/$(1) (once; a minute or two)"
@rm -rf .venv/$(1)
@$(PYTHON) -m venv .venv/$(1)
@.venv/$(1)/bin/python -m pip install -qq --disable-pip-version-check --editable '.[$(2)]'
@touch $@
endef

# $(1) is the environment, $(2) are programs of benchmarks/. All of them run; then it fails if one of them failed.
define programs
@failed=; for program in $(2); do \
	echo "== $$program"; \
	.venv/$(1)/bin/python benchmarks/$$program.py || failed="$$failed $$program"; \
done; \
test -z "$$failed" || { echo "failed:$$failed"; exit 1; }
endef

clean:
	rm -rf .venv build dist .coverage* generator/stagewire_generator/targets/compiled .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache
