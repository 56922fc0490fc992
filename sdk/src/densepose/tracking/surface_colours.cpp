#include "densepose/tracking/surface_colours.h"

#include <algorithm>
#include <cmath>

namespace maq {
namespace {

// Pixels that are read of each frame, about.
constexpr double kReadPixels = 20000;

// Parts of one region wear one colour more often than not, and show it from the front and from behind.
constexpr int kRegions = 8;
enum Region { kTorso, kHands, kFeet, kUpperLegs, kLowerLegs, kUpperArms, kLowerArms, kHead };
constexpr std::array<Region, SurfaceColours::kParts> kRegionOfPart = {
    kTorso,     kTorso,     kHands,     kHands,     kFeet,      kFeet,      kUpperLegs, kUpperLegs,
    kUpperLegs, kUpperLegs, kLowerLegs, kLowerLegs, kLowerLegs, kLowerLegs, kUpperArms, kUpperArms,
    kUpperArms, kUpperArms, kLowerArms, kLowerArms, kLowerArms, kLowerArms, kHead,      kHead};
// How much a region tells of who somebody is: clothes more than skin.
constexpr std::array<float, kRegions> kRegionWeight = {3, 0.3f, 0.7f, 2, 1.5f, 1.5f, 1, 1};
// Pixels that a region or place must show in both to count in full.
constexpr float kEnoughOfRegion = 12, kEnoughOfPlace = 4;
// Light changes Y most. Differences in colour that count as 1.
constexpr float kLumaScale = 110, kChromaScale = 40;

using Place = SurfaceColours::Place;

float colour_distance(const Place& a, const Place& b) {
  const float luma = (a.colour[0] - b.colour[0]) / kLumaScale;
  const float blue = (a.colour[1] - b.colour[1]) / kChromaScale;
  const float red = (a.colour[2] - b.colour[2]) / kChromaScale;
  return std::min(1.0f, std::sqrt(luma * luma + blue * blue + red * red));
}

void add_to(Place& place, const Place& more) {
  const float samples = place.samples + more.samples;
  if (!(samples > 0)) return;
  const float share = more.samples / samples;
  for (size_t c = 0; c < 3; ++c) place.colour[c] += (more.colour[c] - place.colour[c]) * share;
  place.samples = samples;
}

std::array<Place, kRegions> regions_of(const SurfaceColours& colours) {
  std::array<Place, kRegions> regions{};
  for (size_t i = 0; i < colours.places.size(); ++i) {
    add_to(regions[size_t(kRegionOfPart[i / SurfaceColours::kPlacesOfPart])], colours.places[i]);
  }
  return regions;
}

// A weighted mean.
class Mean {
 public:
  void add(float value, float weight) {
    sum_ += value * weight;
    weight_ += weight;
  }
  float weight() const { return weight_; }
  float value() const { return weight_ > 0 ? sum_ / weight_ : 0; }

 private:
  float sum_ = 0, weight_ = 0;
};

float common(const Place& a, const Place& b, float enough) {
  return std::min(1.0f, std::min(a.samples, b.samples) / enough);
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
  for (size_t i = 0; i < places.size(); ++i) {
    add_to(places[i], seen.places[i]);
    places[i].samples = std::min(places[i].samples, kMaxSamples);
  }
}

ColourDifference difference(const SurfaceColours& a, const SurfaceColours& b) {
  const std::array<Place, kRegions> of_a = regions_of(a), of_b = regions_of(b);
  Mean coarse, fine;
  float all = 0;
  for (size_t r = 0; r < kRegions; ++r) {
    all += kRegionWeight[r];
    const float shared = common(of_a[r], of_b[r], kEnoughOfRegion);
    coarse.add(colour_distance(of_a[r], of_b[r]), kRegionWeight[r] * shared);
  }
  for (size_t i = 0; i < a.places.size(); ++i) {
    const float shared = common(a.places[i], b.places[i], kEnoughOfPlace);
    const Region region = kRegionOfPart[i / SurfaceColours::kPlacesOfPart];
    fine.add(colour_distance(a.places[i], b.places[i]), kRegionWeight[size_t(region)] * shared);
  }
  // Places tell more (a print on the chest) but are seldom the same ones: they count by half if they are there.
  const float distance = fine.weight() > 0 ? (coarse.value() + fine.value()) / 2 : coarse.value();
  return {distance, coarse.weight() / all};
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
      if (person == 0 || person > people || part == 0 || part > size_t(SurfaceColours::kParts)) continue;
      const size_t place = size_t(SurfaceColours::kPlacesOfPart) * (part - 1) + size_t(planes.u[pixel] / 128) * 2 +
                           size_t(planes.v[pixel] / 128);
      Place& sum = colours[person - 1].places[place];
      const std::array<float, 3> colour = colour_at(image, x, y);
      for (size_t c = 0; c < 3; ++c) sum.colour[c] += colour[c];
      ++sum.samples;
    }
  }
  for (SurfaceColours& one : colours) {
    for (Place& place : one.places) {
      for (float& mean : place.colour) mean /= std::max(1.0f, place.samples);
    }
  }
}

}  // namespace maq
