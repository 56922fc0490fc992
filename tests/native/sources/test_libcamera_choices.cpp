// The libcamera backend's choice of the formats and controls that a camera offers. Cameras here are lists in memory.
#include <gtest/gtest.h>
#include <libcamera/control_ids.h>
#include <libcamera/formats.h>

#include <cmath>

#include "sources/libcamera/controls.h"
#include "sources/libcamera/formats.h"
#include "support/expect_error.h"

namespace {

namespace controls = libcamera::controls;
namespace formats = libcamera::formats;
using libcamera::ControlInfo;
using libcamera::ControlInfoMap;
using libcamera::ControlList;
using libcamera::PixelFormat;
using libcamera::Size;
using libcamera::SizeRange;

using Offer = std::map<PixelFormat, std::vector<SizeRange>>;

// Takes the formats and sizes of the offer: of a list of sizes the next smaller one, of a range any.
class OfferedConfiguration : public libcamera::CameraConfiguration {
 public:
  explicit OfferedConfiguration(const Offer& offer) : offer_(offer) {
    addConfiguration(libcamera::StreamConfiguration(libcamera::StreamFormats(offer)));
  }
  Status validate() override {
    libcamera::StreamConfiguration& stream = at(0);
    if (offer_.count(stream.pixelFormat) == 0) stream.pixelFormat = offer_.begin()->first;
    Size taken = offer_[stream.pixelFormat].front().min;
    for (const SizeRange& range : offer_[stream.pixelFormat]) {
      if (range.min != range.max) taken = stream.size.boundedTo(range.max).expandedTo(range.min);
      if (range.min == range.max && range.max.width <= stream.size.width && range.max > taken) taken = range.max;
    }
    stream.size = taken;
    return is_invalid ? Invalid : Adjusted;
  }

  bool is_invalid = false;

 private:
  Offer offer_;
};

std::string chosen(const Offer& offer, const maq::CameraRequest& request) {
  OfferedConfiguration configuration(offer);
  maq::choose_libcamera_format(configuration, request, 5, "libcamera:0");
  const libcamera::StreamConfiguration& stream = configuration.at(0);
  EXPECT_EQ(stream.bufferCount, 5u);
  return stream.pixelFormat.toString() + " " + stream.size.toString();
}

TEST(LibcameraChoices, TakeTheNearestSizeAndThenTheCheapestFormat) {
  const SizeRange vga(Size(640, 480)), qvga(Size(320, 240)), hd(Size(1280, 720)), any(Size(64, 64), Size(2592, 1944));
  const Offer webcam = {{formats::MJPEG, {qvga, vga, hd}}, {formats::YUYV, {qvga, vga}}};
  EXPECT_EQ(chosen(webcam, {}), "YUYV 640x480");
  EXPECT_EQ(chosen(webcam, {"", 300, 200, 0}), "YUYV 320x240");
  EXPECT_EQ(chosen(webcam, {"", 1270, 710, 0}), "MJPEG 1280x720") << "the next smaller one is not the nearest";
  EXPECT_EQ(chosen(webcam, {"MJPG", 640, 480, 0}), "MJPEG 640x480") << "by its four letters";
  EXPECT_EQ(chosen(webcam, {"MJPEG", 640, 480, 0}), "MJPEG 640x480") << "by libcamera's own name";
  const Offer board = {{formats::RGB888, {any}}, {formats::NV12, {any}}, {formats::SRGGB10, {any}}};
  EXPECT_EQ(chosen(board, {"", 650, 490, 0}), "NV12 650x490") << "any size will do";
  EXPECT_EQ(chosen(board, {"RG24", 5000, 5000, 0}), "RGB888 2592x1944");
  expect_error(MAQ_ERROR_UNSUPPORTED, "libcamera:0 offers MJPG, YUYV, but not NV12.", [&] {
    chosen(webcam, {"NV12", 640, 480, 0});
  });
  expect_error(MAQ_ERROR_UNSUPPORTED, "libcamera:0 offers RG10, but none of them is understood.", [&] {
    chosen({{formats::SRGGB10, {any}}}, {});
  });
}

TEST(LibcameraChoices, ACameraThatTakesNothingOfItsOfferIsRefused) {
  OfferedConfiguration configuration({{formats::YUYV, {SizeRange(Size(640, 480))}}});
  configuration.is_invalid = true;
  expect_error(MAQ_ERROR_UNSUPPORTED, "libcamera:0 offers YUYV, but",
               [&] { maq::choose_libcamera_format(configuration, {}, 4, "libcamera:0"); });
}

TEST(LibcameraChoices, ListsEveryFormatAndSize) {
  const OfferedConfiguration configuration({{formats::R8, {SizeRange(Size(320, 240)), SizeRange(Size(640, 480))}},
                                            {formats::YUV420, {SizeRange(Size(64, 64))}}});
  const std::vector<maq::CameraMode> modes = maq::libcamera_modes(configuration);
  ASSERT_EQ(modes.size(), 3u);
  for (const maq::CameraMode& mode : modes) EXPECT_EQ(mode.usable, mode.format == "R8") << mode.format;
  EXPECT_EQ(modes[1].width_px * modes[1].height_px + modes[0].width_px * modes[0].height_px +
                modes[2].width_px * modes[2].height_px,
            320 * 240 + 640 * 480 + 64 * 64);
}

TEST(LibcameraChoices, WhatTheCameraAgreedToIsChecked) {
  libcamera::Stream stream;
  libcamera::StreamConfiguration agreed;
  agreed.setStream(&stream);
  agreed.pixelFormat = formats::RGB888;
  agreed.size = Size(640, 480);
  agreed.stride = 2048;
  const maq::LibcameraFormat found = maq::agreed_libcamera_format(agreed, "libcamera:0");
  EXPECT_EQ(found.format.pixels, MAQ_PIXEL_BGR8) << "libcamera's RGB888 is B, G, R in memory";
  EXPECT_EQ(found.stride_bytes, 2048u);
  const auto refused = [&](const char* text) {
    expect_error(MAQ_ERROR_UNSUPPORTED, text, [&] { maq::agreed_libcamera_format(agreed, "libcamera:0"); });
  };
  agreed.stride = 639;
  refused("lines of 639 bytes for 640 pixels");
  agreed.stride = 1u << 30;
  refused("lines of 1073741824 bytes");
  agreed.stride = 0;
  EXPECT_EQ(maq::agreed_libcamera_format(agreed, "libcamera:0").stride_bytes, 1920u);
  agreed.size = Size(100000, 2);
  refused("(100000 x 2)");
  agreed.size = Size(0, 480);
  refused("(0 x 480)");
  agreed.size = Size(640, 480);
  agreed.setStream(nullptr);
  refused("cannot be used");
}

// As the IPA of a Raspberry Pi offers them.
ControlInfoMap board_controls() {
  ControlInfoMap::Map map;
  map.emplace(&controls::AeEnable, ControlInfo(false, true, true));
  map.emplace(&controls::ExposureTime, ControlInfo(int32_t(100), int32_t(66666), int32_t(20000)));
  map.emplace(&controls::AnalogueGain, ControlInfo(1.0f, 16.0f, 1.0f));
  map.emplace(&controls::AfMode, ControlInfo(controls::AfModeValues));
  map.emplace(&controls::LensPosition, ControlInfo(0.0f, 32.0f, 1.0f));
  map.emplace(&controls::Brightness, ControlInfo(-1.0f, 1.0f, 0.0f));
  map.emplace(&controls::FrameDurationLimits, ControlInfo(int64_t(16666), int64_t(1000000)));
  return ControlInfoMap(std::move(map), controls::controls);
}

// The setting that the next request takes to the camera: "AeEnable=false".
std::string next_setting(maq::LibcameraControls& book) {
  ControlList request(controls::controls);
  book.take_setting(request);
  EXPECT_LE(request.size(), 1u);
  for (const auto& [id, value] : request) return controls::controls.at(id)->name() + "=" + value.toString();
  return "";
}

TEST(LibcameraChoices, ControlsHaveTheRangesOfTheCamera) {
  const maq::LibcameraControls book(board_controls(), "libcamera:0");
  const maq_source_control_info exposure = book.get(MAQ_SOURCE_CONTROL_EXPOSURE);
  EXPECT_EQ(exposure.min, 100);
  EXPECT_EQ(exposure.max, 66666);
  EXPECT_EQ(exposure.default_value, 20000);
  EXPECT_EQ(exposure.value, 20000);
  EXPECT_EQ(exposure.step, 1);
  EXPECT_EQ(book.get(MAQ_SOURCE_CONTROL_BRIGHTNESS).min, -1);
  EXPECT_EQ(book.get(MAQ_SOURCE_CONTROL_AUTO_FOCUS).max, 1) << "libcamera has three ways to focus, and we two";
  EXPECT_EQ(book.get(MAQ_SOURCE_CONTROL_AUTO_FOCUS).value, 0);
  expect_error(MAQ_ERROR_UNSUPPORTED, "libcamera:0 has no control 7",
               [&] { book.get(MAQ_SOURCE_CONTROL_WHITE_BALANCE); });
}

TEST(LibcameraChoices, ACameraWithoutAnyControlHasNone) {
  const maq::LibcameraControls book(ControlInfoMap(), "libcamera:0");
  expect_error(MAQ_ERROR_UNSUPPORTED, "has no control 2", [&] { book.get(MAQ_SOURCE_CONTROL_EXPOSURE); });
}

TEST(LibcameraChoices, AValueSetByHandSwitchesItsAutomaticOffWithARequestBeforeIt) {
  maq::LibcameraControls book(board_controls(), "libcamera:0");
  EXPECT_EQ(next_setting(book), "");
  book.set(MAQ_SOURCE_CONTROL_EXPOSURE, 12345.4);
  EXPECT_EQ(book.get(MAQ_SOURCE_CONTROL_EXPOSURE).value, 12345);
  EXPECT_EQ(book.get(MAQ_SOURCE_CONTROL_AUTO_EXPOSURE).value, 0);
  book.set(MAQ_SOURCE_CONTROL_GAIN, 4);
  book.set(MAQ_SOURCE_CONTROL_FOCUS, 2.5);
  book.set(MAQ_SOURCE_CONTROL_AUTO_FOCUS, 1);
  for (const char* setting : {"AeEnable=false", "ExposureTime=12345", "AeEnable=false", "AnalogueGain=4.000000",
                              "AfMode=0", "LensPosition=2.500000", "AfMode=2", ""}) {
    EXPECT_EQ(next_setting(book), setting);
  }
}

TEST(LibcameraChoices, SettingsThatNoFrameTakesAwayDoNotPileUp) {
  maq::LibcameraControls book(board_controls(), "libcamera:0");
  for (int value = 100; value < 10000; ++value) book.set(MAQ_SOURCE_CONTROL_EXPOSURE, value);
  for (const char* setting : {"AeEnable=false", "ExposureTime=9999", ""}) EXPECT_EQ(next_setting(book), setting);
  expect_error(MAQ_ERROR_BUSY, "settings waiting for its next frames", [&] {
    for (int i = 0; i < 100; ++i) {
      book.set(MAQ_SOURCE_CONTROL_EXPOSURE, 1000 + i);
      book.set(MAQ_SOURCE_CONTROL_BRIGHTNESS, 0.5);
    }
  });
}

TEST(LibcameraChoices, ValuesOutOfRangeAreRefusedAndSetNothing) {
  maq::LibcameraControls book(board_controls(), "libcamera:0");
  for (const double value : {99.0, 66667.0, -1.0, std::nan("")}) {
    expect_error(MAQ_ERROR_INVALID_ARGUMENT, "Control 2 of libcamera:0 goes from 100 to 66666, not to",
                 [&] { book.set(MAQ_SOURCE_CONTROL_EXPOSURE, value); });
  }
  EXPECT_EQ(next_setting(book), "");
}

TEST(LibcameraChoices, FramesSayWhatTheControlsAreUnlessSomethingIsOnItsWay) {
  maq::LibcameraControls book(board_controls(), "libcamera:0");
  ControlList reported(controls::controls);
  reported.set(controls::ExposureTime, 5000);
  reported.set(controls::AfMode, int32_t(controls::AfModeContinuous));
  book.note(reported);
  EXPECT_EQ(book.get(MAQ_SOURCE_CONTROL_EXPOSURE).value, 5000);
  EXPECT_EQ(book.get(MAQ_SOURCE_CONTROL_AUTO_FOCUS).value, 1);
  book.set(MAQ_SOURCE_CONTROL_EXPOSURE, 700);
  book.note(reported);
  EXPECT_EQ(book.get(MAQ_SOURCE_CONTROL_EXPOSURE).value, 700);
}

TEST(LibcameraChoices, TheRateIsTheNearestThatTheCameraCan) {
  ControlList at_start(controls::controls);
  EXPECT_NEAR(maq::set_libcamera_rate(board_controls(), 25, at_start), 25, 1e-9);
  const auto limits = at_start.get(controls::FrameDurationLimits);
  ASSERT_TRUE(limits);
  EXPECT_EQ((*limits)[0], 40000);
  EXPECT_EQ((*limits)[1], 40000);
  EXPECT_NEAR(maq::set_libcamera_rate(board_controls(), 1000, at_start), 60, 0.01);
  EXPECT_NEAR(maq::set_libcamera_rate(board_controls(), 0.5, at_start), 1, 1e-9);
  EXPECT_EQ(maq::set_libcamera_rate(board_controls(), 0, at_start), 0) << "no rate requested";
  EXPECT_EQ(maq::set_libcamera_rate({}, 25, at_start), 0) << "no such control";
}

}  // namespace
