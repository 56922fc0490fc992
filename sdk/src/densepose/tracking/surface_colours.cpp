#include "densepose/tracking/surface_colours.h"

#include <algorithm>
#include <cmath>

namespace maq {
namespace {

// Pixels that are read of each frame, about.
constexpr double kReadPixels = 20000;

constexpr size_t kColouredParts = 24;
enum RegionName { kTorso, kHands, kFeet, kUpperLegs, kLowerLegs, kUpperArms, kLowerArms, kHead };
constexpr std::array<RegionName, kColouredParts> kRegionOfPart = {
    kTorso,     kTorso,     kHands,     kHands,     kFeet,      kFeet,      kUpperLegs, kUpperLegs,
    kUpperLegs, kUpperLegs, kLowerLegs, kLowerLegs, kLowerLegs, kLowerLegs, kUpperArms, kUpperArms,
    kUpperArms, kUpperArms, kLowerArms, kLowerArms, kLowerArms, kLowerArms, kHead,      kHead};
// How much a region tells of who somebody is: clothes more than skin.
constexpr std::array<float, size_t(SurfaceColours::kRegions)> kWeight = {3, 0.3f, 0.7f, 3, 2, 1.5f, 0.5f, 1};
// Pixels that a region must show in both to count in full.
constexpr float kEnough = 12;
// Light changes Y most. Differences in colour that count as 1.
constexpr float kLumaScale = 110, kChromaScale = 25;

using Region = SurfaceColours::Region;

float colour_distance(const Region& a, const Region& b) {
  const float luma = (a.colour[0] - b.colour[0]) / kLumaScale;
  const float blue = (a.colour[1] - b.colour[1]) / kChromaScale;
  const float red = (a.colour[2] - b.colour[2]) / kChromaScale;
  return std::min(1.0f, std::sqrt(luma * luma + blue * blue + red * red));
}

std::array<float, 3> of_rgb(float red, float green, float blue) {
  const float luma = 0.299f * red + 0.587f * green + 0.114f * blue;
  return {luma, 128 + 0.564f * (blue - luma), 128 + 0.713f * (red - luma)};
}

std::array<float, 3> colour_at(const ImageView& image, int x, int y) {
  const PlaneView& plane = image.planes[0];
  const uint8_t* const row = plane.data + size_t(y) * plane.stride_bytes;
  switch (image.format) {
    case MAQ_PIXEL_RGB8: {
      const uint8_t* const p = row + 3 * size_t(x);
      return of_rgb(p[0], p[1], p[2]);
    }
    case MAQ_PIXEL_BGR8: {
      const uint8_t* const p = row + 3 * size_t(x);
      return of_rgb(p[2], p[1], p[0]);
    }
    case MAQ_PIXEL_RGBA8: {
      const uint8_t* const p = row + 4 * size_t(x);
      return of_rgb(p[0], p[1], p[2]);
    }
    case MAQ_PIXEL_NV12: {
      const PlaneView& chroma = image.planes[1];
      const uint8_t* const c = chroma.data + size_t(y / 2) * chroma.stride_bytes + size_t(x / 2 * 2);
      return {float(row[x]), float(c[0]), float(c[1])};
    }
    case MAQ_PIXEL_YUYV: {
      const uint8_t* const pair = row + 4 * size_t(x / 2);
      return {float(pair[x % 2 * 2]), float(pair[1]), float(pair[3])};
    }
    case MAQ_PIXEL_GREY8: return {float(row[x]), 128, 128};
    default: return {};
  }
}

}  // namespace

void SurfaceColours::add(const SurfaceColours& seen) {
  for (size_t r = 0; r < regions.size(); ++r) {
    Region& region = regions[r];
    const float samples = region.samples + seen.regions[r].samples;
    if (!(samples > 0)) continue;
    const float share = seen.regions[r].samples / samples;
    for (size_t c = 0; c < 3; ++c) region.colour[c] += (seen.regions[r].colour[c] - region.colour[c]) * share;
    region.samples = std::min(samples, kMaxSamples);
  }
}

ColourDifference difference(const SurfaceColours& a, const SurfaceColours& b) {
  float sum = 0, weight = 0, all = 0;
  for (size_t r = 0; r < kWeight.size(); ++r) {
    const float samples = std::min(a.regions[r].samples, b.regions[r].samples);
    const float shared = kWeight[r] * std::min(1.0f, samples / kEnough);
    sum += shared * colour_distance(a.regions[r], b.regions[r]);
    weight += shared;
    all += kWeight[r];
  }
  return {weight > 0 ? sum / weight : 0, weight / all};
}

void read_colours(const ImageView& image, const DensePlanes& planes, size_t people,
                  std::vector<SurfaceColours>& colours) {
  colours.assign(people, {});
  if (people == 0 || image.width_px != planes.width_px || image.height_px != planes.height_px) return;
  const double pixels = double(planes.width_px) * double(planes.height_px);
  const int step = std::max(1, int(std::sqrt(pixels / kReadPixels)));
  for (int y = step / 2; y < planes.height_px; y += step) {
    const size_t row = size_t(y) * size_t(planes.width_px);
    for (int x = step / 2; x < planes.width_px; x += step) {
      const size_t pixel = row + size_t(x);
      const size_t person = planes.person[pixel], part = planes.part[pixel];
      if (person == 0 || person > people || part == 0 || part > kColouredParts) continue;
      Region& sum = colours[person - 1].regions[size_t(kRegionOfPart[part - 1])];
      const std::array<float, 3> colour = colour_at(image, x, y);
      for (size_t c = 0; c < 3; ++c) sum.colour[c] += colour[c];
      ++sum.samples;
    }
  }
  for (SurfaceColours& one : colours) {
    for (Region& region : one.regions) {
      for (float& mean : region.colour) mean /= std::max(1.0f, region.samples);
    }
  }
}

}  // namespace maq
