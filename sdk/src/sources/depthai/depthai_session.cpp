// DepthAI devices by the vendor's library, depthai-core 3: the only file that includes it. It is built into
// libmaquette_depthai.so, which depthai_backend.cpp opens.
#include "sources/depthai/depthai_session.h"

#include <algorithm>
#include <chrono>
#include <depthai/depthai.hpp>
#include <functional>
#include <stdexcept>
#include <utility>

#include "core/module.h"

namespace maq {
namespace {

constexpr dai::CameraBoardSocket kColour = dai::CameraBoardSocket::CAM_A;
constexpr dai::CameraBoardSocket kLeft = dai::CameraBoardSocket::CAM_B;
constexpr dai::CameraBoardSocket kRight = dai::CameraBoardSocket::CAM_C;
constexpr std::pair<uint32_t, uint32_t> kStereoSizePx{640, 400};
// Messages are taken in the queues' callbacks; the content of the queues is discarded.
constexpr unsigned kQueueLength = 1;
constexpr unsigned kControlQueueLength = 8;

// Types of the vendor's exceptions stay in this library, their texts go on.
template <class Body>
auto plain(Body&& body) -> decltype(body()) {
  try {
    return body();
  } catch (const std::exception& error) {
    throw std::runtime_error(error.what());
  } catch (...) {
    throw std::runtime_error("depthai-core threw something unknown");
  }
}

std::optional<maq_pixel_format> format_of(dai::ImgFrame::Type type) {
  switch (type) {
    case dai::ImgFrame::Type::NV12: return MAQ_PIXEL_NV12;
    case dai::ImgFrame::Type::BGR888i: return MAQ_PIXEL_BGR8;
    case dai::ImgFrame::Type::RGB888i: return MAQ_PIXEL_RGB8;
    case dai::ImgFrame::Type::GRAY8:
    case dai::ImgFrame::Type::RAW8: return MAQ_PIXEL_GREY8;
    case dai::ImgFrame::Type::RAW16: return MAQ_PIXEL_DEPTH16;
    default: return {};
  }
}

DepthAiFrame frame_of(const std::shared_ptr<const dai::ImgFrame>& from) {
  DepthAiFrame frame;
  const auto bytes = from->getData();
  frame.owner = from;
  frame.data = bytes.data();
  frame.size_bytes = bytes.size();
  frame.format = format_of(from->getType());
  frame.width_px = from->getWidth();
  frame.height_px = from->getHeight();
  frame.stride_bytes = from->getStride();
  frame.uv_offset_bytes = from->getPlaneStride(0);
  // Fitted to the host's std::chrono::steady_clock by the library; on Linux that is CLOCK_MONOTONIC.
  const auto time = static_cast<const dai::Buffer&>(*from).getTimestamp().time_since_epoch();
  frame.timestamp_ns = std::chrono::duration_cast<std::chrono::nanoseconds>(time).count();
  frame.sequence = from->getSequenceNum();
  frame.exposure_us = int(std::clamp<int64_t>(from->getExposureTime().count(), 0, 1000000000));
  frame.gain_iso = from->getSensitivity();
  frame.focus = from->getLensPosition();
  frame.white_balance_k = from->getColorTemperature();
  return frame;
}

using Receive = void (DepthAiReceiver::*)(DepthAiFrame);

void forward(dai::MessageQueue& queue, std::shared_ptr<DepthAiReceiver> receiver, Receive receive) {
  const std::function<void(std::shared_ptr<dai::ADatatype>)> callback =
      [receiver = std::move(receiver), receive](const std::shared_ptr<dai::ADatatype>& message) {
        try {
          const auto frame = std::dynamic_pointer_cast<const dai::ImgFrame>(message);
          if (frame != nullptr) (*receiver.*receive)(frame_of(frame));
        } catch (...) {  // no memory: the frame is lost, but the library's thread goes on
        }
      };
  queue.addCallback(callback);
}

class Session : public DepthAiSession {
 public:
  explicit Session(const std::string& device) : device_(std::make_shared<dai::Device>(dai::DeviceInfo(device))) {
    device_->setMaxReconnectionAttempts(0);  // LiveSource opens a lost device again
  }
  ~Session() override {
    try {
      close();
    } catch (...) {  // the device is destroyed anyway
    }
  }

  DepthAiFeatures features() override {
    return plain([&] {
      DepthAiFeatures found;
      found.id = device_->getDeviceId();
      bool has_colour = false, has_left = false, has_right = false;
      for (const dai::CameraFeatures& camera : device_->getConnectedCameraFeatures()) {
        has_left |= camera.socket == kLeft;
        has_right |= camera.socket == kRight;
        if (camera.socket != kColour) continue;
        has_colour = true;
        found.width_px = camera.width;
        found.height_px = camera.height;
        found.has_autofocus = camera.hasAutofocus;
        for (const dai::CameraSensorConfig& config : camera.configs) {
          found.fps = std::max(found.fps, double(config.maxFps));
        }
      }
      if (!has_colour) throw std::runtime_error("it has no camera at socket CAM_A");
      found.has_stereo = has_left && has_right;
      return found;
    });
  }

  std::optional<DepthAiLens> lens(int width_px, int height_px) override {
    return plain([&]() -> std::optional<DepthAiLens> {
      try {
        const dai::CalibrationHandler calibration = device_->readCalibration();
        const auto matrix = calibration.getCameraIntrinsics(kColour, width_px, height_px);
        const auto distortion = calibration.getDistortionCoefficients(kColour);
        DepthAiLens found;
        found.fx_px = matrix.at(0).at(0);
        found.cx_px = matrix.at(0).at(2);
        found.fy_px = matrix.at(1).at(1);
        found.cy_px = matrix.at(1).at(2);
        found.distortion.assign(distortion.begin(), distortion.end());
        found.is_perspective = calibration.getDistortionModel(kColour) == dai::CameraModel::Perspective;
        return found;
      } catch (const std::exception&) {
        if (device_->isClosed()) throw;
        return {};  // the device has no calibration
      }
    });
  }

  void start(const DepthAiPlan& plan, std::shared_ptr<DepthAiReceiver> receiver) override {
    plain([&] {
      pipeline_ = std::make_unique<dai::Pipeline>(device_);
      const auto camera = pipeline_->create<dai::node::Camera>()->build(kColour);
      dai::Node::Output* const picture =
          camera->requestOutput({uint32_t(plan.width_px), uint32_t(plan.height_px)}, dai::ImgFrame::Type::NV12,
                                dai::ImgResizeMode::CROP, float(plan.fps), plan.with_depth);
      colour_ = picture->createOutputQueue(kQueueLength, false);
      forward(*colour_, receiver, &DepthAiReceiver::receive_colour);
      control_ = camera->inputControl.createInputQueue(kControlQueueLength, false);
      if (plan.with_depth) {
        depth_ = add_stereo(plan, *picture).createOutputQueue(kQueueLength, false);
        forward(*depth_, receiver, &DepthAiReceiver::receive_depth);
      }
      pipeline_->start();
    });
  }

  std::string problem() override {
    return plain([&]() -> std::string {
      if (device_->isClosed()) return "the link to the device is closed";
      return pipeline_->isRunning() ? "" : "the device's pipeline has stopped";
    });
  }

  void close() override {
    plain([&] {
      if (pipeline_ != nullptr) pipeline_->stop();
      device_->close();
    });
  }

  void set_auto_exposure(bool on) override {
    send([&](dai::CameraControl& control) {
      if (on) control.setAutoExposureEnable();
      control.setAutoExposureLock(!on);
    });
  }
  void set_exposure(int exposure_us, int gain_iso) override {
    send([&](dai::CameraControl& control) { control.setManualExposure(uint32_t(exposure_us), uint32_t(gain_iso)); });
  }
  void set_auto_focus(bool on) override {
    using Mode = dai::CameraControl::AutoFocusMode;
    send([&](dai::CameraControl& control) { control.setAutoFocusMode(on ? Mode::CONTINUOUS_VIDEO : Mode::OFF); });
  }
  void set_focus(int position) override {
    send([&](dai::CameraControl& control) { control.setManualFocus(uint8_t(position)); });
  }
  void set_auto_white_balance(bool on) override {
    send([&](dai::CameraControl& control) {
      if (on) control.setAutoWhiteBalanceMode(dai::CameraControl::AutoWhiteBalanceMode::AUTO);
      control.setAutoWhiteBalanceLock(!on);
    });
  }
  void set_white_balance(int kelvin) override {
    send([&](dai::CameraControl& control) { control.setManualWhiteBalance(kelvin); });
  }
  void set_brightness(int value) override {
    send([&](dai::CameraControl& control) { control.setBrightness(value); });
  }

 private:
  // Depth in millimetres, aligned to `picture`.
  dai::Node::Output& add_stereo(const DepthAiPlan& plan, dai::Node::Output& picture) {
    const auto mono = [&](dai::CameraBoardSocket socket) {
      return pipeline_->create<dai::node::Camera>()->build(socket)->requestOutput(
          kStereoSizePx, std::nullopt, dai::ImgResizeMode::CROP, float(plan.fps));
    };
    const auto stereo = pipeline_->create<dai::node::StereoDepth>();
    stereo->setDefaultProfilePreset(dai::node::StereoDepth::PresetMode::DEFAULT);
    stereo->setLeftRightCheck(true);  // without it depth cannot be aligned to another camera
    mono(kLeft)->link(stereo->left);
    mono(kRight)->link(stereo->right);
    if (device_->getPlatform() == dai::Platform::RVC4) {  // whose stereo cannot align
      const auto align = pipeline_->create<dai::node::ImageAlign>();
      stereo->depth.link(align->input);
      picture.link(align->inputAlignTo);
      return align->outputAligned;
    }
    stereo->setOutputSize(plan.width_px, plan.height_px);
    picture.link(stereo->inputAlignTo);
    return stereo->depth;
  }

  template <class Change>
  void send(Change&& change) {
    plain([&] {
      const auto message = std::make_shared<dai::CameraControl>();
      change(*message);
      control_->send(message);
    });
  }

  std::shared_ptr<dai::Device> device_;
  std::unique_ptr<dai::Pipeline> pipeline_;
  std::shared_ptr<dai::MessageQueue> colour_, depth_;
  std::shared_ptr<dai::InputQueue> control_;
};

const char* chip_of(XLinkPlatform_t platform) {
  switch (platform) {
    case X_LINK_MYRIAD_X: return "RVC2";
    case X_LINK_RVC4: return "RVC4";
    default: return "device";
  }
}

class Driver : public DepthAiDriver {
 public:
  std::vector<DepthAiDevice> list() override {
    return plain([] {
      std::vector<DepthAiDevice> devices;
      // Includes devices that cannot be opened, with the reason.
      for (const dai::DeviceInfo& info : dai::XLinkConnection::getAllConnectedDevices(X_LINK_ANY_STATE, false)) {
        DepthAiDevice device{info.getDeviceId(), info.name, chip_of(info.platform), MAQ_OK, ""};
        if (info.status == X_LINK_INSUFFICIENT_PERMISSIONS) {
          device.status = MAQ_ERROR_NO_PERMISSION;
          device.problem = "the user may not use this USB device";
        } else if (info.status == X_LINK_DEVICE_ALREADY_IN_USE || info.state == X_LINK_BOOTED ||
                   info.state == X_LINK_GATE_BOOTED) {
          device.status = MAQ_ERROR_BUSY;
          device.problem = "it runs already";
        } else if (info.status != X_LINK_SUCCESS) {
          device.status = MAQ_ERROR_DEVICE_LOST;
          device.problem = "it does not answer (XLink error " + std::to_string(int(info.status)) + ")";
        }
        devices.push_back(std::move(device));
      }
      return devices;
    });
  }

  std::unique_ptr<DepthAiSession> open(const std::string& device) override {
    return plain([&]() -> std::unique_ptr<DepthAiSession> { return std::make_unique<Session>(device); });
  }
};

}  // namespace
}  // namespace maq

extern "C" __attribute__((visibility("default"))) maq::ModuleExport maquette_depthai() {
  static maq::Driver driver;
  return {MAQ_MODULE_VERSION, static_cast<maq::DepthAiDriver*>(&driver)};
}
