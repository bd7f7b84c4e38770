"""Layers of a stage: which files it is made of, where they may lie, and which variants are chosen."""

from __future__ import annotations

import os

from pxr import Sdf, Usd

from lippmann.scene.readers.usd.stage_materialx import materialx_layer

#: Layers that a stage may be made of.
_MOST_LAYERS = 10_000
#: Rounds in which a chosen variant may bring prims that have variants themselves.
_MOST_ROUNDS = 8


class StageError(Exception):
    """A stage that is not read: what is wrong, the rule and the fix."""

    def __init__(self, what: str, *, rule: str = "", fix: str = "") -> None:
        super().__init__(what)
        self.what, self.rule, self.fix = what, rule, fix


def check_layers(path: str, folder: str | None) -> tuple[list[Sdf.Layer], list[str]]:
    """Look at all layers that a file leads to, before a stage is made of them.

    In place of MaterialX documents, those that name them name layers of the same content.

    Parameters
    ----------
    folder:
        The folder that all must lie in; None allows any.

    Returns
    -------
    The layers, which must be held until the stage is made, and notes on those that are not there or not understood.

    Raises
    ------
    StageError
        A layer lies outside, or there are too many.
    """
    home = None if folder is None else os.path.realpath(folder)

    def admits(name: str) -> bool:
        return home is None or _lies_in(name, home)

    waiting, known, notes = [path], {path}, []
    layers: list[Sdf.Layer] = []
    documents: dict[str, Sdf.Layer] = {}
    while waiting:
        layer = Sdf.Layer.FindOrOpen(waiting.pop())
        if layer is None:
            continue
        layers.append(layer)
        for name in sorted(filter(None, layer.GetCompositionAssetDependencies())):
            layer_path = layer.ComputeAbsolutePath(name)
            if layer_path in documents:
                _replace(layer, name, documents[layer_path])
            if layer_path in known:
                continue
            known.add(layer_path)
            if len(known) > _MOST_LAYERS:
                raise StageError(f"is made of more than {_MOST_LAYERS} layers")
            if not admits(layer_path):
                raise StageError(
                    f"layer '{name}' lies outside the scene's folder",
                    rule="a scene file may name only files in its own folder and below",
                    fix="move it there, or trust the scene file with allow_outside=True",
                )
            if not os.path.isfile(_outer(layer_path)):
                notes.append(f"layer '{name}' not found: the scene lacks what it holds")
            elif Sdf.FileFormat.FindByExtension(layer_path) is not None:
                waiting.append(layer_path)
            elif _is_materialx(layer_path):
                try:
                    documents[layer_path] = materialx_layer(layer_path, admits, notes)
                except ValueError as error:
                    notes.append(f"layer '{name}' is no MaterialX that can be read ({error}): left out")
                else:
                    _replace(layer, name, documents[layer_path])
            else:
                notes.append(f"layer '{name}' is of a format that the installed USD does not read: left out")
    return [*layers, *documents.values()], notes


def _is_materialx(path: str) -> bool:
    return path.rstrip("]").lower().endswith(".mtlx")


def _replace(layer: Sdf.Layer, name: str, document: Sdf.Layer) -> None:
    """Let a layer name a document's layer, in memory alone."""
    layer.SetPermissionToEdit(True)
    layer.UpdateCompositionAssetDependency(name, document.identifier)


def _outer(name: str) -> str:
    """The file of a layer's name, which may lie in a package and have arguments."""
    return name.split(":SDF_FORMAT_ARGS:")[0].split("[")[0]


def _lies_in(name: str, home: str) -> bool:
    place = os.path.realpath(os.path.join(home, _outer(name)))
    return place == home or place.startswith(home.rstrip(os.sep) + os.sep)


def used_files(stage: Usd.Stage) -> list[str]:
    """The files of all layers that a stage is made of."""
    names = [layer.realPath or layer.GetDisplayName().removesuffix(".usda") for layer in stage.GetUsedLayers()]
    return sorted({_outer(name) for name in names if os.path.isfile(_outer(name))})


def choose_variants(stage: Usd.Stage, choices: dict[str, str]) -> None:
    """Choose variants: ``{"set": "choice"}`` for every prim that has them, ``{"/prim:set": "choice"}`` for one.

    Raises
    ------
    StageError
        No prim has such a set with such a choice.
    """
    left = dict(choices)
    with Usd.EditContext(stage, stage.GetSessionLayer()):
        for _ in range(_MOST_ROUNDS):
            changed = False
            for path in [prim.GetPath() for prim in stage.TraverseAll()]:
                prim = stage.GetPrimAtPath(path)
                if not prim:  # a choice took it away
                    continue
                for name in prim.GetVariantSets().GetNames():
                    variants = prim.GetVariantSet(name)
                    for key in (name, f"{prim.GetPath()}:{name}"):
                        choice = choices.get(key)
                        if choice is None or choice not in variants.GetVariantNames():
                            continue
                        left.pop(key, None)
                        if variants.GetVariantSelection() != choice:
                            variants.SetVariantSelection(choice)
                            changed = True
            if not changed:
                break
    if left:
        key, choice = next(iter(left.items()))
        raise StageError(f"no prim has a variant '{choice}' of '{key}'", rule=_known_variants(stage))


def _known_variants(stage: Usd.Stage) -> str:
    known: dict[str, set[str]] = {}
    for prim in stage.TraverseAll():
        for name in prim.GetVariantSets().GetNames():
            known.setdefault(name, set()).update(prim.GetVariantSet(name).GetVariantNames())
    listing = [f"{name}={'|'.join(sorted(choices))}" for name, choices in sorted(known.items())]
    return "known are " + ", ".join(listing[:20]) if listing else "the stage has no variants"
