#include "head/mesh/mesh_raster.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/error.h"

namespace maq::head {
namespace {

constexpr int kBandRows = 16, kMaxSide = 16384;
constexpr size_t kTask = 8192;  // vertices or triangles
constexpr uint32_t kNoTriangle = UINT32_MAX;

using Vector = std::array<double, 3>;

// What is linear in the pixel: a column + b row + c.
struct Plane {
  double a = 0, b = 0, c = 0;
};

// The plane that is 0 along the edge from p to q in the picture (Olano and Greer, Triangle scan conversion using 2D
// homogeneous coordinates, 1997: no clipping). The other way round it is the negative, to the bit: so of triangles that
// share an edge, each pixel on it belongs to one at least.
template <class Vertex>
Plane edge_plane(const Vertex& p, const Vertex& q, const HeadCamera& camera) {
  const double x = p.y * q.z - p.z * q.y, y = p.z * q.x - p.x * q.z, z = p.x * q.y - p.y * q.x;
  return {x / camera.focal_px, y / camera.focal_px, z - (x * camera.cx_px + y * camera.cy_px) / camera.focal_px};
}

struct Setup {
  std::array<Plane, 3> edges;  // opposite of each corner; all positive inside
  Plane inverse_depth;
  bool is_seen = false;
};

template <class Vertex>
Setup set_up(const std::array<const Vertex*, 3>& corners, const HeadCamera& camera) {
  Setup made;
  for (size_t k = 0; k < 3; ++k) {
    made.edges[k] = edge_plane(*corners[(k + 1) % 3], *corners[(k + 2) % 3], camera);
  }
  // Six times the volume of the triangle and the camera's centre; 0 for triangles without an area, and those seen from
  // their side.
  const Vertex &p = *corners[0], &q = *corners[1], &r = *corners[2];
  const double volume = p.x * (q.y * r.z - q.z * r.y) + p.y * (q.z * r.x - q.x * r.z) + p.z * (q.x * r.y - q.y * r.x);
  if (volume == 0 || !std::isfinite(volume)) return made;
  const double sign = volume > 0 ? 1 : -1;
  for (Plane& edge : made.edges) {
    edge = {sign * edge.a, sign * edge.b, sign * edge.c};
    made.inverse_depth.a += edge.a, made.inverse_depth.b += edge.b, made.inverse_depth.c += edge.c;
  }
  const double scale = 1 / std::abs(volume);
  made.inverse_depth = {made.inverse_depth.a * scale, made.inverse_depth.b * scale, made.inverse_depth.c * scale};
  made.is_seen = std::isfinite(scale);
  return made;
}

void check(const HeadCamera& camera) {
  if (camera.width_px < 1 || camera.height_px < 1 || camera.width_px > kMaxSide || camera.height_px > kMaxSide) {
    throw Error(MAQ_ERROR_IMAGE_SIZE, "A picture of a mesh is asked for with ", camera.width_px, "x", camera.height_px,
                " pixels. Give each side 1 to ", kMaxSide, ".");
  }
  bool is_finite = std::isfinite(camera.focal_px) && camera.focal_px > 0 && std::isfinite(camera.cx_px) &&
                   std::isfinite(camera.cy_px);
  is_finite = is_finite && maq::is_finite(camera.head_to_camera.translation);
  for (const double value : camera.head_to_camera.rotation) is_finite = is_finite && std::isfinite(value);
  if (!is_finite) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The camera of a mesh's picture has a focal length of ", camera.focal_px,
                " pixels, or a number that is not finite. Give a positive one and finite numbers.");
  }
}

// The first and last pixel between two positions, within 0 and `size`.
std::array<int, 2> pixels_between(double low, double high, int size) {
  return {int(std::clamp(std::ceil(low), 0.0, double(size))), int(std::clamp(std::floor(high), -1.0, size - 1.0))};
}

}  // namespace

void MeshRaster::project(const HeadMesh& mesh, const HeadCamera& camera, double near, WorkerThreads& threads) {
  vertices_.resize(mesh.vertex_count());
  rows_.resize(mesh.triangle_count());
  threads.run((vertices_.size() + kTask - 1) / kTask, [&](size_t task, int) {
    for (size_t i = task * kTask; i < std::min((task + 1) * kTask, vertices_.size()); ++i) {
      const float* const p = &mesh.positions[3 * i];
      const Vec3 seen = camera.head_to_camera * Vec3{double(p[0]), double(p[1]), double(p[2])};
      Vertex& vertex = vertices_[i];
      vertex.x = seen.x, vertex.y = seen.y, vertex.z = seen.z;
      if (vertex.z < near) continue;
      vertex.column_px = camera.focal_px * vertex.x / vertex.z + camera.cx_px;
      vertex.row_px = camera.focal_px * vertex.y / vertex.z + camera.cy_px;
    }
  });
  threads.run((rows_.size() + kTask - 1) / kTask, [&](size_t task, int) {
    for (size_t i = task * kTask; i < std::min((task + 1) * kTask, rows_.size()); ++i) {
      double low = 1e300, high = -1e300;
      int behind = 0;
      for (size_t k = 0; k < 3; ++k) {
        const Vertex& vertex = vertices_[mesh.triangles[3 * i + k]];
        if (!(vertex.z >= near)) {
          ++behind;
        } else {
          low = std::min(low, vertex.row_px), high = std::max(high, vertex.row_px);
        }
      }
      rows_[i] = {0, -1};
      if (behind == 3) continue;
      if (behind > 0) low = -1, high = camera.height_px;  // may be anywhere
      const auto rows = pixels_between(low, high, camera.height_px);
      rows_[i] = {rows[0], rows[1]};
    }
  });
}

void MeshRaster::draw_band(const HeadMesh& mesh, const HeadCamera& camera, double near, int top, int bottom) {
  const size_t width = size_t(camera.width_px);
  std::fill(inverse_depth_.begin() + std::ptrdiff_t(size_t(top) * width),
            inverse_depth_.begin() + std::ptrdiff_t(size_t(bottom) * width), 0.0f);
  std::fill(triangles_.begin() + std::ptrdiff_t(size_t(top) * width),
            triangles_.begin() + std::ptrdiff_t(size_t(bottom) * width), kNoTriangle);
  const double max_inverse_depth = 1 / near;
  for (size_t i = 0; i < rows_.size(); ++i) {
    const int first_row = std::max(rows_[i].first, top), last_row = std::min(rows_[i].last, bottom - 1);
    if (first_row > last_row) continue;
    std::array<const Vertex*, 3> corners{};
    double low = 1e300, high = -1e300;
    for (size_t k = 0; k < 3; ++k) {
      corners[k] = &vertices_[mesh.triangles[3 * i + k]];
      const bool is_behind = !(corners[k]->z >= near);
      low = std::min(low, is_behind ? -1.0 : corners[k]->column_px);
      high = std::max(high, is_behind ? double(camera.width_px) : corners[k]->column_px);
    }
    const auto columns = pixels_between(low, high, camera.width_px);
    if (columns[0] > columns[1]) continue;
    const Setup setup = set_up(corners, camera);
    if (!setup.is_seen) continue;
    const Plane &e0 = setup.edges[0], &e1 = setup.edges[1], &e2 = setup.edges[2], &depth = setup.inverse_depth;
    for (int row = first_row; row <= last_row; ++row) {
      const double c0 = e0.b * row + e0.c, c1 = e1.b * row + e1.c, c2 = e2.b * row + e2.c, cd = depth.b * row + depth.c;
      float* const depths = inverse_depth_.data() + size_t(row) * width;
      for (int column = columns[0]; column <= columns[1]; ++column) {
        if (e0.a * column + c0 < 0 || e1.a * column + c1 < 0 || e2.a * column + c2 < 0) continue;
        const double inverse = depth.a * column + cd;
        if (!(inverse > 0) || inverse > max_inverse_depth || float(inverse) <= depths[column]) continue;
        depths[column] = float(inverse);
        triangles_[size_t(row) * width + size_t(column)] = uint32_t(i);
      }
    }
  }
}

void MeshRaster::shade_band(const HeadMesh& mesh, const HeadCamera& camera, const RasterOptions& options, int top,
                            int bottom, RasterImage& image) const {
  const size_t width = size_t(camera.width_px);
  uint32_t last = kNoTriangle;
  Setup setup;
  std::array<const Vertex*, 3> corners{};
  for (size_t pixel = size_t(top) * width; pixel < size_t(bottom) * width; ++pixel) {
    const uint32_t triangle = triangles_[pixel];
    if (triangle == kNoTriangle) {
      image.alpha[pixel] = 0, image.depth[pixel] = 0;
      for (size_t axis = 0; axis < 3; ++axis) image.bgr[3 * pixel + axis] = 0, image.normals[3 * pixel + axis] = 0;
      continue;
    }
    const uint32_t* const indices = &mesh.triangles[3 * size_t(triangle)];
    if (triangle != last) {
      for (size_t k = 0; k < 3; ++k) corners[k] = &vertices_[indices[k]];
      setup = set_up(corners, camera);
      last = triangle;
    }
    const size_t row_px = pixel / width, column_px = pixel % width;
    const double row = double(row_px), column = double(column_px);
    std::array<double, 3> weights{};
    double sum = 0;
    for (size_t k = 0; k < 3; ++k) {
      weights[k] = std::max(0.0, setup.edges[k].a * column + setup.edges[k].b * row + setup.edges[k].c);
      sum += weights[k];
    }
    for (double& weight : weights) weight = sum > 0 ? weight / sum : 1.0 / 3;
    Vector normal{};
    if (mesh.normals.empty()) {
      const Vertex &p = *corners[0], &q = *corners[1], &r = *corners[2];
      const Vector a = {q.x - p.x, q.y - p.y, q.z - p.z}, b = {r.x - p.x, r.y - p.y, r.z - p.z};
      normal = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    } else {
      const Mat3& rotation = camera.head_to_camera.rotation;
      Vector head{};
      for (size_t k = 0; k < 3; ++k) {
        for (size_t axis = 0; axis < 3; ++axis) {
          head[axis] += weights[k] * double(mesh.normals[3 * size_t(indices[k]) + axis]);
        }
      }
      for (size_t r = 0; r < 3; ++r) {
        for (size_t axis = 0; axis < 3; ++axis) normal[r] += rotation[3 * r + axis] * head[axis];
      }
    }
    const double length = std::sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
    double lit = 0;
    for (size_t axis = 0; axis < 3; ++axis) {
      normal[axis] = length > 0 ? normal[axis] / length : axis == 2 ? -1 : 0;
      lit += normal[axis] * double(options.light[axis]);
      image.normals[3 * pixel + axis] = float(normal[axis]);
    }
    const double light = double(options.ambient) + (1 - double(options.ambient)) * std::max(0.0, lit);
    for (size_t channel = 0; channel < 3; ++channel) {
      double colour = double(options.grey[channel]);
      if (!mesh.colours.empty()) {
        colour = 0;
        for (size_t k = 0; k < 3; ++k) colour += weights[k] * double(mesh.colours[3 * size_t(indices[k]) + channel]);
      }
      image.bgr[3 * pixel + 2 - channel] = uint8_t(std::clamp(colour * light + 0.5, 0.0, 255.0));
    }
    image.alpha[pixel] = 255;
    image.depth[pixel] = 1 / inverse_depth_[pixel];
  }
}

void MeshRaster::draw(const HeadMesh& mesh, const HeadCamera& camera, const RasterOptions& options,
                      WorkerThreads& threads, RasterImage& image) {
  check(camera);
  const double near = double(options.near);
  if (!std::isfinite(near) || !(near > 0)) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The near plane of a mesh's picture is at ", near,
                ". Give a positive distance.");
  }
  const size_t pixels = size_t(camera.width_px) * size_t(camera.height_px);
  image.width_px = camera.width_px, image.height_px = camera.height_px;
  image.bgr.resize(3 * pixels), image.alpha.resize(pixels), image.depth.resize(pixels);
  image.normals.resize(3 * pixels), inverse_depth_.resize(pixels), triangles_.resize(pixels);
  project(mesh, camera, near, threads);
  threads.run(size_t(camera.height_px + kBandRows - 1) / kBandRows, [&](size_t band, int) {
    const int top = int(band) * kBandRows, bottom = std::min(camera.height_px, top + kBandRows);
    draw_band(mesh, camera, near, top, bottom);
    shade_band(mesh, camera, options, top, bottom, image);
  });
}

}  // namespace maq::head
