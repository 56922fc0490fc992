// Cameras of Android, on an Android in memory: which one is opened and how, and every failure of every function.
#include "support/android_camera_test.h"

#include <tuple>

#include "sources/android/camera2_errors.h"
#include "support/expect_error.h"

namespace {

using AndroidCameras = AndroidCameraTest;

TEST_F(AndroidCameras, TheNearestSizeAndRateAreTaken) {
  const struct {
    maq::CameraRequest request;
    int width, height;
    double fps;
    std::pair<int, int> rates;
  } table[] = {{{}, 640, 480, 30, {7, 30}},  // the device's own rate
               {{"", 300, 200, 0}, 320, 240, 30, {7, 30}},
               {{"", 4000, 3000, 30}, 1280, 720, 20, {30, 30}},  // which takes 50 ms a frame
               {{"", 640, 480, 15}, 640, 480, 15, {15, 15}},
               {{"", 640, 480, 29}, 640, 480, 30, {30, 30}}};
  for (const auto& row : table) {
    const auto opened = camera(row.request);
    EXPECT_EQ(opened->format().pixels, MAQ_PIXEL_NV12);
    EXPECT_EQ(opened->format().width_px, row.width);
    EXPECT_EQ(opened->format().height_px, row.height);
    EXPECT_EQ(opened->format().fps, row.fps);
    EXPECT_EQ(fake_.rates(), row.rates);
  }
}

TEST_F(AndroidCameras, RatesInThousandthsAreUnderstood) {
  fake_.cameras[0].metadata.set<int32_t>(ndk::ACAMERA_CONTROL_AE_AVAILABLE_TARGET_FPS_RANGES,
                                         {15000, 15000, 30000, 30000, 0, 5000, 9000, 8000});
  const auto opened = camera({"", 320, 240, 14});
  EXPECT_EQ(fake_.rates(), std::pair(15000, 15000));
  EXPECT_EQ(opened->format().fps, 15);
}

TEST_F(AndroidCameras, AreOpenedByIdNumberAndFacing) {
  fake_.cameras = {FakeCamera2::camera("10", ndk::ACAMERA_LENS_FACING_FRONT),
                   FakeCamera2::camera("0", ndk::ACAMERA_LENS_FACING_BACK),
                   FakeCamera2::camera("usb", ndk::ACAMERA_LENS_FACING_EXTERNAL)};
  for (const auto& [name, id] : {std::pair("10", "10"), std::pair("0", "0"), std::pair("1", "0"), std::pair("2", "usb"),
                                 std::pair("front", "10"), std::pair("back", "0"), std::pair("external", "usb")}) {
    EXPECT_EQ(camera({}, name)->identity(), std::string("android:") + id) << name;
    EXPECT_EQ(fake_.opened_id(), id) << name;
  }
  for (const char* name : {"3", "side", "-1", "99999999999999999999", "0 ", "Front"}) {
    expect_error(MAQ_ERROR_NOT_FOUND, "it has 10 (front), 0 (back), usb (external)", [&] { camera({}, name); });
  }
  fake_.cameras.clear();
  expect_error(MAQ_ERROR_NOT_FOUND, "it has none", [&] { camera(); });
}

TEST_F(AndroidCameras, AreListedWithTheirSizesAndTheirProblems) {
  fake_.cameras.push_back({"2", {}});
  const auto found = maq::list_android_cameras(functions_);
  ASSERT_EQ(found.size(), 3u);
  EXPECT_EQ(found[1].uri, "android:1");
  EXPECT_EQ(found[1].name, "front camera");
  ASSERT_EQ(found[1].modes.size(), 4u);  // neither JPEG nor an input
  EXPECT_EQ(found[1].modes[0].width_px, 1280);
  EXPECT_EQ(found[1].modes[0].fps, 20);
  EXPECT_EQ(found[1].modes[1].fps, 30);
  EXPECT_EQ(found[2].name, "camera");
  EXPECT_TRUE(found[2].modes.empty());
  fake_.break_call("ACameraManager_getCameraCharacteristics", ndk::ACAMERA_ERROR_CAMERA_DISCONNECTED, 1, 1);
  const auto broken = maq::list_android_cameras(functions_);
  ASSERT_EQ(broken.size(), 3u);
  EXPECT_EQ(broken[0].status, MAQ_OK);
  EXPECT_EQ(broken[1].status, MAQ_ERROR_DEVICE_LOST);
  EXPECT_NE(broken[1].problem.find("not connected"), std::string::npos) << broken[1].problem;
}

TEST_F(AndroidCameras, WhatTheyCannotDoIsASentence) {
  fake_.cameras.push_back({"2", {}});
  expect_error(MAQ_ERROR_UNSUPPORTED, "android:2 offers no images for processing", [&] { camera({}, "2"); });
  // Metadata that cannot be is as good as none.
  auto& odd = fake_.cameras[2].metadata;
  odd.set<int32_t>(ndk::ACAMERA_SCALER_AVAILABLE_STREAM_CONFIGURATIONS,
                   {0x23, -640, 480, 0, 0x23, 0, 0, 0, 0x23, 1 << 30, 1 << 30, 0, 0x23, 640, 480});
  expect_error(MAQ_ERROR_UNSUPPORTED, "offers no images", [&] { camera({}, "2"); });
  odd.set<int64_t>(ndk::ACAMERA_SCALER_AVAILABLE_STREAM_CONFIGURATIONS, {0x23, 640, 480, 0});
  expect_error(MAQ_ERROR_UNSUPPORTED, "offers no images", [&] { camera({}, "2"); });
  odd.set<int32_t>(ndk::ACAMERA_SCALER_AVAILABLE_STREAM_CONFIGURATIONS, {0x23, 640, 480, 0});
  odd.set<uint8_t>(ndk::ACAMERA_LENS_FACING, {77});
  EXPECT_EQ(camera({"", 0, 0, 30}, "2")->format().width_px, 640);
  expect_error(MAQ_ERROR_UNSUPPORTED, "has no", [&] { camera()->set_control(MAQ_SOURCE_CONTROL_EXPOSURE, 1); });
}

TEST_F(AndroidCameras, SayWhatToDo) {
  const std::tuple<int, maq_status, const char*> table[] = {
      {ndk::ACAMERA_ERROR_PERMISSION_DENIED, MAQ_ERROR_NO_PERMISSION, "Grant android.permission.CAMERA"},
      {ndk::ACAMERA_ERROR_CAMERA_DISABLED, MAQ_ERROR_NO_PERMISSION, "foreground"},
      {ndk::ACAMERA_ERROR_CAMERA_IN_USE, MAQ_ERROR_BUSY, "Another app"},
      {ndk::ACAMERA_ERROR_MAX_CAMERA_IN_USE, MAQ_ERROR_BUSY, "Close another camera"},
      {ndk::ACAMERA_ERROR_CAMERA_DISCONNECTED, MAQ_ERROR_DEVICE_LOST, "not connected"},
      {ndk::ACAMERA_ERROR_CAMERA_DEVICE, MAQ_ERROR_DEVICE_LOST, "camera device failed"},
      {ndk::ACAMERA_ERROR_CAMERA_SERVICE, MAQ_ERROR_DEVICE_LOST, "camera service failed"},
      {ndk::ACAMERA_ERROR_NOT_ENOUGH_MEMORY, MAQ_ERROR_OUT_OF_MEMORY, "smaller size"},
      {ndk::ACAMERA_ERROR_UNKNOWN, MAQ_ERROR_UNSUPPORTED, "camera_status_t -10000"},
      {-12345, MAQ_ERROR_UNSUPPORTED, "camera_status_t -12345"}};
  for (const auto& [error, status, text] : table) {
    fake_.break_call("ACameraManager_openCamera", error);
    expect_error(status, text, [&] { camera(); });
    expect_error(status, "android:0 cannot be opened: ", [&] { camera(); });
  }
}

std::vector<std::string> names_of_functions() {
  return {
#define MAQ_FUNCTION(name, signature) #name,
      MAQ_FUNCTIONS_OF_CAMERA2NDK(MAQ_FUNCTION) MAQ_FUNCTIONS_OF_MEDIANDK(MAQ_FUNCTION)
#undef MAQ_FUNCTION
  };
}

bool ends_with(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

// Functions that return nothing cannot fail.
bool can_fail(const std::string& name) {
  return !ends_with(name, "_delete") && !ends_with(name, "_free") && !ends_with(name, "IdList") &&
         name != "ACameraCaptureSession_close";
}

TEST_F(AndroidCameras, EveryFailureOfEveryFunctionIsNamedAndLeavesNothing) {
  // Without these a camera opens all the same.
  const std::vector<std::string> harmless = {"ACameraDevice_close", "ACaptureRequest_getConstEntry",
                                             "ACaptureRequest_setEntry_i32"};
  int failures = 0;
  for (const std::string& name : names_of_functions()) {
    if (!can_fail(name) && name != "ACameraManager_getCameraIdList") continue;
    const bool is_of_images = name.rfind("AImage_", 0) == 0 || ends_with(name, "acquireNextImage");
    const bool is_harmless = is_of_images || std::count(harmless.begin(), harmless.end(), name) != 0;
    for (const int error : {ndk::ACAMERA_ERROR_CAMERA_DEVICE, ndk::ACAMERA_ERROR_UNKNOWN, ndk::camera_status_t(-1)}) {
      for (const int after : {0, 1, 2, 3}) {
        fake_.break_call(name, error, after);
        const std::string what = maq::concatenate(name, " ", error, " after ", after);
        try {
          const auto opened = camera({"", 320, 240, 30}, "back");
          EXPECT_TRUE(is_harmless || after > 0) << what;
        } catch (const maq::Error& failure) {
          ++failures;
          EXPECT_FALSE(is_harmless) << what;
          EXPECT_NE(failure.status(), MAQ_ERROR_INTERNAL) << what;
          const std::string text = failure.what();
          EXPECT_TRUE(text.rfind("android:", 0) == 0 || text.rfind("Android ", 0) == 0) << text;
          EXPECT_EQ(text.back(), '.') << text;
        }
        expect_nothing_left(what);
        fake_.break_call(name, error, after);
        try {
          maq::list_android_cameras(functions_);
        } catch (const maq::Error& failure) {
          EXPECT_TRUE(after == 0 && name.rfind("ACameraManager_", 0) == 0) << what << ": " << failure.what();
        }
        expect_nothing_left(what);
        fake_.mend();
      }
    }
  }
  EXPECT_GE(failures, 3 * 15);
}

TEST_F(AndroidCameras, OptionsOfTheUriAreChecked) {
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "display=45",
               [] { maq::android_uri_opener(maq::parse_source_uri("android:back?display=45"), 4, {}); });
  maq::SourceUri uri = maq::parse_source_uri("android:back?size=640x480&fps=30&zoom=2");
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "zoom", [&] { maq::android_uri_opener(uri, 4, {}); });
}

TEST_F(AndroidCameras, WithoutAndroidTheLibraryIsNamed) {
  const auto open = maq::android_uri_opener(maq::parse_source_uri("android:0"), 4, {});
  expect_error(MAQ_ERROR_RUNTIME_LIBRARY, "libcamera2ndk.so", [&] { open(); });
  EXPECT_TRUE(maq::list_android_cameras().empty());
  expect_error(MAQ_ERROR_RUNTIME_LIBRARY, "the function ACameraManager_create, which libc.so.6 does not have",
               [] { ndk::load_functions("libc.so.6", "libc.so.6"); });
}

}  // namespace
