# SPDX-License-Identifier: GPL-3.0-or-later
# Tests and demo, in the environments that the launcher makes on first use. SERIES="5.2 4.5" names the Blenders to test;
# by default every one whose Python is found.

SERIES ?=
ARGUMENTS ?=

.PHONY: test unit gpu gui demo nightly bench zip lint

test:
	@./scripts/test $(SERIES) -- tests -m "not nightly" $(ARGUMENTS)

unit:
	@./scripts/test $(SERIES) -- tests/unit -m "not nightly" $(ARGUMENTS)

gpu:
	@./scripts/test $(SERIES) -- tests/gpu -m "not nightly" $(ARGUMENTS)

gui:
	@./scripts/test $(or $(firstword $(SERIES)),5.2) -- tests/gui -m "not nightly" $(ARGUMENTS)

nightly:
	@./scripts/test $(SERIES) -- tests $(ARGUMENTS)

demo:
	@./gridlight demo -o out/demo

bench:
	@./gridlight bench peers $(ARGUMENTS)

# The extension for each platform, in out/zip.
zip:
	@"$$(./gridlight --environment)" -I scripts/build_zip.py $(ARGUMENTS)

# ruff and mypy, in an environment of their own.
lint:
	@./scripts/lint
