// The controls of a DepthAI camera: their ranges and current values.
#pragma once

#include "maquette/source.h"
#include "sources/depthai/depthai_session.h"

namespace maq {

class DepthAiControls {
 public:
  DepthAiControls() = default;
  DepthAiControls(const DepthAiFeatures& features, double fps);

  // In automatic mode, the value is the device's choice for the newest image.
  void note(const DepthAiFrame& newest);

  // Throws MAQ_ERROR_UNSUPPORTED for a control that the device does not have.
  maq_source_control_info info(maq_source_control which) const;
  // Throws MAQ_ERROR_INVALID_ARGUMENT for a value out of range, and the errors of the session; then nothing changes.
  void set(maq_source_control which, double value, DepthAiSession& session);

 private:
  bool has_autofocus_ = false;
  double longest_exposure_us_ = 0;
  bool auto_exposure_ = true, auto_focus_ = true, auto_white_balance_ = true;
  // Until a frame reports them.
  int exposure_us_ = 10000, gain_iso_ = 400, focus_ = 128, white_balance_k_ = 5000, brightness_ = 0;
};

}  // namespace maq
