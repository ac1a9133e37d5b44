# Two commands do everything on a fresh machine, set-up included:
#   make demo   check the spec, regenerate every binding, run all worked examples
#   make test   formatting, types, import rules and all tests
# Each has its own virtual environment below .venv/.

PYTHON ?= python3
SPEC := spec
OUT := generated
REPORT := build/junit.xml

.PHONY: demo test generate format bench clean

demo: .venv/demo/ready
	@echo "== the spec: schemas, layouts, witness, errata"
	@.venv/demo/bin/stagewire check $(SPEC)
	@echo "== every binding, regenerated in memory and compared byte by byte"
	@.venv/demo/bin/stagewire generate --spec $(SPEC) --out $(OUT) --check
	@echo "== every worked example of the documents, in both directions"
	@.venv/demo/bin/stagewire conformance examples

test: .venv/test/ready
	.venv/test/bin/ruff check .
	.venv/test/bin/ruff format --check .
	.venv/test/bin/mypy
	.venv/test/bin/lint-imports
	@mkdir -p $(dir $(REPORT))
	.venv/test/bin/python -m pytest -q -n auto --junitxml=$(REPORT)
	.venv/test/bin/python tests/no_skips.py $(REPORT)

generate: .venv/test/ready
	.venv/test/bin/stagewire generate --spec $(SPEC) --out $(OUT)

format: .venv/test/ready
	.venv/test/bin/ruff check --fix .
	.venv/test/bin/ruff format .

bench: .venv/test/ready
	.venv/test/bin/python benchmarks/framing_time.py
	.venv/test/bin/python benchmarks/framing_experiment.py

.venv/demo/ready: pyproject.toml
	$(call environment,demo,generator)

.venv/test/ready: pyproject.toml
	$(call environment,test,dev)

# $(1) the environment, $(2) the extra; made anew when pyproject.toml changes
define environment
@echo "== setting up .venv/$(1) (once; a minute or two)"
@rm -rf .venv/$(1)
@$(PYTHON) -m venv .venv/$(1)
@.venv/$(1)/bin/python -m pip install --disable-pip-version-check --editable '.[$(2)]'
@touch $@
endef

clean:
	rm -rf .venv build dist .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache
