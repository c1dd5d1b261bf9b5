# SPDX-License-Identifier: GPL-3.0-or-later
# Tests and demo, in the environments that the launcher makes on first use. SERIES="5.2 4.5" names the Blenders to test;
# by default every one whose Python is found.

SERIES ?=
ARGUMENTS ?=

.PHONY: test unit gpu gui demo nightly bench zip lint

test:
	@./scripts/test --quick --beside tests/gui $(SERIES) -- tests $(ARGUMENTS)

unit:
	@./scripts/test --quick $(SERIES) -- tests/unit $(ARGUMENTS)

gpu:
	@./scripts/test --quick $(SERIES) -- tests/gpu $(ARGUMENTS)

gui:
	@./scripts/test --quick $(or $(firstword $(SERIES)),5.2) -- tests/gui $(ARGUMENTS)

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
