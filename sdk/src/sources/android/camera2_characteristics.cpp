#include "sources/android/camera2_characteristics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <tuple>

#include "core/checked_arithmetic.h"
#include "core/error.h"
#include "sources/android/camera2_errors.h"
#include "sources/camera_errors.h"

namespace maq {
namespace {

constexpr int64_t kSecondNs = 1000000000;
constexpr int64_t kMaxStampAgeNs = 10 * kSecondNs;

const uint8_t* values_of(const ndk::ACameraMetadata_const_entry& entry, uint8_t) { return entry.data.u8; }
const int32_t* values_of(const ndk::ACameraMetadata_const_entry& entry, int32_t) { return entry.data.i32; }
const int64_t* values_of(const ndk::ACameraMetadata_const_entry& entry, int64_t) { return entry.data.i64; }
const float* values_of(const ndk::ACameraMetadata_const_entry& entry, float) { return entry.data.f; }
constexpr uint8_t type_of(uint8_t) { return ndk::ACAMERA_TYPE_BYTE; }
constexpr uint8_t type_of(int32_t) { return ndk::ACAMERA_TYPE_INT32; }
constexpr uint8_t type_of(int64_t) { return ndk::ACAMERA_TYPE_INT64; }
constexpr uint8_t type_of(float) { return ndk::ACAMERA_TYPE_FLOAT; }

// The values of a tag; none when the device has no such tag, or gives it another type.
template <class Value>
std::vector<Value> read(const ndk::Functions& functions, const ndk::ACameraMetadata& metadata, uint32_t tag) {
  ndk::ACameraMetadata_const_entry entry{};
  if (functions.ACameraMetadata_getConstEntry(&metadata, tag, &entry) != ndk::ACAMERA_OK) return {};
  const Value* values = values_of(entry, Value{});
  if (entry.type != type_of(Value{}) || values == nullptr) return {};
  return {values, values + entry.count};
}

bool is_usable(int64_t width_px, int64_t height_px) {
  return width_px >= 1 && height_px >= 1 && width_px <= MAQ_MAX_SIDE_PX && height_px <= MAQ_MAX_SIDE_PX &&
         width_px * height_px <= MAQ_MAX_PIXELS;
}

const char* name_of_facing(uint8_t facing) {
  switch (facing) {
    case ndk::ACAMERA_LENS_FACING_FRONT: return "front";
    case ndk::ACAMERA_LENS_FACING_BACK: return "back";
    case ndk::ACAMERA_LENS_FACING_EXTERNAL: return "external";
    default: return "";
  }
}

}  // namespace

Camera2Manager create_camera2_manager(const ndk::Functions& functions) {
  Camera2Manager manager(functions.ACameraManager_create(), functions.ACameraManager_delete);
  if (manager == nullptr) {
    throw Error(MAQ_ERROR_DEVICE_LOST, "Android gives no access to its cameras (ACameraManager_create); try again.");
  }
  return manager;
}

std::vector<std::string> camera2_ids(const ndk::Functions& functions, ndk::ACameraManager& manager) {
  ndk::ACameraIdList* list = nullptr;
  const ndk::camera_status_t status = functions.ACameraManager_getCameraIdList(&manager, &list);
  if (status != ndk::ACAMERA_OK) fail_camera2("Android", "does not list its cameras", status);
  if (list == nullptr) return {};
  const std::unique_ptr<ndk::ACameraIdList, void (*)(ndk::ACameraIdList*)> owner(
      list, functions.ACameraManager_deleteCameraIdList);
  return {list->cameraIds, list->cameraIds + std::max(list->numCameras, 0)};
}

Camera2Characteristics::Camera2Characteristics(const ndk::Functions& functions, ndk::ACameraManager& manager,
                                               const std::string& id, const std::string& label)
    : label_(label) {
  ndk::ACameraMetadata* found = nullptr;
  const ndk::camera_status_t status = functions.ACameraManager_getCameraCharacteristics(&manager, id.c_str(), &found);
  if (status != ndk::ACAMERA_OK) fail_camera2(label, "does not say what it can do", status);
  if (found == nullptr) fail_camera2(label, "does not say what it can do", ndk::ACAMERA_ERROR_METADATA_NOT_FOUND);
  const std::unique_ptr<ndk::ACameraMetadata, void (*)(ndk::ACameraMetadata*)> metadata(found,
                                                                                        functions.ACameraMetadata_free);

  const auto facing = read<uint8_t>(functions, *metadata, ndk::ACAMERA_LENS_FACING);
  if (!facing.empty()) facing_ = name_of_facing(facing[0]);
  const auto orientation = read<int32_t>(functions, *metadata, ndk::ACAMERA_SENSOR_ORIENTATION);
  if (!orientation.empty() && orientation[0] % 90 == 0) orientation_deg_ = orientation[0];
  const auto clock = read<uint8_t>(functions, *metadata, ndk::ACAMERA_SENSOR_INFO_TIMESTAMP_SOURCE);
  has_boottime_ = !clock.empty() && clock[0] == ndk::ACAMERA_SENSOR_INFO_TIMESTAMP_SOURCE_REALTIME;
  const auto rates = read<int32_t>(functions, *metadata, ndk::ACAMERA_CONTROL_AE_AVAILABLE_TARGET_FPS_RANGES);
  for (size_t i = 0; i + 1 < rates.size(); i += 2) {
    if (rates[i] >= 1 && rates[i] <= rates[i + 1]) rates_.push_back({rates[i], rates[i + 1]});
  }
  read_sizes(functions, *metadata);
  read_lens(functions, *metadata);
}

void Camera2Characteristics::read_sizes(const ndk::Functions& functions, const ndk::ACameraMetadata& metadata) {
  // Format, width, height, direction; format, width, height, nanoseconds.
  const auto streams = read<int32_t>(functions, metadata, ndk::ACAMERA_SCALER_AVAILABLE_STREAM_CONFIGURATIONS);
  const auto durations = read<int64_t>(functions, metadata, ndk::ACAMERA_SCALER_AVAILABLE_MIN_FRAME_DURATIONS);
  double fastest = 0;
  for (const Camera2Rates& rates : rates_) fastest = std::max(fastest, rates.max_fps());
  for (size_t i = 0; i + 3 < streams.size(); i += 4) {
    const int32_t width = streams[i + 1], height = streams[i + 2];
    if (streams[i] != ndk::AIMAGE_FORMAT_YUV_420_888 ||
        streams[i + 3] != ndk::ACAMERA_SCALER_AVAILABLE_STREAM_CONFIGURATIONS_OUTPUT || !is_usable(width, height)) {
      continue;
    }
    double fps = fastest;
    for (size_t k = 0; k + 3 < durations.size(); k += 4) {
      const bool is_same =
          durations[k] == ndk::AIMAGE_FORMAT_YUV_420_888 && durations[k + 1] == width && durations[k + 2] == height;
      if (!is_same || durations[k + 3] <= 0) continue;
      const double sensor_fps = double(kSecondNs) / double(durations[k + 3]);
      fps = fastest > 0 ? std::min(fastest, sensor_fps) : sensor_fps;
    }
    sizes_.push_back({width, height, fps});
  }
}

void Camera2Characteristics::read_lens(const ndk::Functions& functions, const ndk::ACameraMetadata& metadata) {
  const auto lens = read<float>(functions, metadata, ndk::ACAMERA_LENS_INTRINSIC_CALIBRATION);
  // Left, top, width, height.
  const auto active = read<int32_t>(functions, metadata, ndk::ACAMERA_SENSOR_INFO_ACTIVE_ARRAY_SIZE);
  auto whole = read<int32_t>(functions, metadata, ndk::ACAMERA_SENSOR_INFO_PRE_CORRECTION_ACTIVE_ARRAY_SIZE);
  if (whole.size() != 4) whole = active;
  if (lens.size() != 5 || active.size() != 4) return;
  if (!is_usable(active[2], active[3]) || !is_usable(whole[2], whole[3])) return;
  const bool is_finite = std::all_of(lens.begin(), lens.end(), [](float value) { return std::isfinite(value); });
  if (!is_finite || lens[0] <= 0 || lens[1] <= 0) return;
  Lens found{};
  found.fx = lens[0];
  found.fy = lens[1];
  found.cx = lens[2];
  found.cy = lens[3];
  found.width = whole[2];
  found.height = whole[3];
  found.scale_x = found.scale_y = 1;
  // A device that can correct distortion does so unless it is told not to, and fits the result to the active array.
  const auto modes = read<uint8_t>(functions, metadata, ndk::ACAMERA_DISTORTION_CORRECTION_AVAILABLE_MODES);
  const bool is_corrected = std::any_of(
      modes.begin(), modes.end(), [](uint8_t mode) { return mode != ndk::ACAMERA_DISTORTION_CORRECTION_MODE_OFF; });
  if (is_corrected) {
    found.scale_x = double(active[2]) / whole[2];
    found.scale_y = double(active[3]) / whole[3];
  } else {
    const auto distortion = read<float>(functions, metadata, ndk::ACAMERA_LENS_DISTORTION);
    if (distortion.size() == 5 &&
        std::all_of(distortion.begin(), distortion.end(), [](float value) { return std::isfinite(value); })) {
      std::copy(distortion.begin(), distortion.end(), found.distortion);
    }
  }
  lens_ = found;
}

Camera2Size Camera2Characteristics::nearest_size(int width_px, int height_px) const {
  if (sizes_.empty()) refuse_camera(label_, "offers no images for processing (YUV_420_888)");
  const auto error = [&](const Camera2Size& size) {
    const double size_error =
        std::abs(std::log(double(size.width_px) / width_px)) + std::abs(std::log(double(size.height_px) / height_px));
    return std::make_tuple(size_error, -size.fps);
  };
  return *std::min_element(sizes_.begin(), sizes_.end(),
                           [&](const Camera2Size& a, const Camera2Size& b) { return error(a) < error(b); });
}

std::optional<Camera2Rates> Camera2Characteristics::nearest_rates(double fps) const {
  const auto nearest =
      std::min_element(rates_.begin(), rates_.end(), [&](const Camera2Rates& a, const Camera2Rates& b) {
        return std::make_tuple(std::abs(a.max_fps() - fps), -a.min) <
               std::make_tuple(std::abs(b.max_fps() - fps), -b.min);
      });
  if (nearest == rates_.end()) return {};
  return *nearest;
}

std::optional<maq_intrinsics> Camera2Characteristics::intrinsics(int width_px, int height_px) const {
  if (!lens_) return {};
  const double width = lens_->width * lens_->scale_x, height = lens_->height * lens_->scale_y;
  const double scale = std::max(width_px / width, height_px / height);
  maq_intrinsics found{};
  found.width_px = width_px;
  found.height_px = height_px;
  found.fx_px = lens_->fx * lens_->scale_x * scale;
  found.fy_px = lens_->fy * lens_->scale_y * scale;
  // Around the middle, which both share; the centre of the first pixel is 0, 0 here.
  found.cx_px = (lens_->cx * lens_->scale_x - width / 2) * scale + width_px / 2.0 - 0.5;
  found.cy_px = (lens_->cy * lens_->scale_y - height / 2) * scale + height_px / 2.0 - 0.5;
  const double* k = lens_->distortion;
  for (int i = 0; i < 5; ++i) found.distortion[i] = k[std::array{0, 1, 3, 4, 2}[size_t(i)]];
  return found;
}

int Camera2Characteristics::quarter_turns(int display_deg) const {
  // Seen from its front, a device rotates the other way.
  const int rotated_deg =
      std::strcmp(facing_, "front") == 0 ? orientation_deg_ + display_deg : orientation_deg_ - display_deg;
  return ((rotated_deg / 90) % 4 + 4) % 4;
}

maq_intrinsics rotated_intrinsics(maq_intrinsics of_picture, int quarter_turns) {
  maq_intrinsics rotated = of_picture;
  for (int i = 0; i < quarter_turns; ++i) {
    const maq_intrinsics before = rotated;
    rotated.width_px = before.height_px;
    rotated.height_px = before.width_px;
    rotated.fx_px = before.fy_px;
    rotated.fy_px = before.fx_px;
    rotated.cx_px = before.height_px - 1 - before.cy_px;
    rotated.cy_px = before.cx_px;
    // The tangential coefficients (p2, p1) are a vector.
    rotated.distortion[2] = before.distortion[3];
    rotated.distortion[3] = -before.distortion[2];
  }
  return rotated;
}

int64_t camera2_time_ns(int64_t stamp_ns, std::optional<int64_t> boottime_now_ns, int64_t now_ns) {
  const std::optional<int64_t> age = checked_sum(boottime_now_ns.value_or(now_ns), -std::max<int64_t>(stamp_ns, 0));
  return !age || *age < 0 || *age > kMaxStampAgeNs ? now_ns : now_ns - *age;
}

}  // namespace maq
