// Frames as codes: what torch says, and extreme images.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "support/expect_error.h"
#include "support/samples/tiny_prediction.h"

namespace {

using tiny_prediction::kFolder;

std::vector<uint16_t> codes_of(maq::FrameEncoder& encoder, const maq::Frame& frame) {
  std::vector<uint16_t> codes(encoder.codes().count());
  encoder.encode(frame.image, codes.data());
  return codes;
}

size_t equal_count(const std::vector<uint16_t>& one, const std::vector<uint16_t>& other) {
  size_t equal = 0;
  for (size_t i = 0; i < one.size(); ++i) equal += one[i] == other[i] ? 1 : 0;
  return equal;
}

TEST(FrameCodes, AreThoseOfTorch) {
  const auto encoder = tiny_prediction::encoder();
  const std::string expected = read_text(kFolder + "/codes.u8");
  size_t equal = 0;
  for (int number = 0; number < tiny_prediction::kFrames; ++number) {
    const std::vector<uint16_t> codes = codes_of(*encoder, tiny_prediction::frame(number));
    const auto* const of_torch = reinterpret_cast<const uint8_t*>(expected.data()) + size_t(number) * codes.size();
    equal += equal_count(codes, std::vector<uint16_t>(of_torch, of_torch + codes.size()));
  }
  EXPECT_GE(double(equal), 0.999 * double(expected.size())) << "of " << expected.size();
}

TEST(FrameCodes, ThePictureOfThemIsThatOfTorch) {
  const maq::CodeBundle bundle(maq::read_bundle(tiny_prediction::kBundle));
  const auto encoder = tiny_prediction::encoder();
  maq::FrameDecoder decoder(tiny_prediction::runtime(), bundle, {});
  const std::string stored = read_text(kFolder + "/rebuilt.f32"), codes = read_text(kFolder + "/codes.u8");
  std::vector<uint16_t> of_torch(encoder->codes().count());
  for (size_t i = 0; i < of_torch.size(); ++i) of_torch[i] = uint8_t(codes[i]);
  std::vector<uint8_t> rgb(64 * 64 * 3);
  for (int again = 0; again < 2; ++again) {
    decoder.decode(of_torch.data(), rgb.data());
    double squares = 0;
    for (size_t i = 0; i < rgb.size(); ++i) {
      float expected;
      std::memcpy(&expected, stored.data() + i * sizeof expected, sizeof expected);
      squares += std::pow(double(rgb[i]) - std::round(double(expected)), 2);
    }
    EXPECT_LE(squares / double(rgb.size()), 255.0 * 255.0 / 1e5) << "PSNR is at least 50 dB";
  }
}

TEST(FrameCodes, OfALargeFrameAreThoseOfThePictureThatOpenCVMakesOfIt) {
  const auto encoder = tiny_prediction::encoder();
  const std::string large = read_text(kFolder + "/large.rgb"), small = read_text(kFolder + "/large.u8");
  const auto view = [](const std::string& bytes) { return reinterpret_cast<const uint8_t*>(bytes.data()); };
  const auto of_large = codes_of(*encoder, tiny_prediction::frame_of(view(large), 160, 120, 0));
  const auto of_small = codes_of(*encoder, tiny_prediction::frame_of(view(small), 64, 64, 0));
  EXPECT_GE(equal_count(of_large, of_small), of_small.size() * 99 / 100) << "means of ties are rounded otherwise";
}

TEST(FrameCodes, OfBlackWhiteOneColourNoiseAndAChequerboardAreInRange) {
  const auto encoder = tiny_prediction::encoder();
  std::mt19937 random(1);
  for (const auto& [width, height] : {std::pair{64, 64}, {1, 1}, {3, 500}, {641, 479}}) {
    for (int kind = 0; kind < 5; ++kind) {
      maq::Frame frame;
      uint8_t* const pixels = frame.allocate_bgr(width, height);
      for (int i = 0; i < width * height * 3; ++i) {
        const int x = i / 3 % width, y = i / 3 / width;
        const int values[] = {0, 255, i % 3 == 0 ? 200 : 30, int(random() & 255), (x + y) % 2 * 255};
        pixels[i] = uint8_t(values[kind]);
      }
      for (const uint16_t code : codes_of(*encoder, frame)) ASSERT_LT(code, encoder->codes().entries) << kind;
    }
  }
}

TEST(FrameCodes, ADepthImageHasNone) {
  const auto encoder = tiny_prediction::encoder();
  maq::Frame depth;
  depth.allocate(MAQ_PIXEL_DEPTH16, 64, 64);
  expect_error(MAQ_ERROR_UNSUPPORTED, "depth image", [&] { codes_of(*encoder, depth); });
}

}  // namespace
