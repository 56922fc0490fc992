// Areas whose depth does not change keep their field.
#include "edges/kept_field.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "edges/edges.h"
#include "support/tiny_edges.h"

namespace kept_field {
namespace {

constexpr int kWide = 320, kHigh = 240, kMultiple = 16;
const maq::Intrinsics kCamera{kWide, kHigh, 300, 300, 159.5, 119.5};

using Depth = std::vector<float>;

// A wall that leans, with a box before it whose left side is at `left`; noise in footprints.
Depth frame(double noise_r, unsigned seed, int left = 40, double farther = 0) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, noise_r / 300);
  Depth depth;
  for (int y = 0; y < kHigh; ++y) {
    for (int x = 0; x < kWide; ++x) {
      const bool box = x >= left && x < left + 50 && y >= 30 && y < 80;
      const double z = (box ? 1.2 : 1.5) / (1 + 0.3 * (x - 159.5) / 300) + farther;
      depth.push_back(float(z * (1 + noise(random))));
    }
  }
  return depth;
}

maq::EdgeField field_with(const Depth& depth, float distance_r) {
  maq::EdgeField field;
  field.width = kWide;
  field.height = kHigh;
  field.intrinsics = kCamera;
  field.eps_r = 16;
  field.depth_m = depth;
  field.distance_r.assign(depth.size(), distance_r);
  field.spread_r.assign(depth.size(), 1);
  field.kind.assign(depth.size(), maq::kCreaseEdge);
  return field;
}

class KeptField : public ::testing::Test {
 protected:
  maq::FieldWindow find(maq::KeptField& kept, const Depth& depth, const maq::Intrinsics& camera = kCamera) {
    return kept.find({depth.data(), camera.width_px, camera.height_px}, camera, kMultiple, workers_);
  }

  maq::WorkerThreads workers_{2};
};

TEST_F(KeptField, NothingIsFoundAnewWhereOnlyNoiseChanges) {
  for (const double noise_r : {0.0, 0.1, 1.0, 4.0}) {
    maq::KeptField kept(64);
    for (unsigned k = 0; k < 20; ++k) {
      const Depth depth = frame(noise_r, k);
      const maq::FieldWindow window = find(kept, depth);
      EXPECT_EQ(window.width_px, k == 0 ? kWide : 0) << noise_r << " r, frame " << k;
      maq::EdgeField field = field_with(depth, float(k));
      EXPECT_EQ(kept.merge(field, workers_), k == 0 ? 0 : kWide * kHigh);
      EXPECT_EQ(field.distance_r.front(), 0) << "of the first frame";
      EXPECT_EQ(field.distance_r.back(), 0);
    }
  }
}

TEST_F(KeptField, WhereABoxMovesThatPartIsFoundAnew) {
  maq::KeptField kept(64);
  for (int k = 0; k < 2; ++k) {
    const Depth depth = frame(0.5, unsigned(k), k == 0 ? 40 : 42);
    const maq::FieldWindow window = find(kept, depth);
    maq::EdgeField field = field_with(depth, float(k + 1));
    const int64_t pixels = kept.merge(field, workers_);
    if (k == 0) continue;
    EXPECT_EQ(window.left_px, 0);
    EXPECT_EQ(window.width_px, 160) << "half of the frame is enough";
    EXPECT_EQ(window.height_px, kHigh) << "what is fresh and its surroundings are more than half as high";
    for (int y = 14; y < 96; ++y) {
      for (int x = 24; x < 108; ++x) ASSERT_EQ(field.distance_r[size_t(y * kWide + x)], 2) << x << " " << y;
    }
    EXPECT_EQ(field.distance_r[size_t(200 * kWide + 280)], 1);
    EXPECT_EQ(pixels, std::count(field.distance_r.begin(), field.distance_r.end(), 1.0f));
  }
}

// Each frame differs from the one before by less than noise does.
TEST_F(KeptField, ASlowMotionIsNoticedOnceItIsAFootprint) {
  constexpr double kStep_r = 0.05;
  maq::KeptField kept(64);
  int64_t kept_pixels = 0;
  for (unsigned k = 0; k < 40; ++k) {
    const Depth depth = frame(0.5, k, 40, kStep_r * 1.5 / 300 * k);
    find(kept, depth);
    maq::EdgeField field = field_with(depth, float(k));
    kept_pixels += kept.merge(field, workers_);
    const float oldest = *std::min_element(field.distance_r.begin(), field.distance_r.end());
    EXPECT_LT(kStep_r * (k - double(oldest)), 1.3)
        << k << ": the wall ends at 1.79 m, where a footprint is 1.2 times as large";
  }
  EXPECT_GT(kept_pixels, 40 * kWide * kHigh / 2);
}

// As time of flight has them: where a surface ends, pixels are of either side, between both, or lost; others anywhere.
TEST_F(KeptField, PixelsThatFlickerAreNoMotion) {
  maq::KeptField kept(64);
  std::mt19937 random(5);
  std::uniform_real_distribution<float> share(0, 1);
  for (unsigned k = 0; k < 10; ++k) {
    Depth depth = frame(0.5, k);
    for (int y = 30; y < 80; ++y) {
      for (const int x : {39, 90}) {
        float& z = depth[size_t(y * kWide + x)];
        z = share(random) < 0.2f ? 0 : z * (1 - 0.2f * share(random));
      }
    }
    for (int i = 0; i < 1500; ++i) depth[random() % depth.size()] = 0;
    EXPECT_EQ(find(kept, depth).width_px, k == 0 ? kWide : 0) << k;
    maq::EdgeField field = field_with(depth, 1);
    kept.merge(field, workers_);
  }
}

TEST_F(KeptField, NothingIsKeptForLongerThanAsked) {
  maq::KeptField kept(3);
  for (int k = 0; k < 10; ++k) {
    const Depth depth = frame(0, 1);
    EXPECT_EQ(find(kept, depth).width_px > 0, k % 3 == 0) << k;
    maq::EdgeField field = field_with(depth, float(k));
    kept.merge(field, workers_);
    EXPECT_EQ(field.distance_r[100], float(k / 3 * 3));
  }
}

TEST_F(KeptField, UnknownDepthHasNoEdgeAndAHoleIsFoundAnew) {
  maq::KeptField kept(64);
  Depth depth = frame(0, 1);
  find(kept, depth);
  maq::EdgeField first = field_with(depth, 3);
  kept.merge(first, workers_);
  for (int x = 300; x < 304; ++x) depth[size_t(220 * kWide + x)] = 0;
  EXPECT_EQ(find(kept, depth).width_px, 0) << "four pixels, as sensors lose them at every frame";
  maq::EdgeField field = field_with(depth, 5);
  kept.merge(field, workers_);
  EXPECT_EQ(field.distance_r[size_t(220 * kWide + 302)], 16);
  EXPECT_EQ(field.kind[size_t(220 * kWide + 302)], maq::kNoEdge);
  EXPECT_EQ(field.distance_r[size_t(220 * kWide + 305)], 3);
  for (int y = 219; y < 223; ++y) {
    for (int x = 300; x < 312; ++x) depth[size_t(y * kWide + x)] = 0;
  }
  EXPECT_GT(find(kept, depth).width_px, 0);
  for (const Depth& other : {Depth(kWide * kHigh, 0), frame(0, 1)}) {
    EXPECT_EQ(find(kept, other).width_px, kWide) << "all of it came or went";
    maq::EdgeField all = field_with(other, 5);
    EXPECT_EQ(kept.merge(all, workers_), 0);
  }
}

TEST_F(KeptField, AFrameOfAnotherCameraOrThatWasNotFinishedKeepsNothing) {
  maq::KeptField kept(64);
  const Depth depth = frame(0, 1);
  find(kept, depth);
  EXPECT_EQ(find(kept, depth).width_px, kWide) << "the network failed or was cancelled";
  maq::EdgeField field = field_with(depth, 3);
  kept.merge(field, workers_);
  maq::Intrinsics other = kCamera;
  other.fx_px = 301;
  EXPECT_EQ(find(kept, depth, other).width_px, kWide);
}

// Depth is exact and the tiny network sees no farther than 18 px.
TEST_F(KeptField, TheFieldOfAMovingBoxIsThatWithoutIt) {
  for (const bool skips_planes : {false, true}) {
    maq::EdgesSettings settings;
    settings.spin = false;
    maq::Edges plain(tiny_edges::runtime(), maq::read_bundle(tiny_edges::kBundle), settings);
    settings.keep_frames = 16;
    settings.skips_planes = skips_planes;
    maq::Edges keeping(tiny_edges::runtime(), maq::read_bundle(tiny_edges::kBundle), settings);
    maq::EdgesResult expected, found;
    int64_t run_on = 0;
    for (int k = 0; k < 12; ++k) {
      const Depth depth = frame(0, 1, 30 + 3 * (k / 2));  // every other frame is like the one before
      plain.run(tiny_edges::view_of(depth, kWide, kHigh), kCamera, expected);
      keeping.run(tiny_edges::view_of(depth, kWide, kHigh), kCamera, found);
      EXPECT_EQ(found.stats.kept_pixels > 0, k > 0);
      if (k % 2 == 1) {
        EXPECT_EQ(found.stats.network_pixels, 0);
      }
      run_on += found.stats.network_pixels;
      for (size_t i = 0; i < depth.size(); ++i) {
        const int x = int(i) % kWide, y = int(i) / kWide;
        // Far from edges, skipped planes are eps_r, which an untrained network does not say.
        const int left = 30 + 3 * (k / 2);
        if (skips_planes && !(x >= left - 16 && x < left + 66 && y >= 14 && y < 96)) continue;
        ASSERT_NEAR(found.field.distance_r[i], expected.field.distance_r[i], 1e-3) << k << ": " << x << " " << y;
        ASSERT_EQ(found.field.kind[i], expected.field.kind[i]) << k << ": " << x << " " << y;
      }
    }
    EXPECT_LT(run_on, 5 * kWide * kHigh) << "of twelve frames";
  }
}

TEST_F(KeptField, IsTheSameForAnyNumberOfThreads) {
  maq::KeptField one(8), many(8);
  maq::WorkerThreads single(1), several(3);
  for (unsigned k = 0; k < 6; ++k) {
    const Depth depth = frame(1, k, 40 + int(k) / 3);
    const maq::DepthPlane plane{depth.data(), kWide, kHigh};
    EXPECT_EQ(one.find(plane, kCamera, kMultiple, single).width_px,
              many.find(plane, kCamera, kMultiple, several).width_px);
    maq::EdgeField first = field_with(depth, float(k)), second = first;
    EXPECT_EQ(one.merge(first, single), many.merge(second, several));
    EXPECT_EQ(first.distance_r, second.distance_r);
  }
}

}  // namespace
}  // namespace kept_field
