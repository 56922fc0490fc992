#include "scene/fusion/depth_fusion.h"

#include <algorithm>
#include <cmath>

#include "scene/stereo/stereo_photo.h"

namespace maq {
namespace {

constexpr int kVoteRows = 16;
constexpr double kVotingFraction = 0.98;  // of the time

size_t width_of(const DepthMap& map) { return size_t(map.camera.width_px); }
size_t height_of(const DepthMap& map) { return size_t(map.camera.height_px); }

// A row of points as a neighbour sees it.
struct ProjectedRow {
  explicit ProjectedRow(size_t width) : pixels(width), depths(width) {}
  std::vector<int32_t> pixels;  // -1: outside
  std::vector<float> depths;
};

struct Projection {
  float turn[9], shift[3];
  int width_px, height_px;
};

void project_row(const Projection& given, int y, const float* __restrict depth, int count, int32_t* __restrict pixels,
                 float* __restrict depths) {
  const Projection by = given;
  float at[3];
  for (int i = 0; i < 3; ++i) at[i] = by.turn[3 * i + 1] * float(y) + by.turn[3 * i + 2];
  const float right = float(by.width_px) - 0.5f, bottom = float(by.height_px) - 0.5f;
  for (int i = 0; i < count; ++i) {
    const float x = float(i), here = depth[i];
    const float z = (at[2] + by.turn[6] * x) * here + by.shift[2];
    const float inverse = 1.0f / z;
    const float u = ((at[0] + by.turn[0] * x) * here + by.shift[0]) * inverse;
    const float v = ((at[1] + by.turn[3] * x) * here + by.shift[1]) * inverse;
    const int inside =
        int(here > 0.0f) & int(z > 0.0f) & int(u > -0.5f) & int(v > -0.5f) & int(u < right) & int(v < bottom);
    const float in_u = inside != 0 ? u : 0.0f, in_v = inside != 0 ? v : 0.0f;
    // Just below the border, the sum with a half may be rounded up to it.
    const int column = std::min(int(in_u + 0.5f), by.width_px - 1), line = std::min(int(in_v + 0.5f), by.height_px - 1);
    pixels[i] = inside != 0 ? line * by.width_px + column : -1;
    depths[i] = z;
  }
}

Projection projection_of(const PinholeCamera& from, const PinholeCamera& to) {
  const PixelTransfer transfer(from, to);
  Projection by{};
  std::copy_n(transfer.turn, 9, by.turn);
  std::copy_n(transfer.shift, 3, by.shift);
  by.width_px = to.width_px;
  by.height_px = to.height_px;
  return by;
}

// Calls vote(pixel of the map, its depth in a neighbour, neighbour, pixel there) for all points of a map that its
// neighbours have in their image, and done(first pixel, count) after each row.
template <class Vote, class Done>
void for_votes(const std::vector<DepthMap>& maps, size_t of, WorkerThreads& threads, const Vote& vote,
               const Done& done) {
  const DepthMap& map = maps[of];
  std::vector<Projection> projections;
  for (const uint32_t k : map.neighbours) projections.push_back(projection_of(map.camera, maps[k].camera));
  const size_t width = width_of(map), height = height_of(map);
  threads.run((height + kVoteRows - 1) / kVoteRows, [&](size_t task, int) {
    ProjectedRow row(width);
    for (size_t y = task * kVoteRows; y < std::min((task + 1) * kVoteRows, height); ++y) {
      const size_t first = y * width;
      for (size_t k = 0; k < projections.size(); ++k) {
        project_row(projections[k], int(y), &map.depth[first], int(width), row.pixels.data(), row.depths.data());
        for (size_t x = 0; x < width; ++x) {
          if (row.pixels[x] >= 0) vote(first + x, row.depths[x], map.neighbours[k], size_t(row.pixels[x]));
        }
      }
      done(first, width);
    }
  });
}

// The next of a sequence of random numbers (Steele and others, "Fast splittable pseudorandom number generators", 2014).
uint64_t next_random(uint64_t& state) {
  state += 0x9e3779b97f4a7c15u;
  uint64_t mixed = state;
  mixed = (mixed ^ (mixed >> 30)) * 0xbf58476d1ce4e5b9u;
  mixed = (mixed ^ (mixed >> 27)) * 0x94d049bb133111ebu;
  return mixed ^ (mixed >> 31);
}

}  // namespace

std::vector<FusedPixel> fuse_depth_maps(const std::vector<DepthMap>& maps, const FusionRule& rule, uint64_t max_points,
                                        WorkerThreads& threads, const FusionProgress& progress) {
  std::vector<std::vector<uint8_t>> kept(maps.size());
  uint64_t total = 0;
  for (size_t of = 0; of < maps.size(); ++of) {
    const DepthMap& map = maps[of];
    std::vector<uint16_t> agreeing(map.depth.size()), behind(map.depth.size());
    kept[of].resize(map.depth.size());
    for_votes(
        maps, of, threads,
        [&](size_t pixel, float depth, uint32_t other, size_t there) {
          const float found = maps[other].depth[there];
          if (found > (1 + rule.farther) * depth) {
            ++behind[pixel];
          } else if (found > 0 && std::abs(found - depth) < rule.agreement * depth) {
            ++agreeing[pixel];
          }
        },
        [&](size_t first, size_t count) {
          for (size_t i = first; i < first + count; ++i) {
            const bool is_kept = map.depth[i] > 0 && float(1 + agreeing[i]) >= rule.factor * float(behind[i]);
            kept[of][i] = is_kept ? 1 : 0;
          }
        });
    for (const uint8_t is_kept : kept[of]) total += is_kept;
    if (progress && !progress(kVotingFraction * double(of + 1) / double(maps.size()))) return {};
  }
  // Selection sampling: each pixel is taken with the probability still needed / still left.
  uint64_t needed = max_points == 0 ? total : std::min(max_points, total), state = 0;
  std::vector<FusedPixel> taken;
  taken.reserve(needed);
  for (size_t of = 0; of < maps.size() && needed > 0; ++of) {
    for (size_t i = 0; i < kept[of].size(); ++i) {
      if (kept[of][i] == 0) continue;
      if (needed == total || next_random(state) % total < needed) {
        taken.push_back({uint32_t(of), uint32_t(i)});
        --needed;
      }
      --total;
    }
  }
  return taken;
}

PointCloud points_of(const std::vector<DepthMap>& maps, const std::array<double, 3>& origin,
                     std::vector<FusedPixel>& pixels) {
  PointCloud cloud;
  cloud.origin = origin;
  cloud.reserve(pixels.size(), false);
  size_t kept = 0;
  for (const FusedPixel& at : pixels) {
    const DepthMap& map = maps[at.map];
    const PinholeCamera& camera = map.camera;
    const double depth = double(map.depth[at.pixel]);
    const size_t column = at.pixel % width_of(map), row_of_pixel = at.pixel / width_of(map);
    const double ray[3] = {(double(column) - camera.cx_px) / camera.fx_px * depth,
                           (double(row_of_pixel) - camera.cy_px) / camera.fy_px * depth, depth};
    double point[3];
    for (size_t k = 0; k < 3; ++k) {
      point[k] = camera.centre[k];
      for (size_t row = 0; row < 3; ++row) point[k] += camera.rotation[3 * row + k] * ray[row];
    }
    if (cloud.add(point[0], point[1], point[2])) pixels[kept++] = at;
  }
  pixels.resize(kept);
  return cloud;
}

}  // namespace maq
