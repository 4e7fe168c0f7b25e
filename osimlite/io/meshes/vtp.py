"""Reading surfaces in VTK's XML format (``.vtp``, PolyData), in every encoding that VTK writes.

The format: https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html. Numbers stand
as text, or as base64 in place, or after the tree, raw or as base64; either of the last three may be
compressed in blocks. Vertices and lines have no surface and are passed over.
"""

from __future__ import annotations

import base64
import binascii
import lzma
import re
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
from lxml import etree
from numpy.typing import NDArray

from osimlite.base.text import append_clause
from osimlite.errors import OsimliteError
from osimlite.io.meshes.surface import (
    Array,
    Indices,
    Polygons,
    Surface,
    split_strip,
    triangulate,
)

MAX_BYTES = 400_000_000
"""Bytes of all numbers of a file, decompressed. A mesh of a million points has about 50 MB of them."""


def _decompress_zlib(block: bytes, size: int) -> bytes:
    """Return the content of a block that zlib has compressed.

    Raises:
        ValueError: the block is cut off, or its content is longer than `size` bytes.
    """
    stream = zlib.decompressobj()
    # One byte more than allowed shows that there is more.
    data = stream.decompress(block, size + 1)
    if len(data) > size or not stream.eof:
        raise ValueError
    return data


def _decompress_lzma(block: bytes, size: int) -> bytes:
    """Return the content of a block that LZMA has compressed.

    Raises:
        ValueError: the block is cut off, or its content is longer than `size` bytes.
    """
    stream = lzma.LZMADecompressor(memlimit=MAX_BYTES)
    data = stream.decompress(block, size + 1)
    if len(data) > size or not stream.eof:
        raise ValueError
    return data


_DECOMPRESS: dict[str, Callable[[bytes, int], bytes]] = {
    "vtkZLibDataCompressor": _decompress_zlib,
    "vtkLZMADataCompressor": _decompress_lzma,
}

_TYPES = {
    **{f"Int{bits}": f"i{bits // 8}" for bits in (8, 16, 32, 64)},
    **{f"UInt{bits}": f"u{bits // 8}" for bits in (8, 16, 32, 64)},
    "Float32": "f4",
    "Float64": "f8",
}


class _Unreadable(Exception):
    """Error of a file, without its name."""


def read_vtp(content: bytes, name: str) -> Surface:
    """Read the surface of a ``.vtp`` file as triangles.

    Args:
        content: content of the file.
        name: name of the file, for messages.

    Returns:
        Triangles of the surface, with normals if the file has them for all points.

    Raises:
        OsimliteError: the file is not such a file, is damaged, or has an unsupported compression.
    """
    with _name_errors(name):
        return _File(content).read_surface()


def read_vtp_polygons(content: bytes, name: str) -> Polygons:
    """Read the polygons of a ``.vtp`` file.

    Numbers in text keep all digits even if the file declares single precision, as in Simbody.

    Args:
        content: content of the file.
        name: name of the file, for messages.

    Returns:
        Polygons of the file, including those of strips.

    Raises:
        OsimliteError: the file is not such a file, is damaged, or has an unsupported compression.
    """
    with _name_errors(name):
        return _File(content, all_digits=True).read_polygons()[0]


@contextmanager
def _name_errors(name: str) -> Iterator[None]:
    """Raise errors of a file with its name.

    Raises:
        OsimliteError: the reader finds in the body of the `with` statement that it cannot read the
            file.
    """
    try:
        # Invalid numbers of a damaged file are found in the result, so numpy need not warn of
        # them.
        with np.errstate(all="ignore"):
            yield
    except _Unreadable as problem:
        raise OsimliteError(
            append_clause(str(problem), "save the mesh again as PolyData (.vtp) or as .obj"),
            file=name,
        ) from None


class _File:
    def __init__(self, content: bytes, *, all_digits: bool = False) -> None:
        self.all_digits = all_digits
        self.left: float = MAX_BYTES
        # Appended data may be raw bytes, which are not XML, so they are cut out before parsing.
        self.appended = b""
        mark = content.find(b"<AppendedData")
        if mark >= 0:
            data_start = content.find(b"_", content.find(b">", mark)) + 1
            data_end = content.rfind(b"</AppendedData")
            # The data begin after an underscore.
            if not 0 < data_start <= data_end:
                raise _Unreadable("the file ends in the middle")
            self.appended, content = (
                content[data_start:data_end],
                content[:data_start] + content[data_end:],
            )
        try:
            # `huge_tree`: meshes have texts beyond the parser's limit of 10 MB.
            parser = etree.XMLParser(resolve_entities=False, no_network=True, huge_tree=True)
            self.root = etree.fromstring(content, parser)
        except etree.XMLSyntaxError as error:
            # The parser breaks some of its messages into lines.
            reason = " ".join(str(error.msg).split()).replace(" ,", ",")
            raise _Unreadable(f"it is not a VTK file in XML ({reason})") from None
        if self.root.getroottree().docinfo.internalDTD is not None:
            raise _Unreadable("it has a DOCTYPE, which may declare what is not in the file")
        if self.root.tag != "VTKFile" or self.root.get("type") != "PolyData":
            raise _Unreadable("it is not a VTK file with a surface (type PolyData)")
        section = self.root.find("AppendedData")
        self.raw = section is not None and section.get("encoding") == "raw"
        # VTK writes the byte order of the machine that wrote the file.
        self.order = ">" if self.root.get("byte_order") == "BigEndian" else "<"
        self.header = np.dtype(
            self.order + _TYPES.get(self.root.get("header_type", "UInt32"), "u4")
        )
        self.compressor = self.root.get("compressor", "")
        try:
            offsets = {int(array.get("offset", "0")) for array in self.root.iter("DataArray")}
        except ValueError:
            raise _Unreadable("one of its offsets is not a number") from None
        # An array ends where the next one begins.
        self.offsets = [*sorted(offsets), len(self.appended)]

    def read_surface(self) -> Surface:
        polygons, normals = self.read_polygons()
        return Surface(polygons.points, triangulate(*polygons), normals)

    def read_polygons(self) -> tuple[Polygons, Array | None]:
        """Return all polygons, including those of strips, and the normals.

        Returns:
            The polygons, and the normals at the points (n, 3); None if a piece has none.

        Raises:
            _Unreadable: the file has no polygons.
        """
        points = [np.zeros((0, 3))]
        corners = [np.zeros(0, dtype=np.int64)]
        normals = [np.zeros((0, 3))]
        sizes = [np.zeros(0, dtype=np.int64)]
        count = 0
        all_normals = True
        for piece in self.root.iterfind("PolyData/Piece"):
            piece_points = self._read_vectors(piece.find("Points/DataArray"))
            points.append(piece_points)
            for around, lengths in self._iterate_polygons(piece, len(piece_points)):
                # Indices of a piece count from its first point.
                corners.append(around + count)
                sizes.append(lengths)
            at_points = self._read_normals(piece, len(piece_points))
            # Normals of some pieces only would not fit the points of all.
            all_normals = all_normals and at_points is not None
            normals += [] if at_points is None else [at_points]
            count += len(piece_points)
        ends = np.concatenate(sizes).cumsum()
        if not len(ends):
            raise _Unreadable("it has no polygons")
        result = Polygons(np.concatenate(points), np.concatenate(corners), ends)
        return result, np.concatenate(normals) if all_normals else None

    def _iterate_polygons(
        self, piece: etree._Element, count: int
    ) -> Iterator[tuple[Indices, Indices]]:
        """Yield corners one after the other, and numbers of corners: polygons first, then triangles of each strip."""
        corners, ends = self._read_cells(piece, "Polys", count)
        yield corners, np.diff(ends, prepend=0)
        corners, ends = self._read_cells(piece, "Strips", count)
        for strip in np.split(corners, ends[:-1]) if len(ends) else []:
            # A strip of n points makes n - 2 triangles.
            if len(strip) >= 3:
                triangles = split_strip(strip)
                yield triangles.ravel(), np.full(len(triangles), 3)

    def _read_cells(self, piece: etree._Element, tag: str, count: int) -> tuple[Indices, Indices]:
        """Return the corners of all cells of a kind, one after the other, and the end of each cell.

        Raises:
            _Unreadable: the offsets do not fit the connectivity, or a corner is not one of the
                points.
        """
        corners, ends = (
            np.zeros(0, dtype=np.int64)
            if array is None
            else self._read_numbers(array).astype(np.int64)
            for array in (
                piece.find(f"{tag}/DataArray[@Name='{name}']")
                for name in ("connectivity", "offsets")
            )
        )
        if not len(ends):
            return corners[:0], ends
        if ends[0] < 0 or np.any(np.diff(ends) < 0) or ends[-1] > len(corners):
            raise _Unreadable(f"the offsets of its {tag} do not fit their connectivity")
        # Corners beyond the last cell are ignored.
        corners = corners[: ends[-1]]
        if len(corners) and not 0 <= corners.min() <= corners.max() < count:
            raise _Unreadable(f"its {tag} refer to points that the file does not contain")
        return corners, ends

    def _read_normals(self, piece: etree._Element, count: int) -> Array | None:
        """Return the normals (n, 3) at the points of a piece; None if it has none that fit."""
        data = piece.find("PointData")
        if data is None:
            return None
        # PointData names its normals in an attribute; "Normals" is VTK's usual name.
        normals_name = data.get("Normals", "Normals")
        array = next(
            (
                candidate
                for candidate in data.iterfind("DataArray")
                if candidate.get("Name") == normals_name
            ),
            None,
        )
        if array is None or array.get("NumberOfComponents") != "3":
            return None
        normals = self._read_vectors(array)
        return normals if len(normals) == count else None

    def _read_vectors(self, array: etree._Element | None) -> Array:
        if array is None:
            raise _Unreadable("it has a piece without points")
        numbers = self._read_numbers(array).astype(np.float64)
        if len(numbers) % 3 or not np.isfinite(numbers).all():
            raise _Unreadable(
                f"its {array.get('Name', 'points')} are not three finite numbers each"
            )
        return numbers.reshape(-1, 3)

    def _read_numbers(self, array: etree._Element) -> NDArray[np.generic]:
        """Return the numbers of a DataArray.

        Raises:
            _Unreadable: the type or format of the numbers is unknown, or they are damaged, cut off,
                or need too much memory.
        """
        kind, form = array.get("type", ""), array.get("format", "ascii")
        if kind not in _TYPES:
            raise _Unreadable(f"it has numbers of the type '{kind}'")
        dtype = np.dtype(self.order + _TYPES[kind])
        try:
            match form:
                case "ascii":
                    # Text of single precision has more digits than the type holds.
                    exact = self.all_digits and dtype.kind == "f"
                    return np.array(
                        (array.text or "").split(), dtype=np.float64 if exact else dtype
                    )
                case "binary":
                    stream = _decode_base64((array.text or "").encode())
                case "appended":
                    stream = self._get_appended_array(int(array.get("offset", "0")))
                case _:
                    raise _Unreadable(f"it has numbers in the format '{form}'")
            # Callers convert each number to eight bytes, however few the file uses.
            return np.frombuffer(self._read_block(stream, 8 / dtype.itemsize), dtype)
        except MemoryError:
            raise _Unreadable(
                f"its numbers named '{array.get('Name', '')}' need more memory than there is"
            ) from None
        except (ValueError, IndexError, OverflowError, binascii.Error, zlib.error, lzma.LZMAError):
            raise _Unreadable(
                f"its numbers named '{array.get('Name', '')}' are damaged or cut off"
            ) from None

    def _get_appended_array(self, offset: int) -> bytes:
        """Return the bytes of the array that starts at an offset of the appended data.

        Raises:
            ValueError: the offset is outside of the appended data.
        """
        if not 0 <= offset < len(self.appended):
            raise ValueError
        end = next(next_offset for next_offset in self.offsets if next_offset > offset)
        encoded = self.appended[offset:end]
        return encoded if self.raw else _decode_base64(encoded)

    def _count_bytes(self, count: float) -> None:
        """Add bytes to the sum of numbers read, which is limited.

        Several arrays may use the same bytes, so that the size of the file is no limit.

        Raises:
            _Unreadable: the sum is larger than `MAX_BYTES`.
        """
        self.left -= count
        if self.left < 0:
            raise _Unreadable(f"it has more than {MAX_BYTES / 1e6:g} MB of numbers")

    def _read_block(self, stream: bytes, weight: float) -> bytes:
        """Return the content of a block of bytes after its header, decompressed.

        Args:
            stream: bytes of the header and the block.
            weight: bytes in memory for each byte of the content.

        Raises:
            ValueError: the block does not have the size that its header declares.
            _Unreadable: the compression is unknown, or the content is larger than `MAX_BYTES`
                allows.
        """
        width = self.header.itemsize
        if not self.compressor:
            size = int(np.frombuffer(stream, self.header, 1)[0])
            # The size that the header says may be more than is there.
            self._count_bytes(weight * min(size, len(stream)))
            data = stream[width : width + size]
            if len(data) != size:
                raise ValueError
            return data
        if self.compressor not in _DECOMPRESS:
            raise _Unreadable(
                f"it is compressed by {self.compressor}, which osimlite does not read"
            )
        blocks = int(np.frombuffer(stream, self.header, 1)[0])
        if not blocks:
            return b""
        # The header has the number of blocks, their size, the size of the last one, and the
        # compressed sizes.
        _, block_size, last_size, *sizes = np.frombuffer(stream, self.header, 3 + blocks).tolist()
        # Check the declared size before decompressing anything; no block may be larger.
        self._count_bytes(weight * (block_size * (blocks - bool(last_size)) + last_size))
        offset = (3 + blocks) * width
        contents = []
        for size in sizes:
            contents.append(
                _DECOMPRESS[self.compressor](
                    stream[offset : offset + size], max(block_size, last_size)
                )
            )
            offset += size
        # VTK writes the length zero for a last block that is as long as the others.
        if sum(map(len, contents)) != block_size * (blocks - bool(last_size)) + last_size:
            raise ValueError
        return b"".join(contents)


def _decode_base64(text: bytes) -> bytes:
    """Return the bytes of base64 text, in which header and data may be encoded separately."""
    # "=" ends a part.
    parts = re.findall(rb"[^=]+=*", b"".join(text.split()))
    return b"".join(base64.b64decode(part, validate=True) for part in parts)
