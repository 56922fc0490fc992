// Captures through the C API: what is in a folder, its photos, and folders in which something is wrong.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "support/samples/api_tiny_scene.h"

namespace {

using api_tiny_scene::kCapture;

class ApiCaptures : public ::testing::Test {
 protected:
  ApiCaptures() { std::filesystem::copy(kCapture, copy(), std::filesystem::copy_options::recursive); }

  std::string copy() const { return folder_.file("capture"); }
  nlohmann::json transforms() const { return nlohmann::json::parse(read_text(copy() + "/transforms.json")); }
  void write(const nlohmann::json& document) const { write_text(copy() + "/transforms.json", document.dump()); }
  void expect_refused(maq_status status, const std::string& text) const {
    maq_capture* capture = nullptr;
    EXPECT_EQ(maq_capture_open(context_.get(), copy().c_str(), &capture), status) << maq_last_error(context_.get());
    EXPECT_NE(std::string(maq_last_error(context_.get())).find(text), std::string::npos)
        << maq_last_error(context_.get());
    EXPECT_EQ(capture, nullptr);
  }

  // The only thing dropped begins with `reason`.
  static void expect_dropped(const maquette::Capture& capture, const std::string& reason, uint64_t expected) {
    ASSERT_EQ(capture.info().drop_count, 1u);
    EXPECT_EQ(std::string(capture.drop(0).reason).rfind(reason, 0), 0u) << capture.drop(0).reason;
    EXPECT_EQ(capture.drop(0).count, expected);
  }

  TempFolder folder_;
  maquette::Context context_;
};

TEST_F(ApiCaptures, TellsWhatIsInTheFolder) {
  const maquette::Capture capture(context_, kCapture);
  const maq_capture_info info = capture.info();
  EXPECT_EQ(info.view_count, 5u);
  EXPECT_EQ(info.point_count, api_tiny_scene::capture_places().size() / 3);
  EXPECT_EQ(info.drop_count, 0u);
  EXPECT_EQ(info.up[2], 1);
  for (uint32_t i = 0; i < info.view_count; ++i) {
    const maq_capture_view view = capture.view(i);
    EXPECT_EQ(view.name, "images/" + std::to_string(i) + ".png");
    EXPECT_EQ(view.is_held_out, i == 3);
    EXPECT_EQ(view.camera.struct_size, sizeof(maq_pinhole_camera));
    EXPECT_EQ(view.camera.intrinsics.width_px, 72);
    EXPECT_EQ(view.camera.intrinsics.height_px, 56);
    EXPECT_EQ(view.camera.intrinsics.fx_px, 80);
    EXPECT_EQ(view.camera.intrinsics.cx_px, 36.5) << "half a pixel is taken off";
    EXPECT_EQ(view.camera.intrinsics.distortion[0], 0);
  }
  EXPECT_NEAR(capture.view(0).camera.centre[0], 3, 1e-12);
}

TEST_F(ApiCaptures, PhotosAreFramesThatOutliveTheirCapture) {
  maquette::Frame frame = maquette::Capture(context_, kCapture).load_view(2);
  const maq_frame_desc desc = frame.desc();
  EXPECT_EQ(desc.format, MAQ_PIXEL_BGR8);
  EXPECT_EQ(desc.width_px, 72);
  EXPECT_EQ(desc.height_px, 56);
  EXPECT_EQ(desc.sequence, 2u);
  int least = 255, most = 0;
  for (int y = 0; y < desc.height_px; ++y) {
    for (int x = 0; x < 3 * desc.width_px; ++x) {
      const int value = desc.planes[0][size_t(y) * desc.stride_bytes[0] + size_t(x)];
      least = std::min(least, value);
      most = std::max(most, value);
    }
  }
  EXPECT_GT(most, least + 100) << "it is a photo of noise";
}

TEST_F(ApiCaptures, DistortedPhotosComeUndistorted) {
  nlohmann::json document = transforms();
  document["k1"] = -0.2;
  write(document);
  const maquette::Capture capture(context_, copy());
  const maq_capture_view view = capture.view(0);
  EXPECT_NE(view.camera.intrinsics.fx_px, 80);
  EXPECT_EQ(view.camera.intrinsics.distortion[0], 0) << "the camera is that of the undistorted photo";
  EXPECT_EQ(capture.load_view(0).desc().width_px, view.camera.intrinsics.width_px);
}

TEST_F(ApiCaptures, WhatCannotBeUsedIsToldWithItsReason) {
  std::filesystem::remove(copy() + "/images/4.png");
  const maquette::Capture capture(context_, copy());
  EXPECT_EQ(capture.info().view_count, 4u);
  expect_dropped(capture, "photos that are not in their folder", 1);
  EXPECT_NE(std::string(capture.drop(0).reason).find("(first: images/4.png)"), std::string::npos);
}

TEST_F(ApiCaptures, APhotoThatIsGoneOrDamagedSinceIsAStatusOfTheCapture) {
  const maquette::Capture capture(context_, copy());
  maq_frame* frame = nullptr;
  std::filesystem::remove(copy() + "/images/0.png");
  EXPECT_EQ(maq_capture_load_view(capture.get(), 0, &frame), MAQ_ERROR_NOT_FOUND);
  EXPECT_NE(std::string(maq_last_error(capture.get())).find("0.png"), std::string::npos);
  write_text(copy() + "/images/1.png", "no picture");
  EXPECT_EQ(maq_capture_load_view(capture.get(), 1, &frame), MAQ_ERROR_UNREADABLE);
  EXPECT_EQ(frame, nullptr);
}

}  // namespace
