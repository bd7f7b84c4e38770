"""Start and diagnosis of the rendering engine; the only module that selects a Mitsuba variant and an LLVM library.

:func:`start` imports Mitsuba and Dr.Jit once it has selected the library; no code imports them before.
:func:`diagnose` reports what a render would use and tests it in a child process.
"""

from __future__ import annotations

import contextlib
import ctypes
import functools
import json
import os
import platform
import re
import subprocess
import sys
import time
import typing
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Literal, cast

from lippmann.errors import EngineError, UsageError
from lippmann.runtime import llvm, machine
from lippmann.runtime.child_python import python_command
from lippmann.runtime.engine_lock import exclusive

DeviceChoice = Literal["auto", "cpu", "gpu"]
DEVICES: tuple[DeviceChoice, ...] = ("auto", "cpu", "gpu")
VARIANTS: dict[str, Literal["cpu", "gpu"]] = {"llvm_ad_rgb": "cpu", "cuda_ad_rgb": "gpu"}

_REINSTALL = "reinstall Lippmann: pip install --force-reinstall lippmann"
_PROBE_SECONDS = 120

_set_here: str | None = None  # the variant that `start` set last; any other was set by the caller


@dataclass(frozen=True)
class Engine:
    """A running engine.

    Attributes
    ----------
    variant:
        Mitsuba variant, ``llvm_ad_rgb`` or ``cuda_ad_rgb``.
    device:
        ``cpu`` or ``gpu``.
    threads:
        CPU threads.
    llvm_version:
        Of the LLVM library; None on the GPU.
    gpu_name:
        Name of the GPU; None on the CPU.
    """

    variant: str
    device: Literal["cpu", "gpu"]
    threads: int
    llvm_version: str | None = None
    gpu_name: str | None = None


def start(device: DeviceChoice = "auto", threads: int | None = None) -> Engine:
    """Start the engine, or change the device and threads of the running one.

    The first call takes about half a second, later ones almost none.

    Parameters
    ----------
    device:
        ``cpu``, ``gpu`` or ``auto``: the Mitsuba variant that the caller has set if it is one of :data:`VARIANTS`, else
        the GPU if it can be used, else the CPU.
    threads:
        CPU threads, at least 1 and at most one per core that the process may use; None for all of these.

    Raises
    ------
    UsageError
        If an argument is out of range.
    EngineError
        If the device cannot be used on this machine; the message names the fix. LLVM libraries that may crash the
        process are never used.
    """
    global _set_here
    if device not in DEVICES:
        raise UsageError.unknown("device", device, DEVICES)
    if threads is not None and threads < 1:
        raise UsageError(f"{threads} is out of range", parameter="threads", rule="it must be at least 1")
    with exclusive():
        library = None if "drjit" in sys.modules else _point_to_llvm(device)
        dr, mi = _load()
        search_package_alone(mi)
        kind = _resolve(device, dr, mi)
        engine = _on_gpu() if kind == "gpu" else _on_cpu(dr, library)
        if mi.variant() != engine.variant:
            try:
                with _hints_compiled_at_use(), _syntax_at_first_call(dr):
                    mi.set_variant(engine.variant)
            except ImportError as error:
                raise EngineError(f"Mitsuba cannot use '{engine.variant}': {error}", fix=_REINSTALL) from error
            _set_here = engine.variant
        mi.set_log_level(mi.LogLevel.Error)
        dr.set_log_level(dr.LogLevel.Error)
        cores = machine.usable_cores()
        count = min(threads or cores, cores)
        if dr.thread_count() != count:
            dr.set_thread_count(count)
        return replace(engine, threads=count)


def runs_on_gpu() -> bool:
    """Whether an engine is running, and on the GPU."""
    mitsuba = sys.modules.get("mitsuba")
    return mitsuba is not None and VARIANTS.get(mitsuba.variant()) == "gpu"


def _point_to_llvm(device: DeviceChoice) -> llvm.Library | None:
    """Select the LLVM library for Dr.Jit, which is not loaded yet."""
    try:
        library = llvm.choose()
    except EngineError as error:
        forced_wrong = error.where == llvm.PATH_VARIABLE
        if device == "gpu" or (device == "auto" and not forced_wrong and machine.find_gpu()):
            return None  # Dr.Jit may find another library, but compiles nothing with it on the GPU
        raise
    os.environ[llvm.PATH_VARIABLE] = str(library.path)
    return library


def _load() -> tuple[Any, Any]:
    try:
        machine.keep_freed_memory()
        # Dr.Jit loads LLVM in the background, during the import of Mitsuba.
        with _hints_compiled_at_use():
            import drjit

        with _syntax_at_first_call(drjit):
            import mitsuba
    except (ImportError, NameError) as error:
        # Dr.Jit raises NameError while it reports a missing library: the reason is in the context.
        reason = error.__context__ if isinstance(error, NameError) and error.__context__ else error
        raise EngineError(f"Mitsuba cannot be loaded: {reason}", fix=_fix_of_import(str(reason))) from error
    return drjit, mitsuba


@contextlib.contextmanager
def _hints_compiled_at_use() -> Iterator[None]:
    """Let :mod:`typing` keep the texts of type hints as they are: it evaluates a text as it evaluates code.

    Dr.Jit's import makes hints of 2500 texts, and no render evaluates one: compiling them is two fifths of its time.
    """
    names = vars(typing)
    names["compile"] = lambda text, *_: text  # in front of the built-in function
    try:
        yield
    finally:
        del names["compile"]


@contextlib.contextmanager
def _syntax_at_first_call(dr: Any) -> Iterator[None]:
    """Let :func:`drjit.syntax` transform kernels when they are first called.

    Mitsuba's differentiable integrators are loaded with it and with a variant: each kernel's source is parsed and
    compiled again, and no render here calls one.
    """
    transform = dr.syntax

    def syntax(kernel: Callable[..., Any] | None = None, **options: Any) -> Callable[..., Any]:
        if kernel is None or options:
            return cast("Callable[..., Any]", transform(kernel, **options))

        @functools.wraps(kernel)
        def call(*arguments: Any, **keywords: Any) -> Any:
            return transformed()(*arguments, **keywords)

        transformed = functools.cache(lambda: transform(kernel))
        return call

    dr.syntax = syntax
    try:
        yield
    finally:
        dr.syntax = transform


def search_package_alone(mi: Any) -> None:
    """Restrict Mitsuba's search for plugins and tables to its own package.

    By default it searches the working directory first and runs the code of any ``plugins/NAME.so`` there.
    """
    resolver = mi.file_resolver()
    resolver.clear()
    resolver.append(str(Path(mi.__file__).resolve().parent))


def _fix_of_import(reason: str) -> str:
    if "libatomic.so" in reason:  # the only system library of Mitsuba that Debian may lack
        return "install it: sudo apt-get install libatomic1"
    return _REINSTALL


def _resolve(device: DeviceChoice, dr: Any, mi: Any) -> Literal["cpu", "gpu"]:
    current = mi.variant()
    if device == "auto" and current in VARIANTS and current != _set_here:
        return VARIANTS[current]
    if device == "cpu":
        return "cpu"
    obstacle = machine.gpu_obstacle(dr)
    if device == "gpu" and obstacle:
        raise EngineError(obstacle, where="device 'gpu'", fix="render on the CPU: device 'cpu'")
    return "cpu" if obstacle else "gpu"


def _on_cpu(dr: Any, library: llvm.Library | None) -> Engine:
    if not dr.has_backend(dr.JitBackend.LLVM):
        library = library or llvm.choose()  # its error, if any, explains more
        raise EngineError(
            f"the LLVM library '{library.path}' could not be used{_load_error(library.path)}",
            rule="it has to load, and the processor has to know AVX and FMA (x86) or NEON (ARM)",
            fix=f"install another: {llvm.install_command()}",
        )
    version = tuple(dr.detail.llvm_version())
    if version[0] < llvm.OLDEST:
        llvm.choose()  # raises a better error if there is no other library
        raise EngineError(
            f"Dr.Jit has loaded LLVM {version[0]}, which is too old",
            rule=f"LLVM {llvm.OLDEST} or newer is needed, and has to be selected before Dr.Jit is first imported",
            fix=f"start Lippmann before Mitsuba is imported, or set {llvm.PATH_VARIABLE}",
        )
    return Engine("llvm_ad_rgb", "cpu", 1, llvm_version=".".join(map(str, version)))


def _load_error(path: Path) -> str:
    try:
        ctypes.CDLL(str(path))
    except OSError as error:
        return f": {error}"
    return ""


def _on_gpu() -> Engine:
    return Engine("cuda_ad_rgb", "gpu", 1, gpu_name=machine.find_gpu())


@dataclass(frozen=True)
class Check:
    """One finding of a diagnosis.

    Attributes
    ----------
    name:
        The part checked, such as ``LLVM``.
    ok:
        Whether it can be used.
    value:
        What was found.
    fix:
        How to fix it; empty if there is nothing to fix.
    needed:
        Whether a render needs it.
    """

    name: str
    ok: bool
    value: str
    fix: str = ""
    needed: bool = True


@dataclass(frozen=True)
class Diagnosis:
    """Findings on the engine, and the engine that a render would use; None if a render would fail."""

    checks: tuple[Check, ...]
    engine: Engine | None

    @property
    def ok(self) -> bool:
        """Whether a render would succeed."""
        return self.engine is not None and all(check.ok for check in self.checks if check.needed)


def diagnose(device: DeviceChoice = "auto") -> Diagnosis:
    """Check the parts of the engine, and render a small picture in a child process.

    Problems of the machine are findings, not errors. No library is loaded into this process, so that one that crashes
    ends the child process only.

    Parameters
    ----------
    device:
        ``auto``, ``cpu`` or ``gpu``, as for :func:`start`.
    """
    render, engine = _try_render(device)
    on_gpu = engine is not None and engine.device == "gpu"
    free, total = map(machine.amount_in_words, (machine.available_memory(), machine.total_memory()))
    checks = (
        _check_packages(),
        Check("variant", engine is not None, engine.variant if engine else "none", render.fix),
        _check_llvm(needed=not on_gpu),
        Check("GPU", on_gpu, (engine.gpu_name if engine and on_gpu else None) or "none in use", needed=False),
        Check("threads", True, str(machine.usable_cores())),
        Check("memory", True, f"{free} free of {total}"),
        *_check_extras(),
        render,
    )
    return Diagnosis(checks, engine)


def _check_extras() -> list[Check]:
    """Packages of the extras: the installed version of each, or how to install it."""
    from importlib.metadata import PackageNotFoundError, requires, version  # slow to import

    missing: dict[str, list[str]] = {}
    for line in requires("lippmann") or ():
        match = re.match(r"([\w.-]+).*extra == [\"'](\w+)[\"']", line)
        if match is None or match[2] == "dev":
            continue
        absent = missing.setdefault(match[2], [])
        try:
            version(match[1])
        except PackageNotFoundError:
            absent.append(match[1])
    return [
        Check(
            f"extra {name}",
            not absent,
            f"without {', '.join(absent)}" if absent else "installed",
            f"pip install 'lippmann[{name}]'" if absent else "",
            needed=False,
        )
        for name, absent in sorted(missing.items())
    ]


def _check_packages() -> Check:
    from importlib.metadata import PackageNotFoundError, version  # slow to import

    versions = [f"Python {platform.python_version()}"]
    for label, name in (("Lippmann", "lippmann"), ("Mitsuba", "mitsuba"), ("Dr.Jit", "drjit")):
        try:
            versions.append(f"{label} {version(name)}")
        except PackageNotFoundError:
            return Check("versions", False, f"{', '.join(versions)}; {label} is not installed", _REINSTALL)
    return Check("versions", True, ", ".join(versions))


def _check_llvm(*, needed: bool) -> Check:
    try:
        library = llvm.choose()
    except EngineError as error:
        return Check("LLVM", False, f"{error.where}: {error.what}" if error.where else error.what, error.fix, needed)
    others = ", ".join(other.version_text for other in llvm.installed() if other.problem)
    passed_over = f" (passed over: {others})" if others else ""
    return Check("LLVM", True, f"{library.version_text}, {library.path}{passed_over}", needed=needed)


def _try_render(device: DeviceChoice) -> tuple[Check, Engine | None]:
    """Run :func:`_probe` in a child process and check how it ended."""
    name = "test render"
    command, environment = python_command(
        "import sys; from lippmann.runtime.engine import _probe; _probe(sys.argv[1])", device
    )
    began = time.perf_counter()
    try:
        run = subprocess.run(
            command, capture_output=True, text=True, timeout=_PROBE_SECONDS, check=False, env=environment
        )
    except (OSError, subprocess.SubprocessError) as error:
        return Check(name, False, f"did not finish: {error}", _REINSTALL), None
    seconds = time.perf_counter() - began
    if run.returncode != 0:
        last = (run.stderr.strip().splitlines() or ["no message"])[-1]
        end = f"signal {-run.returncode}" if run.returncode < 0 else f"exit code {run.returncode}"
        return Check(name, False, f"the engine ended its process with {end}: {last}", _REINSTALL), None
    answer = json.loads(run.stdout.splitlines()[-1])
    if "problem" in answer:
        return Check(name, False, answer["problem"], answer["fix"]), None
    return Check(name, True, f"done in {seconds:.1f} s, start of the engine included"), Engine(**answer)


def _probe(device: DeviceChoice) -> None:
    """Start the engine, render a grey sphere under a white sky, and print the engine or the problem as JSON."""
    try:
        engine = start(device)
        _, mi = _load()
        scene = {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 3},
            "sensor": {
                "type": "perspective",
                "to_world": mi.ScalarTransform4f().look_at([0, 0, 5], [0, 0, 0], [0, 1, 0]),
                "film": {"type": "hdrfilm", "width": 16, "height": 16, "rfilter": {"type": "box"}},
            },
            "ball": {"type": "sphere", "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.5}}},
            "sky": {"type": "constant", "radiance": {"type": "rgb", "value": 1.0}},
        }
        picture = mi.render(mi.load_dict(scene), spp=4).numpy()
        corner, centre = float(picture[0, 0, 0]), float(picture[8, 8, 0])
        if not (abs(corner - 1) < 1e-3 and abs(centre - 0.5) < 0.25):
            raise EngineError(f"the picture is wrong: {corner:g} and {centre:g} for 1 and 0.5", fix=_REINSTALL)
    except EngineError as error:
        where = f"{error.where}: " if error.where else ""
        print(json.dumps({"problem": where + error.what, "fix": error.fix}))
    else:
        print(json.dumps(asdict(engine)))
