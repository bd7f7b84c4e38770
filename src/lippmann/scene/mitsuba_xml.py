"""Mitsuba XML files, read and checked here before Mitsuba sees any of them.

A scene file may include others, fill in parameters (``$name``) and add folders to search (``<path>``). All of that is
resolved once, by the rules of Mitsuba 3.9's own parser (``src/core/parser.cpp``), into one :class:`MitsubaXml`: a tree
of elements without parameters, includes and search paths, and the files that the scene reads. The same list of files
serves loading, the check of folders, fingerprints and clusters. Mitsuba is given absolute paths and plugins of its own
package only, so that no scene can make it look anywhere else.

Mitsuba's parser (``mitsuba.parser``, 3.9) does not take its place: it opens includes by absolute paths and by ``..``
wherever they lie, and elements inside elements, 200 000 deep, end the process.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import islice, zip_longest
from os.path import relpath
from pathlib import Path
from xml.parsers import expat

from lippmann.color.transfer import decode_srgb
from lippmann.errors import SceneError
from lippmann.scene.mitsuba_plugins import check_material, check_plugin, is_plugin
from lippmann.scene.parsing.files import NamedFiles, read_bytes

#: Included files inside included files, as Mitsuba allows by default.
MOST_INCLUDE_LEVELS = 15
#: Included files in all: a few short ones that include each other in turn could stand for any number of elements.
MOST_INCLUDES = 1000
#: Elements of all files, counted as often as they are included. A kilobyte each, here and in Mitsuba.
MOST_ELEMENTS = 1_000_000
#: Elements inside elements; Mitsuba's own parser recurses without a limit.
MOST_LEVELS = 100

_ESCAPED_DOLLAR = "\\$"
#: Entities for characters that cannot stand in an attribute's quotes; xml.sax.saxutils loads all of urllib.
_ENTITIES = str.maketrans(
    {"&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;", "\n": "&#10;", "\r": "&#13;", "\t": "&#9;"}
)
_HEXADECIMAL = re.compile(r"#[0-9a-fA-F]{6}")
_PARAMETER = re.compile(r"(?<!\\)\$(\w*)", re.ASCII)
#: Elements without a type that Mitsuba copies from an included scene, beside its objects: other names for them.
_NAMES = ("alias", "ref")
#: Elements whose plugins do not count here, and what stands for those that Mitsuba has no more.
_UNCOUNTED = {"film": "hdrfilm", "integrator": "path", "sampler": "independent"}
#: Parameters of a film that count: the shape of the camera's picture.
_FILM_SIZE = ("width", "height")


@dataclass(frozen=True)
class XmlElement:
    """An element with its attributes in order. ``file`` is the attribute that holds the key of a file, if any."""

    tag: str
    attributes: tuple[tuple[str, str], ...]
    children: tuple[XmlElement, ...] = ()
    file: str | None = None
    _origin: str = ""  # the file and line that it comes from; two equal scenes may differ in it

    def get(self, name: str, default: str = "") -> str:
        """The value of an attribute."""
        return dict(self.attributes).get(name, default)


@dataclass(frozen=True)
class MitsubaXml:
    """A scene file with all that it includes.

    Attributes
    ----------
    root:
        The element ``scene``.
    files:
        Every file that the scene reads beside its XML, by key: the path from the scene's folder, with slashes.
    """

    root: XmlElement
    files: Mapping[str, Path] = field(default_factory=dict)

    def text(self) -> str:
        """The scene as XML for Mitsuba, an element a line, files by absolute path."""
        places = {key: str(path.resolve()) for key, path in self.files.items()}
        return "\n".join(line for line, _ in self._lines(places))

    def outline(self) -> str:
        """The same with files by key: equal for equal scenes, wherever they lie."""
        return "\n".join(line for line, _ in self._lines({}))

    def origin(self, line: int) -> str:
        """The file and line that a line of :meth:`text`, counted from 1, comes from; the root's if it has none."""
        origin = next((origin for _, origin in islice(self._lines({}), line - 1, line)), "")
        return origin or self.root._origin

    def _lines(self, places: Mapping[str, str]) -> Iterator[tuple[str, str]]:
        stack: list[XmlElement | str] = [self.root]
        while stack:
            element = stack.pop()
            if isinstance(element, str):
                yield f"</{element}>", ""
                continue
            words = [element.tag]
            for name, value in element.attributes:
                text = places.get(value, value) if name == element.file else value
                quoted = text.replace("$", _ESCAPED_DOLLAR).translate(_ENTITIES)
                words.append(f'{name}="{quoted}"')
            yield f"<{' '.join(words)}>", element._origin
            stack += [element.tag, *reversed(element.children)]


def read_mitsuba_xml(path: Path, files: NamedFiles | None = None) -> MitsubaXml:
    """Read a scene file and the files that it includes; the files that they name are found, but not opened.

    Raises
    ------
    SceneError
        A file is missing, is no XML or no scene, names a plugin or material that Mitsuba does not have, or names a
        file that is not found, or that is none of ``files``.
    """
    reader = _Reader(NamedFiles.of(path, files))
    root = reader.file(path, {}, [], "", level=0)
    return MitsubaXml(root, reader.files)


class _Reader:
    """Reads one scene: ``named`` are the files that it may name, ``folder`` is that of its own."""

    def __init__(self, named: NamedFiles) -> None:
        self.named, self.folder = named, named.folder
        self.files: dict[str, Path] = {}
        self._scene_folders = [self.folder]  # where files of all kinds but spectra are looked up
        self._includes = self._elements = 0
        self._version: tuple[str, bool] | None = None

    def file(self, path: Path, parameters: dict[str, str], folders: list[Path], name: str, *, level: int) -> XmlElement:
        """The root element of a file.

        Parameters
        ----------
        parameters:
            Values by name, those of the files before included; what the file declares is added.
        folders:
            Folders and search paths of the including files, the nearest one first.
        name:
            What messages call the file.
        """
        where = name or path.name
        self._includes += level > 0
        if level >= MOST_INCLUDE_LEVELS or self._includes > MOST_INCLUDES:
            rule = f"at most {MOST_INCLUDE_LEVELS} files inside each other and {MOST_INCLUDES} in all are included"
            raise SceneError("includes too many files", where=where, rule=rule, fix="does a file include itself?")
        raw = parse_xml(read_bytes(path), where)
        if level == 0 and raw.tag != "scene":
            raise SceneError(f"is XML of a '{raw.tag[:40]}'", where=where, rule="a Mitsuba file holds a 'scene'")
        self._check_version(raw, where)
        paths: list[Path] = []
        known = dict(parameters)
        for child in raw.children:  # Mitsuba looks files up when it has read all: later paths count, too
            if child.tag == "default":
                self._declare(child, known)
            elif child.tag == "path":
                value = self._substitute(child, known).get("value")
                near = [path.parent, *paths, *folders, self.folder]
                paths.insert(0, self.named.find_folder(value, where=child._origin, folders=near))
        if level == 0:
            self._scene_folders = [*paths, self.folder]
        return self._element(raw, path, parameters, [*paths, *folders], level, is_root=True)

    def _element(
        self,
        raw: XmlElement,
        path: Path,
        parameters: dict[str, str],
        folders: list[Path],
        level: int,
        *,
        is_root: bool = False,
    ) -> XmlElement:
        self._elements += 1
        if self._elements > MOST_ELEMENTS:
            rule = f"at most {MOST_ELEMENTS} are read"
            raise SceneError(
                "the scene has too many elements", where=raw._origin, rule=rule, fix="put them into meshes"
            )
        element = self._substitute(raw, parameters)
        where = element._origin
        if element.tag in _UNCOUNTED and not is_plugin(element.get("type")):
            raw = element = _stand_in(element)
        elif kind := element.get("type"):
            check_plugin(kind, where)
        elif element.tag in ("rgb", "srgb"):
            element = _linear_color(element)
        children: list[XmlElement] = []
        for child in raw.children:
            if child.tag == "default":
                self._declare(child, parameters)
            elif child.tag == "include":
                children += self._include(self._substitute(child, parameters), path, parameters, folders, level)
            elif child.tag != "path":
                children.append(self._element(child, path, parameters, folders, level))
            elif not is_root:
                raise SceneError("holds a search path", where=child._origin, rule="'path' stands in the root alone")
        attributes, named = dict(element.attributes), None
        # Mitsuba looks for spectra while it parses, from the files that include the one which names them; for all else
        # when it has read all, from the scene's file. What it would not find may lie beside the file that names it.
        if element.tag == "spectrum" and attributes.get("filename"):
            named = "filename"
            attributes[named] = self._key(attributes[named], [*folders, self.folder, path.parent], where)
        elif element.tag == "string" and attributes.get("name") == "filename":
            named = "value"
            searched = [*self._scene_folders, *folders, path.parent]
            attributes[named] = self._key(attributes.get(named, ""), searched, where)
        elif element.tag == "string" and attributes.get("name") == "material":
            check_material(attributes.get("value", ""), where)
        if named is None and all(one is other for one, other in zip_longest(children, element.children)):
            return element
        return XmlElement(element.tag, tuple(attributes.items()), tuple(children), named, where)

    def _include(
        self, include: XmlElement, path: Path, parameters: dict[str, str], folders: list[Path], level: int
    ) -> list[XmlElement]:
        """The elements that take the place of an ``<include>``."""
        name = include.get("filename")
        file = self._find(name, [path.parent, *folders, self.folder], include._origin)
        including = [path.parent, *folders]
        root = self.file(file, parameters, including, Path(name.replace("\\", "/")).name, level=level + 1)
        if root.get("type", "scene") == "scene" and root.tag == "scene":
            return [child for child in root.children if child.get("type") or child.tag in _NAMES]
        attributes = {key: value for key, value in root.attributes if key not in ("version", "name")}
        if include.get("name"):
            attributes["name"] = include.get("name")
        return [XmlElement(root.tag, tuple(attributes.items()), root.children, root.file, root._origin)]

    def _check_version(self, root: XmlElement, where: str) -> None:
        """Mitsuba renames what files of before version 2 say, file by file; in one document that cannot be mixed."""
        text = root.get("version")
        old = text.partition(".")[0] in ("0", "1")
        if self._version is None:
            self._version = text, old
        elif self._version[1] != old:
            raise SceneError(
                f"is of version {text[:20]}, the scene of {self._version[0][:20]}",
                where=where,
                rule="files of before version 2 are included by such files alone",
                fix="bring both to one version",
            )

    def _declare(self, default: XmlElement, parameters: dict[str, str]) -> None:
        """Add a parameter; one that has a value keeps it."""
        declared = self._substitute(default, parameters)
        if not declared.get("name"):
            raise SceneError("declares a parameter without a name", where=declared._origin)
        parameters.setdefault(declared.get("name"), declared.get("value"))

    @staticmethod
    def _substitute(element: XmlElement, parameters: Mapping[str, str]) -> XmlElement:
        if not any("$" in value for _, value in element.attributes):
            return element
        attributes = tuple((name, _fill_in(value, parameters, element)) for name, value in element.attributes)
        return XmlElement(element.tag, attributes, element.children, None, element._origin)

    def _key(self, name: str, folders: list[Path], where: str) -> str:
        file = self._find(name, folders, where)
        key = Path(relpath(file, self.folder)).as_posix()
        self.files[key] = file
        return key

    def _find(self, name: str, folders: list[Path], where: str) -> Path:
        return self.named.find(name, where=where, what="file", folders=folders)


def parse_xml(data: bytes, where: str) -> XmlElement:
    """The root element of an XML document, as it stands there.

    Raises
    ------
    SceneError
        It is not well-formed, declares entities, or is nested too deeply.
    """
    parser = expat.ParserCreate()
    parser.buffer_text = True
    open_elements: list[tuple[str, tuple[tuple[str, str], ...], str]] = []
    children: list[list[XmlElement]] = [[]]

    def begin(tag: str, attributes: dict[str, str]) -> None:
        origin = f"{where}:{parser.CurrentLineNumber}"
        if len(open_elements) >= MOST_LEVELS:
            raise SceneError(f"holds elements inside each other, more than {MOST_LEVELS} deep", where=origin)
        open_elements.append((tag, tuple(attributes.items()), origin))
        children.append([])

    def end(tag: str) -> None:
        name, attributes, origin = open_elements.pop()
        inner = tuple(children.pop())
        children[-1].append(XmlElement(name, attributes, inner, _origin=origin))

    def refuse_entity(*declaration: object) -> None:
        raise SceneError(
            "declares an entity", where=f"{where}:{parser.CurrentLineNumber}", rule="scene files use parameters instead"
        )

    parser.StartElementHandler = begin
    parser.EndElementHandler = end
    parser.EntityDeclHandler = refuse_entity
    parser.ordered_attributes = False
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        if error.code == expat.errors.codes[expat.errors.XML_ERROR_UNKNOWN_ENCODING]:
            raise SceneError(f"cannot be decoded ({error})", where=where, rule="XML is UTF-8") from None
        place = f"{where}:{error.lineno}"
        raise SceneError(f"is no well-formed XML ({error})", where=place, fix="is the file cut short?") from None
    except (LookupError, ValueError) as error:  # of the encoding that it names
        raise SceneError(f"cannot be decoded ({error})", where=where, rule="XML is UTF-8") from None
    return children[0][0]


def _stand_in(element: XmlElement) -> XmlElement:
    """An integrator, sampler or film of a plugin that Mitsuba has, for one of before version 2 (``ldrfilm``, say)."""
    sizes = tuple(child for child in element.children if element.tag == "film" and child.get("name") in _FILM_SIZE)
    others = tuple((name, value) for name, value in element.attributes if name != "type")
    attributes = (("type", _UNCOUNTED[element.tag]), *others)
    return XmlElement(element.tag, attributes, sizes, _origin=element._origin)


def _linear_color(element: XmlElement) -> XmlElement:
    """A colour as the linear ``rgb`` that Mitsuba 3 reads: before version 2 there were ``srgb`` and hexadecimal codes.

    Raises
    ------
    SceneError
        It is no number, no three and no ``#RRGGBB``.
    """
    text = element.get("value").strip()
    if element.tag == "rgb" and not text.startswith("#"):
        return element
    if _HEXADECIMAL.fullmatch(text):
        values = [int(text[start : start + 2], 16) / 255 for start in (1, 3, 5)]
    else:
        try:
            values = [float(word) for word in text.replace(",", " ").split()]
        except ValueError:
            values = []
    if len(values) not in (1, 3):
        rule = "one number, three, or #RRGGBB"
        raise SceneError(f"the colour '{text[:40]}' is not understood", where=element._origin, rule=rule)
    if element.tag == "srgb":
        values = decode_srgb(values).tolist()
    attributes = {**dict(element.attributes), "value": " ".join(repr(value) for value in values)}
    return XmlElement("rgb", tuple(attributes.items()), element.children, _origin=element._origin)


def _fill_in(value: str, parameters: Mapping[str, str], element: XmlElement) -> str:
    """An attribute's value with its parameters replaced, longer names first; ``\\$`` stands for a dollar sign."""
    if "$" not in value:
        return value
    for name in sorted(parameters, key=len, reverse=True):
        text = parameters[name]
        value = re.sub(rf"(?<!\\)\${re.escape(name)}", lambda _, text=text: text, value)  # type: ignore[misc]
    if missing := _PARAMETER.search(value):
        raise SceneError(
            f"parameter '${missing[1][:40]}' has no value",
            where=element._origin,
            rule="a parameter is declared before it is used",
            fix=f'add <default name="{missing[1][:40]}" value="..."/>',
        )
    return value.replace(_ESCAPED_DOLLAR, "$")
