"""Arrays of a shape for rendering and labels: triangles by face, edges with the normals on both sides.

Faces are numbered from 0. An edge is a line, an arc, or a polyline through points of its curve; where its faces meet at
a varying angle (a cylinder through a cylinder) normals are known at each of its knots.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve, BRepAdaptor_Surface
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.BRepTools import BRepTools
from OCP.GeomAbs import (
    GeomAbs_Circle,
    GeomAbs_Cylinder,
    GeomAbs_Line,
    GeomAbs_Plane,
    GeomAbs_Sphere,
    GeomAbs_Torus,
)
from OCP.gp import gp_Pnt, gp_Vec
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_REVERSED
from OCP.TopExp import TopExp, TopExp_Explorer
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Face, TopoDS_Shape
from OCP.TopTools import TopTools_IndexedDataMapOfShapeListOfShape, TopTools_IndexedMapOfShape

from export.solids import shapes
from export.solids.surfaces import Bent, bent_of

MESH_ANGLE = 0.25  # radians between neighbouring triangles; the deviation in metres is what counts
_MESH_FRACTION = 0.7  # of the deviation asked for; OpenCascade takes it for a guide and exceeds it a little
_ARC_STEP = 0.1  # radians between the knots of an arc
LINE, ARC, SPLINE = 0, 1, 2


@dataclass(eq=False)
class Edge:
    """kind: LINE, ARC or SPLINE (points joined by chords). parameter: float64 [k], rising, along the curve (0..1;
    radians of arcs); point [k, 3]; normal [k, 2, 3]: outward, of either face; face: [2]; convex: bool [k];
    centre, x, y: float64 [3] of arcs, point = centre + x cos t + y sin t."""

    kind: int
    parameter: np.ndarray
    point: np.ndarray
    normal: np.ndarray
    face: tuple[int, int]
    convex: np.ndarray
    centre: np.ndarray | None = None
    x: np.ndarray | None = None
    y: np.ndarray | None = None

    @property
    def angle(self) -> np.ndarray:
        """[k] radians between the normals: 0 on a smooth surface, pi on a blade."""
        a, b = self.normal[:, 0], self.normal[:, 1]
        return np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), (a * b).sum(1))


@dataclass(eq=False)
class Rounding:
    """A face that rounds something, tightly bent one way: radius in metres, and the curve along its middle."""

    face: int
    radius: float
    middle: Edge


@dataclass(eq=False)
class Solid:
    """vertex: float64 [v, 3]; triangle: int32 [t, 3], outward; triangle_face: int32 [t]; bent: the equation of
    each face that has one."""

    vertex: np.ndarray
    triangle: np.ndarray
    triangle_face: np.ndarray
    face_count: int
    bent: dict[int, Bent]
    edges: list[Edge]
    roundings: list[Rounding]


def solid_of(shape: TopoDS_Shape, deviation_m: float) -> Solid:
    """deviation_m: of triangles and chords from surface and curves, at most."""
    mesher = BRepMesh_IncrementalMesh(shape, _MESH_FRACTION * deviation_m, False, MESH_ANGLE, False)
    if not mesher.IsDone():
        raise shapes.ShapeError("the shape could not be divided into triangles")
    faces = shapes.faces(shape)
    vertex, triangle, owner, count = [], [], [], 0
    for number, face in enumerate(faces):
        v, t = _triangles(face)
        vertex.append(v)
        triangle.append(t + count)
        owner.append(np.full(len(t), number, np.int32))
        count += len(v)
    surfaces = [BRepAdaptor_Surface(face) for face in faces]
    edges = _edges(shape, faces, surfaces, deviation_m)
    return Solid(
        vertex=np.concatenate(vertex),
        triangle=np.concatenate(triangle).astype(np.int32),
        triangle_face=np.concatenate(owner),
        face_count=len(faces),
        bent={k: bent for k, surface in enumerate(surfaces) if (bent := bent_of(surface)) is not None},
        edges=edges,
        roundings=_roundings(faces, surfaces, edges),
    )


def _triangles(face: TopoDS_Face) -> tuple[np.ndarray, np.ndarray]:
    location = TopLoc_Location()
    mesh = BRep_Tool.Triangulation_s(face, location)
    if mesh is None:
        raise shapes.ShapeError("a face has no triangles")
    transform = location.Transformation()
    moved = not location.IsIdentity()
    points = np.empty((mesh.NbNodes(), 3))
    for k in range(len(points)):
        p = mesh.Node(k + 1)
        p = p.Transformed(transform) if moved else p
        points[k] = p.X(), p.Y(), p.Z()
    corners = np.array([mesh.Triangle(k + 1).Get() for k in range(mesh.NbTriangles())], np.int64) - 1
    if face.Orientation() == TopAbs_REVERSED:
        corners = corners[:, ::-1]
    return points, corners


def _normal(surface: BRepAdaptor_Surface, u: float, v: float, reversed_: bool) -> np.ndarray:
    p, du, dv = gp_Pnt(), gp_Vec(), gp_Vec()
    surface.D1(u, v, p, du, dv)
    a, b = np.array([du.X(), du.Y(), du.Z()]), np.array([dv.X(), dv.Y(), dv.Z()])
    n = np.cross(a, b)
    length = np.linalg.norm(n)
    if length < 1e-12 * max(a @ a, b @ b, 1e-30):
        return np.full(3, np.nan)  # a cone's tip, a sphere's pole
    return -n / length if reversed_ else n / length


def _edges(
    shape: TopoDS_Shape, faces: list[TopoDS_Face], surfaces: list[BRepAdaptor_Surface], deviation_m: float
) -> list[Edge]:
    around = TopTools_IndexedDataMapOfShapeListOfShape()
    TopExp.MapShapesAndAncestors_s(shape, TopAbs_EDGE, TopAbs_FACE, around)
    number = TopTools_IndexedMapOfShape()
    TopExp.MapShapes_s(shape, TopAbs_FACE, number)
    found = []
    for k in range(1, around.Extent() + 1):
        edge = TopoDS.Edge_s(around.FindKey(k))
        if BRep_Tool.Degenerated_s(edge):
            continue
        beside = sorted({number.FindIndex(f) - 1 for f in around.FindFromIndex(k)})
        if len(beside) != 2:  # a seam of one face with itself
            continue
        one = _edge(edge, (beside[0], beside[1]), faces, surfaces, deviation_m)
        if one is not None:
            found.append(one)
    return found


def _edge(edge, beside, faces, surfaces, deviation_m) -> Edge | None:
    curve = BRepAdaptor_Curve(edge)
    first, last = curve.FirstParameter(), curve.LastParameter()
    kind = {GeomAbs_Line: LINE, GeomAbs_Circle: ARC}.get(curve.GetType(), SPLINE)
    frame = (None, None, None)
    if kind == LINE:
        both_flat = all(surfaces[f].GetType() == GeomAbs_Plane for f in beside)
        t = np.linspace(first, last, 2 if both_flat else 9)
    elif kind == ARC:
        t = np.linspace(first, last, max(int(np.ceil((last - first) / _ARC_STEP)), 2) + 1)
        circle = curve.Circle()
        axes, radius = circle.Position(), circle.Radius()
        frame = tuple(
            np.array([p.X(), p.Y(), p.Z()]) * s
            for p, s in ((axes.Location(), 1.0), (axes.XDirection(), radius), (axes.YDirection(), radius))
        )
    else:
        t = _chord_knots(curve, first, last, deviation_m)
    points = np.array([_xyz(curve.Value(float(s))) for s in t])
    normals = np.empty((len(t), 2, 3))
    for side, f in enumerate(beside):
        face = faces[f]
        flat = surfaces[f].GetType() == GeomAbs_Plane
        flip = face.Orientation() == TopAbs_REVERSED
        on_face = BRep_Tool.CurveOnSurface_s(edge, face, 0.0, 0.0) if not flat else None
        for j, s in enumerate(t):
            if flat and j:
                normals[j, side] = normals[0, side]
                continue
            u, v = (0.0, 0.0) if flat else (lambda p: (p.X(), p.Y()))(on_face.Value(float(s)))
            normals[j, side] = _normal(surfaces[f], u, v, flip)
    normals = _filled(normals)
    if normals is None:
        return None
    tangent = np.gradient(points, t, axis=0)
    if kind == ARC:
        tangent = -frame[1] * np.sin(t)[:, None] + frame[2] * np.cos(t)[:, None]
    side = _travel_sign(edge, faces[beside[0]])
    inward = np.cross(normals[:, 0], tangent) * side  # within the first face, away from the edge
    convex = (inward * normals[:, 1]).sum(1) < 0
    if kind != ARC:
        t = (t - first) / (last - first)
    return Edge(kind, t, points, normals, beside, convex, *frame)


def _xyz(p: gp_Pnt) -> tuple[float, float, float]:
    return p.X(), p.Y(), p.Z()


def _filled(normals: np.ndarray) -> np.ndarray | None:
    """Where a normal is not defined, that of its neighbour; None where there is none at all."""
    for side in range(2):
        bad = np.isnan(normals[:, side, 0])
        if bad.all():
            return None
        if bad.any():
            good = np.flatnonzero(~bad)
            near = good[np.abs(np.flatnonzero(bad)[:, None] - good).argmin(1)]
            normals[bad, side] = normals[near, side]
    return normals


def _travel_sign(edge, face) -> float:
    """1 where the face lies to the left of the edge's curve, seen from outside."""
    explorer = TopExp_Explorer(face, TopAbs_EDGE)
    while explorer.More():
        if explorer.Current().IsSame(edge):
            # An explorer composes orientations: that of the face is in it already.
            return -1.0 if explorer.Current().Orientation() == TopAbs_REVERSED else 1.0
        explorer.Next()
    raise shapes.ShapeError("an edge is not on its face")


def _chord_knots(curve: BRepAdaptor_Curve, first: float, last: float, deviation_m: float) -> np.ndarray:
    """Parameters between which chords leave the curve by no more than the deviation."""
    count = 8
    while True:
        t = np.linspace(first, last, 2 * count + 1)
        p = np.array([_xyz(curve.Value(float(s))) for s in t])
        off = np.linalg.norm(p[1::2] - (p[:-2:2] + p[2::2]) / 2, axis=1).max()
        if off <= deviation_m or count >= 256:
            return t[::2]
        count *= 2


def _roundings(faces, surfaces, edges: list[Edge]) -> list[Rounding]:
    """Faces bent tightly one way that go over smoothly into others on at least two edges."""
    smooth: dict[int, int] = {}
    for edge in edges:
        if np.median(edge.angle) < np.radians(10):
            for f in edge.face:
                smooth[f] = smooth.get(f, 0) + 1
    found = []
    for number, (face, surface) in enumerate(zip(faces, surfaces, strict=True)):
        if smooth.get(number, 0) < 2 or surface.GetType() == GeomAbs_Plane:
            continue
        one = _rounding(number, face, surface)
        if one is not None:
            found.append(one)
    return found


def _rounding(number: int, face: TopoDS_Face, surface: BRepAdaptor_Surface) -> Rounding | None:
    u0, u1, v0, v1 = BRepTools.UVBounds_s(face)
    kind = surface.GetType()
    u, v = (u0 + u1) / 2, (v0 + v1) / 2
    if kind == GeomAbs_Cylinder:
        radius, across, turn = surface.Cylinder().Radius(), "u", u1 - u0
    elif kind == GeomAbs_Torus:
        radius, across, turn = surface.Torus().MinorRadius(), "v", v1 - v0
    elif kind == GeomAbs_Sphere:
        radius, across, turn = surface.Sphere().Radius(), "u", min(u1 - u0, v1 - v0)
    else:
        bends = _bends(surface, u, v, u1 - u0, v1 - v0)
        across = "u" if bends[0] > bends[1] else "v"
        turn = max(bends)
        arc = _length(surface, *((u0, u1, v, v) if across == "u" else (u, u, v0, v1)))
        radius = arc / max(turn, 1e-9)
    if not np.radians(10) < turn < np.radians(200):
        return None
    count = 13
    us = np.full(count, u) if across == "u" else np.linspace(u0, u1, count)
    vs = np.linspace(v0, v1, count) if across == "u" else np.full(count, v)
    flip = face.Orientation() == TopAbs_REVERSED
    points = np.array([_xyz(surface.Value(float(a), float(b))) for a, b in zip(us, vs, strict=True)])
    if np.linalg.norm(np.diff(points, axis=0), axis=1).sum() < 1e-9:
        return None
    # The normals of what lies on either side, as if the rounding were not there.
    sides = ((u0, vs), (u1, vs)) if across == "u" else ((us, v0), (us, v1))
    normals = _filled(
        np.stack([[_normal(surface, float(a), float(b), flip) for a, b in np.broadcast(*s)] for s in sides], 1)
    )
    if normals is None:
        return None
    # Convex where the surface bends away from its outward normal.
    a, b = ((u0, v), (u1, v)) if across == "u" else ((u, v0), (u, v1))
    ends = (np.array(_xyz(surface.Value(*a))) + np.array(_xyz(surface.Value(*b)))) / 2
    middle = np.array(_xyz(surface.Value(u, v)))
    convex = np.full(count, bool((middle - ends) @ normals[count // 2].sum(0) > 0))
    t = np.linspace(0, 1, count)
    return Rounding(number, float(radius), Edge(SPLINE, t, points, normals, (number, number), convex))


def _bends(surface, u: float, v: float, du: float, dv: float) -> tuple[float, float]:
    """Angle that the normal turns through across the face in u and in v."""

    def turn(ends) -> float:
        a, b = (_normal(surface, *end, False) for end in ends)
        return float(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b)) if not np.isnan([a, b]).any() else 0.0

    return turn(((u - du / 2, v), (u + du / 2, v))), turn(((u, v - dv / 2), (u, v + dv / 2)))


def _length(surface, ua: float, ub: float, va: float, vb: float) -> float:
    s = np.linspace(0, 1, 9)
    p = np.array([_xyz(surface.Value(float(ua + (ub - ua) * k), float(va + (vb - va) * k))) for k in s])
    return float(np.linalg.norm(np.diff(p, axis=0), axis=1).sum())
