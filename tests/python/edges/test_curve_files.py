"""Files of curves as other programs read them: the bytes that the native test writes again (tests/native/edges)."""

import json
from pathlib import Path

import numpy as np
import pytest
import trimesh

from export.edges.curve_metrics import curves_of

DATA = Path("tests/native/data/curves")


def length(points: np.ndarray) -> float:
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


@pytest.fixture(scope="module")
def expected() -> list[np.ndarray]:
    """The points of each curve in the JSON."""
    return curves_of(json.loads((DATA / "example.json").read_text()))


def test_the_json_says_how_long_its_curves_are():
    for curve in json.loads((DATA / "example.json").read_text())["curves"]:
        assert length(np.array(curve["points"])) == pytest.approx(curve["length_m"], rel=2e-4)


def test_trimesh_reads_the_points_that_the_lines_of_the_obj_join(expected):
    """It reads no `l` elements; these are plain."""
    points = np.asarray(trimesh.load(DATA / "example.obj", process=False).vertices)
    lines = [line.split()[1:] for line in (DATA / "example.obj").read_text().splitlines() if line.startswith("l ")]
    found = [length(points[np.array(line, int) - 1]) for line in lines]
    assert found == pytest.approx([length(points) for points in expected], abs=1e-6)


def test_trimesh_reads_the_edges_of_the_ply(expected):
    raw = trimesh.load(DATA / "example.ply").metadata["_ply_raw"]
    points = np.stack([np.ravel(raw["vertex"]["data"][axis]) for axis in "xyz"], 1)
    ends = np.stack([np.ravel(raw["edge"]["data"][name]) for name in ("vertex1", "vertex2")], 1)
    total = np.linalg.norm(points[ends[:, 1]] - points[ends[:, 0]], axis=1).sum()
    assert total == pytest.approx(sum(map(length, expected)), abs=1e-6)


def test_ezdxf_reads_lines_and_polylines_on_the_layers_of_their_kind(expected):
    ezdxf = pytest.importorskip("ezdxf", reason="ezdxf is not installed: pip install -e .[dev]")
    entities = list(ezdxf.readfile(DATA / "example.dxf").modelspace())
    assert [e.dxftype() for e in entities] == ["LINE", "POLYLINE", "POLYLINE", "POLYLINE"]
    assert [e.dxf.layer for e in entities] == ["CREASE_CONVEX", "BOUNDARY", "CREASE_CONCAVE", "CREASE"]
    line = np.array([entities[0].dxf.start, entities[0].dxf.end])
    lengths = [length(line)] + [length(np.array([v.dxf.location for v in e.vertices])) for e in entities[1:]]
    assert lengths == pytest.approx([length(points) for points in expected], abs=1e-6)


def step_edges(path: Path) -> list:
    """The edges that OpenCascade makes of a STEP file, in metres, with the lengths of their curves."""
    pytest.importorskip("OCP", reason="OpenCascade is not installed: pip install -e .[solids]")
    from OCP.BRepAdaptor import BRepAdaptor_Curve
    from OCP.GCPnts import GCPnts_AbscissaPoint
    from OCP.IFSelect import IFSelect_RetDone
    from OCP.STEPControl import STEPControl_Reader
    from OCP.TopAbs import TopAbs_EDGE
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS

    reader = STEPControl_Reader()
    assert reader.ReadFile(str(path)) == IFSelect_RetDone
    reader.TransferRoots()
    explorer, found = TopExp_Explorer(reader.OneShape(), TopAbs_EDGE), []
    while explorer.More():
        curve = BRepAdaptor_Curve(TopoDS.Edge_s(explorer.Current()))
        found.append((curve, GCPnts_AbscissaPoint.Length_s(curve, 1e-9) / 1000))  # it reads as millimetres
        explorer.Next()
    return found


def test_opencascade_reads_lines_circles_and_splines_of_the_step_exactly():
    curves = json.loads((DATA / "example.json").read_text())["curves"]
    edges = step_edges(DATA / "example.step")
    assert [str(curve.GetType()).rsplit("_", 1)[1] for curve, _ in edges] == [
        "Line",
        "Circle",
        "BSplineCurve",
        "Circle",
    ]
    line, arc, spline, circle = (length for _, length in edges)
    assert line == pytest.approx(curves[0]["length_m"], abs=1e-6)
    assert arc == pytest.approx(np.linalg.norm(curves[1]["x_axis"]) * curves[1]["sweep_rad"], abs=1e-6)
    assert circle == pytest.approx(0.2 * np.pi, abs=1e-6)
    polyline = np.array(curves[2]["points"])
    assert spline == pytest.approx(length(polyline), rel=2e-2)
    assert spline > length(polyline)
    for (curve, _), expected in zip(edges, curves, strict=True):
        first, last = curve.FirstParameter(), curve.LastParameter()
        count = len(expected["points"])
        for i, point in enumerate(expected["points"]):
            value = curve.Value(first + (last - first) * i / (count - 1))
            assert np.array([value.X(), value.Y(), value.Z()]) / 1000 == pytest.approx(np.array(point), abs=1e-6)
