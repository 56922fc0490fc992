"""Random scenes of boxes, wedges, cylinders and balls with slots and pockets, ray traced and labelled in torch.

For training on a GPU, where each crop can be a new one: B-rep solids (`recipe.py`) take a core a second each. Scenes
are simpler than those: bodies are convex, cut by convex cutters, and have no roundings. Labels mean the same: distance
in r = depth / focal length to the nearest sharp curve that borders a point's own face and is seen.

A curve is found where neighbouring rays, half a pixel apart, meet different faces: by halving the way between them. So
labels are within about 0.15 r beside a curve, and less elsewhere, on surfaces that do not lean away too far (`counts`).
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor
from torch.nn import functional as F

FACES = 9  # of a convex: -x, +x, -y, +y, -z, +z, two planes across, and what is round
PARTS = 3  # of a body: itself and two cutters
ROUND = 8
NEAR_M, FARTHEST_M = 0.02, 20.0
LIMIT_R = 16.0
SHARP_COS = 0.951  # 18 degrees
_HALVINGS = 4
_LIMB_COS = 0.2  # a round face seen that flatly where it ends is its silhouette
_STEEPEST = 5.0  # slope, beyond which nearest points of a curve are too far apart for a label
_MARGIN_PX = 16  # around a crop, whose curves count
_FAR = 1e6


@dataclass(frozen=True)
class Convexes:
    """[S, B, PARTS, ...]: pose (axes as rows, centre), half sides (axes that have no planes: _FAR), two planes across
    n x <= d in the part's own axes, weights of x², y², z² of what is round (all 0: nothing is), whether it exists."""

    axes: Tensor
    centre: Tensor
    half: Tensor
    across: Tensor
    across_at: Tensor
    bulge: Tensor
    there: Tensor

    def of(self, scene: Tensor) -> Convexes:
        return Convexes(*(value[scene] for value in vars(self).values()))


def _ends(parts: Convexes, way: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """Where rays [S, N, 3] from the origin enter and leave each part: depths and faces, [S, N, B, PARTS]."""
    v = torch.einsum("sbpij,snj->snbpi", parts.axes, way)
    o = -(parts.axes @ parts.centre[..., None]).squeeze(-1)[:, None]
    half = parts.half[:, None]
    v = torch.where(v.abs() < 1e-9, 1e-9, v)
    low, high = (-half - o) / v, (half - o) / v
    enter, leave = torch.minimum(low, high), torch.maximum(low, high)
    side = torch.arange(3, device=way.device) * 2
    enter_face, leave_face = side + (v < 0), side + (v > 0)
    n, d = parts.across[:, None], parts.across_at[:, None]  # [S, 1, B, P, 2, 3]
    along = (n * v[..., None, :]).sum(-1)
    at = (d - (n * o[..., None, :]).sum(-1)) / torch.where(along.abs() < 1e-9, 1e-9, along)
    across_face = (6 + torch.arange(2, device=way.device)).expand_as(at)
    q = parts.bulge[:, None]
    a, b, c = (q * v * v).sum(-1), (q * o * v).sum(-1), (q * o * o).sum(-1) - 1
    root = (b * b - a * c).clamp_min(0).sqrt()
    is_round = q.sum(-1) > 0
    missed = is_round & (b * b - a * c <= 0)
    safe = torch.where(is_round, a.clamp_min(1e-12), 1)
    round_in = torch.where(missed, _FAR, torch.where(is_round, (-b - root) / safe, -_FAR))
    round_out = torch.where(missed, -_FAR, torch.where(is_round, (-b + root) / safe, _FAR))
    face = torch.full_like(round_in, ROUND, dtype=torch.long)[..., None]
    ins = torch.cat([enter, torch.where(along < 0, at, -_FAR), round_in[..., None]], -1)
    outs = torch.cat([leave, torch.where(along > 0, at, _FAR), round_out[..., None]], -1)
    depth_in, where_in = ins.max(-1)
    depth_out, where_out = outs.min(-1)
    faces_in = torch.cat([enter_face, across_face, face], -1).gather(-1, where_in[..., None]).squeeze(-1)
    faces_out = torch.cat([leave_face, across_face, face], -1).gather(-1, where_out[..., None]).squeeze(-1)
    return depth_in, depth_out, faces_in, faces_out


def traced(parts: Convexes, way: Tensor) -> tuple[Tensor, Tensor]:
    """Depth [S, N] along z of rays [S, N, 3] with z = 1, 0 where they meet nothing; the face that each meets, or -1."""
    depth_in, depth_out, face_in, face_out = _ends(parts, way)
    bodies = depth_in.shape[2]
    empty = ~parts.there[:, None] | (depth_in >= depth_out)
    depth, face = depth_in[..., 0], face_in[..., 0]
    number = torch.arange(bodies, device=way.device) * (PARTS * FACES)
    face = number + face
    for _ in range(2):  # from one cutter into the other
        for k in range(1, PARTS):
            inside = ~empty[..., k] & (depth >= depth_in[..., k]) & (depth < depth_out[..., k])
            depth = torch.where(inside, depth_out[..., k], depth)
            face = torch.where(inside, number + k * FACES + face_out[..., k], face)
    hit = ~empty[..., 0] & (depth < depth_out[..., 0]) & (depth > NEAR_M) & (depth < FARTHEST_M)
    depth, nearest = torch.where(hit, depth, _FAR).min(-1)
    met = depth < _FAR
    return torch.where(met, depth, 0), torch.where(met, face.gather(-1, nearest[..., None]).squeeze(-1), -1)


def normals(parts: Convexes, face: Tensor, point: Tensor) -> Tensor:
    """Unit normals [M, 3] towards the origin of one face [M] of each scene's parts [M, B, ...] at points [M, 3]."""
    body, rest = face.clamp_min(0) // (PARTS * FACES), face.clamp_min(0) % (PARTS * FACES)
    part, number = rest // FACES, rest % FACES
    row = torch.arange(len(face), device=face.device)
    axes, centre = parts.axes[row, body, part], parts.centre[row, body, part]
    local = (axes @ (point - centre)[..., None]).squeeze(-1)
    flat = F.one_hot((number // 2).clamp_max(2), 3).float()
    across = parts.across[row, body, part, (number - 6).clamp(0, 1)]
    bulge = parts.bulge[row, body, part] * local
    own = torch.where((number == ROUND)[:, None], bulge, torch.where((number >= 6)[:, None], across, flat))
    normal = F.normalize((axes.mT @ own[..., None]).squeeze(-1), dim=-1)
    return torch.where(((normal * point).sum(-1) > 0)[:, None], -normal, normal)


@dataclass(frozen=True)
class Crops:
    """Planes [S, H, W] as export.edges wants them: depth in metres, 0: nothing; distance in r, 0..16; kind 0 none, 1
    crease, 2 boundary; counts: has a label. focal_px [S]."""

    depth: Tensor
    distance: Tensor
    kind: Tensor
    counts: Tensor
    focal_px: Tensor


def _rays(across_px: Tensor, down_px: Tensor, focal_px: Tensor, middle_px: Tensor) -> Tensor:
    """[S, N, 3] through pixels [S, N] of a crop, whose own (0, 0) is middle_px [S, 2] from the optical axis."""
    x = (across_px + middle_px[:, :1]) / focal_px[:, None]
    y = (down_px + middle_px[:, 1:]) / focal_px[:, None]
    return torch.stack([x, y, torch.ones_like(x)], -1)


@torch.no_grad()
def labelled(parts: Convexes, focal_px: Tensor, middle_px: Tensor, side_px: int) -> Crops:
    """Crops of side_px x side_px of scenes in camera coordinates."""
    scenes, device = len(focal_px), focal_px.device
    reach = 2 * (side_px + 2 * _MARGIN_PX)  # rays, half a pixel apart; even ones are pixels
    steps = torch.arange(reach, device=device) * 0.5 - _MARGIN_PX
    down, across = (grid.flatten().expand(scenes, -1) for grid in torch.meshgrid(steps, steps, indexing="ij"))
    depth, face = traced(parts, _rays(across, down, focal_px, middle_px))
    grid = face.view(scenes, reach, reach)
    pairs = []
    for axis, stride in ((1, reach), (2, 1)):
        length = reach - 1
        first, second = grid.narrow(axis, 0, length), grid.narrow(axis, 1, length)
        scene, row, column = torch.nonzero(first != second, as_tuple=True)
        index = row * reach + column
        pairs.append(torch.stack([scene, index, index + stride]))
    scene, one, other = torch.cat(pairs, 1)
    points, owner, kind, at_scene = _curve_points(
        parts, scene, one, other, (depth, face, across, down), focal_px, middle_px
    )
    inner = slice(2 * _MARGIN_PX, 2 * (_MARGIN_PX + side_px), 2)
    seen, own = (plane.view(scenes, reach, reach)[:, inner, inner] for plane in (depth, face))
    pixels = [
        plane.view(scenes, reach, reach)[0, inner, inner].flatten().expand(scenes, -1) for plane in (across, down)
    ]
    way = _rays(*pixels, focal_px, middle_px)
    flat, own_flat = seen.flatten(1), own.flatten(1)
    place = way * flat[..., None]
    best = torch.full_like(flat, float("inf"))
    best_kind = torch.zeros_like(own_flat)
    for k in range(scenes):
        mine = at_scene == k
        if mine.any():
            apart = torch.cdist(place[k], points[mine], compute_mode="donot_use_mm_for_euclid_dist")
            apart = torch.where(own_flat[k][:, None] == owner[mine][None], apart, float("inf"))
            best[k], nearest = apart.min(1)
            best_kind[k] = kind[mine][nearest]
    footprint = flat / focal_px[:, None]
    distance = (best / footprint.clamp_min(1e-9)).clamp_max(LIMIT_R)
    distance = torch.where(flat > 0, distance, LIMIT_R)
    row = torch.arange(scenes, device=device).repeat_interleave(flat.shape[1])
    facing = normals(parts.of(row), own_flat.flatten(), place.reshape(-1, 3)).view_as(place)
    cosine = -(facing * F.normalize(way, dim=-1)).sum(-1)
    counts = (flat > 0) & (cosine > 1 / (1 + _STEEPEST**2) ** 0.5)
    shape = seen.shape
    kinds = torch.where(distance < LIMIT_R, best_kind, 0)
    return Crops(seen, distance.view(shape), kinds.view(shape), counts.view(shape), focal_px)


def _curve_points(
    parts: Convexes,
    scene: Tensor,
    one: Tensor,
    other: Tensor,
    rays: tuple[Tensor, ...],
    focal_px: Tensor,
    middle: Tensor,
) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """Points [M, 3] of sharp curves between neighbouring rays, the face that each borders, its kind, its scene."""
    depth, face, across, down = rays
    parts_of = parts.of(scene)
    ends = []
    for index in (one, other):
        ends.append(
            {"x": across[scene, index], "y": down[scene, index], "z": depth[scene, index], "f": face[scene, index]}
        )
    a, b = ends
    for _ in range(_HALVINGS):
        x, y = (a["x"] + b["x"]) / 2, (a["y"] + b["y"]) / 2
        z, f = traced(parts_of, _rays(x[:, None], y[:, None], focal_px[scene], middle[scene]))
        z, f = z[:, 0], f[:, 0]
        nearer_a = f == a["f"]  # a third face in between becomes the other end
        for end, take in ((a, nearer_a), (b, ~nearer_a)):
            for name, value in (("x", x), ("y", y), ("z", z), ("f", f)):
                end[name] = torch.where(take, value, end[name])
    out = []
    ray, point, normal = [], [], []
    for end in (a, b):
        ray.append(_rays(end["x"][:, None], end["y"][:, None], focal_px[scene], middle[scene])[:, 0])
        point.append(ray[-1] * end["z"][:, None])
        normal.append(normals(parts_of, end["f"], point[-1]))
    cosine = [-(n * F.normalize(r, dim=-1)).sum(-1).clamp(-1, 1) for n, r in zip(normal, ray, strict=True)]
    slope = [(1 / c.clamp_min(0.02) ** 2 - 1).clamp_min(0).sqrt() for c in cosine]
    met = (a["f"] >= 0) & (b["f"] >= 0)
    step = ((a["x"] - b["x"]).abs() + (a["y"] - b["y"]).abs()) * torch.maximum(a["z"], b["z"]) / focal_px[scene]
    together = met & ((a["z"] - b["z"]).abs() <= step * (0.5 + 1.5 * torch.maximum(*slope)))
    sharp = (normal[0] * normal[1]).sum(-1) < SHARP_COS
    for end, far, k in ((a, b, 0), (b, a, 1)):
        number = end["f"].clamp_min(0) % (PARTS * FACES)
        limb = (number == ROUND) & (cosine[k] < _LIMB_COS)  # of the body itself: cutters are hollow
        ends_here = ~together & (end["f"] >= 0) & ((far["f"] < 0) | (end["z"] < far["z"])) & ~limb
        crease = together & sharp
        take = crease | ends_here
        kinds = torch.where(crease, 1, 2)
        out.append((point[k][take], end["f"][take], kinds[take], scene[take]))
    return tuple(torch.cat(values) for values in zip(*out, strict=True))


def _between(low: float, high: float, *shape: int, device: torch.device, log: bool = False) -> Tensor:
    share = torch.rand(shape, device=device)
    return low * (high / low) ** share if log else low + (high - low) * share


def _turned(yaw: Tensor) -> Tensor:
    """Rows: axes turned about the vertical [..., 3, 3]."""
    c, s, none = yaw.cos(), yaw.sin(), torch.zeros_like(yaw)
    return torch.stack([c, s, none, -s, c, none, none, none, none + 1], -1).unflatten(-1, (3, 3))


def _any_rotation(*shape: int, device: torch.device) -> Tensor:
    q = F.normalize(torch.randn(*shape, 4, device=device), dim=-1)
    w, x, y, z = q.unbind(-1)
    rows = [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w),
            2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
            2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]  # fmt: skip
    return torch.stack(rows, -1).unflatten(-1, (3, 3))


def _shaped(half: Tensor, across_fraction: float) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """Half sides [..., 3] -> those of planes, planes across, where these are, and bulges, of a random shape each: box,
    box with one or two corners off, cylinder, ball."""
    shape, device = half.shape[:-1], half.device
    kind = torch.rand(shape, device=device)
    ball, cylinder = kind < 0.08, (kind >= 0.08) & (kind < 0.33)
    own = half.clone()
    own[..., 0] = torch.where(cylinder | ball, _FAR, own[..., 0])
    own[..., 1] = torch.where(cylinder | ball, _FAR, own[..., 1])
    own[..., 2] = torch.where(ball, _FAR, own[..., 2])
    bulge = 1 / half**2
    bulge[..., 1] = torch.where(cylinder, bulge[..., 0], bulge[..., 1])  # round from above
    bulge[..., 2] = torch.where(ball, bulge[..., 2], 0)
    bulge = bulge * (cylinder | ball)[..., None]
    # Each coordinate of the normal is a third of it at least, or none: no plane leans by less than 18 degrees.
    n = _between(0.4, 1, *shape, 2, 3, device=device) * torch.randn(*shape, 2, 3, device=device).sign()
    n = n * (torch.rand(*shape, 2, 3, device=device) < 0.75)
    n = torch.where((n.abs().sum(-1, keepdim=True) > 0) & ((n != 0).sum(-1, keepdim=True) > 1), n, n + 0.7)
    n = F.normalize(n / half[..., None, :] * half.amin(-1)[..., None, None], dim=-1)
    corner = (n.abs() * half[..., None, :]).sum(-1)
    used = (torch.rand(*shape, 2, device=device) < across_fraction) & ~(cylinder | ball)[..., None]
    at = torch.where(used, corner * _between(0.3, 0.9, *shape, 2, device=device), _FAR)
    return own, n, at, bulge


@torch.no_grad()
def drawn_scenes(count: int, side_px: int, device: torch.device, bodies: int = 9) -> tuple[Convexes, Tensor, Tensor]:
    """Random scenes in camera coordinates, focal lengths [S] and where crops of side_px lie [S, 2], as for `labelled`,
    from torch's own generator: piles, rows of slats, cartons side by side, single things with slots, on the ground, in
    a corner or alone."""

    def between(low: float, high: float, *shape: int, log: bool = False) -> Tensor:
        return _between(low, high, *shape, device=device, log=log)

    s, b = count, bodies - 3  # three are floor and walls
    focal, away = between(180, 560, s, log=True), between(0.5, 4, s, log=True)
    size = between(60, 450, s, log=True) * away / focal
    layout = torch.rand(s, 1, device=device)
    slats, cartons = layout < 0.3, (layout >= 0.3) & (layout < 0.5)
    single = layout >= 0.85
    alive = torch.arange(b, device=device) < torch.randint(2, b + 1, (s, 1), device=device)
    alive = torch.where(
        single, torch.arange(b, device=device) < 1, alive | (slats & (torch.rand(s, 1, device=device) < 0.7))
    )

    half = between(0.04, 0.4, s, b, 3, log=True)
    half = torch.where(single[..., None], between(0.15, 0.5, s, b, 3), half)
    common = between(0.06, 0.5, s, 1, 3, log=True)
    pitch = between(0.03, 0.3, s, 1, log=True)
    thin = torch.stack([(pitch * between(0.1, 0.45, s, 1)), common[..., 1], common[..., 2]], -1)
    half = torch.where(slats[..., None], thin.expand_as(half), half)
    side_by_side = common[..., :1] * between(0.8, 1, s, b, 3)
    half = torch.where(cartons[..., None], side_by_side, half)
    half = half * size[:, None, None]

    number = torch.arange(b, device=device, dtype=torch.float32) - b / 2
    spread = torch.stack([*torch.randn(2, s, b, device=device).mul(0.3), between(0, 0.3, s, b)], -1)
    row = torch.stack([number * pitch, between(-0.03, 0.03, s, b) * slats, torch.zeros(s, b, device=device)], -1)
    across = torch.stack([(number % 3 - 1) * 2.02, (number // 3) * 2.02, (number > 1.5) * 2.0], -1) * common[..., :1]
    place = torch.where(slats[..., None], row, torch.where(cartons[..., None], across, spread))
    place = place * size[:, None, None]
    yaw = between(0, 6.2832, s, 1) + torch.where(
        slats | cartons, between(-0.05, 0.05, s, b) * cartons, between(0, 6.2832, s, b)
    )
    turned = _turned(yaw)
    flat_yaw = _turned(yaw[:, :1].expand(s, b))
    place = torch.where((slats | cartons)[..., None], (flat_yaw.mT @ place[..., None]).squeeze(-1), place)
    on_floor = torch.rand(s, b, device=device) < 0.7
    place[..., 2] = torch.where(on_floor | (slats | cartons), place[..., 2] * cartons + half[..., 2], place[..., 2])
    tilted = (torch.rand(s, b, device=device) < 0.15) & ~(slats | cartons)
    axes = torch.where(tilted[..., None, None], _any_rotation(s, b, device=device), turned)

    planes, n, at, bulge = _shaped(half, 0.3)
    plain = (slats & (torch.rand(s, 1, device=device) < 0.8)) | cartons
    planes = torch.where(plain[..., None], half, planes)
    bulge = bulge * ~plain[..., None]
    at = torch.where(plain[..., None], _FAR, at)

    cut = PARTS - 1
    own_half = half[:, :, None].expand(s, b, cut, 3)
    cutter = own_half * between(0.1, 0.8, s, b, cut, 3, log=True)
    through = F.one_hot(torch.randint(0, 3, (s, b, cut), device=device), 3) > 0
    through = through & (torch.rand(s, b, cut, 1, device=device) < 0.6)
    cutter = torch.where(through, own_half * 1.5, cutter)
    offset = torch.where(through, 0, own_half * between(-1, 1, s, b, cut, 3))
    cut_axes = torch.where(
        (torch.rand(s, b, cut, device=device) < 0.2)[..., None, None], _any_rotation(s, b, cut, device=device),
        torch.eye(3, device=device),
    )  # fmt: skip
    cut_axes = cut_axes @ axes[:, :, None]
    cut_place = place[:, :, None] + (axes[:, :, None].mT @ offset[..., None]).squeeze(-1)
    cut_planes, cut_n, cut_at, cut_bulge = _shaped(cutter, 0.15)
    cuts = (torch.rand(s, b, cut, device=device) < torch.where(single, 0.8, 0.25)[..., None]) & ~(slats & ~single)[
        ..., None
    ]

    room = torch.rand(s, 1, device=device)
    far = size[:, None] * between(0.4, 1.2, s, 2)
    walls = torch.zeros(s, 3, 3, device=device)
    walls[:, 0, 2], walls[:, 1, 0], walls[:, 2, 1] = -50.0, 50 + far[:, 0], 50 + far[:, 1]
    wall_yaw = between(0, 6.2832, s, 1)
    wall_axes = _turned(wall_yaw)
    walls = (wall_axes.mT @ walls[..., None]).squeeze(-1)
    there = torch.cat([room > 0.2, (room > 0.55).expand(s, 2)], 1)
    no_cutters = torch.zeros(s, 3, cut, dtype=torch.bool, device=device)
    exists = torch.cat([torch.cat([there[..., None], no_cutters], 2), torch.cat([alive[..., None], cuts], 2)], 1)

    def joined(first: Tensor, cutters: Tensor, floor: Tensor) -> Tensor:
        body = torch.cat([first[:, :, None], cutters], 2)
        return torch.cat([floor[:, :, None].expand(s, 3, PARTS, *floor.shape[2:]), body], 1)

    world = Convexes(
        joined(axes, cut_axes, wall_axes.expand(s, 3, 3, 3)),
        joined(place, cut_place, walls),
        joined(planes, cut_planes, torch.full((s, 3, 3), 50.0, device=device)),
        joined(n, cut_n, torch.zeros(s, 3, 2, 3, device=device)),
        joined(at, cut_at, torch.full((s, 3, 2), _FAR, device=device)),
        joined(bulge, cut_bulge, torch.zeros(s, 3, 3, device=device)),
        exists,
    )
    # The camera looks at the middle of the things; towards the corner where there is one.
    up = between(0.15, 1.35, s)
    sideways = torch.where(room[:, 0] > 0.55, wall_yaw[:, 0] + 3.927 + between(-0.6, 0.6, s), between(0, 6.2832, s))
    eye = torch.stack([up.cos() * sideways.cos(), up.cos() * sideways.sin(), up.sin()], -1) * away[:, None]
    target = torch.zeros(s, 3, device=device)
    target[:, 2] = 0.2 * size
    ahead = F.normalize(target - eye, dim=-1)
    right = F.normalize(torch.linalg.cross(ahead, torch.tensor([0.0, 0, 1], device=device).expand(s, 3)), dim=-1)
    rows = torch.stack([right, torch.linalg.cross(ahead, right), ahead], 1)
    roll = _turned(torch.randn(s, device=device) * 0.1)
    rows = roll @ rows
    turn = rows[:, None, None]
    moved = (turn @ (world.centre - eye[:, None, None])[..., None]).squeeze(-1)
    parts = Convexes(world.axes @ turn.mT, moved, world.half, world.across, world.across_at, world.bulge, exists)
    aim = moved[torch.arange(s, device=device), 3, 0]
    aim = aim[:, :2] / aim[:, 2:].clamp_min(0.1) * focal[:, None]
    middle = (aim.clamp(-150, 150) + between(-0.5, 0.5, s, 2) * side_px - side_px / 2).round()
    return parts, focal, middle
