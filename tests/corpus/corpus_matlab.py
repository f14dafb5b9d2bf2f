"""A writer of MATLAB 7.3 files: HDF5 behind 512 bytes of MATLAB's, every variable with its class."""

import h5py
import numpy as np

CLASSES = {"f8": "double", "f4": "single", "i2": "int16", "b1": "logical", "c16": "double"}


def matlab73(path, content):
    """Write numbers, texts and structures of them, by name, as MATLAB would; vectors stand as columns."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, value in content.items():
            _variable(file, name, value)
    with path.open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")


def _variable(group, name, value):
    if isinstance(value, dict):
        item = group.create_group(name)
        item.attrs["MATLAB_class"] = np.bytes_("struct")
        for each, inner in value.items():
            _variable(item, each, inner)
        return
    if isinstance(value, str):
        item = group.create_dataset(name, data=np.array([[ord(each)] for each in value], np.uint16))
        stated = "char"
    else:
        array = np.asarray(value)
        stated = CLASSES[array.dtype.str[1:]]
        if array.size:
            array = array.astype(np.uint8) if stated == "logical" else array
            array = np.atleast_2d(array.T)
            packing = {"chunks": True, "compression": "gzip"} if array.size > 1 else {}
            item = group.create_dataset(name, data=_pairs(array), **packing)
        else:
            item = group.create_dataset(name, data=np.array(array.shape, np.uint64))
            item.attrs["MATLAB_empty"] = np.uint8(1)
    item.attrs["MATLAB_class"] = np.bytes_(stated)


def _pairs(array):
    """Give complex numbers as MATLAB stores them: pairs called real and imag."""
    if array.dtype.kind != "c":
        return array
    pairs = np.empty(array.shape, [("real", "f8"), ("imag", "f8")])
    pairs["real"], pairs["imag"] = array.real, array.imag
    return pairs
