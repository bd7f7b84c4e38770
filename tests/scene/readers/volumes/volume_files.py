"""Small files of volumes: an even-sided ramp whose values tell the place."""

import numpy as np


def save_nifti(path, grid, affine=None, **header):
    import nibabel

    kind = nibabel.Nifti2Image if header.pop("version", 1) == 2 else nibabel.Nifti1Image
    image = kind(np.asarray(grid), np.eye(4) if affine is None else affine)
    if "slope" in header:
        image.header.set_slope_inter(header["slope"], header["intercept"])
    nibabel.save(image, path)


def save_slice(path, pixels, **values):
    """A slice of a DICOM series; values by keyword, None to leave one out."""
    import pydicom
    from pydicom.uid import ExplicitVRLittleEndian, generate_uid

    meta = pydicom.dataset.FileMetaDataset()
    meta.TransferSyntaxUID = values.pop("syntax", ExplicitVRLittleEndian)
    meta.MediaStorageSOPClassUID = "1.2.840.10008.5.1.4.1.1.2"
    meta.MediaStorageSOPInstanceUID = generate_uid()
    data = pydicom.dataset.FileDataset(str(path), {}, file_meta=meta, preamble=b"\0" * 128)
    defaults = {
        "SOPClassUID": meta.MediaStorageSOPClassUID,
        "SOPInstanceUID": meta.MediaStorageSOPInstanceUID,
        "SeriesInstanceUID": "1.2.3",
        "SeriesDescription": "ramp",
        "Modality": "CT",
        "Rows": pixels.shape[-2],
        "Columns": pixels.shape[-1],
        "SamplesPerPixel": 1,
        "PhotometricInterpretation": "MONOCHROME2",
        "BitsAllocated": 16,
        "BitsStored": 16,
        "HighBit": 15,
        "PixelRepresentation": 1,
        "RescaleSlope": 1,
        "RescaleIntercept": 0,
        "PixelSpacing": [2, 1],
        "ImageOrientationPatient": [1, 0, 0, 0, 1, 0],
        "SliceThickness": 3,
    }
    for name, value in {**defaults, **values}.items():
        if value is not None:
            setattr(data, name, value)
    data.PixelData = np.asarray(pixels, "<i2").tobytes()
    data["PixelData"].VR = "OW"
    data.save_as(path, enforce_file_format=True)


def save_series(folder, places=range(6), shape=(4, 5), **values):
    """Slices at heights (mm), whose pixels hold ten times their height, written in a shuffled order."""
    folder.mkdir(exist_ok=True)
    order = np.random.default_rng(0).permutation(len(places))
    for number, index in enumerate(order):
        height = list(places)[index]
        pixels = np.full(shape, 10 * height, np.int16)
        pixels[0] += 1  # the first row
        own = {"ImagePositionPatient": [-7, -9, height], "InstanceNumber": int(number), **values}
        save_slice(folder / f"{values.get('SeriesInstanceUID', 'a')}-{number}", pixels, **own)
