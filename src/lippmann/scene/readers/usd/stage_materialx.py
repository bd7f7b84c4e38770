"""MaterialX documents (``.mtlx``) as layers, for the wheels of USD, which come without its plugin ``usdMtlx``.

The layer has the plugin's paths: ``/MaterialX/Materials/NAME``, with the inputs of its surface on the material. By the
MaterialX Specification 1.39; looks and variants are not read.
"""

from __future__ import annotations

import os
import posixpath
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from pxr import Ar, Gf, Sdf, Tf, Usd, UsdShade

Element = ElementTree.Element

_TYPES = Sdf.ValueTypeNames
#: Types of MaterialX: that of USD, and what makes one of its numbers; others are texts.
_NUMBERS = {
    "float": (_TYPES.Float, float),
    "integer": (_TYPES.Int, int),
    "color3": (_TYPES.Color3f, Gf.Vec3f),
    "color4": (_TYPES.Color4f, Gf.Vec4f),
    "vector2": (_TYPES.Float2, Gf.Vec2f),
    "vector3": (_TYPES.Float3, Gf.Vec3f),
    "vector4": (_TYPES.Float4, Gf.Vec4f),
}
_OTHERS = {"boolean": _TYPES.Bool, "filename": _TYPES.Asset, "surfaceshader": _TYPES.Token}
#: Of files, packages, numbers and names; USD's own errors are of runtime.
_FAULTS = (OSError, zipfile.BadZipFile, ElementTree.ParseError, KeyError, ValueError, TypeError, RuntimeError)
#: Attributes that hold for all that stands in an element.
_INHERITED = ("colorspace", "fileprefix")
_INCLUDE = "{http://www.w3.org/2001/XInclude}include"


def materialx_layer(path: str, admits: Callable[[str], bool], notes: list[str]) -> Sdf.Layer:
    """The layer of a document: a file, or one in a package (``package.usdz[name.mtlx]``).

    Parameters
    ----------
    admits:
        Whether a document that it includes may be read; ``notes`` name those that are not, or cannot be.

    Raises
    ------
    ValueError
        It cannot be read, is no XML, or holds values that do not fit their types.
    """
    try:
        root = _read(path)
        _include(root, path, admits, notes, {os.path.normpath(path)})
        layer = Sdf.Layer.CreateAnonymous(f"{path}.usda")
        _Document(root, Usd.Stage.Open(layer), path, notes).make_materials()
    except _FAULTS as error:
        raise ValueError(str(error)) from None
    return layer


def _read(path: str) -> Element:
    outer, _, inner = path.rstrip("]").partition("[")
    if not inner:
        return ElementTree.fromstring(Path(path).read_bytes())
    with zipfile.ZipFile(outer) as package:
        return ElementTree.fromstring(package.read(inner))


def _include(root: Element, path: str, admits: Callable[[str], bool], notes: list[str], included: set[str]) -> None:
    """Put what included documents hold in the place of their names, of each document once."""
    for element in root.findall(_INCLUDE):
        name = element.get("href", "")
        inner = _beside(path, name)
        try:
            if not admits(inner):
                raise ValueError("it lies outside the scene's folder")
            held = Element("materialx") if inner in included else _read(inner)
        except _FAULTS as error:
            notes.append(f"'{name}', which '{os.path.basename(path)}' includes, cannot be read ({error}): left out")
            continue
        included.add(inner)
        _include(held, inner, admits, notes, included)
        folder = posixpath.join(posixpath.dirname(name), "")
        for child in held:
            child.set("colorspace", child.get("colorspace", held.get("colorspace", "")))
            child.set("fileprefix", folder + child.get("fileprefix", held.get("fileprefix", "")))
        place = list(root).index(element)
        root[place : place + 1] = list(held)


def _beside(path: str, name: str) -> str:
    """A file that a document names as seen from its folder."""
    if "[" in path:
        package, inner = Ar.SplitPackageRelativePathInner(path)
        return str(Ar.JoinPackageRelativePath(package, posixpath.normpath(f"{posixpath.dirname(inner)}/{name}")))
    return os.path.normpath(os.path.join(os.path.dirname(path), name))


class _Document:
    """Makes prims of the elements of a document, which are ``root`` and what it holds."""

    def __init__(self, root: Element, stage: Usd.Stage, path: str, notes: list[str]) -> None:
        self._root, self._stage, self._path, self._notes = root, stage, path, notes
        self._inherited = {root: {name: root.get(name, "") for name in _INHERITED}}

    def make_materials(self) -> None:
        materials = Sdf.Path("/MaterialX/Materials")
        for element in self._root.findall("surfacematerial"):
            material = UsdShade.Material.Define(self._stage, _below(materials, element))
            source = element.find("input[@name='surfaceshader']")
            surface = None if source is None else self._find(self._root, source.get("nodename"))
            if surface is None:
                continue
            shader = self._shader(material, self._root, surface)
            for given in shader.GetInputs():  # so that stages may set them
                own = material.CreateInput(given.GetBaseName(), given.GetTypeName())
                if given.HasConnectedSource():
                    own.GetAttr().SetConnections(given.GetAttr().GetConnections())
                elif (value := given.Get()) is not None:
                    own.Set(value)
                    own.GetAttr().SetColorSpace(given.GetAttr().GetColorSpace())
                given.ConnectToSource(own)
            material.CreateSurfaceOutput("mtlx").ConnectToSource(shader.ConnectableAPI(), "out")

    @staticmethod
    def _find(scope: Element, name: str | None) -> Element | None:
        return next((each for each in scope if name and each.get("name") == name), None)

    def _shader(self, parent: UsdShade.NodeGraph, scope: Element, element: Element) -> UsdShade.Shader:
        """A node of ``scope`` as a prim below ``parent``, with all that feeds it."""
        path = _below(parent.GetPath(), element)
        shader = UsdShade.Shader.Get(self._stage, path)
        if shader:
            return shader
        shader = UsdShade.Shader.Define(self._stage, path)
        shader.CreateIdAttr(element.get("nodedef") or f"ND_{element.tag}_{element.get('type', '')}")
        self._connect_inputs(shader, parent, scope, element)
        return shader

    def _graph(self, parent: UsdShade.NodeGraph, element: Element) -> UsdShade.NodeGraph:
        path = _below(parent.GetPath(), element)
        graph = UsdShade.NodeGraph.Get(self._stage, path)
        if graph:
            return graph
        graph = UsdShade.NodeGraph.Define(self._stage, path)
        self._connect_inputs(graph, parent, self._root, element)
        for output in element.iter("output"):
            source = self._source(graph, element, output)
            made = graph.CreateOutput(output.get("name", "out"), _type_of(output))
            if source is not None:
                made.ConnectToSource(source)
        return graph

    def _connect_inputs(
        self, node: UsdShade.Shader | UsdShade.NodeGraph, parent: UsdShade.NodeGraph, scope: Element, element: Element
    ) -> None:
        self._inherit(scope, element)
        for given in element.findall("input"):
            self._inherit(element, given)
            made = node.CreateInput(given.get("name", ""), _type_of(given))
            source = self._source(parent, scope, given)
            if source is not None:
                made.ConnectToSource(source)
            elif given.get("value") is not None:
                made.Set(self._value(given))
                if space := self._inherited[given]["colorspace"]:
                    made.GetAttr().SetColorSpace(space)

    def _source(
        self, parent: UsdShade.NodeGraph, scope: Element, given: Element
    ) -> UsdShade.Output | UsdShade.Input | None:
        """What feeds an input, or an output of a graph; ``scope`` are the nodes beside it, which lie in ``parent``."""
        name = given.get("interfacename")
        if name:
            return parent.GetInput(name) or None
        output = given.get("output", "out")
        graph = self._find(self._root, given.get("nodegraph"))
        if graph is not None and graph is not scope:
            return self._graph(parent, graph).GetOutput(output) or None
        node = self._find(scope, given.get("nodename"))
        if node is None:
            if absent := given.get("nodegraph", given.get("nodename")):
                self._notes.append(f"'{os.path.basename(self._path)}' has no node '{absent}': its default is taken")
            return None
        return self._shader(parent, scope, node).CreateOutput(output, _type_of(node))

    def _inherit(self, outer: Element, inner: Element) -> None:
        above = self._inherited[outer]
        self._inherited[inner] = {name: inner.get(name, above[name]) for name in _INHERITED}

    def _value(self, given: Element) -> Any:
        text, kind = given.get("value", ""), given.get("type", "")
        if kind in _NUMBERS:
            numbers = [float(number) for number in text.replace(",", " ").split()]
            return _NUMBERS[kind][1](*numbers)
        if kind == "filename":
            return Sdf.AssetPath(_beside(self._path, self._inherited[given]["fileprefix"] + text))
        return text == "true" if kind == "boolean" else text


def _below(path: Sdf.Path, element: Element) -> Sdf.Path:
    return path.AppendChild(Tf.MakeValidIdentifier(element.get("name", "")))


def _type_of(element: Element) -> Sdf.ValueTypeName:
    kind = element.get("type", "")
    return _NUMBERS[kind][0] if kind in _NUMBERS else _OTHERS.get(kind, _TYPES.String)
