#include "scene/splats/splat_fit.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "core/clock.h"
#include "core/error.h"
#include "core/math/rotation.h"
#include "core/rounding.h"
#include "scene/capture/posed_view.h"
#include "scene/splats/splat_tiles.h"
#include "scene/splats/tile_blending.h"

namespace maq {
namespace {

// The numbers that are fitted: colours, the logit of the opacity, logarithms of the scales, a rotation in the world, a
// shift in units of the mean scale.
constexpr size_t kFitColour = 0, kFitOpacity = 3, kFitScale = 4, kFitRotation = 7, kFitShift = 10, kFitted = 13;
// The steps of Adam, larger than in programs for 3D Gaussian Splatting, because a fit is short.
constexpr float kStepSizes[kFitted] = {0.02f, 0.02f, 0.02f, 0.05f, 0.03f, 0.03f, 0.03f,
                                       0.02f, 0.02f, 0.02f, 0.03f, 0.03f, 0.03f};
constexpr float kFinalStep = 0.1f;  // what is left of a step at the end
constexpr float kMomentum = 0.9f, kSquaresMomentum = 0.99f;
constexpr float kMinSquare = 1e-24f;
constexpr float kMaxLogit = 6, kHalfLog2 = 1.44269504f / 2;
constexpr float kMaxGrowth = 2;  // of a scale, as a logarithm

struct FittedSplat {
  Splat splat;
  float logit = 0;
  std::array<float, 3> first_log_scale{}, log_scale{};
  float mean_scale = 0;
  uint32_t updates = 0;
  float mean[kFitted] = {}, squares[kFitted] = {};
};

float logistic_of(float value) { return 1 / (1 + std::exp(-value)); }

// Quaternions w, x, y, z.
std::array<float, 4> turned(const float* by, const std::array<float, 4>& q) {
  const float half[3] = {by[0] / 2, by[1] / 2, by[2] / 2};
  std::array<float, 4> made = {
      q[0] - half[0] * q[1] - half[1] * q[2] - half[2] * q[3], q[1] + half[0] * q[0] + half[1] * q[3] - half[2] * q[2],
      q[2] + half[1] * q[0] + half[2] * q[1] - half[0] * q[3], q[3] + half[2] * q[0] + half[0] * q[2] - half[1] * q[1]};
  float length = 0;
  for (const float part : made) length += part * part;
  for (float& part : made) part /= std::sqrt(length);
  return made;
}

// The gradient by what is fitted, from that by the ellipse of pixels: the chain rule through SplatView::project(). The
// linearised projection is taken as it is.
void chain_rule(const FittedSplat& of, const SplatView::Parameters& by, const std::array<double, 3>& centre,
                const ProjectedSplat& seen, const SplatGradient& from, float* to) {
  const float* const r = by.rotation;
  const float away[3] = {float(of.splat.position[0] - centre[0]), float(of.splat.position[1] - centre[1]),
                         float(of.splat.position[2] - centre[2])};
  float at[3];
  for (size_t i = 0; i < 3; ++i) at[i] = r[3 * i] * away[0] + r[3 * i + 1] * away[1] + r[3 * i + 2] * away[2];
  const float u = std::clamp(at[0] / at[2], by.low_u, by.high_u), v = std::clamp(at[1] / at[2], by.low_v, by.high_v);
  const float across = by.fx / at[2], down = by.fy / at[2];
  // Rows of the Jacobian times the rotation, in the world.
  float jx[3], jy[3];
  for (size_t i = 0; i < 3; ++i) {
    jx[i] = across * (r[i] - u * r[6 + i]);
    jy[i] = down * (r[3 + i] - v * r[6 + i]);
  }
  // Variances: yy = k / falloff, xy = -slope * yy, xx = k / curvature + slope^2 * yy.
  const float yy = kHalfLog2 / seen.falloff, slope = seen.slope, rest = kHalfLog2 / seen.curvature;
  const float by_rest = -seen.curvature / rest * from.curvature;
  const float by_xx = by_rest, by_xy = 2 * slope * by_rest - from.slope / yy,
              by_yy = slope * slope * by_rest - slope / yy * from.slope - seen.falloff / yy * from.falloff;
  const Vec3 axis_x = {double(of.splat.rotation[1]), double(of.splat.rotation[2]), double(of.splat.rotation[3])};
  const double w = double(of.splat.rotation[0]);
  double spin[3] = {};
  for (size_t k = 0; k < 3; ++k) {
    // Column k of the rotation: e + 2 w (q x e) + 2 q x (q x e).
    const Vec3 e = {k == 0 ? 1.0 : 0.0, k == 1 ? 1.0 : 0.0, k == 2 ? 1.0 : 0.0};
    const Vec3 once = cross(axis_x, e), axis = e + 2 * w * once + 2 * cross(axis_x, once);
    const float a[3] = {float(axis.x), float(axis.y), float(axis.z)};
    const float mx = jx[0] * a[0] + jx[1] * a[1] + jx[2] * a[2], my = jy[0] * a[0] + jy[1] * a[1] + jy[2] * a[2];
    const float variance = of.splat.scale[k] * of.splat.scale[k];
    to[kFitScale + k] = 2 * variance * (mx * mx * by_xx + mx * my * by_xy + my * my * by_yy);
    const float by_mx = variance * (2 * mx * by_xx + my * by_xy), by_my = variance * (mx * by_xy + 2 * my * by_yy);
    const Vec3 by_axis = {double(by_mx * jx[0] + by_my * jy[0]), double(by_mx * jx[1] + by_my * jy[1]),
                          double(by_mx * jx[2] + by_my * jy[2])};
    const Vec3 turn = cross(axis, by_axis);
    spin[0] += turn.x;
    spin[1] += turn.y;
    spin[2] += turn.z;
  }
  for (size_t i = 0; i < 3; ++i) {
    to[kFitColour + i] = seen.rgb[i] > 0 ? from.rgb[i] : 0;
    to[kFitRotation + i] = float(spin[i]);
    to[kFitShift + i] = of.mean_scale * (from.x * jx[i] + from.y * jy[i]);
  }
  const float opacity = of.splat.opacity;
  to[kFitOpacity] = from.log_opacity * 2 * kHalfLog2 * (1 - opacity);
}

class SplatFit {
 public:
  SplatFit(const Splats& splats, const SplatFitOptions& options);

  // One step; returns the mean squared error before it.
  double step(const FitPhoto& photo, float size);
  void write(Splats& splats) const;

 private:
  void find_gradients(const FitPhoto& photo, int columns, double& error);
  void update(FittedSplat& of, uint32_t place, const float* gradient, float size);

  WorkerThreads threads_;
  SplatChunks chunks_;
  SplatTiles tiles_;
  std::vector<FittedSplat> fitted_;  // by place
  std::vector<ProjectedSplat> projected_;
  std::vector<uint8_t> places_;
  std::vector<std::pair<uint32_t, uint32_t>> spans_;
  std::vector<SplatGradient> of_tiles_, gradients_;  // of entries of tiles' lists; of splats
  std::vector<double> errors_;
};

SplatFit::SplatFit(const Splats& splats, const SplatFitOptions& options) : threads_(options.threads), chunks_(splats) {
  fitted_.resize(chunks_.count());
  for (size_t place = 0; place < fitted_.size(); ++place) {
    FittedSplat& of = fitted_[place];
    of.splat = splat_at(splats, chunks_.order()[place]);
    of.logit = std::clamp(std::log(of.splat.opacity / (1 - of.splat.opacity)), -kMaxLogit, kMaxLogit);
    float sum = 0;
    for (size_t k = 0; k < 3; ++k) {
      sum += of.splat.scale[k] / 3;
      of.log_scale[k] = of.first_log_scale[k] = std::log(std::max(of.splat.scale[k], 1e-12f));
    }
    of.mean_scale = sum;
  }
}

double SplatFit::step(const FitPhoto& photo, float size) {
  const int columns = divide_up(photo.camera.width_px, kTileWidth_px),
            rows = divide_up(photo.camera.height_px, kTileHeight_px);
  const SplatView view(photo.camera, 0, false);
  const std::vector<SplatChunk>& chunks = chunks_.chunks();
  projected_.resize(chunks.size() * kChunkSplats);
  places_.resize(projected_.size());
  gradients_.resize(projected_.size());
  spans_.assign(chunks.size(), {0, 0});
  threads_.run(chunks.size(), [&](size_t i, int) {
    if (!view.may_show(chunks[i])) return;
    const size_t first = i * kChunkSplats;
    const int seen = view.project(chunks[i], 0, projected_.data() + first, places_.data() + first);
    spans_[i] = {uint32_t(first), uint32_t(first) + uint32_t(seen)};
    std::fill_n(gradients_.data() + first, seen, SplatGradient{});
  });
  tiles_.sort(projected_.data(), spans_, columns, rows, threads_);
  double error = 0;
  while (tiles_.fill_next(threads_)) find_gradients(photo, columns, error);
  threads_.run(chunks.size(), [&](size_t i, int) {
    for (uint32_t k = spans_[i].first; k < spans_[i].second; ++k) {
      const auto place = uint32_t(i * kChunkSplats) + places_[k];
      float gradient[kFitted];
      chain_rule(fitted_[place], view.parameters(), photo.camera.centre, projected_[k], gradients_[k], gradient);
      update(fitted_[place], place, gradient, size);
    }
  });
  return error / double(3 * photo.camera.width_px * photo.camera.height_px);
}

void SplatFit::find_gradients(const FitPhoto& photo, int columns, double& error) {
  const auto count = size_t(tiles_.end_tile() - tiles_.first_tile());
  const uint32_t* const list = tiles_.begin_of(tiles_.first_tile());
  of_tiles_.resize(size_t(tiles_.end_of(tiles_.end_tile() - 1) - list));
  errors_.assign(count, 0);
  threads_.run(count, [&](size_t task, int) {
    const int tile = tiles_.first_tile() + int(task);
    const int left_px = tile % columns * kTileWidth_px, top_px = tile / columns * kTileHeight_px;
    TileSums sums;
    blend_tile(projected_.data(), tiles_.begin_of(tile), tiles_.end_of(tile), left_px, top_px, sums);
    alignas(32) float loss[3][kTilePixels] = {};
    const int width = std::min(kTileWidth_px, photo.camera.width_px - left_px),
              height = std::min(kTileHeight_px, photo.camera.height_px - top_px);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const size_t pixel = size_t(top_px + y) * size_t(photo.camera.width_px) + size_t(left_px + x);
        if (!photo.valid.empty() && photo.valid[pixel] == 0) continue;
        for (size_t c = 0; c < 3; ++c) {
          const float wanted = float(photo.bgr[3 * pixel + 2 - c]) / 255;
          const float off = sums.rgb[c][y * kTileWidth_px + x] - wanted;
          loss[c][y * kTileWidth_px + x] = 2 * off;
          errors_[task] += double(off * off);
        }
      }
    }
    tile_gradients(projected_.data(), tiles_.begin_of(tile), tiles_.end_of(tile), left_px, top_px, loss, sums,
                   of_tiles_.data() + (tiles_.begin_of(tile) - list));
  });
  for (const double of_tile : errors_) error += of_tile;
  for (size_t i = 0; i < of_tiles_.size(); ++i) {
    SplatGradient& to = gradients_[list[i]];
    const SplatGradient& from = of_tiles_[i];
    to.log_opacity += from.log_opacity;
    to.curvature += from.curvature;
    to.slope += from.slope;
    to.falloff += from.falloff;
    to.x += from.x;
    to.y += from.y;
    for (size_t c = 0; c < 3; ++c) to.rgb[c] += from.rgb[c];
  }
}

void SplatFit::update(FittedSplat& of, uint32_t place, const float* gradient, float size) {
  ++of.updates;
  const auto steps = float(std::min(of.updates, 1000u));
  const float unbias = 1 / (1 - std::pow(kMomentum, steps)),
              unbias_squares = 1 / (1 - std::pow(kSquaresMomentum, steps));
  float change[kFitted];
  for (size_t k = 0; k < kFitted; ++k) {
    const float g = std::isfinite(gradient[k]) ? gradient[k] : 0;
    of.mean[k] = kMomentum * of.mean[k] + (1 - kMomentum) * g;
    of.squares[k] = kSquaresMomentum * of.squares[k] + (1 - kSquaresMomentum) * g * g;
    change[k] = -size * kStepSizes[k] * unbias * of.mean[k] / std::sqrt(unbias_squares * of.squares[k] + kMinSquare);
  }
  Splat& splat = of.splat;
  for (size_t k = 0; k < 3; ++k) {
    splat.colour[k] = std::clamp(splat.colour[k] + change[kFitColour + k], -0.5f, 1.5f);
    of.log_scale[k] = std::clamp(of.log_scale[k] + change[kFitScale + k], of.first_log_scale[k] - kMaxGrowth,
                                 of.first_log_scale[k] + kMaxGrowth);
    splat.scale[k] = std::exp(of.log_scale[k]);
    splat.position[k] += double(of.mean_scale * change[kFitShift + k]);
  }
  of.logit = std::clamp(of.logit + change[kFitOpacity], -kMaxLogit, kMaxLogit);
  splat.opacity = logistic_of(of.logit);
  splat.rotation = turned(change + kFitRotation, splat.rotation);
  chunks_.set(place, splat);
}

void SplatFit::write(Splats& splats) const {
  for (size_t place = 0; place < fitted_.size(); ++place) {
    const Splat& from = fitted_[place].splat;
    const size_t i = chunks_.order()[place];
    for (size_t k = 0; k < 3; ++k) {
      splats.position[3 * i + k] = float(from.position[k] - splats.origin[k]);
      splats.scale[3 * i + k] = from.scale[k];
      splats.colour[3 * i + k] = from.colour[k];
    }
    for (size_t k = 0; k < 4; ++k) splats.rotation[4 * i + k] = from.rotation[k];
    splats.opacity[i] = from.opacity;
  }
}

}  // namespace

std::vector<FitPhoto> photos_to_fit(const Capture& capture, int long_side_px, bool uses_held_out) {
  std::vector<FitPhoto> photos;
  PosedView view;
  for (const CaptureView& from : capture.views) {
    if (from.is_held_out && !uses_held_out) continue;
    try {
      view.load(from, long_side_px);
    } catch (const Error& error) {
      if (error.status() == MAQ_ERROR_OUT_OF_MEMORY) throw;
      continue;
    }
    const ImageView& image = view.image();
    FitPhoto photo;
    photo.camera = view.camera();
    const size_t pixels = size_t(image.width_px) * size_t(image.height_px);
    photo.bgr.resize(3 * pixels);
    copy_packed(image, photo.bgr.data());
    if (view.valid() != nullptr) photo.valid.assign(view.valid(), view.valid() + pixels);
    photos.push_back(std::move(photo));
  }
  if (photos.empty()) throw Error(MAQ_ERROR_UNREADABLE, "None of the photos can be read, to fit splats to them.");
  return photos;
}

SplatFitErrors fit_splats(Splats& splats, const std::vector<FitPhoto>& photos, const SplatFitOptions& options,
                          const SplatFitProgress& progress) {
  if (photos.empty()) throw Error(MAQ_ERROR_INVALID_ARGUMENT, "There are no photos to fit splats to.");
  for (const FitPhoto& photo : photos) {
    check_camera(photo.camera, "A photo's camera");
    const size_t pixels = size_t(photo.camera.width_px) * size_t(photo.camera.height_px);
    if (photo.bgr.size() != 3 * pixels || (!photo.valid.empty() && photo.valid.size() != pixels)) {
      throw Error(MAQ_ERROR_INVALID_ARGUMENT, "A photo has ", photo.bgr.size() / 3, " pixels, but its camera ", pixels,
                  "; give it the camera of its size.");
    }
  }
  const Stopwatch watch;
  SplatFit fit(splats, options);
  std::mt19937_64 random(options.seed);
  std::vector<size_t> order(photos.size());
  for (size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::vector<double> first(photos.size(), -1), last(photos.size(), -1);
  SplatFitErrors errors;
  while (errors.steps < options.max_steps) {
    const double done =
        std::max(watch.elapsed_ms() / 1e3 / options.seconds, double(errors.steps) / double(options.max_steps));
    if (done >= 1) break;
    const size_t turn = errors.steps % order.size();
    if (turn == 0) {  // std::shuffle differs between libraries
      for (size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random() % i]);
    }
    const size_t index = order[turn];
    last[index] = fit.step(photos[index], std::pow(kFinalStep, float(done)));
    if (first[index] < 0) first[index] = last[index];
    ++errors.steps;
    if (progress && !progress(done, "Fitting splats to the photos.")) break;
  }
  size_t seen = 0;
  for (size_t i = 0; i < photos.size(); ++i) {
    if (first[i] < 0) continue;
    errors.first += first[i];
    errors.last += last[i];
    ++seen;
  }
  if (seen > 0) errors.first /= double(seen), errors.last /= double(seen);
  fit.write(splats);
  return errors;
}

}  // namespace maq
