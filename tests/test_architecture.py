"""The shape of the code, held by reading its source: who may import whom, and what may be loaded when."""

import ast
import json
import re
import subprocess
import sys
from collections.abc import Iterator, Mapping, Set
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
SOURCE = ROOT / "src" / "lippmann"

#: From the ground up: a package imports only from packages before it. Modules of the root are parts of their own; the
#: package itself offers the API, so it comes after.
ORDER = (
    "_version",
    "printable",
    "wording",
    "errors",
    "progress",
    "progress_bar",
    "json_values",
    "color",
    "runtime",
    "display",
    "optics",
    "display.formats",
    "codecs",
    "scene.values",
    "options",
    "scene.parsing",
    "scene.whitted",
    "scene.volumes",
    "scene",
    "scene.bundled",
    "scene.readers.splats",
    "scene.readers.volumes",
    "scene.readers.vtk",
    "scene.readers.gltf",
    "scene.readers.gltf_animation",
    "scene.readers.tachyon",
    "scene.readers",
    "scene.readers.usd",
    "journal",
    "image",
    "device",
    "device.splats",
    "device.volumes",
    "device.whitted",
    "device.pbr",
    "calibration",
    "quilts",
    "exchange",
    "metrics",
    "rendering.request",
    "rendering.estimate",
    "rendering.transport",
    "rendering.film",
    "rendering.preparation",
    "rendering.sharing",
    "rendering.denoise",
    "rendering.adaptive",
    "rendering.reprojection",
    "rendering",
    "rendering.live",
    "corrected",
    "viewing",
    "tiles",
    "cluster",
    "reproduce",
    "viewer",
    "viewer.calibrate",
    "studio_app",
    "sequences",
    "api",
    "plugins",
    "",
    "cli.shared",
    "cli.commands",
    "cli",
    "__main__",
)

#: Conveniences that reach up, each only from inside a function, so that using the part alone loads nothing more:
#: ``IntegralImage.replay``, ``.refocus`` and its widget.
REACHES_UP = {("image", "viewing"), ("image", "viewer")}

#: The same between modules of one package: ``IntegralImage.save``, ``Quilt.save``.
REACHES_BACK = {("image.integral_image", "image.write"), ("quilts.quilt", "quilts.files")}

#: Packages whose ``__init__`` offers what packages below it in the tree define: it ranks after those.
FACADES = {"display": "display.formats"}

#: The only modules that may use Mitsuba or Dr.Jit; of the scene those that build it on the device, never its readers.
USES_ENGINE = ("runtime.engine", "scene.mitsuba_source", "scene.mitsuba_trial_child", "device", "rendering")
#: Of those, the ones that may load it by being imported.
LOADS_ENGINE = ("device", "rendering")

#: What a user imports; none of it may load the engine, which has to choose its library first.
ENTRANCES = (
    "",
    "api",
    "plugins",
    "cli",
    "runtime.engine",
    "journal",
    "display",
    "image",
    "scene.scene",
    "scene.readers.load",
    "rendering",
    "viewing.replay",
    "viewing.refocus",
    "viewing.video_frames",
    "quilts.quilt",
    "quilts.files",
    "quilts.weave",
    "sequences.frames",
    "calibration",
    "exchange",
    "metrics",
    "viewer.server",
    "viewer.notebook",
)


@dataclass(frozen=True)
class Import:
    """``importer`` (dotted, below the package) imports ``imported`` (a full name) in ``line``."""

    importer: str
    imported: str
    line: int
    inside_function: bool
    for_annotations: bool

    @property
    def ours(self) -> str | None:
        """The imported module below the package, or ``None`` for others' packages."""
        if self.imported == "lippmann":
            return ""
        return self.imported.removeprefix("lippmann.") if self.imported.startswith("lippmann.") else None


def part(module: str) -> str:
    """The package that a module lies in, of those that have a rank."""
    while module not in ORDER and "." in module:
        module = module.rpartition(".")[0]
    return module


def inside(module: str, parts: tuple[str, ...]) -> bool:
    return any(module == name or module.startswith(f"{name}.") for name in parts)


@cache
def modules() -> dict[str, Path]:
    """All modules below the package by dotted name; the package itself is the empty name."""
    found = {}
    for path in sorted(SOURCE.rglob("*.py")):
        names = path.relative_to(SOURCE).with_suffix("").parts
        found[".".join(names[:-1] if names[-1] == "__init__" else names)] = path
    return found


def imports_of(module: str, source: str) -> Iterator[Import]:
    """All imports of ``source``, those inside functions and under ``if TYPE_CHECKING`` too."""
    is_package = modules().get(module, Path()).name == "__init__.py"

    def visit(node: ast.AST, in_function: bool, for_annotations: bool) -> Iterator[Import]:
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield Import(module, alias.name, node.lineno, in_function, for_annotations)
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                above = ["lippmann", *module.split(".")] if module else ["lippmann"]
                above = above[: len(above) + is_package - node.level]
                base = ".".join([*above, base] if base else above)
            for alias in node.names:
                # "from lippmann.runtime import engine" names a module, "from lippmann import Display" what the package
                # offers.
                whole = f"{base}.{alias.name}"
                imported = whole if whole.removeprefix("lippmann.") in modules() else base
                yield Import(module, imported, node.lineno, in_function, for_annotations)
        is_guard = isinstance(node, ast.If) and getattr(node.test, "id", "") == "TYPE_CHECKING"
        below = in_function or isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef))
        for child in ast.iter_child_nodes(node):
            if not isinstance(child, ast.expr):  # no import stands in an expression
                yield from visit(child, below, for_annotations or is_guard)

    return visit(ast.parse(source), False, False)


@cache
def imports() -> tuple[Import, ...]:
    return tuple(
        found for module, path in modules().items() for found in imports_of(module, path.read_text(encoding="utf-8"))
    )


def is_engine(found: Import) -> bool:
    return found.imported.partition(".")[0] in ("mitsuba", "drjit")


def breaks_order(found: Import) -> bool:
    if found.ours is None:
        return False
    importer, imported = part(found.importer), part(found.ours)
    if importer == imported or ((importer, imported) in REACHES_UP and found.inside_function):
        return False
    if found.importer in FACADES and imported == FACADES[found.importer]:
        return False
    rank = {name: position for position, name in enumerate(ORDER)}
    return rank.get(imported, len(ORDER)) > rank.get(importer, -1)


def imports_inside_packages() -> dict[str, set[str]]:
    """What every module imports of its own package, inside functions too, but for :data:`REACHES_BACK`."""
    graph: dict[str, set[str]] = {}
    for found in imports():
        if found.ours is None or found.importer == found.ours or part(found.importer) != part(found.ours):
            continue
        if not ((found.importer, found.ours) in REACHES_BACK and found.inside_function):
            graph.setdefault(found.importer, set()).add(found.ours)
    return graph


def cycles(graph: Mapping[str, Set[str]]) -> list[list[str]]:
    """Groups of modules of which each imports every other, directly or through others."""
    reached: dict[str, set[str]] = {}
    for module in graph:
        waiting, reached[module] = [module], set()
        while waiting:
            new = graph.get(waiting.pop(), set()) - reached[module]
            reached[module] |= new
            waiting += new
    groups = {
        frozenset(other for other in found if module in reached.get(other, ()))
        for module, found in reached.items()
        if module in found
    }
    return sorted(sorted(group) for group in groups)


def places(found: list[Import]) -> list[str]:
    return [f"{modules()[item.importer].relative_to(ROOT)}:{item.line} imports {item.imported}" for item in found]


def test_every_part_has_its_place_in_the_order():
    assert {part(module) for module in modules()} <= set(ORDER)


@pytest.mark.long
def test_parts_import_only_from_parts_before_them():
    assert places([found for found in imports() if breaks_order(found)]) == []


@pytest.mark.parametrize(
    ("module", "source", "broken"),
    [
        ("display.display", "from lippmann.errors import DisplayError", False),
        ("display.display", "from lippmann.display.panel import Panel", False),
        ("display.display", "from .panel import Panel", False),
        ("display.display", "import lippmann.scene.readers.load", True),
        ("display.display", "from lippmann import scene", True),
        ("display.display", "from lippmann import Display", True),
        ("display.display", "from ..scene.load import load_scene", True),
        ("display.display", "def f():\n    import lippmann.cli", True),
        ("image.views", "def f():\n    from lippmann.viewing.replay import replay", False),
        ("image.views", "from lippmann.viewing.replay import replay", True),
        ("cli", "import lippmann", False),
    ],
)
def test_the_order_is_read_rightly(module, source, broken):
    assert any(breaks_order(found) for found in imports_of(module, source)) == broken


@pytest.mark.slow
def test_modules_of_a_package_do_not_import_each_other_in_a_circle():
    assert cycles(imports_inside_packages()) == []


@pytest.mark.parametrize(
    ("graph", "expected"),
    [
        ({}, []),
        ({"a": {"b", "c"}, "b": {"c"}}, []),
        ({"a": {"b"}, "b": {"a"}}, [["a", "b"]]),
        ({"a": {"b"}, "b": {"c"}, "c": {"b", "d"}}, [["b", "c"]]),
        ({"a": {"b"}, "b": {"c"}, "c": {"a"}, "x": {"a", "y"}, "y": {"x"}}, [["a", "b", "c"], ["x", "y"]]),
    ],
)
def test_a_circle_is_found(graph, expected):
    assert cycles(graph) == expected


def test_only_the_modules_that_render_use_the_engine():
    foreign = [found for found in imports() if is_engine(found) and not found.for_annotations]
    assert places([found for found in foreign if not inside(found.importer, USES_ENGINE)]) == []
    at_import = [found for found in foreign if not found.inside_function]
    assert places([found for found in at_import if not inside(found.importer, LOADS_ENGINE)]) == []


#: Formats with heavy libraries: a folder each, the libraries that it alone imports, and who may come in by its door.
#: Readers are named in the registry, and so loaded when a file of theirs is read.
HEAVY: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "scene.readers.blend": (("bpy", "mathutils"), ()),
    "scene.readers.heif": (("pillow_heif",), ("scene.readers.depth_photo", "quilts.photos")),
    "scene.readers.lidar": (("laspy", "lazrs"), ()),
    "scene.readers.molecules": (("gemmi",), ()),
    "scene.readers.usd": (("pxr",), ()),
    "scene.readers.volumes": (("nibabel", "pydicom", "openvdb", "pyopenvdb"), ()),
    "scene.readers.vtk": (("pyvista", "vtkmodules", "vtk"), ()),
    "cluster": (("distributed", "dask", "bokeh", "cryptography"), ("cli.commands.cluster",)),
}


@pytest.mark.slow
@pytest.mark.parametrize("folder", HEAVY)
def test_a_heavy_format_is_a_folder_with_one_door(folder):
    libraries, guests = HEAVY[folder]
    outside = [found for found in imports() if not inside(found.importer, (folder,))]
    entering = [found for found in outside if found.ours is not None and inside(found.ours, (folder,))]
    lazy = [
        found for found in entering if found.importer in guests and (found.inside_function or found.for_annotations)
    ]
    assert places([found for found in entering if found not in lazy]) == []
    foreign = [found for found in outside if found.imported.partition(".")[0] in libraries]
    assert places(foreign) == []


def loaded_with(module: str) -> set[str]:
    """Names of all that importing ``module`` imports in turn, as far as it is written outside functions."""
    loaded, waiting = set(), [module]
    while waiting:
        name = waiting.pop()
        if name in loaded:
            continue
        loaded.add(name)
        waiting += [name.rpartition(".")[0]]  # a package is imported before what lies in it
        for found in imports_with().get(name, ()):
            if found.ours is None:
                loaded.add(found.imported.partition(".")[0])
            else:
                waiting.append(found.ours)
    return loaded


@cache
def imports_with() -> dict[str, list[Import]]:
    """What importing each module imports itself: imports outside functions."""
    found: dict[str, list[Import]] = {}
    for each in imports():
        if not (each.inside_function or each.for_annotations):
            found.setdefault(each.importer, []).append(each)
    return found


@pytest.mark.parametrize("module", [name for name in ENTRANCES if name in modules()])
def test_entrances_do_not_load_the_engine(module):
    assert loaded_with(module) & {"mitsuba", "drjit"} == set()


@pytest.mark.parametrize("module", [name for name in ("lippmann", "lippmann.cli") if name[9:] in modules()])
def test_import_is_light(module):
    code = f"import sys; import {module}; print(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    heavy = {
        "numpy",
        "scipy",
        "PIL",
        "mitsuba",
        "drjit",
        "trimesh",
        "pygltflib",
        "OpenEXR",
        "av",
        "imagecodecs",
        "tifffile",
        "h5py",
        "zarr",
    }
    assert set(run.stdout.split()) & heavy == set()


def project_files() -> Iterator[Path]:
    for folder in ("src", "tests", "docs", "examples", "benchmarks", "scripts", ".ci"):
        yield from (ROOT / folder).rglob("*")
    yield from ROOT.iterdir()


TEXT = {".py", ".toml", ".md", ".sh", ".cfg", ".yml", ".yaml", ".json", ".html", ".js", ".css", ".txt"}
#: Homes and working folders of one machine, at the start of an absolute path.
MACHINE_PATH = re.compile(r"(?<![\w.~:/$}*-])/(?:root|work|home|Users|mnt|tmp)/\w")


def test_no_path_of_one_machine():
    found = []
    for path in project_files():
        if not path.is_file() or (path.suffix not in TEXT and path.name not in ("Makefile", "run")):
            continue
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
            if MACHINE_PATH.search(line):
                found.append(f"{path.relative_to(ROOT)}:{number}: {line.strip()}")
    assert found == []


@pytest.mark.parametrize("line", ["see /" + "home/me/x.py", 'open("/' + "tmp/x.png" + '")', "=/" + "work/a"])
def test_paths_of_one_machine_are_recognised(line):
    assert MACHINE_PATH.search(line)


#: How ``lippmann render`` gets from the command to the file, in the order in which it first calls each function;
#: CONTRIBUTING.md shows it to readers.
WALK = (
    "cli.commands.render.render",
    "rendering.picture.render_picture",
    "rendering.request.plan.make_plan",
    "rendering.session.open_session",
    "rendering.methods.trace",
    "rendering.methods.trace_samples",
    "rendering.film.sample_batches.add",
    "rendering.transport.path.sample_with_hit",
    "image.integral_image.save",
    "image.write.write_picture",
    "image.encoding.encode_values",
    "codecs.png.encode_png",
)

#: How large the centre of the program may be. Raised by hand alone, and only where a user is worth it.
MOST_LINES = 14_380
MOST_CONSTANTS = 119
MOST_BRANCHES = 184
#: Files of which a default render calls a function, and calls from a file to one of a part above its own.
MOST_FILES = 90
MOST_CLIMBING = 4

#: What decides how a picture is made, below ``rendering``: packages and modules.
DECIDES = ("request", "preparation", "adaptive", "methods", "session", "picture", "provenance")

#: Decorators, by whose functions others are called: these call for whoever calls them.
DECORATORS = {
    "cli.shared.command_options",
    "device.syntax",
    "options.option",
    "runtime.engine_lock",
    "runtime.row_threads",
}

#: Writes which function called which of the program's files, in the order of the first calls, as JSON into the file
#: that the last word names. Bodies of modules and classes are no functions.
TRACING = """
import json, sys, threading
from pathlib import Path
from types import FunctionType

file, source = sys.argv.pop(), sys.argv.pop()
calls = {}

def name(code):
    return code.co_filename[len(source) + 1 :], code.co_qualname

def note(frame, event, argument):
    caller = frame.f_back
    if event != "call" or caller is None or not frame.f_code.co_flags & 2:
        return
    if frame.f_code.co_filename.startswith(source):
        while name(caller.f_code)[0] in DECORATORS and caller.f_back is not None:
            caller = caller.f_back
        is_ours = caller.f_code.co_filename.startswith(source) and caller.f_code.co_flags & 2
        calls[name(caller.f_code) if is_ours else None, name(frame.f_code)] = None

threading.setprofile(note)
sys.setprofile(note)
from lippmann.cli import main
try:
    main()
finally:
    sys.setprofile(None)
    json.dump(list(calls), open(file, "w"))
"""


@dataclass(frozen=True)
class Call:
    """A function of the program that another of its functions called; None where foreign code called it."""

    caller: str | None
    module: str
    function: str


@pytest.fixture(scope="module")
def default_render(engine, tmp_path_factory) -> list[Call]:
    """All calls between functions of a default render, in the order in which each was first made."""
    del engine  # the child would fail without
    folder = tmp_path_factory.mktemp("traced")
    preset = (SOURCE / "display" / "presets" / "seed-lenticular.toml").read_text("utf-8")
    (folder / "small.toml").write_text(preset.replace("= 512", "= 64"), "utf-8")
    decorators = {f"{name.replace('.', '/')}.py" for name in DECORATORS}
    program = f"DECORATORS = {decorators!r}{TRACING}"
    words = ["render", "teapot", "-d", "small.toml", "-q", "-o", "picture.png"]
    file = folder / "calls.json"
    command = [sys.executable, "-W", "ignore", "-c", program, *words, str(SOURCE), str(file)]
    subprocess.run(command, cwd=folder, check=True)
    names = {str(path.relative_to(SOURCE)): module for module, path in modules().items()}
    return [
        Call(caller and names[caller[0]], names[path], function)
        for caller, (path, function) in json.loads(file.read_text(encoding="utf-8"))
    ]


def test_a_render_is_followed_in_twelve_hops(default_render):
    first_calls = dict.fromkeys(f"{call.module}.{call.function.rpartition('.')[2]}" for call in default_render)
    assert [name for name in first_calls if name in WALK] == list(WALK)


def test_a_default_render_enters_few_files(default_render):
    files = {call.module for call in default_render}
    assert len(files) <= MOST_FILES, sorted(files)


def test_few_calls_of_a_default_render_climb(default_render):
    rank = {name: position for position, name in enumerate(ORDER)}
    climbing = {
        (call.caller, call.module)
        for call in default_render
        if call.caller is not None and rank[part(call.module)] > rank[part(call.caller)]
    }
    assert len(climbing) <= MOST_CLIMBING, sorted(climbing)


@cache
def rendering_trees() -> dict[str, ast.Module]:
    """The syntax trees of ``rendering`` by dotted name below it."""
    sources = {name: path for name, path in modules().items() if inside(name, ("rendering",))}
    return {name.removeprefix("rendering."): ast.parse(path.read_text("utf-8")) for name, path in sources.items()}


def constants_of(tree: ast.Module, *, is_tuning: bool) -> int:
    """Numbers that stand in assignments of a module, and in the classes of one of tuned constants."""
    bodies = [tree.body, *(each.body for each in tree.body if is_tuning and isinstance(each, ast.ClassDef))]
    values = [each.value for body in bodies for each in body if isinstance(each, (ast.Assign, ast.AnnAssign))]
    return sum(numbers_in(value) for value in values if value is not None)


def numbers_in(value: ast.expr) -> int:
    """How many numbers, or sums and products of such, an expression names."""
    if isinstance(value, (ast.Tuple, ast.List)):
        return sum(numbers_in(each) for each in value.elts)
    if isinstance(value, ast.UnaryOp):
        return numbers_in(value.operand)
    if isinstance(value, ast.BinOp):
        return min(1, numbers_in(value.left) + numbers_in(value.right))
    return int(isinstance(value, ast.Constant) and type(value.value) in (int, float))


def test_rendering_is_short():
    lines = sum(path.read_text("utf-8").count("\n") for path in (SOURCE / "rendering").rglob("*.py"))
    assert lines <= MOST_LINES


def test_few_constants_are_tuned():
    found = {name: constants_of(tree, is_tuning=name.endswith("tuning")) for name, tree in rendering_trees().items()}
    assert sum(found.values()) <= MOST_CONSTANTS, {name: count for name, count in found.items() if count}


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("A = 1\nB, C = 2, -3.0\nD: int = 1 << 4", 4),
        ("A = True\nB = 'x'\nC = f(2)\ndef f(): x = 1", 0),
        ("class Tuning:\n a: int = 1\n b: tuple = (2, (3, 4))\n c = other", 4),
    ],
)
def test_constants_are_counted(source, expected):
    assert constants_of(ast.parse(source), is_tuning=True) == expected


def test_few_branches_decide():
    found = {
        name: sum(isinstance(node, (ast.If, ast.IfExp, ast.match_case)) for node in ast.walk(tree))
        for name, tree in rendering_trees().items()
        if inside(name, DECIDES)
    }
    assert sum(found.values()) <= MOST_BRANCHES, found


#: Names by which integrators go in the source.
INTEGRATORS = re.compile(r"(^|_)(integrator|paths)$")


def writes_to_integrators(source: str) -> list[int]:
    """Lines that assign an attribute of an integrator, or set one by its name, outside a class's own ``__init__``."""
    found = []

    def is_integrator(node: ast.AST) -> bool:
        name = node.id if isinstance(node, ast.Name) else node.attr if isinstance(node, ast.Attribute) else ""
        return INTEGRATORS.search(name) is not None

    for node in ast.walk(ast.parse(source)):
        written: list[ast.expr] = []
        if isinstance(node, ast.Assign):
            written = [part for target in node.targets for part in ast.walk(target) if isinstance(part, ast.Attribute)]
        elif isinstance(node, (ast.AugAssign, ast.AnnAssign)):
            written = [node.target]
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in ("setattr", "delattr"):
            found += [node.lineno] if is_integrator(node.args[0]) else []
        found += [part.lineno for part in written if isinstance(part, ast.Attribute) and is_integrator(part.value)]
        if isinstance(node, ast.ClassDef) and node.name.endswith("Integrator"):
            methods = [each for each in node.body if isinstance(each, ast.FunctionDef) and each.name != "__init__"]
            stores = [part for each in methods for part in ast.walk(each) if isinstance(part, ast.Attribute)]
            found += [
                part.lineno
                for part in stores
                if isinstance(part.ctx, ast.Store) and isinstance(part.value, ast.Name) and part.value.id == "self"
            ]
    return found


def test_integrators_are_written_by_their_own_init_alone():
    """What a picture needs is handed over when an integrator is made: see ``rendering.preparation``."""
    found = {
        f"{path.relative_to(ROOT)}:{line}"
        for path in (SOURCE / "rendering").rglob("*.py")
        for line in writes_to_integrators(path.read_text(encoding="utf-8"))
    }
    assert found == set()


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("integrator.gain = 1", [1]),
        ("self._integrator.gain, x = 1, 2", [1]),
        ("setattr(paths, name, 1)", [1]),
        ("integrator.depth += 1", [1]),
        ("class PathIntegrator:\n def __init__(self): self.a = 1\n def b(self): self.a = 2", [3]),
        ("self._integrator = integrator", []),
        ("integrator = integrator.lit_by(light)", []),
    ],
)
def test_writes_to_integrators_are_found(source, expected):
    assert writes_to_integrators(source) == expected
