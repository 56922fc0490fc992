#include "head/mesh/mesh_raster.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/error.h"

namespace maq::head {

// The camera as edges of triangles need it. Samples are the pixels of an image that is larger by their number a side.
struct RasterSampling {
  RasterSampling(const HeadCamera& camera, int samples_a_side)
      : per_pixel(samples_a_side),
        width(camera.width_px * samples_a_side),
        step(1 / (camera.focal_px * samples_a_side)),
        cx(of_pixel(camera.cx_px)),
        cy(of_pixel(camera.cy_px)) {}

  double of_pixel(double px) const { return (px + 0.5) * per_pixel - 0.5; }

  int per_pixel, width;
  double step;  // between directions of neighbouring samples
  double cx, cy;
};

namespace {

constexpr int kBandRows = 16, kMaxSide = 16384;
constexpr size_t kTask = 8192, kChunk = 256;  // vertices or triangles; a task has whole chunks
constexpr uint32_t kNoTriangle = UINT32_MAX;
constexpr size_t kMaxSamples = 4;          // of a pixel
constexpr float kSameSurface = 1 / 1.02f;  // of inverse depths in a pixel: farther samples are of another surface

// A linear function of the pixel: a column + b row + c.
struct Plane {
  double a = 0, b = 0, c = 0;
};

// The plane that is 0 along the edge from p to q in the image (Olano and Greer, Triangle scan conversion using 2D
// homogeneous coordinates, 1997: no clipping). The other way round it is the negative, to the bit: so of triangles that
// share an edge, each pixel on it belongs to one at least.
template <class Vertex>
Plane edge_plane(const Vertex& p, const Vertex& q, const RasterSampling& sampling) {
  const double x = (p.y * q.z - p.z * q.y) * sampling.step, y = (p.z * q.x - p.x * q.z) * sampling.step;
  return {x, y, (p.x * q.y - p.y * q.x) - (x * sampling.cx + y * sampling.cy)};
}

struct Setup {
  std::array<Plane, 3> edges;  // opposite of each corner; all positive inside
  Plane inverse_depth;
  bool is_seen = false;
};

// Six times the volume of the triangle and the camera's centre; 0 for triangles without an area and triangles seen
// edge-on. Positive for triangles seen from behind.
template <class Vertex>
double volume_of(const Vertex& p, const Vertex& q, const Vertex& r) {
  return p.x * (q.y * r.z - q.z * r.y) + p.y * (q.z * r.x - q.x * r.z) + p.z * (q.x * r.y - q.y * r.x);
}

template <class Vertex>
Setup set_up(const std::array<const Vertex*, 3>& corners, const RasterSampling& sampling) {
  Setup made;
  for (size_t k = 0; k < 3; ++k) {
    made.edges[k] = edge_plane(*corners[(k + 1) % 3], *corners[(k + 2) % 3], sampling);
  }
  const double volume = volume_of(*corners[0], *corners[1], *corners[2]);
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

void check(const HeadCamera& camera, const RasterOptions& options) {
  if (camera.width_px < 1 || camera.height_px < 1 || camera.width_px > kMaxSide || camera.height_px > kMaxSide) {
    throw Error(MAQ_ERROR_IMAGE_SIZE, "A picture of a mesh is asked for with ", camera.width_px, "x", camera.height_px,
                " pixels. Give each side 1 to ", kMaxSide, ".");
  }
  bool is_finite = std::isfinite(camera.focal_px) && camera.focal_px > 0 && std::isfinite(camera.cx_px) &&
                   std::isfinite(camera.cy_px) && std::isfinite(options.pixel_aspect) && options.pixel_aspect > 0;
  is_finite = is_finite && maq::is_finite(camera.head_to_camera.translation);
  for (const double value : camera.head_to_camera.rotation) is_finite = is_finite && std::isfinite(value);
  if (!is_finite) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The camera of a mesh's picture has a focal length of ", camera.focal_px,
                " pixels, or a number that is not finite. Give a positive one and finite numbers.");
  }
  if (!std::isfinite(options.near) || !(options.near > 0)) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The near plane of a mesh's picture is at ", options.near,
                ". Give a positive distance.");
  }
}

// The first and last pixel between two positions, within 0 and `size`. By hand, since ceil and floor are calls on
// processors that have no instruction for them.
std::array<int, 2> pixels_between(double low, double high, int size) {
  const double first = std::clamp(low, 0.0, double(size)), last = std::clamp(high, -1.0, size - 1.0);
  const int first_px = int(first), last_px = int(last + 1) - 1;
  return {double(first_px) < first ? first_px + 1 : first_px, last_px};
}

bool is_textured(const HeadMesh& mesh, const RasterOptions& options) {
  return options.shading == MeshShading::kColour && options.texture != nullptr && !mesh.texture_coordinates.empty();
}

uint8_t byte_of(float value) { return uint8_t(std::clamp(value + 0.5f, 0.0f, 255.0f)); }

// A point of the surface.
struct SurfacePoint {
  std::array<float, 3> normal, colour, template_point;  // colour: R, G, B, 0 to 255
  float depth;
};

std::array<float, 3> shade(const SurfacePoint& point, const RasterOptions& options) {
  std::array<float, 3> rgb{};
  switch (options.shading) {
    case MeshShading::kColour:
    case MeshShading::kShape: {
      float lit = 0;
      for (size_t axis = 0; axis < 3; ++axis) lit += point.normal[axis] * options.light[axis];
      const float light = options.ambient + (1 - options.ambient) * std::max(0.0f, lit);
      for (size_t channel = 0; channel < 3; ++channel) rgb[channel] = point.colour[channel] * light;
      break;
    }
    case MeshShading::kNormals:
      rgb = {127.5f * (1 + point.normal[0]), 127.5f * (1 - point.normal[1]), 127.5f * (1 - point.normal[2])};
      break;
    case MeshShading::kTemplate:
      for (size_t axis = 0; axis < 3; ++axis) {
        rgb[axis] = 127.5f * (1 + point.template_point[axis] / options.template_reach);
      }
      break;
    case MeshShading::kDepth:
      rgb.fill(127.5f * (1 - (point.depth - options.middle_depth) / options.depth_reach));
      break;
  }
  return rgb;
}

}  // namespace

struct MeshRaster::Band {
  RasterSampling sampling;
  float* inverse_depth;  // of each sample
  uint32_t* triangles;
};

void MeshRaster::project(const HeadMesh& mesh, const HeadCamera& camera, const RasterOptions& options,
                         WorkerThreads& threads) {
  vertices_.resize(mesh.vertex_count()), attributes_.resize(mesh.vertex_count());
  const bool has_normals = !mesh.normals.empty(), has_template = !mesh.template_points.empty();
  const bool has_colours = !mesh.colours.empty() && options.shading != MeshShading::kShape;
  const bool has_places = is_textured(mesh, options);
  std::array<float, 9> rotation{};
  for (size_t i = 0; i < 9; ++i) rotation[i] = float(camera.head_to_camera.rotation[i]);
  threads.run((vertices_.size() + kTask - 1) / kTask, [&](size_t task, int) {
    for (size_t i = task * kTask; i < std::min((task + 1) * kTask, vertices_.size()); ++i) {
      const float* const p = &mesh.positions[3 * i];
      const Vec3 seen = camera.head_to_camera * Vec3{double(p[0]), double(p[1]), double(p[2])};
      Vertex& vertex = vertices_[i];
      vertex.x = seen.x, vertex.y = seen.y * options.pixel_aspect, vertex.z = seen.z;
      Attributes& attributes = attributes_[i];
      attributes = {};
      for (size_t axis = 0; axis < 3; ++axis) {
        attributes.colour[axis] = float(has_colours ? mesh.colours[3 * i + axis] : options.grey[axis]);
        if (has_template) attributes.template_point[axis] = mesh.template_points[3 * i + axis];
        if (!has_normals) continue;
        const float *const row = &rotation[3 * axis], *const n = &mesh.normals[3 * i];
        attributes.normal[axis] = row[0] * n[0] + row[1] * n[1] + row[2] * n[2];
      }
      if (has_places) attributes.texture_uv = {mesh.texture_coordinates[2 * i], mesh.texture_coordinates[2 * i + 1]};
      if (vertex.z < double(options.near)) continue;
      const double scale = camera.focal_px / vertex.z;
      vertex.column_px = scale * vertex.x + camera.cx_px;
      vertex.row_px = scale * vertex.y + camera.cy_px;
    }
  });
}

void MeshRaster::find_rows(const HeadMesh& mesh, const HeadCamera& camera, const RasterOptions& options,
                           WorkerThreads& threads) {
  const double near = double(options.near);
  rows_.resize(mesh.triangle_count());
  chunk_rows_.resize((rows_.size() + kChunk - 1) / kChunk);
  const auto rows_of = [&](size_t triangle) -> Rows {
    std::array<const Vertex*, 3> corners{};
    double low = 1e300, high = -1e300;
    int behind = 0;
    for (size_t k = 0; k < 3; ++k) {
      corners[k] = &vertices_[mesh.triangles[3 * triangle + k]];
      if (!(corners[k]->z >= near)) {
        ++behind;
      } else {
        low = std::min(low, corners[k]->row_px), high = std::max(high, corners[k]->row_px);
      }
    }
    if (behind == 3) return {0, -1};
    if (options.draws_front_alone && !(volume_of(*corners[0], *corners[1], *corners[2]) < 0)) return {0, -1};
    if (behind > 0) low = -1, high = camera.height_px;  // may be anywhere
    // Samples are up to a quarter of a pixel away from its middle.
    const auto rows = pixels_between(low - 0.25, high + 0.25, camera.height_px);
    return {int16_t(rows[0]), int16_t(rows[1])};
  };
  threads.run((rows_.size() + kTask - 1) / kTask, [&](size_t task, int) {
    for (size_t chunk = task * (kTask / kChunk); chunk < (task + 1) * (kTask / kChunk); ++chunk) {
      const size_t end = std::min((chunk + 1) * kChunk, rows_.size());
      if (chunk * kChunk >= end) break;
      Rows all = {INT16_MAX, -1};
      for (size_t i = chunk * kChunk; i < end; ++i) {
        rows_[i] = rows_of(i);
        if (rows_[i].first > rows_[i].last) continue;
        all = {std::min(all.first, rows_[i].first), std::max(all.last, rows_[i].last)};
      }
      chunk_rows_[chunk] = all;
    }
  });
}

void MeshRaster::draw_band(const HeadMesh& mesh, const HeadCamera& camera, const RasterOptions& options, int top,
                           int bottom, Band& band) const {
  const RasterSampling& sampling = band.sampling;
  const double near = double(options.near), max_inverse_depth = 1 / near;
  const int first_sample = top * sampling.per_pixel, sample_rows = (bottom - top) * sampling.per_pixel;
  const size_t samples = size_t(sampling.width) * size_t(sample_rows);
  std::fill_n(band.inverse_depth, samples, 0.0f);
  std::fill_n(band.triangles, samples, kNoTriangle);
  const auto draw = [&](size_t triangle) {
    std::array<const Vertex*, 3> corners{};
    double left = 1e300, right = -1e300, high = 1e300, low = -1e300;
    for (size_t k = 0; k < 3; ++k) {
      const Vertex& corner = *(corners[k] = &vertices_[mesh.triangles[3 * triangle + k]]);
      if (!(corner.z >= near)) {  // it may reach anywhere
        left = high = -1, right = camera.width_px, low = camera.height_px;
        continue;
      }
      left = std::min(left, corner.column_px), right = std::max(right, corner.column_px);
      high = std::min(high, corner.row_px), low = std::max(low, corner.row_px);
    }
    const auto columns = pixels_between(sampling.of_pixel(left), sampling.of_pixel(right), sampling.width);
    const auto rows =
        pixels_between(sampling.of_pixel(high) - first_sample, sampling.of_pixel(low) - first_sample, sample_rows);
    if (columns[0] > columns[1] || rows[0] > rows[1]) return;
    const Setup setup = set_up(corners, sampling);
    if (!setup.is_seen) return;
    const Plane &e0 = setup.edges[0], &e1 = setup.edges[1], &e2 = setup.edges[2], &depth = setup.inverse_depth;
    for (int row = rows[0]; row <= rows[1]; ++row) {
      const double y = first_sample + row;
      const double c0 = e0.b * y + e0.c, c1 = e1.b * y + e1.c, c2 = e2.b * y + e2.c, cd = depth.b * y + depth.c;
      const size_t begin = size_t(row) * size_t(sampling.width);
      double x = columns[0];
      for (int column = columns[0]; column <= columns[1]; ++column, x += 1) {
        if (e0.a * x + c0 < 0 || e1.a * x + c1 < 0 || e2.a * x + c2 < 0) continue;
        const double inverse = depth.a * x + cd;
        const size_t sample = begin + size_t(column);
        if (!(inverse > 0) || inverse > max_inverse_depth || float(inverse) <= band.inverse_depth[sample]) continue;
        band.inverse_depth[sample] = float(inverse);
        band.triangles[sample] = uint32_t(triangle);
      }
    }
  };
  for (size_t chunk = 0; chunk < chunk_rows_.size(); ++chunk) {
    if (chunk_rows_[chunk].first >= bottom || chunk_rows_[chunk].last < top) continue;
    for (size_t i = chunk * kChunk; i < std::min((chunk + 1) * kChunk, rows_.size()); ++i) {
      if (rows_[i].first < bottom && rows_[i].last >= top) draw(i);
    }
  }
}

void MeshRaster::shade_band(const HeadMesh& mesh, const HeadCamera& camera, const RasterOptions& options, int top,
                            int bottom, const Band& band, RenderedImage& image) const {
  const RasterSampling& sampling = band.sampling;
  const size_t width = size_t(camera.width_px), side = size_t(sampling.per_pixel), samples_count = side * side;
  const bool has_normals = !mesh.normals.empty(), has_template = !mesh.template_points.empty();
  const MeshTexture* const texture = is_textured(mesh, options) ? options.texture : nullptr;
  // Twice the area of a triangle in the image and in the texture. Corners behind the near plane are nowhere in the
  // image: no level is right for all of such a triangle.
  const auto level_of = [&](const std::array<const Vertex*, 3>& corners,
                            const std::array<const Attributes*, 3>& attributes) {
    const Vertex &p = *corners[0], &q = *corners[1], &r = *corners[2];
    if (std::min({p.z, q.z, r.z}) < double(options.near)) return 0;
    const double pixels =
        (q.column_px - p.column_px) * (r.row_px - p.row_px) - (q.row_px - p.row_px) * (r.column_px - p.column_px);
    const std::array<float, 2>&a = attributes[0]->texture_uv, &b = attributes[1]->texture_uv,
                            &c = attributes[2]->texture_uv;
    const double texels = double((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])) *
                          double(texture->width_px()) * double(texture->height_px());
    return texture->level_of(std::abs(texels), std::abs(pixels));
  };
  // The point of a triangle at a pixel's centre or, if the centre is outside of it, near the centre.
  const auto point_of = [&](uint32_t triangle, size_t row_px, size_t column_px, float depth) {
    const uint32_t* const indices = &mesh.triangles[3 * size_t(triangle)];
    const Vertex &p = vertices_[indices[0]], &q = vertices_[indices[1]], &r = vertices_[indices[2]];
    // A corner's weight is the volume of the pixel's ray and the other two corners.
    const double x = (double(column_px) - camera.cx_px) / camera.focal_px;
    const double y = (double(row_px) - camera.cy_px) / camera.focal_px;
    const auto volume = [&](const Vertex& a, const Vertex& b) {
      return x * (a.y * b.z - a.z * b.y) + y * (a.z * b.x - a.x * b.z) + (a.x * b.y - a.y * b.x);
    };
    // Outside, but near, they go on as they are inside.
    std::array<double, 3> volumes = {volume(q, r), volume(r, p), volume(p, q)};
    const double sum = volumes[0] + volumes[1] + volumes[2];
    const bool is_near =
        std::isfinite(1 / sum) && std::min({volumes[0] / sum, volumes[1] / sum, volumes[2] / sum}) > -1;
    std::array<float, 3> weights{};
    for (size_t k = 0; k < 3; ++k) weights[k] = is_near ? float(volumes[k] / sum) : 1.0f / 3;
    const Attributes &of_p = attributes_[indices[0]], &of_q = attributes_[indices[1]], &of_r = attributes_[indices[2]];
    SurfacePoint point{};
    point.depth = depth;
    const auto mean = [&](std::array<float, 3> Attributes::*which, std::array<float, 3>& to) {
      for (size_t axis = 0; axis < 3; ++axis) {
        to[axis] =
            weights[0] * (of_p.*which)[axis] + weights[1] * (of_q.*which)[axis] + weights[2] * (of_r.*which)[axis];
      }
    };
    mean(&Attributes::normal, point.normal);
    if (texture != nullptr) {
      std::array<float, 2> place{};
      for (size_t axis = 0; axis < 2; ++axis) {
        place[axis] = weights[0] * of_p.texture_uv[axis] + weights[1] * of_q.texture_uv[axis] +
                      weights[2] * of_r.texture_uv[axis];
      }
      point.colour = texture->colour(place[0], place[1], level_of({&p, &q, &r}, {&of_p, &of_q, &of_r}));
    } else {
      mean(&Attributes::colour, point.colour);
    }
    mean(&Attributes::template_point, point.template_point);
    if (!has_normals) {
      const Vec3 a{q.x - p.x, (q.y - p.y) / options.pixel_aspect, q.z - p.z};
      const Vec3 across = normalized(cross(a, {r.x - p.x, (r.y - p.y) / options.pixel_aspect, r.z - p.z}));
      point.normal = {float(across.x), float(across.y), float(across.z)};
    }
    const float length = std::sqrt(point.normal[0] * point.normal[0] + point.normal[1] * point.normal[1] +
                                   point.normal[2] * point.normal[2]);
    const float to_length = length > 0 ? 1 / length : 0;
    for (float& value : point.normal) value *= to_length;
    if (!(length > 0)) point.normal = {0, 0, -1};
    return point;
  };
  const size_t first = size_t(top) * width, count_of_band = size_t(bottom - top) * width;
  std::fill_n(&image.alpha[first], count_of_band, uint8_t(0));
  std::fill_n(&image.depth[first], count_of_band, 0.0f);
  std::fill_n(&image.bgr[3 * first], 3 * count_of_band, uint8_t(0));
  std::fill_n(&image.normals[3 * first], 3 * count_of_band, 0.0f);
  if (has_template) std::fill_n(&image.template_points[3 * first], 3 * count_of_band, 0.0f);
  for (size_t row = size_t(top); row < size_t(bottom); ++row) {
    for (size_t column = 0; column < width; ++column) {
      const size_t pixel = row * width + column;
      const size_t corner = (row - size_t(top)) * side * size_t(sampling.width) + column * side;
      std::array<size_t, kMaxSamples> covered{};
      size_t count = 0, nearest = 0;
      for (size_t k = 0; k < samples_count; ++k) {
        const size_t sample = corner + (k / side) * size_t(sampling.width) + k % side;
        if (band.triangles[sample] == kNoTriangle) continue;
        if (count == 0 || band.inverse_depth[sample] > band.inverse_depth[nearest]) nearest = sample;
        covered[count++] = sample;
      }
      if (count == 0) continue;
      image.alpha[pixel] = uint8_t(255 * count / samples_count);
      float inverse = 0;
      size_t of_nearest = 0;  // samples of the same surface
      for (size_t k = 0; k < count; ++k) {
        if (band.inverse_depth[covered[k]] < kSameSurface * band.inverse_depth[nearest]) continue;
        inverse += band.inverse_depth[covered[k]];
        ++of_nearest;
      }
      image.depth[pixel] = float(of_nearest) / inverse;
      const SurfacePoint point = point_of(band.triangles[nearest], row, column, image.depth[pixel]);
      std::array<float, 3> rgb = shade(point, options);
      if (of_nearest < count) {
        rgb.fill(0);
        for (size_t k = 0; k < count; ++k) {
          const size_t sample = covered[k];
          const std::array<float, 3> one =
              shade(point_of(band.triangles[sample], row, column, 1 / band.inverse_depth[sample]), options);
          for (size_t channel = 0; channel < 3; ++channel) rgb[channel] += one[channel] / float(count);
        }
      }
      for (size_t axis = 0; axis < 3; ++axis) {
        image.normals[3 * pixel + axis] = point.normal[axis];
        image.bgr[3 * pixel + 2 - axis] = byte_of(rgb[axis]);
        if (has_template) image.template_points[3 * pixel + axis] = point.template_point[axis];
      }
    }
  }
}

void MeshRaster::draw(const HeadMesh& mesh, const HeadCamera& camera, const RasterOptions& options,
                      WorkerThreads& threads, RenderedImage& image) {
  check(camera, options);
  const size_t pixels = size_t(camera.width_px) * size_t(camera.height_px);
  image.width_px = camera.width_px, image.height_px = camera.height_px;
  image.bgr.resize(3 * pixels), image.alpha.resize(pixels), image.depth.resize(pixels);
  image.normals.resize(3 * pixels);
  image.template_points.resize(mesh.template_points.empty() ? 0 : 3 * pixels);
  const RasterSampling sampling(camera, options.is_smooth ? 2 : 1);
  const size_t samples = size_t(sampling.width) * kBandRows * size_t(sampling.per_pixel);
  inverse_depths_.resize(size_t(threads.count())), triangles_.resize(size_t(threads.count()));
  for (auto& depths : inverse_depths_) depths.resize(samples);
  for (auto& triangles : triangles_) triangles.resize(samples);
  project(mesh, camera, options, threads);
  find_rows(mesh, camera, options, threads);
  threads.run(size_t(camera.height_px + kBandRows - 1) / kBandRows, [&](size_t number, int worker) {
    const int top = int(number) * kBandRows, bottom = std::min(camera.height_px, top + kBandRows);
    Band band{sampling, inverse_depths_[size_t(worker)].data(), triangles_[size_t(worker)].data()};
    draw_band(mesh, camera, options, top, bottom, band);
    shade_band(mesh, camera, options, top, bottom, band, image);
  });
}

}  // namespace maq::head
