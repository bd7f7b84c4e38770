"""The process that reads DICOM files by ``pydicom`` and its decoders, with nothing else in it."""

from __future__ import annotations

import json
import os
import struct
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pydicom

from lippmann.runtime.helper_process import limit_memory, serve
from lippmann.scene.parsing.dicom_files import MOST_FILES, fault_of, files_in
from lippmann.scene.readers.volumes.dicom_decoders import add_decoders
from lippmann.scene.readers.volumes.dicom_slices import (
    Frame,
    SeriesError,
    choose_series,
    interpolate,
    make_stack,
)

_LENGTH = struct.Struct("<Q")
#: Tags that are read of a file before its pixels: none that tells of the patient.
_TAGS = [
    *("SeriesInstanceUID", "SeriesDescription", "SeriesNumber", "Modality", "InstanceNumber", "Rows", "Columns"),
    *("ImagePositionPatient", "ImageOrientationPatient", "PixelSpacing", "SliceThickness", "SamplesPerPixel"),
    *("SpacingBetweenSlices", "NumberOfFrames", "RescaleSlope", "RescaleIntercept", "PhotometricInterpretation"),
    *("SharedFunctionalGroupsSequence", "PerFrameFunctionalGroupsSequence", "BitsAllocated"),
    *("GridFrameOffsetVector", "DoseGridScaling", "DetectorInformationSequence", "SliceVector", "ImagerPixelSpacing"),
    *("NominalScannedPixelSpacing", "PixelAspectRatio", "FrameIncrementPointer", "TotalPixelMatrixColumns"),
]
#: Planes whose normal has so much of the patient's length are axial.
_AXIAL = 0.9999
#: Groups of a frame that tell its place: in the patient, and in the volume of an ultrasound probe.
_PLACES = ("PlanePositionSequence", "PlanePositionVolumeSequence")
#: FrameTime, FrameTimeVector: of files whose frames are moments.
_TIMES = (0x00181063, 0x00181065)


def main() -> None:
    """Answer requests, JSON with ``path``, ``series`` and ``memory``, by JSON after its length and a grid's bytes."""
    add_decoders()
    serve(_answer)


def _answer(data: bytes) -> bytes:
    request = json.loads(data)
    limit_memory(request["memory"])
    body = b""
    try:
        head, body = _read(request["path"], request["series"], request["memory"])
    except SeriesError as error:
        head = error.said
    except MemoryError:
        head = {"error": "takes more memory than is left"}
    except Exception as error:  # noqa: BLE001  # it raises errors of many kinds
        head = {"error": f"cannot be read ({_words(error, request['path'])})", "fix": "are the files whole?"}
    text = json.dumps(head).encode()
    return b"".join([_LENGTH.pack(len(text)), text, body])


def _words(error: Exception, path: str) -> str:
    said = " ".join(str(error).split()).replace(os.path.join(os.path.dirname(path), ""), "")
    return said[:200] or type(error).__name__


def _read(path: str, series: str | None, memory: int) -> tuple[dict[str, Any], bytes]:
    own = None
    names = list(islice(files_in(Path(path)), MOST_FILES))
    if not os.path.isdir(path):
        own = str(_header(path).get("SeriesInstanceUID", ""))
        beside = (name for name in files_in(Path(path).parent) if os.path.dirname(name) == os.path.dirname(path))
        names = [path, *islice((name for name in beside if name != path), MOST_FILES)] if own else [path]
    frames: list[Frame] = []
    lost: dict[str, list[str]] = {}
    for name in names:
        fault = fault_of(name) if name != path else None
        if fault is None:
            try:
                frames.extend(_frames(name, _header(name)))
                continue
            except Exception as error:  # noqa: BLE001  # as above; other files may be whole
                if name == path:
                    raise SeriesError(error=f"is no DICOM file ({_words(error, path)})") from None
                fault = "damaged"
        if _may_be_slice(name, path, of_one=own is not None):
            lost.setdefault(fault, []).append(name)
    chosen, remarks = choose_series(frames, series, own)
    head, grid = _fill(chosen, lost, memory)
    notes = _losses(lost, len(names))
    if len(names) >= MOST_FILES:
        notes.append(f"only the first {MOST_FILES} files are read")
    return {**head, "notes": [*notes, *remarks, *head["notes"]]}, grid


def _may_be_slice(name: str, path: str, *, of_one: bool) -> bool:
    """Whether a file that cannot be read may be a slice: no hidden file, and of one file's ending if that was given."""
    if of_one and os.path.splitext(name)[1] != os.path.splitext(path)[1]:
        return False
    return not any(part.startswith(".") for part in Path(os.path.relpath(name, path)).parts[of_one:])


def _losses(lost: dict[str, list[str]], total: int) -> list[str]:
    """One line on files that are left out, with the first of each kind by name."""
    if not lost:
        return []
    parts = ", ".join(f"{len(names)} {kind} ('{os.path.basename(names[0])[:60]}')" for kind, names in lost.items())
    count = sum(map(len, lost.values()))
    return [f"{count} of {total} files {'is' if count == 1 else 'are'} left out: {parts}"]


def _header(name: str) -> pydicom.Dataset:
    return pydicom.dcmread(name, stop_before_pixels=True, specific_tags=_TAGS, force=True)


def _frames(name: str, header: pydicom.Dataset) -> Iterator[Frame]:
    """The slices of a file."""
    if "Rows" not in header or "Columns" not in header:
        kind = header.file_meta.get("MediaStorageSOPClassUID")
        if kind is None or kind.name == kind or "Image Storage" in kind.name:
            raise ValueError("cut before its picture")
        return  # a directory of files, a report
    count = int(header.get("NumberOfFrames", 1) or 1)
    shared = _first(header, "SharedFunctionalGroupsSequence")
    own = list(header.get("PerFrameFunctionalGroupsSequence", None) or [])
    detector = _first(header, "DetectorInformationSequence")
    for index in range(min(count, 1 << 16)):
        groups = [own[index]] if index < len(own) else []
        if shared is not None:
            groups.append(shared)

        def find(sequence: str, tag: str, groups: list[pydicom.Dataset] = groups) -> Any:
            for group in groups:
                item = _first(group, sequence)
                if item is not None and tag in item:
                    return item.get(tag)
            return header.get(tag) if tag in header or detector is None else detector.get(tag)

        position = _numbers(find("PlanePositionSequence", "ImagePositionPatient"), 3)
        position = position or _numbers(find("PlanePositionVolumeSequence", "ImagePositionVolume"), 3)
        orientation = _numbers(find("PlaneOrientationSequence", "ImageOrientationPatient"), 6)
        orientation = orientation or _numbers(find("PlaneOrientationVolumeSequence", "ImageOrientationVolume"), 6)
        spacing = find("PixelMeasuresSequence", "PixelSpacing")
        apart = find("PixelMeasuresSequence", "SpacingBetweenSlices")
        thickness = float(apart or find("PixelMeasuresSequence", "SliceThickness") or 0.0)
        if count > 1 and not any(name in group for name in _PLACES for group in own[index : index + 1]):
            position = _frame_position(header, index, position, orientation, thickness)
        slope = header.get("DoseGridScaling") or find("PixelValueTransformationSequence", "RescaleSlope")
        intercept = find("PixelValueTransformationSequence", "RescaleIntercept")
        yield Frame(
            file=name,
            index=index,
            count=count,
            series=str(header.get("SeriesInstanceUID", "")),
            description=str(header.get("SeriesDescription", "") or ""),
            modality=str(header.get("Modality", "") or ""),
            number=float(header.get("InstanceNumber", 0) or 0),
            shape=(int(header.Rows), int(header.Columns)),
            channels=int(header.get("SamplesPerPixel", 1) or 1),
            shows_low_bright=str(header.get("PhotometricInterpretation", "")).strip() == "MONOCHROME1",
            is_moment=header.get("FrameIncrementPointer") in _TIMES,
            is_palette=str(header.get("PhotometricInterpretation", "")).startswith("PALETTE"),
            is_tile="TotalPixelMatrixColumns" in header,
            position=position,
            orientation=orientation,
            spacing=_numbers(spacing, 2) or _other_spacing(header),
            thickness=thickness,
            slope=1.0 if slope is None or slope == "" else float(slope),
            intercept=0.0 if intercept is None or intercept == "" else float(intercept),
        )


def _frame_position(
    header: pydicom.Dataset,
    index: int,
    first: tuple[float, ...] | None,
    orientation: tuple[float, ...] | None,
    spacing: float,
) -> tuple[float, ...] | None:
    """Place of a frame whose file tells that of the first: by its offset (PS3.3 C.8.8.3.2), or at even distances."""
    if first is None:
        return None
    axes = np.reshape(orientation or (1.0, 0.0, 0.0, 0.0, 1.0, 0.0), (2, 3))
    normal = np.cross(*axes)
    offsets = header.get("GridFrameOffsetVector", None)
    if offsets is not None and not isinstance(offsets, str) and index < len(offsets):
        if float(offsets[0]) == first[2] and abs(normal[2]) > _AXIAL:  # places themselves
            return (*first[:2], float(offsets[index]))
        return tuple((np.asarray(first) + normal * float(offsets[index])).tolist())
    if not spacing:
        return None
    slices = header.get("SliceVector", None)
    place = int(slices[index]) - 1 if slices is not None and index < len(slices) else index
    return tuple((np.asarray(first) + normal * spacing * place).tolist())


def _other_spacing(header: pydicom.Dataset) -> tuple[float, ...] | None:
    """Distances of rows and columns without PixelSpacing: in the detector, on the film, or their ratio alone."""
    for name in ("ImagerPixelSpacing", "NominalScannedPixelSpacing"):
        if spacing := _numbers(header.get(name), 2):
            return spacing
    ratio = _numbers(header.get("PixelAspectRatio"), 2)
    return (ratio[0] / ratio[1], 1.0) if ratio is not None and min(ratio) > 0.0 else None


def _first(dataset: pydicom.Dataset, sequence: str) -> pydicom.Dataset | None:
    items = dataset.get(sequence, None)
    return items[0] if items else None


def _numbers(values: Any, count: int) -> tuple[float, ...] | None:
    if values is None or isinstance(values, str) or len(values) != count:
        return None
    numbers = tuple(float(value) for value in values)
    return numbers if np.isfinite(numbers).all() else None


def _fill(frames: list[Frame], lost: dict[str, list[str]], memory: int) -> tuple[dict[str, Any], bytes]:
    """The grid of a stack, slice by slice; files whose pixels are damaged are left out and added to ``lost``."""
    stack = make_stack(frames)
    frames = stack.frames
    is_one_scale = len({(frame.slope, frame.intercept) for frame in frames}) == 1
    rows, columns = frames[0].shape
    if len(frames) * rows * columns * 4 > memory:
        raise MemoryError
    grid: np.ndarray[Any, Any] | None = None
    held: tuple[str, Any] = ("", None)
    damaged: dict[str, Exception] = {}
    for place, frame in enumerate(frames):
        if held[0] != frame.file:
            try:
                held = (frame.file, _pixels(frame))
            except MemoryError:
                raise
            except Exception as error:  # noqa: BLE001  # as above
                damaged[frame.file] = error
        if frame.file in damaged:
            continue
        pixels = held[1] if frame.count == 1 else held[1][frame.index]
        if pixels.shape != frame.shape:
            raise SeriesError(error=f"{os.path.basename(frame.file)} holds pixels {pixels.shape}, not {frame.shape}")
        if not is_one_scale:
            pixels = pixels.astype(np.float32) * np.float32(frame.slope) + np.float32(frame.intercept)
        if grid is None:
            grid = np.empty((len(frames), rows, columns), pixels.dtype)
        elif not np.can_cast(pixels.dtype, grid.dtype):
            grid = grid.astype(np.result_type(pixels.dtype, grid.dtype))
        grid[place] = pixels
    if grid is None:
        raise next(iter(damaged.values()))
    if damaged:
        for name, problem in damaged.items():
            kind = "damaged"
            if isinstance(problem, SeriesError):  # packed in a way that nothing here decodes, as others are not
                kind = problem.said["error"].removeprefix("its pixels are ")
            lost.setdefault(kind, []).append(name)
        return _fill([frame for frame in frames if frame.file not in damaged], lost, memory)
    if stack.places is not None:
        grid = interpolate(grid, stack.places)
    slope, intercept = (frames[0].slope, frames[0].intercept) if is_one_scale else (1.0, 0.0)
    head = {
        "shape": grid.shape,
        "dtype": grid.dtype.str,
        "patient_from_voxel": stack.patient_from_voxel.tolist(),
        "slope": slope,
        "intercept": intercept,
        "modality": frames[0].modality,
        "notes": stack.notes,
    }
    return head, grid.tobytes()


def _pixels(frame: Frame) -> np.ndarray[Any, Any]:
    dataset = pydicom.dcmread(frame.file, force=True)
    syntax = getattr(getattr(dataset, "file_meta", None), "TransferSyntaxUID", None)
    if syntax is None:
        dataset.file_meta = pydicom.dataset.FileMetaDataset()
        dataset.file_meta.TransferSyntaxUID = syntax = pydicom.uid.ImplicitVRLittleEndian
    try:
        return _apply_modality(dataset, np.asarray(dataset.pixel_array))
    except (RuntimeError, NotImplementedError) as error:
        if not syntax.is_compressed:
            raise
        raise SeriesError(
            error=f"its pixels are compressed as {syntax.name}",
            rule=f"no decoder is installed that reads them ({_words(error, frame.file)})"[:200],
            fix="pip install pylibjpeg pylibjpeg-libjpeg pylibjpeg-openjpeg",
        ) from None


def _apply_modality(dataset: pydicom.Dataset, pixels: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Pixels through the modality's table, where there is one; padding as low as the lowest value."""
    padding = dataset.get("PixelPaddingValue")
    if padding is not None:
        ends = sorted(
            int(end) - (1 << 16) * (pixels.dtype.kind == "i" and int(end) >= 1 << 15)  # written as if unsigned
            for end in (padding, dataset.get("PixelPaddingRangeLimit", padding))
        )
        padded = (pixels >= ends[0]) & (pixels <= ends[1])
        if padded.any() and not padded.all():
            pixels = np.where(padded, pixels[~padded].min(), pixels)
    table = _first(dataset, "ModalityLUTSequence")
    if table is not None and table.get("LUTDescriptor") is not None:  # some programs write one without values
        pixels = pydicom.pixels.apply_modality_lut(pixels, dataset)
    return pixels
