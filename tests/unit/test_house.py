# SPDX-License-Identifier: GPL-3.0-or-later
"""The shape of the house, checked on the syntax tree of every file, and what importing it may do."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
ROOMS = ["core", "scene", "gpu_shaders", "bake", "formats", "viewport", "operators", "panels", "cli", "farm"]
PURE_ROOMS = {"core", "formats"}
BLENDER_MODULES = {"bpy", "gpu", "gpu_extras", "mathutils", "bmesh", "blf", "bpy_extras"}
FILES = sorted(path for room in ROOMS for path in (ROOT / room).rglob("*.py"))
SOURCES = sorted([*FILES, ROOT / "__init__.py", *(ROOT / "tests").rglob("*.py"), *(ROOT / "scripts").rglob("*.py")])
SHADERS = sorted([*(ROOT / "gpu_shaders" / "glsl").glob("*.glsl"), *(ROOT / "tests" / "gpu" / "glsl").glob("*.glsl")])
NAMES = [str(path.relative_to(ROOT)) for path in FILES]


def imports_of(path: Path):
    """Yields (line, module) of every import in ``path``, relative ones resolved to ``gridlight.…``."""
    package = ["gridlight", *path.relative_to(ROOT).parts[:-1]]
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            for name in node.names:
                yield node.lineno, name.name
        elif isinstance(node, ast.ImportFrom):
            if not node.level:
                yield node.lineno, node.module
                continue
            base = package[: len(package) - node.level + 1] + (node.module or "").split(".") * bool(node.module)
            for name in node.names:  # "from .. import core" imports a room by name
                yield node.lineno, ".".join([*base, name.name])


@pytest.mark.parametrize("path", FILES, ids=NAMES)
def test_a_room_imports_only_from_rooms_above_it(path):
    room = path.relative_to(ROOT).parts[0]
    allowed = set(ROOMS[: ROOMS.index(room) + 1])
    for line, module in imports_of(path):
        parts = module.split(".")
        if parts[0] == "gridlight":
            assert len(parts) > 1 and parts[1] in allowed, (
                f"{path.name}:{line} imports {module}; {room}/ may use {sorted(allowed)}"
            )
        else:
            assert parts[0] not in ROOMS, f"{path.name}:{line}: import rooms relatively, not as '{module}'"


@pytest.mark.parametrize(
    "path",
    [path for path in FILES if path.relative_to(ROOT).parts[0] in PURE_ROOMS],
    ids=lambda path: str(path.relative_to(ROOT)),
)
def test_core_and_formats_know_no_blender(path):
    for line, module in imports_of(path):
        assert module.split(".")[0] not in BLENDER_MODULES, f"{path.name}:{line} imports {module}"


def test_core_needs_only_numpy_and_the_standard_library():
    for path in (ROOT / "core").rglob("*.py"):
        for line, module in imports_of(path):
            top = module.split(".")[0]
            assert top in {"numpy", "gridlight"} or top in sys.stdlib_module_names, (
                f"{path.name}:{line} imports {module}"
            )


@pytest.mark.parametrize("path", FILES, ids=NAMES)
def test_no_shader_source_in_python_strings(path):
    glsl = re.compile(r"gl_Position|gl_Layer|texelFetch\s*\(|imageStore\s*\(|void\s+main\s*\(|\bvec[234]\s+\w+\s*=")
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            found = glsl.search(node.value)
            assert not found, (
                f"{path.name}:{node.lineno} holds GLSL ('{found.group()}'); it belongs to gpu_shaders/glsl/"
            )


@pytest.mark.parametrize("path", SOURCES, ids=[str(path.relative_to(ROOT)) for path in SOURCES])
def test_file_starts_with_licence_and_purpose(path):
    text = path.read_text(encoding="utf-8")
    assert text.startswith("# SPDX-License-Identifier: GPL-3.0-or-later\n"), "no SPDX line at the top"
    assert ast.get_docstring(ast.parse(text)), "no module docstring"


def check_size(lines):
    assert len(lines) < 400, f"{len(lines)} lines: split it by responsibility"
    long = [number for number, line in enumerate(lines, 1) if len(line) > 120]
    assert not long, f"lines longer than 120: {long}"


@pytest.mark.parametrize("path", SOURCES, ids=[str(path.relative_to(ROOT)) for path in SOURCES])
def test_files_stay_readable(path):
    check_size(path.read_text(encoding="utf-8").splitlines())


@pytest.mark.parametrize("path", SHADERS, ids=[path.name for path in SHADERS])
def test_shaders_are_like_other_files(path):
    """Licence, then what it is for; as long and as wide as others."""
    licence, purpose, *rest = lines = path.read_text(encoding="utf-8").splitlines()
    assert licence == "/* SPDX-License-Identifier: GPL-3.0-or-later */" and purpose.startswith("/* ")
    check_size(lines)
    if path.stem.endswith("_comp"):
        assert any("Dispatch:" in line for line in rest), "no dispatch shape in the header"


def test_importing_the_package_needs_no_blender():
    """A plain import must work where there is no Blender, and must not load it where there is one."""
    program = (
        "import importlib.util, sys\n"
        f"spec = importlib.util.spec_from_file_location('start', {str(ROOT / 'cli' / '__main__.py')!r})\n"
        "start = importlib.util.module_from_spec(spec); spec.loader.exec_module(start); start.load_package()\n"
        "import gridlight.cli.main, gridlight.operators, gridlight.panels, gridlight.formats.probe_file\n"
        "print(sorted({'bpy', 'gpu', 'mathutils'} & set(sys.modules)))\n"
    )
    done = subprocess.run(
        [sys.executable, "-I", "-c", program], capture_output=True, text=True, check=False, timeout=60
    )
    assert (done.returncode, done.stdout.strip()) == (0, "[]"), done.stderr


def test_the_import_rule_can_fail(tmp_path, monkeypatch):
    """The walker sees relative imports of every form."""
    monkeypatch.setattr(sys.modules[__name__], "ROOT", tmp_path)
    (tmp_path / "core").mkdir()
    file = tmp_path / "core" / "x.py"
    file.write_text("from .. import cli\nfrom ..bake import job\nfrom . import grid\ndef f():\n    import bpy.types\n")
    assert [module for _line, module in imports_of(file)] == [
        "gridlight.cli",
        "gridlight.bake.job",
        "gridlight.core.grid",
        "bpy.types",
    ]


def _calls(function: ast.FunctionDef) -> list[str]:
    """Names of what ``function`` calls, in the order of the text; without functions inside it."""
    found, pending = [], list(function.body)
    while pending:
        node = pending.pop()
        if isinstance(node, (ast.FunctionDef, ast.Lambda)):
            continue
        if isinstance(node, ast.Call):
            named = node.func
            name = named.attr if isinstance(named, ast.Attribute) else getattr(named, "id", "")
            found.append(((node.end_lineno, node.end_col_offset), name.lstrip("_")))
        pending.extend(ast.iter_child_nodes(node))
    return [name for _place, name in sorted(found)]


def test_nothing_is_dispatched_between_a_shaders_bindings_and_its_dispatch():
    """What is bound belongs to no shader: the other dispatch would take its place."""
    fills = {"allocate", "allocate_integers", "fill_elements", "copy_elements", "reserve"}
    checked = 0
    for path in sorted((ROOT / "gpu_shaders").glob("*.py")):
        for function in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not isinstance(function, ast.FunctionDef):
                continue
            is_bound = False
            for name in _calls(function):
                assert not (is_bound and name in fills), f"{path.name}: {function.name} calls {name} amid bindings"
                if name == "program":
                    is_bound, checked = True, checked + 1
                elif name.startswith("dispatch"):
                    is_bound = False
    assert checked > 30
