"""Check surfaces in VTK's XML format: files written by VTK, by these tests, and damaged ones."""

from __future__ import annotations

import base64
import lzma
import zlib
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from osimlite.errors import OsimliteError
from osimlite.io.meshes.surface import Surface, triangulate
from osimlite.io.meshes.vtp import read_vtp

# Names of fixtures that VTK has written, by format of the data.
WRITTEN_BY_VTK = (
    "ascii",
    "binary",
    "binary-zlib-uint64",
    "appended-raw-uint64",
    "appended-base64",
    "appended-raw-zlib",
    "appended-base64-zlib-bigendian",
    "appended-raw-lzma",
)


def area(surface: Surface) -> float:
    a, b, c = (surface.points[surface.triangles[:, k]] for k in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()) / 2


def volume(surface: Surface) -> float:
    a, b, c = (surface.points[surface.triangles[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6


# --------------------------------------------------------------------------------------------- what VTK writes
@pytest.mark.parametrize("encoding", WRITTEN_BY_VTK)
def test_what_vtk_writes_is_read(fixtures, encoding):
    surface = read_vtp((fixtures / "meshes" / f"{encoding}.vtp").read_bytes(), "x.vtp")
    assert len(surface.points) == 54
    # Area and volume were computed by VTK.
    assert area(surface) == pytest.approx(7.090658003369256, rel=1e-12)
    assert volume(surface) == pytest.approx(1.062036759256733, rel=1e-12)
    same = read_vtp((fixtures / "meshes" / "binary.vtp").read_bytes(), "x.vtp")
    assert np.array_equal(surface.triangles, same.triangles)
    assert np.abs(surface.points - same.points).max() < 1e-7
    assert surface.normals is not None and same.normals is not None
    assert np.abs(np.linalg.norm(surface.normals, axis=1) - 1.0).max() < 1e-6


def test_strips_are_cut_into_triangles_that_face_outwards(fixtures):
    surface = read_vtp((fixtures / "meshes" / "strips.vtp").read_bytes(), "x.vtp")
    assert area(surface) == pytest.approx(2.7916199479303834, rel=1e-12)
    assert volume(surface) == pytest.approx(0.4125177180761224, rel=1e-12)


def test_a_compression_that_is_not_known_is_named(fixtures):
    with pytest.raises(
        OsimliteError,
        match=r"lz4\.vtp: it is compressed by vtkLZ4DataCompressor.*save the mesh again",
    ):
        read_vtp((fixtures / "meshes" / "binary-lz4.vtp").read_bytes(), "lz4.vtp")


# ------------------------------------------------------------------------------------- what the format allows
class Writer:
    """Writer of arrays according to the description of the format."""

    def __init__(self, form: str, compressor: str, header: str, order: str) -> None:
        self.form, self.compressor, self.header, self.order = form, compressor, header, order
        self.appended = b""

    def block(self, data: bytes) -> list[bytes]:
        """Return the parts that base64 encodes separately: the header and the compressed blocks."""
        pack = np.dtype(
            ("<" if self.order == "LittleEndian" else ">")
            + {"UInt32": "u4", "UInt64": "u8"}[self.header]
        )
        if not self.compressor:
            return [np.array([len(data)], dtype=pack).tobytes() + data]
        size = 40
        parts = [data[start : start + size] for start in range(0, len(data), size)]
        squeeze = zlib.compress if "ZLib" in self.compressor else lzma.compress
        blocks = [squeeze(part) for part in parts]
        last = len(data) % size
        numbers = [len(blocks), size, last, *map(len, blocks)]
        return [np.array(numbers, dtype=pack).tobytes(), b"".join(blocks)]

    def array(self, name: str, values: np.ndarray, kind: str, components: int = 1) -> str:
        types = {"Float32": "f4", "Float64": "f8", "Int32": "i4", "Int64": "i8"}
        typed = values.astype(("<" if self.order == "LittleEndian" else ">") + types[kind])
        start = f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="{components}"'
        if self.form == "ascii":
            return f'{start} format="ascii">\n {" ".join(map(repr, typed.ravel().tolist()))}\n</DataArray>'
        parts = self.block(typed.tobytes())
        text = b"".join(map(base64.b64encode, parts))
        if self.form == "binary":
            return f'{start} format="binary">\n   {text.decode()}\n</DataArray>'
        offset = len(self.appended)
        self.appended += b"".join(parts) if self.form == "raw" else text
        return f'{start} format="appended" offset="{offset}"/>'

    def file(
        self, pieces: list[tuple[np.ndarray, list[list[int]]]], real: str, whole: str
    ) -> bytes:
        text = ""
        for points, polygons in pieces:
            corners = np.array([corner for polygon in polygons for corner in polygon], dtype=int)
            ends = np.cumsum([len(polygon) for polygon in polygons], dtype=int)
            text += (
                f'<Piece NumberOfPoints="{len(points)}" NumberOfPolys="{len(polygons)}"><Points>'
            )
            text += self.array("Points", points, real, 3) + "</Points><Verts/><Polys>"
            text += self.array("connectivity", corners, whole) + self.array("offsets", ends, whole)
            text += "</Polys></Piece>"
        head = f'<VTKFile type="PolyData" version="1.0" byte_order="{self.order}" header_type="{self.header}"'
        head += f' compressor="{self.compressor}">' if self.compressor else ">"
        result = f'<?xml version="1.0"?>\n{head}<PolyData>{text}</PolyData>'.encode()
        if self.appended:
            encoding = "raw" if self.form == "raw" else "base64"
            result += (
                f'<AppendedData encoding="{encoding}">\n  _'.encode()
                + self.appended
                + b"\n</AppendedData>"
            )
        return result + b"</VTKFile>\n"


CUBE = np.array([(x, y, z) for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
SIDES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]


@given(
    form=st.sampled_from(("ascii", "binary", "raw", "base64")),
    compressor=st.sampled_from(("", "vtkZLibDataCompressor", "vtkLZMADataCompressor")),
    header=st.sampled_from(("UInt32", "UInt64")),
    order=st.sampled_from(("LittleEndian", "BigEndian")),
    real=st.sampled_from(("Float32", "Float64")),
    whole=st.sampled_from(("Int32", "Int64")),
    pieces=st.integers(1, 3),
)
def test_every_encoding_says_the_same(form, compressor, header, order, real, whole, pieces):
    content = Writer(form, compressor, header, order).file(
        [(CUBE + np.array((2.0 * k, 0.0, 0.0)), SIDES) for k in range(pieces)], real, whole
    )
    surface = read_vtp(content, "cube.vtp")
    assert surface.points.shape == (8 * pieces, 3) and surface.triangles.shape == (12 * pieces, 3)
    assert np.array_equal(
        surface.points,
        np.concatenate([CUBE + np.array((2.0 * k, 0.0, 0.0)) for k in range(pieces)]),
    )
    assert volume(surface) == pytest.approx(pieces) and area(surface) == pytest.approx(6.0 * pieces)
    assert surface.normals is None


@given(st.data())
def test_a_damaged_file_is_read_or_refused_in_one_sentence(fixtures, data):
    name = data.draw(st.sampled_from((*WRITTEN_BY_VTK, "strips")))
    content = bytearray((fixtures / "meshes" / f"{name}.vtp").read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        place = data.draw(st.integers(0, len(content) - 1))
        content[place : place + data.draw(st.integers(0, 3))] = data.draw(st.binary(max_size=3))
    content = content[: data.draw(st.one_of(st.just(len(content)), st.integers(0, len(content))))]
    try:
        surface = read_vtp(bytes(content), "damaged.vtp")
    except OsimliteError as error:
        assert (
            str(error).startswith("damaged.vtp: ")
            and "save the mesh again" in str(error)
            and "\n" not in str(error)
        )
    else:
        assert np.isfinite(surface.points).all()
        assert 0 <= surface.triangles.min() <= surface.triangles.max() < len(surface.points)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"solid bone", "not a VTK file in XML"),
        (b'<VTKFile type="UnstructuredGrid"/>', "surface"),
        (b'<VTKFile type="PolyData"><PolyData/></VTKFile>', "no polygons"),
        (b'<VTKFile type="PolyData"><AppendedData encoding="raw">_xx', "ends in the middle"),
        (b'<VTKFile type="PolyData"><PolyData><Piece/></PolyData></VTKFile>', "without points"),
        (
            Writer("ascii", "", "UInt32", "LittleEndian").file(
                [(CUBE[:4], SIDES)], "Float32", "Int32"
            ),
            "does not contain",
        ),
        (
            Writer("ascii", "", "UInt32", "LittleEndian").file(
                [(CUBE + np.inf, SIDES)], "Float32", "Int32"
            ),
            "finite",
        ),
    ],
)
def test_what_is_wrong_is_said(content, said):
    with pytest.raises(OsimliteError, match=said):
        read_vtp(content, "bone.vtp")


# --------------------------------------------------------------------------------------------------- polygons
@given(st.lists(st.floats(0.2, 3.0), min_size=3, max_size=12), st.floats(0.0, 6.0), st.booleans())
def test_polygons_that_are_not_convex_are_covered_once(radii, tilt, turned):
    """Triangles of a star-shaped polygon in any plane have its area and its orientation."""
    angles = np.linspace(0.0, 2.0 * np.pi, len(radii), endpoint=False)
    flat = np.array([np.cos(angles), np.sin(angles)]).T * np.array(radii)[:, None]
    flat = flat[::-1] if turned else flat
    points = np.column_stack([flat[:, 0], flat[:, 1] * np.cos(tilt), flat[:, 1] * np.sin(tilt)])
    triangles = triangulate(points, np.arange(len(points)), np.array([len(points)]))
    assert len(triangles) == len(points) - 2
    whole = np.cross(points, np.roll(points, -1, axis=0)).sum(axis=0)
    a, b, c = (points[triangles[:, k]] for k in range(3))
    parts = np.cross(b - a, c - a)
    assert np.abs(parts.sum(axis=0) - whole).max() < 1e-9
    assert (parts @ whole > -1e-9).all()
    edges = {(first, second) for t in triangles.tolist() for first, second in pairwise([*t, t[0]])}
    assert {(k, (k + 1) % len(points)) for k in range(len(points))} <= edges


def test_a_mirrored_surface_still_faces_outwards(fixtures):
    surface = read_vtp((fixtures / "meshes" / "ascii.vtp").read_bytes(), "x.vtp")
    for signs in ((1.0, 1.0, -1.0), (-1.0, 1.0, -1.0), (-1.0, -1.0, -1.0)):
        mirrored = surface.stretch(signs)
        assert volume(mirrored) == pytest.approx(volume(surface))
        assert mirrored.normals is not None
        a, b, c = (mirrored.points[mirrored.triangles[:, k]] for k in range(3))
        assert (
            np.einsum(
                "ij,ij->i", np.cross(b - a, c - a), mirrored.normals[mirrored.triangles[:, 0]]
            )
            > 0.0
        ).all()
