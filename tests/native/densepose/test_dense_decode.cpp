#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "densepose/surface/dense_decode.h"

namespace {

using maq::Box;
using maq::DenseLogits;
using maq::DensePlanes;

constexpr int kCoarse = 15, kIndex = 25;
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

// U and V from whole planes [parts, size, size], background first, as a network would give them.
class Planes : public maq::ChartValues {
 public:
  Planes(const std::vector<float>& u, const std::vector<float>& v, int size) : u_(u), v_(v), size_(size) {}
  maq::ChartPoint at(int part, int row, int column) override {
    const size_t cell = size_t(((part + 1) * size_ + row) * size_ + column);
    return {u_[cell], v_[cell]};
  }

 private:
  const std::vector<float>&u_, &v_;
  int size_;
};

struct Logits {
  explicit Logits(int cells)
      : coarse(size_t(kCoarse * cells * cells), 0.0f),
        index(size_t(kIndex * cells * cells), 0.0f),
        u(index),
        v(index),
        size(cells) {}
  void fill(std::vector<float>& plane, int channel, float value) {
    std::fill_n(plane.begin() + channel * size * size, size * size, value);
  }
  DenseLogits view(maq::ChartValues* charts) {
    labels.resize(coarse.size() + index.size());
    const DenseLogits view{labels.data(), charts, kCoarse, kIndex, size};
    for (int y = 0; y < size; ++y) {
      for (int x = 0; x < size; ++x) {
        const size_t four = size_t((y / 2) * (size / 2) + x / 2);
        float* cell = labels.data() + (four * 4 + size_t(y % 2 * 2 + x % 2)) * (kCoarse + kIndex);
        for (int c = 0; c < kCoarse; ++c) cell[c] = coarse[size_t((c * size + y) * size + x)];
        for (int c = 0; c < kIndex; ++c) cell[kCoarse + c] = index[size_t((c * size + y) * size + x)];
      }
    }
    return view;
  }

  std::vector<float> coarse, index, u, v;  // planes [classes, size, size]
  std::vector<float> labels;               // the same as the dense head gives them
  int size;
};

maq::DecodeCounts paint(Logits& logits, const Box& box, uint8_t person, DensePlanes& planes,
                        float mask_threshold = 0.5f, float min_visible_fraction = 0) {
  Planes charts(logits.u, logits.v, logits.size);
  static maq::DecodeMemory memory;  // as in the SDK, the same for all people
  return paint_person(logits.view(&charts), box, person, mask_threshold, min_visible_fraction, memory, planes);
}

// The value of a bilinearly resized plane (half-pixel centres, edges repeated) in double.
double resized(const float* plane, int size, double y, double x) {
  const auto tap = [size](double at, int* low, int* high, double* fraction) {
    at = std::max(0.0, at);
    *low = std::min(int(at), size - 1);
    *high = std::min(*low + 1, size - 1);
    *fraction = at - *low;
  };
  int x0, x1, y0, y1;
  double fx, fy;
  tap(x, &x0, &x1, &fx);
  tap(y, &y0, &y1, &fy);
  return (1 - fy) * ((1 - fx) * plane[y0 * size + x0] + fx * plane[y0 * size + x1]) +
         fy * ((1 - fx) * plane[y1 * size + x0] + fx * plane[y1 * size + x1]);
}

int best_class(const std::vector<float>& logits, int classes, int size, double y, double x, double* margin) {
  std::vector<double> values;
  for (int c = 0; c < classes; ++c) values.push_back(resized(logits.data() + c * size * size, size, y, x));
  const auto best = std::max_element(values.begin(), values.end());
  std::vector<double> sorted = values;
  std::sort(sorted.rbegin(), sorted.rend());
  *margin = std::min(*margin, sorted[0] - sorted[1]);
  return int(best - values.begin());
}

void make_everybody_part(Logits& logits, int part) {
  logits.fill(logits.coarse, 1, 5);
  logits.fill(logits.index, part, 5);
}

// Logits of 16 x 16 cells, about half of them background.
Logits random_logits(std::mt19937& random) {
  std::uniform_real_distribution<float> logit(-4, 4), coordinate(-0.2f, 1.2f);
  Logits logits(16);
  for (auto* plane : {&logits.coarse, &logits.index}) {
    for (float& value : *plane) value = logit(random);
  }
  for (size_t cell = 0; cell < 256; ++cell) logits.coarse[cell] += 4;
  for (auto* plane : {&logits.u, &logits.v}) {
    for (float& value : *plane) value = coordinate(random);
  }
  return logits;
}

// The definition: of each cell the log-odds of a person, whichever part.
std::vector<float> person_odds(const Logits& logits) {
  const size_t cells = size_t(logits.size * logits.size);
  std::vector<float> odds(cells);
  for (size_t cell = 0; cell < cells; ++cell) {
    double sum = 0;
    for (size_t c = 1; c < kCoarse; ++c) sum += std::exp(double(logits.coarse[c * cells + cell]));
    odds[cell] = float(std::log(sum) - logits.coarse[cell]);
  }
  return odds;
}

TEST(DenseDecode, EqualsTheReferenceOnRandomLogits) {
  std::mt19937 random(5);
  for (const Box& box : {Box{3, 5, 43, 65}, Box{-10.5f, -4.2f, 30.7f, 100}, Box{50, 60, 51.5f, 61}}) {
    Logits logits = random_logits(random);
    const std::vector<float> odds = person_odds(logits);
    const std::vector<float> parts(logits.index.begin() + 256, logits.index.end());
    DensePlanes planes;
    planes.reset(70, 80);
    const maq::DecodeCounts counts = paint(logits, box, 9, planes);
    const maq::PixelRect rect = maq::pixel_rect(box);
    int64_t body = 0;
    for (int y = 0; y < 80; ++y) {
      for (int x = 0; x < 70; ++x) {
        const size_t pixel = size_t(y * 70 + x);
        body += planes.person[pixel] != 0;
        const int in_x = x - rect.x, in_y = y - rect.y;
        if (in_x < 0 || in_y < 0 || in_x >= rect.width || in_y >= rect.height) {
          ASSERT_EQ(planes.person[pixel] + planes.part[pixel], 0) << "outside the box";
          continue;
        }
        const double at_x = (in_x + 0.5) * 16 / rect.width - 0.5, at_y = (in_y + 0.5) * 16 / rect.height - 0.5;
        double margin = 1e9;
        const double person = resized(odds.data(), 16, at_y, at_x);
        margin = std::min(margin, std::abs(person));
        const int part = person <= 0 ? 0 : 1 + best_class(parts, kIndex - 1, 16, at_y, at_x, &margin);
        if (margin < 1e-4) continue;  // float and double may disagree about a near tie
        ASSERT_EQ(planes.part[pixel], part) << x << " " << y;
        ASSERT_EQ(planes.person[pixel], part == 0 ? 0 : 9);
        if (part == 0) continue;
        const double u = resized(logits.u.data() + part * 256, 16, at_y, at_x);
        ASSERT_NEAR(planes.u[pixel], std::clamp(u, 0.0, 1.0) * 255, 0.51);
      }
    }
    EXPECT_EQ(counts.body_pixels, body);
  }
}

TEST(DenseDecode, ARotatedPersonIsPaintedAsTheReference) {
  std::mt19937 random(6);
  Logits logits = random_logits(random);
  const std::vector<float> odds = person_odds(logits);
  const std::vector<float> parts(logits.index.begin() + 256, logits.index.end());
  Planes charts(logits.u, logits.v, logits.size);
  // A box of 40 x 60 pixels about (34, 30), rotated by 30 degrees, partly beyond the image.
  const double c = std::cos(0.5236), s = std::sin(0.5236);
  maq::AffineMap to_cells;
  to_cells.xx = c * 16 / 40, to_cells.xy = s * 16 / 40, to_cells.shift_x = 8 - (c * 34 + s * 30) * 16 / 40;
  to_cells.yx = -s * 16 / 60, to_cells.yy = c * 16 / 60, to_cells.shift_y = 8 - (-s * 34 + c * 30) * 16 / 60;
  DensePlanes planes;
  planes.reset(60, 50);
  maq::DecodeMemory memory;
  const maq::DecodeCounts counts = paint_rotated_person(logits.view(&charts), to_cells, 9, 0.5f, 0, memory, planes);
  int64_t body = 0, outside = 0;
  for (int y = 0; y < 50; ++y) {
    for (int x = 0; x < 60; ++x) {
      const size_t pixel = size_t(y * 60 + x);
      body += planes.person[pixel] != 0;
      const maq::Point cell = to_cells({x + 0.5, y + 0.5});
      if (cell.x < 0 || cell.y < 0 || cell.x > 16 || cell.y > 16) {
        ASSERT_EQ(planes.person[pixel] + planes.part[pixel], 0) << "outside the box";
        ++outside;
        continue;
      }
      double margin = 1e9;
      const double person = resized(odds.data(), 16, cell.y - 0.5, cell.x - 0.5);
      margin = std::min(margin, std::abs(person));
      const int part = person <= 0 ? 0 : 1 + best_class(parts, kIndex - 1, 16, cell.y - 0.5, cell.x - 0.5, &margin);
      if (margin < 1e-4) continue;
      ASSERT_EQ(planes.part[pixel], part) << x << " " << y;
      ASSERT_EQ(planes.person[pixel], part == 0 ? 0 : 9);
      if (part == 0) continue;
      const double u = resized(logits.u.data() + part * 256, 16, cell.y - 0.5, cell.x - 0.5);
      ASSERT_NEAR(planes.u[pixel], std::clamp(u, 0.0, 1.0) * 255, 0.51);
    }
  }
  EXPECT_EQ(counts.body_pixels, body);
  EXPECT_GT(body, 500);
  EXPECT_GT(outside, 500);
  // People in front stay, and a person who is mostly hidden leaves no trace.
  const DensePlanes before = planes;
  EXPECT_EQ(paint_rotated_person(logits.view(&charts), to_cells, 7, 0.5f, 0.5f, memory, planes).body_pixels, 0);
  EXPECT_EQ(planes.person, before.person);
}

TEST(DenseDecode, ConfidenceIsTheMeanProbabilityOfTheBestPartWhereThePersonIs) {
  Logits logits(8);
  maq::DecodeMemory memory;
  const auto confidence = [&] {
    const DenseLogits view = logits.view(nullptr);
    classify_cells(view, memory);
    return part_confidence(view, 0.5f, memory);
  };
  EXPECT_NEAR(confidence(), 1 / 24.0, 1e-5) << "all alike";
  logits.fill(logits.index, 4, std::log(23.0f));
  EXPECT_NEAR(confidence(), 0.5, 1e-5);
  logits.fill(logits.index, 9, kNan);
  EXPECT_NEAR(confidence(), 23.0 / 45, 1e-5) << "what is no number counts as absent";
  // Half of the cells are background, whatever their parts are.
  for (size_t cell = 0; cell < 32; ++cell) {
    logits.coarse[cell] = 50;
    logits.index[4 * 64 + cell] = 0;
  }
  EXPECT_NEAR(confidence(), 23.0 / 45, 1e-5);
  logits.fill(logits.coarse, 0, 50);
  EXPECT_EQ(confidence(), 0);
}

TEST(DenseDecode, BackgroundOfTheCoarseHeadGatesTheParts) {
  Logits logits(8);
  make_everybody_part(logits, 4);
  logits.fill(logits.coarse, 0, 6);
  DensePlanes planes;
  planes.reset(20, 20);
  EXPECT_EQ(paint(logits, {0, 0, 20, 20}, 1, planes).body_pixels, 0);
}

TEST(DenseDecode, TiesGoToTheLowestClass) {
  Logits logits(8);
  logits.fill(logits.coarse, 3, 1);
  logits.fill(logits.coarse, 5, 1);
  logits.fill(logits.index, 6, 2);
  logits.fill(logits.index, 20, 2);
  DensePlanes planes;
  planes.reset(10, 10);
  EXPECT_EQ(paint(logits, {0, 0, 10, 10}, 1, planes).body_pixels, 100);
  EXPECT_EQ(planes.part[55], 6);
  // As likely as not: background.
  for (float& value : logits.coarse) value = kNan;
  logits.fill(logits.coarse, 0, 2);
  logits.fill(logits.coarse, 3, 2);
  planes.reset(10, 10);
  EXPECT_EQ(paint(logits, {0, 0, 10, 10}, 1, planes).body_pixels, 0);
}

TEST(DenseDecode, PartsCountTogetherAgainstBackground) {
  Logits logits(8);
  logits.fill(logits.index, 0, 9);
  logits.fill(logits.index, 17, 1);
  logits.fill(logits.coarse, 0, 1);  // 14 parts at 0: log(14) > 1, though background is the best single class
  DensePlanes planes;
  planes.reset(10, 10);
  EXPECT_EQ(paint(logits, {0, 0, 10, 10}, 1, planes).body_pixels, 100);
  EXPECT_EQ(planes.part[55], 17);
  logits.fill(logits.coarse, 0, 3);
  planes.reset(10, 10);
  EXPECT_EQ(paint(logits, {0, 0, 10, 10}, 1, planes).body_pixels, 0);
}

TEST(DenseDecode, PaintsAboveTheMaskThreshold) {
  Logits logits(8);
  for (float& value : logits.coarse) value = kNan;
  logits.fill(logits.coarse, 0, 0);
  logits.fill(logits.coarse, 7, std::log(0.3f / 0.7f));  // a person with probability 0.3
  for (const auto& [threshold, painted] : {std::pair{0.5f, 0}, {0.31f, 0}, {0.29f, 100}}) {
    DensePlanes planes;
    planes.reset(10, 10);
    EXPECT_EQ(paint(logits, {0, 0, 10, 10}, 1, planes, threshold).body_pixels, painted) << threshold;
  }
}

TEST(DenseDecode, InfiniteLogitsAreStable) {
  Logits logits(8);
  make_everybody_part(logits, 4);
  const float infinity = std::numeric_limits<float>::infinity();
  logits.fill(logits.coarse, 2, infinity);
  DensePlanes planes;
  planes.reset(10, 10);
  EXPECT_EQ(paint(logits, {0, 0, 10, 10}, 1, planes).body_pixels, 100);
  logits.fill(logits.coarse, 2, -infinity);
  planes.reset(10, 10);
  EXPECT_EQ(paint(logits, {0, 0, 10, 10}, 1, planes).body_pixels, 100);
  logits.fill(logits.coarse, 0, infinity);
  planes.reset(10, 10);
  EXPECT_EQ(paint(logits, {0, 0, 10, 10}, 1, planes).body_pixels, 0);
}

TEST(DenseDecode, LargeLogitsAreStable) {
  Logits logits(8);
  for (float& value : logits.coarse) value = -80;
  for (float& value : logits.index) value = -80;
  logits.fill(logits.coarse, 14, 80);
  logits.fill(logits.index, 24, 80);
  DensePlanes planes;
  planes.reset(4, 4);
  paint(logits, {0, 0, 4, 4}, 1, planes);
  for (const uint8_t part : planes.part) EXPECT_EQ(part, 24);
}

TEST(DenseDecode, UAndVAreClampedAndCountedAndNanIsZero) {
  Logits logits(8);
  make_everybody_part(logits, 2);
  logits.fill(logits.u, 2, 1.5f);
  logits.fill(logits.v, 2, -0.5f);
  DensePlanes planes;
  planes.reset(10, 10);
  EXPECT_EQ(paint(logits, {0, 0, 10, 10}, 1, planes).clamped_uv, 100);
  EXPECT_EQ(planes.u[0], 255);
  EXPECT_EQ(planes.v[0], 0);
  logits.fill(logits.u, 2, kNan);
  logits.fill(logits.v, 2, 0.5f);
  planes.reset(10, 10);
  EXPECT_EQ(paint(logits, {0, 0, 10, 10}, 1, planes).clamped_uv, 100);
  EXPECT_EQ(planes.u[0], 0);
  EXPECT_EQ(planes.v[0], 128);
}

TEST(DenseDecode, NanLogitsNeverWin) {
  Logits logits(8);
  make_everybody_part(logits, 2);
  logits.fill(logits.coarse, 7, kNan);
  logits.fill(logits.index, 9, kNan);
  DensePlanes planes;
  planes.reset(4, 4);
  paint(logits, {0, 0, 4, 4}, 1, planes);
  for (const uint8_t part : planes.part) EXPECT_EQ(part, 2);
  for (float& value : logits.coarse) value = kNan;
  planes.reset(4, 4);
  EXPECT_EQ(paint(logits, {0, 0, 4, 4}, 1, planes).body_pixels, 0);
}

TEST(DenseDecode, OfEquallyLikelyPeopleTheFirstStaysInFront) {
  Logits logits(8);
  make_everybody_part(logits, 2);
  DensePlanes planes;
  planes.reset(20, 10);
  paint(logits, {0, 0, 12, 10}, 1, planes);
  EXPECT_EQ(paint(logits, {8, 0, 20, 10}, 2, planes).body_pixels, 80);
  EXPECT_EQ(planes.person[10], 1);
  EXPECT_EQ(planes.person[12], 2);
}

// Two people who overlap in 40 pixels; the second is likelier there.
TEST(DenseDecode, APixelGoesToTheLikelierPerson) {
  Logits first(8), second(8);
  make_everybody_part(first, 2);
  make_everybody_part(second, 5);
  second.fill(second.coarse, 1, 6);
  Planes charts(second.u, second.v, second.size);
  maq::AffineMap to_cells;  // the box of the second person
  to_cells.xx = 8.0 / 20, to_cells.shift_x = -8 * to_cells.xx, to_cells.yy = 0.8;
  maq::DecodeMemory memory;
  for (const float min_visible : {0.5f, 0.67f}) {  // two thirds of the first person remain
    for (const bool is_rotated : {false, true}) {
      DensePlanes planes;
      planes.reset(28, 10);
      EXPECT_EQ(paint_person(first.view(&charts), {0, 0, 12, 10}, 1, 0.5f, min_visible, memory, planes).body_pixels,
                120);
      const DenseLogits logits = second.view(&charts);
      const maq::DecodeCounts counts =
          is_rotated ? paint_rotated_person(logits, to_cells, 2, 0.5f, min_visible, memory, planes)
                     : paint_person(logits, {8, 0, 28, 10}, 2, 0.5f, min_visible, memory, planes);
      const bool wins = min_visible < 0.6f;
      EXPECT_EQ(counts.body_pixels, wins ? 200 : 160);
      EXPECT_EQ(counts.won_pixels, wins ? 40 : 0);
      for (size_t x = 0; x < 28; ++x) {
        const int owner = x < (wins ? 8u : 12u) ? 1 : 2;
        EXPECT_EQ(planes.person[x], owner) << x;
        EXPECT_EQ(planes.part[x], owner == 1 ? 2 : 5) << x;
      }
    }
  }
}

TEST(DenseDecode, APersonMostlyHiddenByOthersLeavesNoTrace) {
  Logits logits(8);
  make_everybody_part(logits, 2);
  DensePlanes planes;
  planes.reset(20, 10);
  paint(logits, {0, 0, 12, 10}, 1, planes);
  const DensePlanes before = planes;
  EXPECT_EQ(paint(logits, {8, 0, 16, 10}, 2, planes, 0.5f, 0.51f).body_pixels, 0);  // half of its 80 pixels are free
  EXPECT_EQ(planes.person, before.person);
  EXPECT_EQ(planes.part, before.part);
  EXPECT_EQ(planes.u, before.u);
  EXPECT_EQ(planes.v, before.v);
  EXPECT_EQ(paint(logits, {8, 0, 16, 10}, 2, planes, 0.5f, 0.5f).body_pixels, 40);
}

TEST(DenseDecode, BoxesCoverAtLeastOnePixelAndNothingOutsideTheImage) {
  const maq::PixelRect tiny = maq::pixel_rect({5.9f, 5.9f, 6.1f, 6.2f});
  EXPECT_EQ(tiny.x, 5);
  EXPECT_EQ(tiny.width, 1);
  EXPECT_EQ(tiny.height, 1);
  Logits logits(8);
  make_everybody_part(logits, 2);
  DensePlanes planes;
  planes.reset(10, 10);
  EXPECT_EQ(paint(logits, {-100, -100, 200, 200}, 1, planes).body_pixels, 100);
  planes.reset(1, 1);
  EXPECT_EQ(paint(logits, {0, 0, 0.5f, 0.5f}, 1, planes).body_pixels, 1);
}

}  // namespace
