#include "head/texture/template_texture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "head/texture/smooth_fill.h"
#include "head/texture/texels.h"
#include "head/texture/texture_layout.h"

namespace maq::head {
namespace {

constexpr int kReachSide = 512;
// A point is covered when the template's surface is farther out in its direction by more (dm): skin lies in folds, an
// eyeball right behind the lids.
constexpr float kSkinCovered_dm = 0.05f, kEyeCovered_dm = 0.012f;
// The face on the template: points before this (dm, y is to the back). A face of this luma is lit as the painted
// colours are.
constexpr float kFaceBefore_dm = -0.6f;
constexpr double kUsualLuma = 150, kDarkestPaint = 0.4, kBrightestPaint = 1.1;
// So many of the visible texels of an eyeball are darker than its white.
constexpr double kDarkerThanWhite = 0.85;

using PaintColour = std::array<double, 3>;

bool is_eyeball(TemplateKind kind) { return kind == TemplateKind::kEye || kind == TemplateKind::kEyeFront; }
bool is_painted(TemplateKind kind) {
  return kind == TemplateKind::kMouth || kind == TemplateKind::kTeeth || kind == TemplateKind::kTongue;
}

double brightness(const PaintColour& rgb) { return 0.299 * rgb[0] + 0.587 * rgb[1] + 0.114 * rgb[2]; }

class TemplateTexture {
 public:
  TemplateTexture(const TextureImage& from, const HeadTemplate& onto, const std::vector<float>& points,
                  const std::vector<uint8_t>& colours)
      : from_(from), onto_(onto), points_(points), colours_(colours) {
    side_ = std::min(kMaxTexture_px, 2 * from.side_px);
    find_reach();
    paint_ = std::clamp(face_luma() / kUsualLuma, kDarkestPaint, kBrightestPaint);
  }

  TextureImage image(WorkerThreads& threads) {
    const size_t count = size_t(side_) * size_t(side_);
    values_.resize(3 * count), weights_.resize(count);
    threads.run(size_t(side_ + kTexelRowsOfTask - 1) / kTexelRowsOfTask, [&](size_t task, int) {
      const int first = int(task) * kTexelRowsOfTask;
      for_each_texel(
          onto_.texture_coordinates, onto_.triangles, side_, first, std::min(side_, first + kTexelRowsOfTask),
          [&](size_t texel, const uint32_t* corners, const double* shares) { colour(texel, corners, shares); });
    });
    paint_white();
    fill_smoothly(side_, weights_, values_);
    TextureImage made;
    made.side_px = side_;
    made.bgr.resize(3 * count);
    for (size_t i = 0; i < count; ++i) {
      for (size_t c = 0; c < 3; ++c) {
        made.bgr[3 * i + 2 - c] = uint8_t(std::clamp(std::lround(values_[3 * i + c]), 0L, 255L));
      }
    }
    return made;
  }

 private:
  TemplateKind kind_of(uint32_t vertex) const { return onto_.kinds[onto_.vertex_points[vertex]]; }

  Vec3 between(const std::vector<float>& of_points, const uint32_t* corners, const double* shares) const {
    Vec3 sum;
    for (size_t k = 0; k < 3; ++k) {
      const float* const p = &of_points[3 * size_t(onto_.vertex_points[corners[k]])];
      sum = sum + shares[k] * Vec3{double(p[0]), double(p[1]), double(p[2])};
    }
    return sum;
  }

  // How far the template reaches from the layout's centre, in each direction.
  void find_reach() {
    std::vector<float> places;
    for (const uint32_t point : onto_.vertex_points) {
      const float* const p = &onto_.points[3 * size_t(point)];
      const auto place = texture_place({double(p[0]), double(p[1]), double(p[2])});
      places.insert(places.end(), place.begin(), place.end());
    }
    reach_.assign(size_t(kReachSide) * kReachSide, 0);
    for_each_texel(places, onto_.triangles, kReachSide, 0, kReachSide,
                   [&](size_t texel, const uint32_t* corners, const double* shares) {
                     const auto far = float(length(between(onto_.points, corners, shares) - kLayoutCentre));
                     reach_[texel] = std::max(reach_[texel], far);
                   });
  }

  float covered_by(Vec3 point) const {
    const auto place = texture_place(point);
    const auto at = [](float along) { return size_t(std::clamp(int(along * kReachSide), 0, kReachSide - 1)); };
    return reach_[at(place[1]) * kReachSide + at(place[0])] - float(length(point - kLayoutCentre));
  }

  PaintColour seen_at(Vec3 point) const {
    const auto place = texture_place(point);
    const auto bgr =
        between_pixels<uint8_t, 3>(from_.bgr, from_.side_px, from_.side_px, double(place[0]) * from_.side_px - 0.5,
                                   double(place[1]) * from_.side_px - 0.5);
    return {bgr[2], bgr[1], bgr[0]};
  }

  double face_luma() const {
    double sum = 0, count = 0;
    for (size_t i = 0; i < onto_.point_count(); ++i) {
      if (onto_.kinds[i] != TemplateKind::kSurface || onto_.points[3 * i + 1] > kFaceBefore_dm) continue;
      const float* const p = &points_[3 * i];
      sum += brightness(seen_at({double(p[0]), double(p[1]), double(p[2])})), ++count;
    }
    return count > 0 ? sum / count : kUsualLuma;
  }

  void colour(size_t texel, const uint32_t* corners, const double* shares) {
    PaintColour painted{};
    double share = 0;
    for (size_t k = 0; k < 3; ++k) {
      if (!is_painted(kind_of(corners[k]))) continue;
      share += shares[k];
      for (size_t c = 0; c < 3; ++c) painted[c] += shares[k] * paint_ * double(colours_[3 * size_t(corners[k]) + c]);
    }
    const bool is_eye = is_eyeball(kind_of(corners[0]));
    const float covered = covered_by(between(onto_.points, corners, shares));
    const double seen = covered > (is_eye ? kEyeCovered_dm : kSkinCovered_dm) ? 0 : 1 - share;
    const PaintColour rgb = seen_at(between(points_, corners, shares));
    const double weight = seen + share;
    weights_[texel] = is_eye && seen == 0 ? kIsWhite : float(weight);
    for (size_t c = 0; c < 3; ++c) {
      values_[3 * texel + c] = weight > 0 ? float((seen * rgb[c] + painted[c]) / weight) : 0.0f;
    }
    if (is_eye && seen > 0) weights_[texel] = kIsEye;
  }

  // Gives covered parts of eyeballs the colour of the brightest visible ones.
  void paint_white() {
    std::vector<std::pair<double, size_t>> visible;
    for (size_t i = 0; i < weights_.size(); ++i) {
      if (weights_[i] != kIsEye) continue;
      const float* const rgb = &values_[3 * i];
      visible.push_back({brightness({double(rgb[0]), double(rgb[1]), double(rgb[2])}), i});
    }
    std::sort(visible.begin(), visible.end());
    PaintColour white = {225 * paint_, 222 * paint_, 218 * paint_};
    if (const size_t first = size_t(kDarkerThanWhite * double(visible.size())); first < visible.size()) {
      white = {};
      for (size_t k = first; k < visible.size(); ++k) {
        for (size_t c = 0; c < 3; ++c) {
          white[c] += double(values_[3 * visible[k].second + c]) / double(visible.size() - first);
        }
      }
    }
    for (size_t i = 0; i < weights_.size(); ++i) {
      if (weights_[i] == kIsWhite) {
        for (size_t c = 0; c < 3; ++c) values_[3 * i + c] = float(white[c]);
      }
      if (weights_[i] > 1) weights_[i] = 1;
    }
  }

  static constexpr float kIsEye = 2, kIsWhite = 3;  // weights of texels of eyeballs, until paint_white()

  const TextureImage& from_;
  const HeadTemplate& onto_;
  const std::vector<float>& points_;
  const std::vector<uint8_t>& colours_;
  int side_ = 0;
  double paint_ = 1;
  std::vector<float> reach_;             // [kReachSide][kReachSide], dm
  std::vector<float> values_, weights_;  // [side][side], of three and one
};

}  // namespace

TextureImage texture_on_template(const TextureImage& from, const HeadTemplate& onto, const std::vector<float>& points,
                                 const std::vector<uint8_t>& colours, WorkerThreads& threads) {
  return TemplateTexture(from, onto, points, colours).image(threads);
}

}  // namespace maq::head
