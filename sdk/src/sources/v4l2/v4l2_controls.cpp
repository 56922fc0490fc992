#include "sources/v4l2/v4l2_controls.h"

#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>

#include "core/error.h"
#include "sources/camera_errors.h"

namespace maq {
namespace {

struct Control {
  maq_source_control which;
  const char* name;
  uint32_t id;
  uint32_t automatic_id;  // id of its automatic mode, which is switched off first; 0: none
  double unit;            // factor from the driver's numbers to the API's
  const char* unit_name;
};
const Control kControls[] = {
    {MAQ_SOURCE_CONTROL_AUTO_EXPOSURE, "automatic exposure", V4L2_CID_EXPOSURE_AUTO, 0, 1, ""},
    {MAQ_SOURCE_CONTROL_EXPOSURE, "exposure", V4L2_CID_EXPOSURE_ABSOLUTE, V4L2_CID_EXPOSURE_AUTO, 100, " microseconds"},
    {MAQ_SOURCE_CONTROL_GAIN, "gain", V4L2_CID_GAIN, V4L2_CID_AUTOGAIN, 1, ""},
    {MAQ_SOURCE_CONTROL_AUTO_FOCUS, "automatic focus", V4L2_CID_FOCUS_AUTO, 0, 1, ""},
    {MAQ_SOURCE_CONTROL_FOCUS, "focus", V4L2_CID_FOCUS_ABSOLUTE, V4L2_CID_FOCUS_AUTO, 1, ""},
    {MAQ_SOURCE_CONTROL_AUTO_WHITE_BALANCE, "automatic white balance", V4L2_CID_AUTO_WHITE_BALANCE, 0, 1, ""},
    {MAQ_SOURCE_CONTROL_WHITE_BALANCE, "white balance", V4L2_CID_WHITE_BALANCE_TEMPERATURE, V4L2_CID_AUTO_WHITE_BALANCE,
     1, " kelvin"},
    {MAQ_SOURCE_CONTROL_BRIGHTNESS, "brightness", V4L2_CID_BRIGHTNESS, 0, 1, ""},
};
constexpr Control kAutomaticGain{MAQ_SOURCE_CONTROL_GAIN, "automatic gain", V4L2_CID_AUTOGAIN, 0, 1, ""};

// The driver's checked information about a control.
struct Range {
  int64_t min, max, step, default_value;
  bool is_read_only;
  // For an automatic mode: the values that switch it on and off.
  int64_t on, off;
};

[[noreturn]] void refuse(const V4l2Device& device, const Control& control, int error, bool is_read_only = false) {
  maq_status status = MAQ_ERROR_BUSY;
  const char* remedy = " Try again, or plug the camera in again.";
  switch (error) {
    case ENODEV:
    case ENXIO:
    case EBADF:
      status = MAQ_ERROR_DEVICE_LOST;
      remedy = camera_remedy(status);
      break;
    case EACCES:
    case EBUSY:
      remedy = is_read_only ? " The device lets it be read only."
                            : " It is locked: switch its automatic off, or close the other program.";
  }
  throw Error(status, device.path(), " does not give access to its ", control.name, " (", std::strerror(error), ").",
              remedy);
}

[[noreturn]] void refuse_missing(const V4l2Device& device, const Control& control) {
  throw Error(MAQ_ERROR_UNSUPPORTED, device.path(), " has no ", control.name, ".");
}

bool offers_item(const V4l2Device& device, uint32_t id, const v4l2_queryctrl& found, int32_t item) {
  if (item < found.minimum || item > found.maximum) return false;
  v4l2_querymenu menu{};
  menu.id = id;
  menu.index = uint32_t(item);
  return device.call(VIDIOC_QUERYMENU, &menu) == 0;
}

// Exposure is chosen by an item of a menu; each driver has some of the items.
std::optional<Range> exposure_modes(const V4l2Device& device, const v4l2_queryctrl& found, Range range) {
  const auto first = [&](int32_t best, int32_t other) -> int64_t {
    if (offers_item(device, V4L2_CID_EXPOSURE_AUTO, found, best)) return best;
    return offers_item(device, V4L2_CID_EXPOSURE_AUTO, found, other) ? other : -1;
  };
  range.on = first(V4L2_EXPOSURE_AUTO, V4L2_EXPOSURE_APERTURE_PRIORITY);
  range.off = first(V4L2_EXPOSURE_MANUAL, V4L2_EXPOSURE_SHUTTER_PRIORITY);
  if (range.on < 0 && range.off < 0) return {};
  return range;
}

bool is_automatic_exposure(int64_t item) {
  return item == V4L2_EXPOSURE_AUTO || item == V4L2_EXPOSURE_APERTURE_PRIORITY;
}

// Nothing when the device does not have the control.
std::optional<Range> find_range(const V4l2Device& device, const Control& control) {
  v4l2_queryctrl found{};
  found.id = control.id;
  if (device.call(VIDIOC_QUERYCTRL, &found) != 0) {
    if (errno == EINVAL || errno == ENOTTY || errno == ENODATA) return {};
    refuse(device, control, errno);
  }
  if ((found.flags & V4L2_CTRL_FLAG_DISABLED) != 0) return {};
  if (found.minimum > found.maximum) {
    throw Error(MAQ_ERROR_UNSUPPORTED, device.path(), " says that its ", control.name, " goes from ", found.minimum,
                " to ", found.maximum, ", which cannot be.");
  }
  const Range range{found.minimum,
                    found.maximum,
                    std::max(1, found.step),
                    std::clamp(found.default_value, found.minimum, found.maximum),
                    (found.flags & V4L2_CTRL_FLAG_READ_ONLY) != 0,
                    1,
                    0};
  if (control.id == V4L2_CID_EXPOSURE_AUTO) return exposure_modes(device, found, range);
  return range;
}

int64_t get(const V4l2Device& device, const Control& control, const Range& range) {
  ::v4l2_control asked{control.id, 0};
  if (device.call(VIDIOC_G_CTRL, &asked) != 0) {
    if (errno == EINVAL) refuse_missing(device, control);
    refuse(device, control, errno, range.is_read_only);
  }
  return std::clamp<int64_t>(asked.value, range.min, range.max);
}

void set(const V4l2Device& device, const Control& control, const Range& range, int64_t value) {
  ::v4l2_control wanted{control.id, int32_t(value)};
  if (device.call(VIDIOC_S_CTRL, &wanted) == 0) return;
  const int error = errno;
  if (error != EINVAL && error != ERANGE) refuse(device, control, error, range.is_read_only);
  throw Error(MAQ_ERROR_INVALID_ARGUMENT, device.path(), " does not take ", double(value) * control.unit,
              control.unit_name, " as its ", control.name, " (", std::strerror(error), "); try another value.");
}

// Switches an automatic, where the device has it and it is not so already.
void switch_automatic(const V4l2Device& device, const Control& automatic, bool on) {
  const auto range = find_range(device, automatic);
  if (!range || (on ? range->on : range->off) < 0) return;
  const int64_t now = get(device, automatic, *range);
  const bool is_on = automatic.id == V4L2_CID_EXPOSURE_AUTO ? is_automatic_exposure(now) : now != range->off;
  if (is_on != on) set(device, automatic, *range, on ? range->on : range->off);
}

const Control& entry(maq_source_control which) {
  for (const Control& control : kControls) {
    if (control.which == which) return control;
  }
  throw Error(MAQ_ERROR_UNSUPPORTED, "There is no control ", int(which), " (maq_source_control).");
}

const Control& automatic_of(const Control& control) {
  for (const Control& other : kControls) {
    if (other.id == control.automatic_id) return other;
  }
  return kAutomaticGain;
}

// In the units of the API, all but the value.
maq_source_control_info info_of(const Control& control, const Range& range) {
  if (control.which == MAQ_SOURCE_CONTROL_AUTO_EXPOSURE) {
    return {0,
            range.off < 0 ? 1.0 : 0.0,
            range.on < 0 ? 0.0 : 1.0,
            1,
            is_automatic_exposure(range.default_value) ? 1.0 : 0.0,
            0};
  }
  return {0,
          double(range.min) * control.unit,
          double(range.max) * control.unit,
          double(range.step) * control.unit,
          double(range.default_value) * control.unit,
          0};
}

}  // namespace

maq_source_control_info read_v4l2_control(const V4l2Device& device, maq_source_control which) {
  const Control& control = entry(which);
  const auto range = find_range(device, control);
  if (!range) refuse_missing(device, control);
  maq_source_control_info info = info_of(control, *range);
  const int64_t value = get(device, control, *range);
  info.value =
      which == MAQ_SOURCE_CONTROL_AUTO_EXPOSURE ? double(is_automatic_exposure(value)) : double(value) * control.unit;
  return info;
}

void write_v4l2_control(const V4l2Device& device, maq_source_control which, double value) {
  const Control& control = entry(which);
  const auto range = find_range(device, control);
  if (!range) refuse_missing(device, control);
  const maq_source_control_info info = info_of(control, *range);
  if (!(value >= info.min && value <= info.max)) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The ", control.name, " of ", device.path(), " goes from ", info.min,
                " to ", info.max, control.unit_name, ", not to ", value, ".");
  }
  if (which == MAQ_SOURCE_CONTROL_AUTO_EXPOSURE) {
    const bool on = value >= 0.5;
    set(device, control, *range, on ? range->on : range->off);
    switch_automatic(device, kAutomaticGain, on);
    return;
  }
  if (control.automatic_id != 0) switch_automatic(device, automatic_of(control), false);
  const int64_t steps = std::llround((value - info.min) / info.step);
  const int64_t last_step = (range->max - range->min) / range->step;
  set(device, control, *range, range->min + std::min(steps, last_step) * range->step);
}

}  // namespace maq
