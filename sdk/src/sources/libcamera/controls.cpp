#include "sources/libcamera/controls.h"

#include <libcamera/control_ids.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace maq {
namespace {

namespace controls = libcamera::controls;

constexpr size_t kMaxWaiting = 64;

std::optional<double> number_of(const libcamera::ControlValue& value) {
  if (value.isArray()) return {};
  switch (value.type()) {
    case libcamera::ControlTypeBool: return value.get<bool>() ? 1 : 0;
    case libcamera::ControlTypeInteger32: return value.get<int32_t>();
    case libcamera::ControlTypeInteger64: return double(value.get<int64_t>());
    case libcamera::ControlTypeFloat: return value.get<float>();
    default: return {};
  }
}

// Null when the camera does not have it. A map that never got any controls cannot be asked for one.
const libcamera::ControlInfo* find(const libcamera::ControlInfoMap& offered, const libcamera::ControlId& id) {
  if (offered.empty()) return nullptr;
  const auto found = offered.find(id.id());
  return found == offered.end() ? nullptr : &found->second;
}

// Automatic focus is not a switch but one of several modes, two are used: continuous and manual.
bool is_focus_mode(const libcamera::ControlId& id) { return id.id() == controls::AfMode.id(); }

double from_libcamera(const libcamera::ControlId& id, double value) {
  if (!is_focus_mode(id)) return value;
  return value == double(controls::AfModeContinuous) ? 1 : 0;
}

libcamera::ControlValue to_libcamera(const libcamera::ControlId& id, double value) {
  if (is_focus_mode(id)) {
    return libcamera::ControlValue(int32_t(value != 0 ? controls::AfModeContinuous : controls::AfModeManual));
  }
  if (id.type() == libcamera::ControlTypeBool) return libcamera::ControlValue(value != 0);
  if (id.type() == libcamera::ControlTypeInteger32) return libcamera::ControlValue(int32_t(std::lround(value)));
  return libcamera::ControlValue(float(value));
}

}  // namespace

// The libcamera controls for a control, and the automatic mode that a manual value switches off.
struct LibcameraControls::Known {
  maq_source_control which;
  const libcamera::ControlId& id;
  const libcamera::ControlId* automatic;
};
const LibcameraControls::Known LibcameraControls::kKnown[] = {
    {MAQ_SOURCE_CONTROL_AUTO_EXPOSURE, controls::AeEnable, nullptr},
    {MAQ_SOURCE_CONTROL_EXPOSURE, controls::ExposureTime, &controls::AeEnable},
    {MAQ_SOURCE_CONTROL_GAIN, controls::AnalogueGain, &controls::AeEnable},
    {MAQ_SOURCE_CONTROL_AUTO_FOCUS, controls::AfMode, nullptr},
    {MAQ_SOURCE_CONTROL_FOCUS, controls::LensPosition, &controls::AfMode},
    {MAQ_SOURCE_CONTROL_AUTO_WHITE_BALANCE, controls::AwbEnable, nullptr},
    {MAQ_SOURCE_CONTROL_WHITE_BALANCE, controls::ColourTemperature, &controls::AwbEnable},
    {MAQ_SOURCE_CONTROL_BRIGHTNESS, controls::Brightness, nullptr},
};

LibcameraControls::LibcameraControls(const libcamera::ControlInfoMap& offered, std::string label)
    : label_(std::move(label)) {
  for (const Known& known : kKnown) {
    if (const auto found = range(offered, known)) states_.push_back({&known, *found});
  }
}

// Returns the camera's information about the control; nothing when it does not have it.
std::optional<maq_source_control_info> LibcameraControls::range(const libcamera::ControlInfoMap& offered,
                                                                const Known& known) {
  const libcamera::ControlInfo* const control = find(offered, known.id);
  if (control == nullptr) return {};
  const auto min = number_of(control->min()), max = number_of(control->max());
  if (!min || !max || !(*min <= *max)) return {};
  maq_source_control_info info{};
  info.min = *min;
  info.max = *max;
  info.step = known.id.type() == libcamera::ControlTypeFloat ? 0 : 1;
  info.default_value = from_libcamera(known.id, number_of(control->def()).value_or(*min));
  if (is_focus_mode(known.id)) {
    const auto has = [&](int32_t way) {
      return std::any_of(control->values().begin(), control->values().end(),
                         [&](const auto& value) { return number_of(value) == double(way); });
    };
    if (!has(controls::AfModeContinuous) || !has(controls::AfModeManual)) return {};
    info.min = 0;
    info.max = 1;
  }
  info.value = info.default_value;
  return info;
}

const maq_source_control_info& LibcameraControls::get(maq_source_control which) const {
  for (const State& state : states_) {
    if (state.known->which == which) return state.info;
  }
  throw Error(MAQ_ERROR_UNSUPPORTED, label_, " has no control ", int(which), " (maq_source_control).");
}

void LibcameraControls::set(maq_source_control which, double value) {
  const maq_source_control_info& info = get(which);
  if (!(value >= info.min && value <= info.max)) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "Control ", int(which), " of ", label_, " goes from ", info.min, " to ",
                info.max, ", not to ", value, ".");
  }
  State& state =
      *std::find_if(states_.begin(), states_.end(), [&](const State& other) { return other.known->which == which; });
  value = info.step > 0 ? std::round(value) : value;
  // A slider that is moved sets values faster than frames come.
  if (!settings_.empty() && settings_.back().id == state.known->id.id()) {
    settings_.pop_back();
    return push(state, value);
  }
  if (settings_.size() >= kMaxWaiting) {
    throw Error(MAQ_ERROR_BUSY, label_, " has ", settings_.size(),
                " settings waiting for its next frames; release frames, and set this one later.");
  }
  for (State& other : states_) {
    if (&other.known->id == state.known->automatic) push(other, 0);
  }
  push(state, value);
}

void LibcameraControls::push(State& state, double value) {
  settings_.push_back({state.known->id.id(), to_libcamera(state.known->id, value)});
  state.info.value = value;
}

void LibcameraControls::take_setting(libcamera::ControlList& request) {
  if (settings_.empty()) return;
  request.set(settings_.front().id, settings_.front().value);
  settings_.pop_front();
}

void LibcameraControls::note(const libcamera::ControlList& reported) {
  if (!settings_.empty()) return;
  for (State& state : states_) {
    const libcamera::ControlId& id = state.known->id;
    if (!reported.contains(id.id())) continue;
    if (const auto value = number_of(reported.get(id.id()))) state.info.value = from_libcamera(id, *value);
  }
}

double set_libcamera_rate(const libcamera::ControlInfoMap& offered, double fps, libcamera::ControlList& at_start) {
  const libcamera::ControlInfo* const limits_us = find(offered, controls::FrameDurationLimits);
  if (fps <= 0 || limits_us == nullptr) return 0;
  const double min_us = number_of(limits_us->min()).value_or(1);
  const double max_us = number_of(limits_us->max()).value_or(1e9);
  if (!(min_us >= 1) || !(min_us <= max_us)) return 0;
  const int64_t duration_us = std::llround(std::clamp(1e6 / fps, min_us, max_us));
  const int64_t limits[2] = {duration_us, duration_us};
  at_start.set(controls::FrameDurationLimits.id(), libcamera::ControlValue(libcamera::Span<const int64_t, 2>(limits)));
  return 1e6 / double(duration_us);
}

}  // namespace maq
