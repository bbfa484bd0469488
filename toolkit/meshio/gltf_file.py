"""A glTF 2.0 file: its JSON document, its buffers, and accessors as arrays. Geometry only; no library needed."""

from __future__ import annotations

import base64
import binascii
import json
import struct
from functools import cached_property
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from toolkit.errors import InputError

__all__ = ["GltfFile"]

_COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
_COMPRESSED = {"KHR_draco_mesh_compression", "EXT_meshopt_compression"}
_CUT_SHORT = "it is cut short or damaged, export it again"


class GltfFile:
    """The document of a ``.gltf`` or ``.glb`` file; ``accessor(i)`` decodes one of its arrays."""

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        data = self.path.read_bytes()
        text, self._binary = self._glb_chunks(data) if data[:4] == b"glTF" else (data, b"")
        try:
            self.document: dict[str, Any] = json.loads(text)
        except (UnicodeDecodeError, json.JSONDecodeError) as error:
            raise InputError(f"is not a glTF file ({error})", where=path, remedy=_CUT_SHORT) from None
        compressed = _COMPRESSED & set(self.document.get("extensionsRequired", []))
        if compressed:
            what = f"its geometry is compressed ({', '.join(sorted(compressed))})"
            raise InputError(what, where=path, remedy="export it without compression")

    def items(self, kind: str) -> list[dict[str, Any]]:
        """Return the list of ``nodes``, ``meshes``, ``animations`` ...; empty where the document has none."""
        return self.document.get(kind, [])

    def accessor(self, index: int) -> NDArray:
        """Decode an accessor to ``(count,)`` or ``(count, width)``: strided, sparse and normalised ones too."""
        try:
            accessor = self.items("accessors")[index]
            return self._decode(accessor)
        except (IndexError, KeyError, TypeError, ValueError, binascii.Error) as error:
            raise InputError(f"accessor {index} cannot be read ({error})", where=self.path, remedy=_CUT_SHORT) from None

    def _decode(self, accessor: dict[str, Any]) -> NDArray:
        dtype, width = np.dtype(_COMPONENTS[accessor["componentType"]]), _WIDTHS[accessor["type"]]
        count = accessor["count"]
        if "bufferView" in accessor:
            values = self._rows(accessor["bufferView"], accessor.get("byteOffset", 0), dtype, width, count)
        else:
            values = np.zeros((count, width), dtype=dtype)
        if "sparse" in accessor:
            values = self._with_sparse(values, accessor["sparse"])
        if accessor.get("normalized"):
            values = np.maximum(values / np.float32(np.iinfo(dtype).max), np.float32(-1))
        return values[:, 0] if width == 1 else values

    def _with_sparse(self, values: NDArray, sparse: dict[str, Any]) -> NDArray:
        count, where, what = sparse["count"], sparse["indices"], sparse["values"]
        id_type = np.dtype(_COMPONENTS[where["componentType"]])
        rows = self._rows(where["bufferView"], where.get("byteOffset", 0), id_type, 1, count)[:, 0]
        values = values.copy()
        values[rows] = self._rows(what["bufferView"], what.get("byteOffset", 0), values.dtype, values.shape[1], count)
        return values

    def _rows(self, view_index: int, offset: int, dtype: np.dtype, width: int, count: int) -> NDArray:
        view = self.items("bufferViews")[view_index]
        start = view.get("byteOffset", 0) + offset
        row_bytes = dtype.itemsize * width
        stride = view.get("byteStride", row_bytes)
        data = self._buffers[view["buffer"]]
        if count and start + stride * (count - 1) + row_bytes > len(data):
            raise ValueError(f"its {count} rows reach beyond the {len(data)} bytes of the buffer")
        return np.ndarray((count, width), dtype, data, start, (stride, dtype.itemsize))

    @cached_property
    def _buffers(self) -> list[bytes]:
        return [self._buffer(buffer) for buffer in self.items("buffers")]

    def _buffer(self, buffer: dict[str, Any]) -> bytes:
        uri = buffer.get("uri")
        if uri is None:
            return self._binary
        if uri.startswith("data:"):
            return base64.b64decode(uri.partition(",")[2], validate=True)
        file = self.path.parent / unquote(uri)
        if not file.is_file():
            raise InputError(
                f"its buffer {uri} is missing", where=self.path, remedy="keep it beside the .gltf, or use .glb"
            )
        return file.read_bytes()

    def _glb_chunks(self, data: bytes) -> tuple[bytes, bytes]:
        """Return the JSON and the binary chunk of a GLB container."""
        if len(data) < 20:
            raise InputError(f"has {len(data)} bytes, less than a header", where=self.path, remedy=_CUT_SHORT)
        _, version, length = struct.unpack_from("<4sII", data)
        if version != 2:
            raise InputError(f"is glTF version {version}", where=self.path, remedy="export it as glTF 2.0")
        if length > len(data):
            what = f"the header says {length} bytes, but the file has {len(data)}"
            raise InputError(what, where=self.path, remedy=_CUT_SHORT)
        chunks: dict[bytes, bytes] = {}
        offset = 12
        while offset + 8 <= length:
            size, kind = struct.unpack_from("<I4s", data, offset)
            chunks.setdefault(kind, data[offset + 8 : offset + 8 + size])
            offset += 8 + size
        return chunks.get(b"JSON", b""), chunks.get(b"BIN\0", b"")
