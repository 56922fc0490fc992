// The controls of a camera of libcamera. Each request takes one setting to the camera, so settings go out with the next
// requests, in order.
#pragma once

#include <libcamera/controls.h>

#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "maquette/source.h"

namespace maq {

class LibcameraControls {
 public:
  LibcameraControls() = default;
  // The controls that the camera offers. `label` begins error texts.
  LibcameraControls(const libcamera::ControlInfoMap& offered, std::string label);

  // Like the functions of maq::Camera.
  const maq_source_control_info& get(maq_source_control which) const;
  void set(maq_source_control which, double value);

  // Puts the setting that has waited longest into the request's list.
  void take_setting(libcamera::ControlList& request);
  // Notes the values that a frame was taken with, unless newer ones are still on their way.
  void note(const libcamera::ControlList& reported);

 private:
  struct Known;
  struct State {
    const Known* known;
    maq_source_control_info info;
  };
  struct Setting {
    unsigned int id;
    libcamera::ControlValue value;
  };
  static const Known kKnown[];

  static std::optional<maq_source_control_info> range(const libcamera::ControlInfoMap& offered, const Known& known);
  void push(State& state, double value);

  std::string label_;
  std::vector<State> states_;
  std::deque<Setting> settings_;
};

// As near to `fps` as the camera can: put into its start settings. Returns the rate, or 0 for a camera that keeps its
// rate to itself.
double set_libcamera_rate(const libcamera::ControlInfoMap& offered, double fps, libcamera::ControlList& at_start);

}  // namespace maq
