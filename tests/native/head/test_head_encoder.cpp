// The encoder: what it is shown of a photo, and what it says, against ONNX Runtime in Python.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "maquette/types.h"
#include "support/expect_error.h"
#include "support/samples/tiny_head.h"

namespace head_encoder {
namespace {

using namespace maq::head;  // NOLINT
using maq::ImageView;

constexpr double kPi = 3.14159265358979323846;

struct Encoder {
  explicit Encoder(int threads = 1)
      : bundle(maq::read_bundle(tiny_head::kBundle)), encoder(tiny_head::runtime(), bundle, settings(threads)) {}
  static maq::SessionSettings settings(int threads) {
    maq::SessionSettings made;
    made.threads = threads;
    return made;
  }
  HeadEncoding run(const ImageView& photo, const HeadSquare& square) {
    HeadEncoding encoding;
    encoder.run(photo, square, cancel, encoding);
    return encoding;
  }

  HeadBundle bundle;
  HeadEncoder encoder;
  maq::RunCancel cancel{tiny_head::runtime()};
};

// Blue 40; red rises to the right and green downwards, a step a pixel.
std::vector<uint8_t> ramp(int width, int height) {
  std::vector<uint8_t> bgr;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (const int value : {40, y, x}) bgr.push_back(uint8_t(value));
    }
  }
  return bgr;
}

ImageView view(const std::vector<uint8_t>& bgr, int width, int height) {
  return maq::packed_view(MAQ_PIXEL_BGR8, width, height, bgr.data());
}

TEST(HeadEncoder, SaysOfAPictureWhatOnnxRuntimeSaysInPython) {
  const std::string bytes = read_text(tiny_head::kFolder + "/photo.bgr");
  const std::vector<uint8_t> bgr(bytes.begin(), bytes.end());
  const std::vector<float> expected = tiny_head::read_floats("cells.f32");
  for (const int threads : {1, 2, MAQ_THREADS_MEASURED}) {
    Encoder encoder(threads);
    EXPECT_GE(encoder.encoder.threads(), 1);
    const HeadEncoding found = encoder.run(view(bgr, 32, 32), {16, 16, 32, 0});
    ASSERT_EQ(found.rgb.size(), bgr.size());
    for (size_t i = 0; i < bgr.size(); ++i) ASSERT_NEAR(found.rgb[i], bgr[i - i % 3 + (2 - i % 3)], 1e-4);
    ASSERT_EQ(found.cells.size(), expected.size());
    for (size_t i = 0; i < expected.size(); ++i) ASSERT_NEAR(found.cells[i], expected[i], 1e-4);
    EXPECT_EQ(found.broken_cells, 0u);
  }
}

// Where crop and photo are in other places, of other sizes, or the head is turned.
TEST(HeadEncoder, IsShownTheSquareUpright) {
  const std::vector<uint8_t> bgr = ramp(240, 200);
  const ImageView photo = view(bgr, 240, 200);
  Encoder encoder;
  for (const HeadSquare& square : {HeadSquare{100, 90, 32, 0}, HeadSquare{120.3, 99.7, 100, 0.4},
                                   HeadSquare{60, 80, 20, -2.0}, HeadSquare{120, 100, 96, kPi}}) {
    const HeadEncoding found = encoder.run(photo, square);
    // The crop's axes in the photo: to the right, and the head's down, which is the photo's where it is not turned.
    const double scale = square.side_px / 32;
    const double c = std::cos(square.roll_rad) * scale, s = std::sin(square.roll_rad) * scale;
    for (int row = 0; row < 32; ++row) {
      for (int column = 0; column < 32; ++column) {
        const double x = column - 15.5, y = row - 15.5;
        const double red = square.x_px + c * x - s * y - 0.5, green = square.y_px + s * x + c * y - 0.5;
        const float* rgb = &found.rgb[size_t(3 * (32 * row + column))];
        ASSERT_NEAR(rgb[0], red, 0.75) << square.roll_rad << " " << row << " " << column;
        ASSERT_NEAR(rgb[1], green, 0.75);
        ASSERT_NEAR(rgb[2], 40, 1e-3);
      }
    }
  }
}

TEST(HeadEncoder, CellsAreObservedWhereTheirPixelsAre) {
  const std::vector<uint8_t> bgr = ramp(240, 200);
  Encoder encoder;
  const HeadEncoding found = encoder.run(view(bgr, 240, 200), {120, 100, 64, 0.3});
  const HeadObservations seen =
      read_observations(found.cells.data(), encoder.encoder.spec().cells, found.crop_to_photo, 240, 200);
  EXPECT_EQ(seen.unusable, 0u);
  for (int i = 0; i < 8; ++i) {
    for (int j = 0; j < 8; ++j) {
      // The mean of the four pixels around 4 j + 1.5, 4 i + 1.5 is red and green at the cell's place.
      double red = 0, green = 0;
      for (const int row : {4 * i + 1, 4 * i + 2}) {
        for (const int column : {4 * j + 1, 4 * j + 2}) {
          red += found.rgb[size_t(3 * (32 * row + column))] / 4;
          green += found.rgb[size_t(3 * (32 * row + column) + 1)] / 4;
        }
      }
      const HeadCell& cell = seen.cells[size_t(8 * i + j)];
      ASSERT_NEAR(cell.x_px, red, 0.6);
      ASSERT_NEAR(cell.y_px, green, 0.6);
    }
  }
}

TEST(HeadEncoder, SeesGreyBeyondThePhoto) {
  const std::vector<uint8_t> bgr = ramp(40, 40);
  Encoder encoder;
  const HeadEncoding found = encoder.run(view(bgr, 40, 40), {0, 0, 64, 0});
  for (int row = 0; row < 32; ++row) {
    for (int column = 0; column < 32; ++column) {
      if (row >= 15 && column >= 15) continue;
      for (int c = 0; c < 3; ++c) ASSERT_EQ(found.rgb[size_t(3 * (32 * row + column) + c)], 127);
    }
  }
  EXPECT_LT(found.rgb[size_t(3 * (32 * 20 + 20))], 20);
  const float bias[] = {0.1f, -1, 0.2f, -2.5f, 0.5f, 0, 0, -1};  // of even grey it says nothing else
  for (size_t k = 0; k < 8; ++k) EXPECT_NEAR(found.cells[k], bias[k], 1e-4);
}

TEST(HeadEncoder, TakesExtremeSquaresAndPhotos) {
  Encoder encoder;
  const std::vector<uint8_t> pixel = {10, 20, 30};
  for (const HeadSquare& square :
       {HeadSquare{0.5, 0.5, 2, 0}, HeadSquare{0.5, 0.5, 1e5, 1}, HeadSquare{1.2, 0.5, 2, 40}}) {
    const HeadEncoding found = encoder.run(view(pixel, 1, 1), square);
    for (const float value : found.rgb) ASSERT_TRUE(value >= 0 && value <= 255);
  }
  const std::vector<uint8_t> wide(size_t(3 * 4000), 200);
  EXPECT_NEAR(encoder.run(view(wide, 4000, 1), {2000, 0.5, 4000, 0}).rgb[3 * (32 * 4 + 4)], 127, 1e-3);
  const std::vector<uint8_t> nv12(24 * 36, 128);
  const HeadEncoding grey = encoder.run(maq::packed_view(MAQ_PIXEL_NV12, 24, 24, nv12.data()), {12, 12, 20, 0});
  EXPECT_NEAR(grey.rgb[3 * (32 * 16 + 16)], 130, 1);
}

TEST(HeadEncoder, SquaresThatCannotBeAreRefusedWithWhatToDo) {
  const std::vector<uint8_t> bgr = ramp(64, 48);
  Encoder encoder;
  const double kNan = std::numeric_limits<double>::quiet_NaN();
  for (const HeadSquare& square :
       {HeadSquare{kNan, 9, 9, 0}, HeadSquare{9, kNan, 9, 0}, HeadSquare{9, 9, kNan, 0}, HeadSquare{9, 9, 9, kNan},
        HeadSquare{9, 9, 0, 0}, HeadSquare{9, 9, -9, 0}, HeadSquare{9, 9, 2e5, 0}, HeadSquare{1e9, 9, 9, 0},
        HeadSquare{9, 9, INFINITY, 0}, HeadSquare{9, 9, 9, -INFINITY}}) {
    expect_error(MAQ_ERROR_INVALID_ARGUMENT, "Give finite numbers", [&] { encoder.run(view(bgr, 64, 48), square); });
  }
  for (const HeadSquare& square : {HeadSquare{80, 20, 20, 0}, HeadSquare{-20, 20, 20, 0}, HeadSquare{20, 100, 60, 0},
                                   HeadSquare{20, -100, 20, 0.5}}) {
    expect_error(MAQ_ERROR_INVALID_ARGUMENT, "shows nothing of the photo of 64 x 48",
                 [&] { encoder.run(view(bgr, 64, 48), square); });
  }
  const std::vector<float> depth(16, 1.0f);
  const ImageView metres = maq::packed_view(MAQ_PIXEL_DEPTH32F, 4, 4, reinterpret_cast<const uint8_t*>(depth.data()));
  expect_error(MAQ_ERROR_UNSUPPORTED, "", [&] { encoder.run(metres, {2, 2, 4, 0}); });
}

TEST(HeadEncoder, ASquareIsMadeOfTheLongerSideOfABox) {
  const EncoderSpec spec;
  const HeadSquare square = square_around(10, 20, 40, 70, 0.25, spec);
  EXPECT_EQ(square.x_px, 25);
  EXPECT_EQ(square.y_px, 45);
  EXPECT_EQ(square.side_px, 80);
  EXPECT_EQ(square.roll_rad, 0.25);
  const double kNan = std::numeric_limits<double>::quiet_NaN();
  for (const double wrong : {10.0, 5.0, kNan}) {
    expect_error(MAQ_ERROR_INVALID_ARGUMENT, "box", [&] { square_around(10, 20, wrong, 70, 0, spec); });
    expect_error(MAQ_ERROR_INVALID_ARGUMENT, "box", [&] { square_around(10, 10, 40, wrong, 0, spec); });
  }
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "finite", [&] { square_around(0, 0, INFINITY, 70, 0, spec); });
}

TEST(HeadEncoder, CanBeCancelledAndUsedAgain) {
  const std::vector<uint8_t> bgr = ramp(64, 48);
  Encoder encoder;
  encoder.cancel.cancel();
  expect_error(MAQ_CANCELLED, "", [&] { encoder.run(view(bgr, 64, 48), {20, 20, 30, 0}); });
  encoder.cancel.reset();
  EXPECT_EQ(encoder.run(view(bgr, 64, 48), {20, 20, 30, 0}).broken_cells, 0u);
}

// A bias that is infinite in one channel breaks all cells.
TEST(HeadEncoder, NetworksThatGiveNoNumbersAreAnError) {
  maq::Bundle opened = maq::read_bundle(tiny_head::kBundle);
  std::vector<uint8_t>& bytes = opened.files.at("encoder.onnx");
  const float bias[] = {0.1f, -1, 0.2f, -2.5f, 0.5f, 0, 0, -1}, broken = INFINITY;
  const std::string whole(bytes.begin(), bytes.end());
  const size_t at = whole.find(std::string(reinterpret_cast<const char*>(bias), sizeof bias));
  ASSERT_NE(at, std::string::npos);
  std::memcpy(bytes.data() + at, &broken, sizeof broken);
  const HeadBundle bundle(std::move(opened));
  HeadEncoder encoder(tiny_head::runtime(), bundle, Encoder::settings(1));
  const maq::RunCancel cancel(tiny_head::runtime());
  const std::vector<uint8_t> bgr = ramp(64, 48);
  HeadEncoding encoding;
  expect_error(MAQ_ERROR_INFERENCE, "no finite number", [&] {
    encoder.run(view(bgr, 64, 48), {20, 20, 30, 0}, cancel, encoding);
  });
}

}  // namespace
}  // namespace head_encoder
