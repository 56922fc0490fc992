// A head's texture in the template's coordinates: what is visible is the head's, the rest goes on from it.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "head/files/template_file.h"
#include "head/texture/template_texture.h"
#include "head/texture/texture_layout.h"
#include "support/temp_folder.h"

namespace template_texture_tests {
namespace {

using namespace maq::head;  // NOLINT
using maq::Vec3;
using maq::WorkerThreads;
using Rgb = std::array<int, 3>;

constexpr int kFromSide = 512, kSide = 1024;

const HeadTemplate& shipped_template() {
  static const HeadTemplate head = [] {
    const std::string bytes = read_text(MAQ_TEST_MODELS "/heads-int8/template.maqt");
    return read_template(bytes.data(), bytes.size(), "template.maqt");
  }();
  return head;
}

std::vector<uint8_t> painted() {
  std::vector<uint8_t> colours(3 * shipped_template().vertex_points.size(), 10);
  return colours;
}

// Red rises to the person's left, green upwards, over the disc.
TextureImage slopes() {
  TextureImage image;
  image.side_px = kFromSide;
  for (int row = 0; row < kFromSide; ++row) {
    for (int column = 0; column < kFromSide; ++column) {
      for (const int value : {90, 255 - 255 * row / kFromSide, 255 * column / kFromSide}) {
        image.bgr.push_back(uint8_t(value));
      }
    }
  }
  return image;
}

Rgb at(const TextureImage& image, const float* coordinates) {
  const auto texel = [&](float along) { return std::min(image.side_px - 1, int(along * float(image.side_px))); };
  const size_t pixel = size_t(texel(coordinates[1])) * size_t(image.side_px) + size_t(texel(coordinates[0]));
  return {image.bgr[3 * pixel + 2], image.bgr[3 * pixel + 1], image.bgr[3 * pixel]};
}

TEST(TemplateTexture, TheSurfaceHasTheColoursOfItsDirection) {
  const HeadTemplate& head = shipped_template();
  WorkerThreads threads(2);
  const TextureImage image = texture_on_template(slopes(), head, head.points, painted(), threads);
  ASSERT_EQ(image.side_px, kSide);
  int right = 0, count = 0;
  for (size_t vertex = 0; vertex < head.vertex_points.size(); ++vertex) {
    const size_t point = head.vertex_points[vertex];
    const float* const p = &head.points[3 * point];
    if (head.kinds[point] != TemplateKind::kSurface || p[1] > -0.3f || std::abs(p[0]) > 0.5f) continue;  // the face
    const auto place = texture_place({double(p[0]), double(p[1]), double(p[2])});
    const Rgb seen = at(image, &head.texture_coordinates[2 * vertex]);
    right += std::abs(seen[0] - 255 * double(place[0])) < 12 && std::abs(seen[1] - 255 + 255 * double(place[1])) < 12
                 ? 1
                 : 0;
    ++count;
  }
  EXPECT_GT(count, 500);
  EXPECT_GT(right, 0.95 * count);
}

TEST(TemplateTexture, MouthTeethAndTongueArePaintedAsBrightAsTheFace) {
  const HeadTemplate& head = shipped_template();
  WorkerThreads threads(1);
  TextureImage dark = slopes();
  for (uint8_t& value : dark.bgr) value = uint8_t(value / 3);
  std::vector<uint8_t> colours(3 * head.vertex_points.size(), 200);
  const TextureImage bright = texture_on_template(slopes(), head, head.points, colours, threads);
  const TextureImage dim = texture_on_template(dark, head, head.points, colours, threads);
  for (size_t vertex = 0; vertex < head.vertex_points.size(); ++vertex) {
    const TemplateKind kind = head.kinds[head.vertex_points[vertex]];
    if (kind != TemplateKind::kTongue) continue;
    const float* const place = &head.texture_coordinates[2 * vertex];
    const int of_bright = at(bright, place)[0], of_dim = at(dim, place)[0];
    ASSERT_GT(of_bright, 100);
    ASSERT_LT(of_dim, 0.75 * of_bright);
    ASSERT_NEAR(at(bright, place)[0], at(bright, place)[2], 2) << "in the colour that was given";
  }
}

// A template with the eye behind a lid that covers it wholly has no eye colour from the disc.
TEST(TemplateTexture, EyeballsBehindLidsAreAsWhiteAsTheirVisiblePart) {
  const HeadTemplate& head = shipped_template();
  WorkerThreads threads(1);
  TextureImage blue = slopes();
  for (size_t i = 0; i < blue.bgr.size(); i += 3) blue.bgr[i] = 240, blue.bgr[i + 1] = blue.bgr[i + 2] = 30;
  const TextureImage image = texture_on_template(blue, head, head.points, painted(), threads);
  for (size_t vertex = 0; vertex < head.vertex_points.size(); ++vertex) {
    const size_t point = head.vertex_points[vertex];
    if (head.kinds[point] != TemplateKind::kEye) continue;
    const Rgb seen = at(image, &head.texture_coordinates[2 * vertex]);
    ASSERT_NEAR(seen[2], 240, 3) << "the brightest of what is seen of the eye";
    ASSERT_NEAR(seen[0], 30, 3);
  }
}

TEST(TemplateTexture, IsTheSameForAnyNumberOfThreadsAndNotLargerThanTexturesAre) {
  const HeadTemplate& head = shipped_template();
  WorkerThreads one(1), three(3);
  EXPECT_EQ(texture_on_template(slopes(), head, head.points, painted(), one).bgr,
            texture_on_template(slopes(), head, head.points, painted(), three).bgr);
  TextureImage large;
  large.side_px = kMaxTexture_px;
  large.bgr.resize(3 * size_t(kMaxTexture_px) * kMaxTexture_px);
  EXPECT_EQ(texture_on_template(large, head, head.points, painted(), three).side_px, kMaxTexture_px);
}

}  // namespace
}  // namespace template_texture_tests
