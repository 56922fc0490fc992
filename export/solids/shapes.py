"""Solids by OpenCascade: primitives, swept profiles, Boolean operations, fillets, chamfers, shells.

Lengths in metres, angles in radians, z up. A function that OpenCascade cannot carry out raises ShapeError; what it
makes is checked to be a valid solid, so that nothing later meets a broken one.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from OCP.Bnd import Bnd_Box
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve
from OCP.BRepAlgoAPI import BRepAlgoAPI_BooleanOperation, BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
from OCP.BRepBndLib import BRepBndLib
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge, BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakeWire
from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform as Transform
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepFilletAPI import BRepFilletAPI_MakeChamfer, BRepFilletAPI_MakeFillet
from OCP.BRepGProp import BRepGProp
from OCP.BRepOffsetAPI import BRepOffsetAPI_MakeThickSolid
from OCP.BRepPrimAPI import (
    BRepPrimAPI_MakeBox,
    BRepPrimAPI_MakeCone,
    BRepPrimAPI_MakeCylinder,
    BRepPrimAPI_MakePrism,
    BRepPrimAPI_MakeRevol,
    BRepPrimAPI_MakeSphere,
    BRepPrimAPI_MakeTorus,
)
from OCP.GC import GC_MakeArcOfCircle
from OCP.GeomAbs import GeomAbs_Circle, GeomAbs_Line
from OCP.gp import gp_Ax1, gp_Ax2, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec
from OCP.GProp import GProp_GProps
from OCP.ShapeUpgrade import ShapeUpgrade_UnifySameDomain
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_ShapeEnum
from OCP.TopExp import TopExp
from OCP.TopoDS import TopoDS, TopoDS_Edge, TopoDS_Face, TopoDS_Shape
from OCP.TopTools import TopTools_IndexedMapOfShape, TopTools_ListOfShape

_PLAIN = (GeomAbs_Line, GeomAbs_Circle)
_UP = gp_Dir(0, 0, 1)
_JOIN_TOLERANCE = 1e-7  # OpenCascade's own precision of lengths


class ShapeError(ValueError):
    """OpenCascade could not make this shape; the recipe draws another."""


def box(size: Sequence[float], at: Sequence[float] = (0, 0, 0)) -> TopoDS_Shape:
    """A box of width, depth and height; `at` is the middle of its foot."""
    w, d, h = map(float, size)
    corner = gp_Pnt(float(at[0]) - w / 2, float(at[1]) - d / 2, float(at[2]))
    return BRepPrimAPI_MakeBox(corner, w, d, h).Shape()


def _axis(at: Sequence[float]) -> gp_Ax2:
    return gp_Ax2(gp_Pnt(*map(float, at)), _UP)


def cylinder(radius: float, height: float, at: Sequence[float] = (0, 0, 0)) -> TopoDS_Shape:
    return BRepPrimAPI_MakeCylinder(_axis(at), float(radius), float(height)).Shape()


def cone(foot: float, top: float, height: float, at: Sequence[float] = (0, 0, 0)) -> TopoDS_Shape:
    """A cone, or its stump: radii at the foot and at the top."""
    return BRepPrimAPI_MakeCone(_axis(at), float(foot), float(top), float(height)).Shape()


def sphere(radius: float, at: Sequence[float] = (0, 0, 0)) -> TopoDS_Shape:
    return BRepPrimAPI_MakeSphere(_axis(at), float(radius)).Shape()


def torus(ring: float, tube: float, at: Sequence[float] = (0, 0, 0)) -> TopoDS_Shape:
    return BRepPrimAPI_MakeTorus(_axis(at), float(ring), float(tube)).Shape()


def profile(points: np.ndarray, bulges: Sequence[float] | None = None, plane: str = "xy") -> TopoDS_Face:
    """A face with a closed outline. points: [n, 2]; bulges: height of each side's arc by half its length (0: a line),
    to the right of the way along it. plane: "xy", or "xz" for revolutions."""
    points = np.asarray(points, float)

    def lifted(p: np.ndarray) -> gp_Pnt:
        return gp_Pnt(p[0], p[1], 0.0) if plane == "xy" else gp_Pnt(p[0], 0.0, p[1])

    wire = BRepBuilderAPI_MakeWire()
    for k, start in enumerate(points):
        end = points[(k + 1) % len(points)]
        bulge = bulges[k] if bulges is not None else 0.0
        if abs(bulge) < 1e-3:
            edge = BRepBuilderAPI_MakeEdge(lifted(start), lifted(end)).Edge()
        else:
            along = end - start
            top = (start + end) / 2 + bulge / 2 * np.array([along[1], -along[0]])
            edge = BRepBuilderAPI_MakeEdge(GC_MakeArcOfCircle(lifted(start), lifted(top), lifted(end)).Value()).Edge()
        wire.Add(edge)
    if not wire.IsDone():
        raise ShapeError("the outline is not closed")
    return BRepBuilderAPI_MakeFace(wire.Wire(), True).Face()


def extruded(face: TopoDS_Face, height: float) -> TopoDS_Shape:
    return checked(BRepPrimAPI_MakePrism(face, gp_Vec(0, 0, float(height))).Shape())


def revolved(face: TopoDS_Face, angle: float = 2 * np.pi) -> TopoDS_Shape:
    """About the z axis; the face lies in the plane xz at x >= 0."""
    return checked(BRepPrimAPI_MakeRevol(face, gp_Ax1(gp_Pnt(0, 0, 0), _UP), float(angle)).Shape())


def prism(points: np.ndarray, height: float) -> TopoDS_Shape:
    """An outline [n, 2] of straight lines raised from z = 0."""
    return extruded(profile(points), height)


def moved(shape: TopoDS_Shape, rotation: np.ndarray | None = None, shift: Sequence[float] = (0, 0, 0)) -> TopoDS_Shape:
    """rotation: [3, 3], applied first; shift: metres."""
    matrix = np.eye(3) if rotation is None else np.asarray(rotation, float)
    transform = gp_Trsf()
    rows = [[*map(float, matrix[k]), float(shift[k])] for k in range(3)]
    transform.SetValues(*rows[0], *rows[1], *rows[2])
    return Transform(shape, transform, True).Shape()


def scaled(shape: TopoDS_Shape, factor: float) -> TopoDS_Shape:
    """Enlarged about the origin."""
    transform = gp_Trsf()
    transform.SetScale(gp_Pnt(0, 0, 0), float(factor))
    return Transform(shape, transform, True).Shape()


def _list(shapes: Iterable[TopoDS_Shape]) -> TopTools_ListOfShape:
    out = TopTools_ListOfShape()
    for shape in shapes:
        out.Append(shape)
    return out


def _boolean(
    operation: BRepAlgoAPI_BooleanOperation, first: TopoDS_Shape, rest: Sequence[TopoDS_Shape]
) -> TopoDS_Shape:
    operation.SetArguments(_list([first]))
    operation.SetTools(_list(rest))
    operation.Build()
    if not operation.IsDone():
        raise ShapeError("a Boolean operation failed")
    return operation.Shape()


def fused(shapes: Sequence[TopoDS_Shape]) -> TopoDS_Shape:
    """One shape of all; faces in one plane (or on one cylinder) that touch become one."""
    if len(shapes) == 1:
        return shapes[0]
    made = _boolean(BRepAlgoAPI_Fuse(), shapes[0], shapes[1:])
    joined = ShapeUpgrade_UnifySameDomain(made, True, True, False)
    joined.Build()
    return checked(joined.Shape())


def cut(shape: TopoDS_Shape, tools: Sequence[TopoDS_Shape]) -> TopoDS_Shape:
    return checked(_boolean(BRepAlgoAPI_Cut(), shape, tools)) if tools else shape


def elements(shape: TopoDS_Shape, kind: TopAbs_ShapeEnum) -> list[TopoDS_Shape]:
    found = TopTools_IndexedMapOfShape()
    TopExp.MapShapes_s(shape, kind, found)
    return [found.FindKey(k) for k in range(1, found.Extent() + 1)]


def edges(shape: TopoDS_Shape) -> list[TopoDS_Edge]:
    return [TopoDS.Edge_s(e) for e in elements(shape, TopAbs_EDGE)]


def plain_edges(shape: TopoDS_Shape) -> list[TopoDS_Edge]:
    """Straight lines and arcs: fillets along other curves often fail, and may never end."""
    return [e for e in edges(shape) if not BRep_Tool.Degenerated_s(e) and BRepAdaptor_Curve(e).GetType() in _PLAIN]


def faces(shape: TopoDS_Shape) -> list[TopoDS_Face]:
    return [TopoDS.Face_s(f) for f in elements(shape, TopAbs_FACE)]


def filleted(shape: TopoDS_Shape, chosen: Sequence[TopoDS_Edge], radius: float) -> TopoDS_Shape:
    maker = BRepFilletAPI_MakeFillet(shape)
    for edge in chosen:
        maker.Add(float(radius), edge)
    return _built(maker, "fillet")


def chamfered(shape: TopoDS_Shape, chosen: Sequence[TopoDS_Edge], width: float) -> TopoDS_Shape:
    maker = BRepFilletAPI_MakeChamfer(shape)
    for edge in chosen:
        maker.Add(float(width), edge)
    return _built(maker, "chamfer")


def shelled(shape: TopoDS_Shape, opened: Sequence[TopoDS_Face], thickness: float) -> TopoDS_Shape:
    """Hollow, with walls of a thickness inwards; open where the faces were."""
    maker = BRepOffsetAPI_MakeThickSolid()
    maker.MakeThickSolidByJoin(shape, _list(opened), -float(thickness), 1e-5)
    return _built(maker, "shell")


def _built(maker, what: str) -> TopoDS_Shape:
    try:
        maker.Build()
        done = maker.IsDone()
        made = maker.Shape() if done else None
    except Exception as error:  # OpenCascade's errors share no base class in Python
        raise ShapeError(f"the {what} failed: {error}") from error
    if not done:
        raise ShapeError(f"the {what} failed")
    return checked(made)


def volume(shape: TopoDS_Shape) -> float:
    properties = GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, properties)
    return properties.Mass()


def bounds(shape: TopoDS_Shape) -> np.ndarray:
    """[2, 3]: lowest and highest corner."""
    found = Bnd_Box()
    BRepBndLib.AddOptimal_s(shape, found, False, False)
    if found.IsVoid():
        raise ShapeError("nothing is left of the shape")
    return np.array(found.Get()).reshape(2, 3)


def checked(shape: TopoDS_Shape) -> TopoDS_Shape:
    if shape.IsNull() or not BRepCheck_Analyzer(shape).IsValid() or volume(shape) <= 0:
        raise ShapeError("the shape is not a valid solid")
    return shape
