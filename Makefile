# SPDX-License-Identifier: GPL-3.0-or-later
# Tests and demo, in the environments that the launcher makes on first use. SERIES="5.2 4.5" names the Blenders to test;
# by default every one whose Python is found.

SERIES ?=
ARGUMENTS ?=

.PHONY: test unit gpu demo nightly

test:
	@./scripts/test $(SERIES) -- tests -m "not nightly" $(ARGUMENTS)

unit:
	@./scripts/test $(SERIES) -- tests/unit -m "not nightly" $(ARGUMENTS)

gpu:
	@./scripts/test $(SERIES) -- tests/gpu -m "not nightly" $(ARGUMENTS)

nightly:
	@./scripts/test $(SERIES) -- tests $(ARGUMENTS)

demo:
	@./gridlight demo -o out/demo
