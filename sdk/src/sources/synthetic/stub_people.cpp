#include "sources/synthetic/stub_people.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/error.h"
#include "image/sprite.h"
#include "sources/synthetic/dice.h"
#include "sources/synthetic/people_sheet.h"

namespace maq {
namespace {

// The sheet's layout: one person a row, one frame of the walk cycle a column, walking to the right.
constexpr int kPeople = 4;
constexpr int kCycleFrames = 16;
constexpr int kTileWidthPx = 128;
constexpr int kTileHeightPx = 256;

// A wall and a floor, each with a soft gradient.
std::vector<uint8_t> draw_room(int width, int height, Dice& dice) {
  std::vector<uint8_t> room(size_t(width) * size_t(height) * 3);
  double wall[3], floor[3];
  const double brightness = dice.between(150, 210);
  for (int c = 0; c < 3; ++c) {
    wall[c] = brightness + dice.between(-20, 20);
    floor[c] = brightness * 0.65 + dice.between(-15, 15);
  }
  const int horizon = height * 58 / 100;
  uint8_t* pixel = room.data();
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double across = double(x) / width - 0.4;
      for (int c = 0; c < 3; ++c) {
        const double shade = y < horizon ? wall[c] * (1.0 - 0.12 * (1.0 - double(y) / std::max(1, horizon)))
                                         : floor[c] * (0.8 + 0.3 * double(y - horizon) / std::max(1, height - horizon));
        *pixel++ = uint8_t(std::clamp(shade * (1.05 - 0.35 * across * across), 0.0, 255.0));
      }
    }
  }
  return room;
}

BgraImage read_sheet() {
  BgraImage image = read_people_sheet();
  if (image.width_px != kTileWidthPx * kCycleFrames || image.height_px != kTileHeightPx * kPeople) {
    throw Error(MAQ_ERROR_INTERNAL, "The sprite sheet of stub:people is ", image.width_px, " x ", image.height_px,
                ", but must be ", kTileWidthPx * kCycleFrames, " x ", kTileHeightPx * kPeople, ".");
  }
  return image;
}

}  // namespace

StubPeople::StubPeople(int count, uint64_t seed, int width_px, int height_px) : width_px_(width_px) {
  Dice dice(seed);
  background_ = draw_room(width_px, height_px, dice);
  if (count == 0) return;
  const BgraImage sheet = read_sheet();
  const int first_row = dice.below(kPeople);
  for (int i = 0; i < count; ++i) {
    Walker walker;
    const double nearness = dice.between(0, 1);
    walker.row = (first_row + i) % kPeople;
    walker.height_px = std::max(4, int(height_px * (0.45 + 0.4 * nearness)));
    walker.feet_y_px = height_px * (0.72 + 0.24 * nearness);
    // People begin spread over the image, so that the first frame already shows them all.
    walker.start_x_px = width_px * (i + dice.between(0.3, 0.7)) / count;
    const bool to_the_left = dice.below(2) == 1;
    walker.cycles_s = dice.between(0.7, 1.0);
    // A cycle of two steps takes a walker about 0.75 body heights on.
    walker.speed_px_s = walker.cycles_s * 0.75 * walker.height_px * (to_the_left ? -1 : 1);
    walker.phase_frames = dice.between(0, kCycleFrames);
    const int width = std::max(2, walker.height_px * kTileWidthPx / kTileHeightPx);
    for (int frame = 0; frame < kCycleFrames; ++frame) {
      walker.tiles.push_back(crop_sprite(sheet, frame * kTileWidthPx, walker.row * kTileHeightPx, kTileWidthPx,
                                         kTileHeightPx, width, walker.height_px, to_the_left));
    }
    walkers_.push_back(std::move(walker));
  }
  std::stable_sort(walkers_.begin(), walkers_.end(),
                   [](const Walker& a, const Walker& b) { return a.feet_y_px < b.feet_y_px; });
}

void StubPeople::draw(double time_s, Frame& frame) const {
  std::memcpy(frame.storage.data(), background_.data(), background_.size());
  for (const Walker& walker : walkers_) {
    const int cycle_frame =
        int(std::floor(walker.phase_frames + time_s * walker.cycles_s * kCycleFrames)) % kCycleFrames;
    const BgraImage& tile = walker.tiles[size_t(cycle_frame)];
    // A walker who leaves on one side comes back on the other.
    const double lap_px = width_px_ + tile.width_px;
    double x = std::fmod(walker.start_x_px + walker.speed_px_s * time_s + 0.5 * tile.width_px, lap_px);
    if (x < 0) x += lap_px;
    draw_sprite(tile, int(std::floor(x)) - tile.width_px, int(walker.feet_y_px) - tile.height_px, frame);
  }
}

}  // namespace maq
