#include "sources/depthai/depthai_controls.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace maq {

DepthAiControls::DepthAiControls(const DepthAiFeatures& features, double fps)
    : has_autofocus_(features.has_autofocus), longest_exposure_us_(std::floor(1e6 / fps)) {}

void DepthAiControls::note(const DepthAiFrame& newest) {
  if (auto_exposure_ && newest.exposure_us > 0) exposure_us_ = newest.exposure_us;
  if (auto_exposure_ && newest.gain_iso > 0) gain_iso_ = newest.gain_iso;
  if (auto_focus_ && newest.focus > 0) focus_ = newest.focus;
  if (auto_white_balance_ && newest.white_balance_k > 0) white_balance_k_ = newest.white_balance_k;
}

maq_source_control_info DepthAiControls::info(maq_source_control which) const {
  // The vendor documents the ranges. The device starts in automatic modes, which have no default value.
  const auto made = [](double min, double max, double default_value, double value) {
    return maq_source_control_info{0, min, max, 1, std::clamp(default_value, min, max), std::clamp(value, min, max)};
  };
  if (!has_autofocus_ && (which == MAQ_SOURCE_CONTROL_AUTO_FOCUS || which == MAQ_SOURCE_CONTROL_FOCUS)) {
    throw Error(MAQ_ERROR_UNSUPPORTED, "The lens of this camera cannot be focused.");
  }
  switch (which) {
    case MAQ_SOURCE_CONTROL_AUTO_EXPOSURE: return made(0, 1, 1, auto_exposure_);
    case MAQ_SOURCE_CONTROL_EXPOSURE: return made(1, longest_exposure_us_, exposure_us_, exposure_us_);
    case MAQ_SOURCE_CONTROL_GAIN: return made(100, 1600, gain_iso_, gain_iso_);
    case MAQ_SOURCE_CONTROL_AUTO_FOCUS: return made(0, 1, 1, auto_focus_);
    case MAQ_SOURCE_CONTROL_FOCUS: return made(0, 255, focus_, focus_);
    case MAQ_SOURCE_CONTROL_AUTO_WHITE_BALANCE: return made(0, 1, 1, auto_white_balance_);
    case MAQ_SOURCE_CONTROL_WHITE_BALANCE: return made(1000, 12000, white_balance_k_, white_balance_k_);
    case MAQ_SOURCE_CONTROL_BRIGHTNESS: return made(-10, 10, 0, brightness_);
  }
  throw Error(MAQ_ERROR_UNSUPPORTED, "The camera has no control ", int(which), " (maq_source_control).");
}

void DepthAiControls::set(maq_source_control which, double value, DepthAiSession& session) {
  const maq_source_control_info range = info(which);
  if (!(value >= range.min && value <= range.max)) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "Control ", int(which), " (maq_source_control) goes from ", range.min,
                " to ", range.max, "; ", value, " is outside.");
  }
  const int rounded = int(std::lround(value));
  // Exposure and gain are one command: the other one stays as it is.
  const auto current = [&](maq_source_control other) { return int(info(other).value); };
  switch (which) {
    case MAQ_SOURCE_CONTROL_AUTO_EXPOSURE:
      session.set_auto_exposure(rounded == 1);
      auto_exposure_ = rounded == 1;
      break;
    case MAQ_SOURCE_CONTROL_EXPOSURE:
      session.set_exposure(rounded, current(MAQ_SOURCE_CONTROL_GAIN));
      auto_exposure_ = false;
      exposure_us_ = rounded;
      break;
    case MAQ_SOURCE_CONTROL_GAIN:
      session.set_exposure(current(MAQ_SOURCE_CONTROL_EXPOSURE), rounded);
      auto_exposure_ = false;
      gain_iso_ = rounded;
      break;
    case MAQ_SOURCE_CONTROL_AUTO_FOCUS:
      session.set_auto_focus(rounded == 1);
      auto_focus_ = rounded == 1;
      break;
    case MAQ_SOURCE_CONTROL_FOCUS:
      session.set_focus(rounded);
      auto_focus_ = false;
      focus_ = rounded;
      break;
    case MAQ_SOURCE_CONTROL_AUTO_WHITE_BALANCE:
      session.set_auto_white_balance(rounded == 1);
      auto_white_balance_ = rounded == 1;
      break;
    case MAQ_SOURCE_CONTROL_WHITE_BALANCE:
      session.set_white_balance(rounded);
      auto_white_balance_ = false;
      white_balance_k_ = rounded;
      break;
    case MAQ_SOURCE_CONTROL_BRIGHTNESS:
      session.set_brightness(rounded);
      brightness_ = rounded;
      break;
  }
}

}  // namespace maq
