// The size of a head: by a distance that the app knows, or by depth; and heads out of memory.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <maquette/maquette.hpp>
#include <string>
#include <vector>

#include "support/samples/round_heads.h"
#include "support/temp_folder.h"

namespace api_head_size_tests {
namespace {

using namespace round_heads;  // NOLINT

double distance_m(const maquette::Head& head, const char* from, const char* to) {
  const maq_head_landmark a = head.landmark(from), b = head.landmark(to);
  return std::hypot(a.point_m[0] - b.point_m[0], a.point_m[1] - b.point_m[1], a.point_m[2] - b.point_m[2]);
}

// Depth of the head from the photo's camera, if the head were `larger`; the background is at 5 m.
std::vector<float> depth_of_photo(const maquette::Context& context, const maquette::Head& head, float larger) {
  maq_head_renderer_config config = maquette::default_head_renderer_config();
  maquette::HeadRenderer renderer(context, config, maquette::HeadMesh(head, coarse));
  const maquette::Image image = renderer.run(head.camera(0));
  size_t stride_bytes = 0;
  const auto* const seen = static_cast<const float*>(image.plane(MAQ_IMAGE_PLANE_DEPTH, &stride_bytes));
  EXPECT_EQ(stride_bytes, 320 * sizeof(float));
  std::vector<float> depth(seen, seen + 320 * 240);
  for (float& metres : depth) metres = metres > 0 ? larger * metres : 5;
  return depth;
}

class ApiHeadSize : public RoundHeads {
 protected:
  maquette::Frame frame_of(const std::vector<float>& depth, int width_px = 320, int height_px = 240) {
    maq_frame_desc desc;
    maq_frame_desc_init(&desc, sizeof desc);
    desc.format = MAQ_PIXEL_DEPTH32F;
    desc.width_px = width_px;
    desc.height_px = height_px;
    desc.planes[0] = reinterpret_cast<const uint8_t*>(depth.data());
    return {context, desc};
  }
  void expect_no_scale(const maquette::Head& head, const maquette::Frame& of_depth, maq_status status,
                       const char* text) {
    maq_head* scaled = nullptr;
    EXPECT_EQ(maq_head_scale_by_depth(head.get(), 0, of_depth.get(), &scaled), status);
    EXPECT_EQ(scaled, nullptr);
    expect_text(text);
  }
};

TEST_F(ApiHeadSize, ADistanceThatIsKnownScalesAllOfTheHead) {
  maquette::Head head = fitted();
  const double pupils_m = distance_m(head, "pupil_left", "pupil_right"), height_m = distance_m(head, "chin", "crown");
  const double factor = 0.07 / pupils_m;
  const float crown_m = Mesh(head, coarse).positions_m[2];
  const maq_pinhole_camera camera = head.camera(0);

  maquette::Head scaled = head.scaled_by_distance("pupil_left", "pupil_right", 0.07);
  EXPECT_NEAR(distance_m(scaled, "pupil_left", "pupil_right"), 0.07, 1e-9);
  EXPECT_NEAR(distance_m(scaled, "chin", "crown"), factor * height_m, 1e-9);
  EXPECT_EQ(scaled.info().scale, MAQ_HEAD_SCALE_GIVEN);
  const double unsure_m =
      std::hypot(double(head.landmark("pupil_left").sigma_m), double(head.landmark("pupil_right").sigma_m));
  EXPECT_NEAR(scaled.info().scale_sigma, unsure_m / pupils_m, 1e-5);
  EXPECT_NEAR(scaled.landmark("crown").sigma_m, factor * double(head.landmark("crown").sigma_m), 1e-8);
  EXPECT_NEAR(scaled.camera(0).centre[1], factor * camera.centre[1], 1e-9) << "it still lies on the photo";
  EXPECT_EQ(scaled.camera(0).intrinsics.fx_px, camera.intrinsics.fx_px);
  // Cells are in metres, so the meshes differ, but not in what they enclose.
  const auto height_of = [](const maquette::Head& of) {
    const Mesh mesh(of, coarse);
    float top = -1, bottom = 1;
    for (uint32_t i = 0; i < mesh.vertex_count; ++i) {
      top = std::max(top, mesh.positions_m[3 * i + 2]);
      bottom = std::min(bottom, mesh.positions_m[3 * i + 2]);
    }
    return double(top - bottom);
  };
  EXPECT_NEAR(height_of(scaled), factor * height_of(head), 1e-3);
  EXPECT_EQ(head.info().scale, MAQ_HEAD_SCALE_PRIOR) << "it stays as it is";
  EXPECT_EQ(Mesh(head, coarse).positions_m[2], crown_m);

  const TempFolder folder;
  scaled.save(folder.file("a.maqh"));
  const maquette::Head opened = maquette::Head::open(context, folder.file("a.maqh"));
  EXPECT_EQ(opened.info().scale, MAQ_HEAD_SCALE_GIVEN);
  EXPECT_NEAR(distance_m(opened, "pupil_left", "pupil_right"), 0.07, 1e-4) << "as float16";
}

TEST_F(ApiHeadSize, DistancesThatCannotBeAreASentence) {
  maquette::Head head = fitted();
  maq_head* scaled = nullptr;
  const auto refuse = [&](const char* from, const char* to, double given_m, maq_status status, const char* text) {
    EXPECT_EQ(maq_head_scale_by_distance(head.get(), from, to, given_m, &scaled), status);
    expect_text(text);
  };
  for (const double given_m : {0.0, -0.06, 1e-4, 11.0, double(NAN), double(INFINITY)}) {
    refuse("pupil_left", "pupil_right", given_m, MAQ_ERROR_INVALID_ARGUMENT, "must be 0.001 to 10");
  }
  refuse("pupil_left", "pupil_left", 0.06, MAQ_ERROR_INVALID_ARGUMENT, "are the same landmark");
  refuse("pupil_left", "elbow", 0.06, MAQ_ERROR_NOT_FOUND, "no landmark named \"elbow\"");
  refuse(nullptr, "chin", 0.06, MAQ_ERROR_INVALID_ARGUMENT, "from");
  EXPECT_EQ(scaled, nullptr);
}

TEST_F(ApiHeadSize, DepthOfThePhotoScalesTheHead) {
  maquette::Head head = fitted();
  const double pupils_m = distance_m(head, "pupil_left", "pupil_right");
  for (const float larger : {0.5f, 0.97f, 1.08f, 3.0f}) {
    std::vector<float> depth = depth_of_photo(context, head, larger);
    for (size_t i = 0; i < depth.size(); i += 3) depth[i] = NAN;  // as depth cameras have them
    const maquette::Head scaled = head.scaled_by_depth(frame_of(depth));
    EXPECT_EQ(scaled.info().scale, MAQ_HEAD_SCALE_DEPTH);
    EXPECT_NEAR(distance_m(scaled, "pupil_left", "pupil_right") / pupils_m, larger, 0.001 * double(larger));
    EXPECT_LT(scaled.info().scale_sigma, 0.002f) << "the depth has no noise but that of a mesh of 8 mm";
  }
}

TEST_F(ApiHeadSize, DepthOfAnotherSizeAndWithNoiseWillDo) {
  maquette::Head head = fitted();
  const double pupils_m = distance_m(head, "pupil_left", "pupil_right");
  const std::vector<float> depth = depth_of_photo(context, head, 1.1f);
  std::vector<uint16_t> small(160 * 120);
  for (size_t y = 0; y < 120; ++y) {
    for (size_t x = 0; x < 160; ++x) {
      const float metres = depth[2 * y * 320 + 2 * x] * (1 + 0.01f * (float((x * 7 + y * 13) % 11) - 5) / 5);
      small[y * 160 + x] = uint16_t(std::lround(1e3f * metres));
    }
  }
  // With a fifth of them behind a hand at a third of the distance.
  for (size_t i = 0; i < small.size(); i += 5) small[i] = uint16_t(small[i] / 3);
  maq_frame_desc desc;
  maq_frame_desc_init(&desc, sizeof desc);
  desc.format = MAQ_PIXEL_DEPTH16;
  desc.width_px = 160;
  desc.height_px = 120;
  desc.planes[0] = reinterpret_cast<const uint8_t*>(small.data());
  const maquette::Head scaled = head.scaled_by_depth(maquette::Frame(context, desc));
  EXPECT_NEAR(distance_m(scaled, "pupil_left", "pupil_right") / pupils_m, 1.1, 0.01);
  EXPECT_NEAR(scaled.info().scale_sigma, 0.008, 0.005) << "the noise's";
}

TEST_F(ApiHeadSize, DepthThatDoesNotShowTheHeadIsAStatus) {
  maquette::Head head = fitted();
  const std::vector<float> depth = depth_of_photo(context, head, 1);
  expect_no_scale(head, frame_of(std::vector<float>(320 * 240, 0)), MAQ_ERROR_NOT_FOUND, "0 have depth");
  std::vector<float> scattered = depth;
  for (size_t i = 0; i < scattered.size(); ++i) scattered[i] = float(1 + i * 7919 % 100);
  expect_no_scale(head, frame_of(scattered), MAQ_ERROR_NOT_FOUND, "agree with the head");
  expect_no_scale(head, frame_of(std::vector<float>(1, 1), 1, 1), MAQ_ERROR_INVALID_ARGUMENT, "of another shape");
  expect_no_scale(head, frame_of(std::vector<float>(4 * 3, 1), 4, 3), MAQ_ERROR_NOT_FOUND, "and 30");
  expect_no_scale(head, frame, MAQ_ERROR_INVALID_ARGUMENT, "not depth");
  std::vector<float> far_away = depth;
  for (float& metres : far_away) metres *= 1e8f;
  expect_no_scale(head, frame_of(far_away), MAQ_ERROR_INVALID_ARGUMENT, "cannot have this size");
  maq_head* scaled = nullptr;
  EXPECT_EQ(maq_head_scale_by_depth(head.get(), 1, frame.get(), &scaled), MAQ_ERROR_INVALID_ARGUMENT);
  expect_text("index is 1");
  EXPECT_EQ(maq_head_scale_by_depth(head.get(), 0, nullptr, &scaled), MAQ_ERROR_INVALID_ARGUMENT);
}

TEST_F(ApiHeadSize, HeadsAreOpenedFromMemory) {
  const TempFolder folder;
  maquette::Head head = fitted();
  head.save(folder.file("a.maqh"));
  const std::string bytes = read_text(folder.file("a.maqh"));
  std::string copy = bytes;
  maquette::Head opened = maquette::Head::open(context, copy.data(), copy.size());
  copy.assign(copy.size(), '\0');  // it was copied
  EXPECT_EQ(opened.landmark_names(), head.landmark_names());
  opened.save(folder.file("b.maqh"));
  EXPECT_EQ(read_text(folder.file("b.maqh")), bytes);
  maq_head* made = nullptr;
  for (size_t size = 0; size < bytes.size(); size += 97) {
    ASSERT_EQ(maq_head_open_memory(context.get(), bytes.data(), size, &made), MAQ_ERROR_UNREADABLE) << size;
  }
  expect_text("The head in memory");
  EXPECT_EQ(maq_head_open_memory(context.get(), nullptr, 10, &made), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(made, nullptr);
}

}  // namespace
}  // namespace api_head_size_tests
