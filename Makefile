# Two commands do everything: `make reports` and `make test`. Both set up what they need first.

export OPENBLAS_NUM_THREADS := 1
export PATH := $(CURDIR)/.venv/bin:$(PATH)

.PHONY: reports test docs first-page proof proof-small setup lint lock clean

reports: setup
	snakemake

test: lint
	pytest -n 2 --dist loadgroup $(PYTEST_ARGS)

# The pages that are made from the code, and the documentation as a site in build/site.
docs: setup
	python scripts/reference.py docs
	mkdocs build --strict

# The picture on the first page of the documentation: page 1 of a report.
first-page: reports
	python scripts/first_page.py reports/kr160-side/report.pdf docs/figures/first-page.png

# Judges the commit that is checked out, by docs/protocol.md; goes on where it was stopped.
OBSERVABLE := force joint_force deformation waviness flatness lobes
BATCHES := 150
proof: setup
	for observable in $(OBSERVABLE); do \
	    python -m proof judge --observable $$observable --batches $(BATCHES) \
	        $(if $(BASELINES),--baselines) || exit 1; \
	done

# Blind batches, few of them: fails where a demand is missed by more than chance.
proof-small: setup
	rm -rf build/proof
	python -m proof make build/proof --batches 8 --seed 9 --style a
	python -m proof run build/proof
	python -m proof open build/proof --strict

lint: setup
	ruff check .
	ruff format --check .
	mypy
	snakefmt --check Snakefile workflow
	snakemake --lint

setup:
	@scripts/setup.sh

# Pins what pyproject.toml asks for, with hashes and without addresses. Needs pip-tools.
lock:
	CUSTOM_COMPILE_COMMAND="make lock" pip-compile pyproject.toml --output-file requirements.lock --extra dev \
	    --build-deps-for editable --allow-unsafe --strip-extras --generate-hashes \
	    --no-emit-options --no-emit-index-url --no-emit-find-links --no-emit-trusted-host

clean:
	rm -rf data/processed reports logs .snakemake
