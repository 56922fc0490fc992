// Sizes, rates, lens and clock of a camera that is not open, read from Android and checked.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sources/android/camera2_functions.h"
#include "sources/camera_backend.h"

namespace maq {

using Camera2Manager = std::unique_ptr<ndk::ACameraManager, void (*)(ndk::ACameraManager*)>;

// Throws MAQ_ERROR_DEVICE_LOST without Android's camera service.
Camera2Manager create_camera2_manager(const ndk::Functions& functions);

// The id of each camera, in Android's order. Throws.
std::vector<std::string> camera2_ids(const ndk::Functions& functions, ndk::ACameraManager& manager);

struct Camera2Size {
  int width_px = 0;
  int height_px = 0;
  double fps = 0;  // at most; 0: not known
};

// Android's number: frames a second, or thousandths of them on some old devices.
struct Camera2Rates {
  int32_t min = 0;
  int32_t max = 0;
  double max_fps() const { return max >= 1000 ? max / 1000.0 : max; }
};

class Camera2Characteristics {
 public:
  // Throws; `label` ("android:0") begins the sentence.
  Camera2Characteristics(const ndk::Functions& functions, ndk::ACameraManager& manager, const std::string& id,
                         const std::string& label);

  // "back", "front" or "external"; "" when it does not say.
  const char* facing() const { return facing_; }
  // How often to rotate its images by 90 degrees clockwise, 0 to 3, to show them upright on a display that is rotated
  // by `display_deg` from the device's natural orientation (Display.getRotation), a multiple of 90.
  int quarter_turns(int display_deg) const;
  // Whether times of images are of CLOCK_BOOTTIME; otherwise they are near CLOCK_MONOTONIC.
  bool has_boottime() const { return has_boottime_; }
  // Sizes for the pixel format of this build (YUV_420_888).
  const std::vector<Camera2Size>& sizes() const { return sizes_; }
  // Throws MAQ_ERROR_UNSUPPORTED when there are none.
  Camera2Size nearest_size(int width_px, int height_px) const;
  // The range with the nearest maximum, and among these the highest minimum: the requested rate, whatever the light.
  // Nothing when the device lists none.
  std::optional<Camera2Rates> nearest_rates(double fps) const;
  // For images of that size before they are rotated, which show the middle of the sensor's image.
  std::optional<maq_intrinsics> intrinsics(int width_px, int height_px) const;

 private:
  struct Lens {
    double fx, fy, cx, cy;      // in pixels of the sensor, whose first has its centre at 0.5, 0.5
    double distortion[5] = {};  // k1, k2, k3, p1, p2
    double width, height;       // size of the part of the sensor that these refer to
    double scale_x, scale_y;    // from there to the part that images show
  };

  void read_sizes(const ndk::Functions& functions, const ndk::ACameraMetadata& metadata);
  void read_lens(const ndk::Functions& functions, const ndk::ACameraMetadata& metadata);

  std::string label_;
  const char* facing_ = "";
  int orientation_deg_ = 0;  // clockwise, of its images, for the device's natural orientation
  bool has_boottime_ = false;
  std::vector<Camera2Size> sizes_;
  std::vector<Camera2Rates> rates_;
  std::optional<Lens> lens_;
};

// Returns the intrinsics after `quarter_turns` clockwise rotations by 90 degrees.
maq_intrinsics rotated_intrinsics(maq_intrinsics of_picture, int quarter_turns);

// When an image was taken, of CLOCK_MONOTONIC: `stamp_ns` is of CLOCK_BOOTTIME, which is `boottime_now_ns` now, or of
// CLOCK_MONOTONIC (`boottime_now_ns` empty). `now_ns` where that cannot be: in the future, or older than frames become.
int64_t camera2_time_ns(int64_t stamp_ns, std::optional<int64_t> boottime_now_ns, int64_t now_ns);

}  // namespace maq
