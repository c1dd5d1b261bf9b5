# SPDX-License-Identifier: GPL-3.0-or-later
# Tests and demo, in the environments that the launcher makes on first use; 'make help' lists them. SERIES="5.2 4.5"
# names the Blenders to test; by default every one whose Python is found.

SERIES ?=
ARGUMENTS ?=

.PHONY: help test unit gpu gui demo nightly bench zip lint

# What there is: targets and the line above each.
help:
	@awk '/^# /{line = substr($$0, 3)} /^[a-z]+:/{printf "make %-8s %s\n", substr($$1, 1, length($$1) - 1), line} !/^# /{line = ""}' Makefile

# Everything but the nightly ones, 25 minutes on two cores with both Blenders.
test:
	@./scripts/test --quick --beside tests/gui $(SERIES) -- tests $(ARGUMENTS)

# What needs no Blender, a minute.
unit:
	@./scripts/test --quick $(SERIES) -- tests/unit $(ARGUMENTS)

# The shaders.
gpu:
	@./scripts/test --quick $(SERIES) -- tests/gpu $(ARGUMENTS)

# A whole Blender with a window.
gui:
	@./scripts/test --quick $(or $(firstword $(SERIES)),5.2) -- tests/gui $(ARGUMENTS)

# Also the long ones, all with both Blenders.
nightly:
	@./scripts/test $(SERIES) -- tests $(ARGUMENTS)

# The gallery, baked into out/demo.
demo:
	@./gridlight demo -o out/demo

# Speed against error, peers side by side.
bench:
	@./gridlight bench peers $(ARGUMENTS)

# What users install: the extension for each platform, into out/zip.
zip:
	@"$$(./gridlight --environment)" -I scripts/build_zip.py $(ARGUMENTS)

# ruff, and mypy with Blender's stubs.
lint:
	@./scripts/lint
