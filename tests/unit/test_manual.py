# SPDX-License-Identifier: GPL-3.0-or-later
"""The manual does not contradict the program: links lead somewhere; commands, options and files that it names exist."""

import importlib
import re
from pathlib import Path

import pytest

pytestmark = pytest.mark.any_version

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md")])
ROOMS = ("core", "scene", "gpu_shaders", "bake", "formats", "viewport", "operators", "panels", "cli", "farm", "tests")
MAKE = re.compile(r"^([a-z]+):", re.MULTILINE)
# What pages say of the program.
LINK = re.compile(r"\]\(([^)\s]+)\)")
COMMAND = re.compile(r"(?:\./gridlight|--command gridlight) (?:(farm) )?([a-z]+)\b([^`|\n]*)")
TARGET = re.compile(r"(?:`|^ {4}|  )make ([a-z]+)", re.MULTILINE)
FILE = re.compile(rf"`((?:{'|'.join(ROOMS)}|docs|scripts)/[\w/]+\.(?:py|glsl|md|txt))")


def anchors(text: str) -> set[str]:
    """What a page's headings are called in links to it."""
    titles = re.findall(r"^#+ (.+)$", text, re.MULTILINE)
    plain = [re.sub(r"[^\w\- ]", "", title.lower()) for title in titles]
    return {title.replace(" ", "-") for title in plain}


@pytest.mark.parametrize("pattern", [LINK, COMMAND, TARGET, FILE], ids=["links", "commands", "targets", "files"])
def test_there_is_something_to_check(pattern):
    """The tests below say nothing of pages in which they find nothing."""
    assert sum(len(pattern.findall(page.read_text(encoding="utf-8"))) for page in PAGES) >= 10


@pytest.mark.parametrize("page", PAGES, ids=[page.name for page in PAGES])
def test_links_lead_somewhere(page):
    text = page.read_text(encoding="utf-8")
    for target in LINK.findall(text):
        if target.startswith("http"):
            continue
        name, _, anchor = target.partition("#")
        path = page.parent / name if name else page
        assert path.exists(), f"{page.name} links to {target}"
        if anchor:
            assert anchor in anchors(path.read_text(encoding="utf-8")), f"{page.name} links to {target}"


def options_of(package: str, command: str) -> set[str]:
    from gridlight.cli.arguments import Parser

    module = importlib.import_module(f"{package}.{command}")
    parser = Parser(prog="gridlight")
    module.add_arguments(parser, in_blender=False)
    return {option for action in parser._actions for option in action.option_strings} | {"--verbose"}


@pytest.mark.parametrize("page", PAGES, ids=[page.name for page in PAGES])
def test_commands_and_options_exist(page):
    from gridlight.cli.main import GRIDLIGHT
    from gridlight.farm.commands import FAMILY as FARM

    for farm, command, words in COMMAND.findall(page.read_text()):
        if command == "farm":
            continue
        family = FARM if farm else GRIDLIGHT
        assert command in family.names, f"{page.name}: {family.program} {command}"
        if command != "bench":  # its parts have options of their own
            known = options_of(family.package, command)
            for option in re.findall(r"(?<!\S)(--[a-z-]+)", words):
                assert option in known, f"{page.name}: {family.program} {command} {option}"


@pytest.mark.parametrize("page", PAGES, ids=[page.name for page in PAGES])
def test_make_targets_exist(page):
    targets = set(MAKE.findall((ROOT / "Makefile").read_text()))
    for target in TARGET.findall(page.read_text()):
        assert target in targets, f"{page.name}: make {target}"


@pytest.mark.parametrize("page", PAGES, ids=[page.name for page in PAGES])
def test_files_that_are_named_exist(page):
    for name in FILE.findall(page.read_text()):
        assert "NAME" in name or (ROOT / name).exists(), f"{page.name} names {name}"


def test_every_export_format_is_told_of_and_has_a_title():
    """How far each was tried stands in the table of docs/export.md; "no" means that no engine has run it."""
    from gridlight.formats.export import TARGETS
    from gridlight.operators.export_targets import TARGET_ITEMS

    text = (ROOT / "docs" / "export.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| ([\w, -]+) \| ([^|]+) \|", text, re.MULTILINE)
    told = {name: how for names, how in rows for name in names.split(", ")}
    titles = {name: title for name, title, _description in TARGET_ITEMS}
    for name, module in TARGETS.items():
        assert told.get(name, "").startswith("no") != module.RUN_IN_ENGINE and name in told, f"docs/export.md: {name}"
        assert titles[name] != name, f"{name} has no title in operators/export_targets.py"
