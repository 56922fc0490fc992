#include "head/texture/unseen_parts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "core/math/vec3.h"
#include "head/texture/smooth_fill.h"
#include "head/texture/texels.h"
#include "head/texture/texture_layout.h"

namespace maq::head {
namespace {

// Points of the template head (dm) whose surroundings have the colours of skin and of hair.
constexpr Vec3 kCheeks[2] = {{0.35, -0.85, -0.25}, {-0.35, -0.85, -0.25}};
constexpr Vec3 kTopOfHead[2] = {{0.3, 0.3, 1.1}, {-0.3, 0.3, 1.1}};
// The hairline, seen from the layout's centre: degrees from the upward direction, mean - turn * cos(a) + fold * cos(2
// a) at the angle a from the front: 31 before, 49 over the ears, 86 behind.
constexpr double kHairlineMean = 53.75, kHairlineTurn = 27.5, kHairlineFold = 4.75;
constexpr double kSoftHairline = 6, kInsideHairline = 25;  // degrees
// Hair hangs as far beyond it; dark skin of the neck is no hair.
constexpr double kNearHair = 15, kFarthestHair = 50;
constexpr double kDegreesOfRadian = 57.29577951308232;
constexpr double kAroundFraction = 0.02;                                  // of the texture's side
constexpr double kMinContrast = 25;                                       // between skin and hair, grey levels
constexpr double kSurelySkin = 0.3, kMaybeHair = 0.5, kSurelyHair = 0.9;  // of the way from skin to hair
// A class has its own colour as far as it is more than this share of what photos show.
constexpr double kLittleSeen = 0.02;
// Weights so small make fill_smoothly() take means over squares of 32 texels a side.
constexpr float kOverSquare = 1.0f / 1024;
// Next to known texels their values go on; to 1 / e over this fraction of the side.
constexpr double kNearFraction = 0.06;
// Colours that are farther than this from the mean of hair or skin hardly count for it, grey levels.
constexpr double kOutlier = 45;
constexpr double kDarkest = 0.85, kBrightest = 1.15;  // of a class, relative to its mean

using Colour = std::array<double, 3>;

double luma_of(const Colour& rgb) { return 0.299 * rgb[0] + 0.587 * rgb[1] + 0.114 * rgb[2]; }

Colour mean_colour_around(const Texels& texels, int side, const Vec3 (&points)[2]) {
  Colour sum{};
  double count = 0;
  const int reach = std::max(1, int(kAroundFraction * side));
  for (const Vec3& point : points) {
    const auto place = texture_place(point);
    const int column = int(place[0] * float(side)), row = int(place[1] * float(side));
    for (int y = std::max(0, row - reach); y <= std::min(side - 1, row + reach); ++y) {
      for (int x = std::max(0, column - reach); x <= std::min(side - 1, column + reach); ++x) {
        const size_t at = size_t(y) * size_t(side) + size_t(x);
        if (texels.is_surface[at] == 0) continue;
        for (size_t c = 0; c < 3; ++c) sum[c] += double(texels.colours[3 * at + c]);
        ++count;
      }
    }
  }
  for (double& value : sum) value = count > 0 ? value / count : 0;
  return sum;
}

// The mean colours of a class, whose share of each texel is `share(i)`: in photos, and of the mesh.
struct ClassMean {
  Colour seen{}, own{};
  double weight = 0;
};

template <class Share>
ClassMean mean_of_class(const Differences& known, const Texels& texels, Share&& share, const ClassMean* before) {
  ClassMean mean;
  for (size_t i = 0; i < known.weights.size(); ++i) {
    double weight = double(known.weights[i]) * double(share(i));
    if (weight <= 0) continue;
    Colour own{}, seen{};
    double squared = 0;
    for (size_t c = 0; c < 3; ++c) {
      own[c] = double(texels.colours[3 * i + c]), seen[c] = own[c] + double(known.values[3 * i + c]);
      if (before != nullptr) squared += (seen[c] - before->seen[c]) * (seen[c] - before->seen[c]);
    }
    weight *= std::exp(-squared / (2 * kOutlier * kOutlier));
    for (size_t c = 0; c < 3; ++c) mean.own[c] += weight * own[c], mean.seen[c] += weight * seen[c];
    mean.weight += weight;
  }
  for (size_t c = 0; c < 3 && mean.weight > 0; ++c) mean.own[c] /= mean.weight, mean.seen[c] /= mean.weight;
  return mean;
}

// Adds what the class makes of each texel's difference, far from all that is known.
template <class Share, class Evidence>
void add_class(const Differences& known, const Texels& texels, Share&& share, Evidence&& evidence,
               std::vector<float>& sum) {
  const ClassMean all = mean_of_class(known, texels, evidence, nullptr);
  const ClassMean mean = mean_of_class(known, texels, evidence, &all);
  if (!(mean.weight > 0)) return;
  double all_weight = 0;
  for (const float weight : known.weights) all_weight += double(weight);
  const double trust = mean.weight / (mean.weight + kLittleSeen * all_weight);
  for (size_t i = 0; i < known.weights.size(); ++i) {
    const double of_class = trust * double(share(i));
    if (of_class <= 0) continue;
    const Colour own = {double(texels.colours[3 * i]), double(texels.colours[3 * i + 1]),
                        double(texels.colours[3 * i + 2])};
    const double brightness = std::clamp(luma_of(own) / std::max(1.0, luma_of(mean.own)), kDarkest, kBrightest);
    for (size_t c = 0; c < 3; ++c) sum[3 * i + c] += float(of_class * (brightness * mean.seen[c] - own[c]));
  }
}

// Degrees within the hairline, of each texel's direction; negative outside.
double within_hairline(size_t texel, int side) {
  const size_t column = texel % size_t(side), row = texel / size_t(side);
  const double right = (double(column) + 0.5) / side - 0.5;
  const double up = 0.5 - (double(row) + 0.5) / side;  // the back of the head is above
  const double angle = texture_angle(std::hypot(right, up)) * kDegreesOfRadian, around = std::atan2(right, -up);
  return kHairlineMean - kHairlineTurn * std::cos(around) + kHairlineFold * std::cos(2 * around) - angle;
}

}  // namespace

std::vector<float> hair_fractions(const Texels& texels, int side) {
  const Colour skin = mean_colour_around(texels, side, kCheeks), hair = mean_colour_around(texels, side, kTopOfHead);
  const Colour along = {hair[0] - skin[0], hair[1] - skin[1], hair[2] - skin[2]};
  const double squared = along[0] * along[0] + along[1] * along[1] + along[2] * along[2];
  std::vector<float> made(texels.is_surface.size());
  for (size_t i = 0; i < made.size(); ++i) {
    double product = 0;
    for (size_t c = 0; c < 3; ++c) product += (double(texels.colours[3 * i + c]) - skin[c]) * along[c];
    const bool differs = squared >= kMinContrast * kMinContrast;
    const double within = within_hairline(i, side), by_place = smooth_step(within, -kSoftHairline, kSoftHairline);
    const double by_colour = differs ? smooth_step(product / squared, kMaybeHair, kSurelyHair) : 0;
    const double may_be_hair = differs ? smooth_step(product / squared, 0, kSurelySkin) : 1;
    made[i] = float(std::max(by_colour * smooth_step(within, -kFarthestHair, -kNearHair), by_place * may_be_hair));
  }
  return made;
}

Differences mirrored(const Differences& known, const Texels& texels, int side) {
  const size_t count = known.weights.size(), width = size_t(side);
  const auto other_side = [&](size_t at) { return at / width * width + width - 1 - at % width; };
  std::vector<float> weights(count), offsets(3 * count);
  for (size_t at = 0; at < count; ++at) {
    const size_t from = other_side(at);
    weights[at] = kOverSquare * known.weights[at] * known.weights[from];
    for (size_t c = 0; c < 3; ++c) offsets[3 * at + c] = known.values[3 * at + c] - known.values[3 * from + c];
  }
  fill_smoothly(side, weights, offsets);
  Differences made = known;
  for (size_t at = 0; at < count; ++at) {
    const size_t from = other_side(at);
    const float own = known.weights[at], other = (1 - own) * known.weights[from];
    if (other <= 0 || texels.is_surface[at] == 0 || texels.is_cap[at] != 0) continue;
    for (size_t c = 0; c < 3; ++c) {
      const float mirror = known.values[3 * from + c] + offsets[3 * at + c];
      made.values[3 * at + c] = (own * known.values[3 * at + c] + other * mirror) / (own + other);
    }
    made.weights[at] = own + other;
  }
  return made;
}

std::vector<float> colours_of_classes(const Differences& known, const Texels& texels, const std::vector<float>& hair,
                                      int side) {
  std::vector<float> made(known.values.size());
  const auto is_skin = [&](size_t i) { return 1 - hair[i]; };
  const auto is_hair = [&](size_t i) { return hair[i]; };
  const auto is_surely_hair = [&](size_t i) {
    return hair[i] * float(smooth_step(within_hairline(i, side), 0, kInsideHairline));
  };
  const auto is_surely_skin = [&](size_t i) {
    return (1 - hair[i]) * float(smooth_step(-within_hairline(i, side), 0, kInsideHairline));
  };
  add_class(known, texels, is_skin, is_surely_skin, made);
  add_class(known, texels, is_hair, is_surely_hair, made);
  return made;
}

void go_on_from_known(const Differences& known, int side, std::vector<float>& values) {
  std::vector<float> near = known.values;
  fill_smoothly(side, known.weights, near);
  const std::vector<float> distances = distance_to_known(side, known.weights);
  for (size_t i = 0; i < values.size(); ++i) {
    const auto nearness = float(std::exp(-double(distances[i / 3]) / (kNearFraction * double(side))));
    values[i] += nearness * (near[i] - values[i]);
  }
}

}  // namespace maq::head
