// The controls of a DepthAI camera: what they can be, and what they are.
#pragma once

#include "maquette/source.h"
#include "sources/depthai/depthai_session.h"

namespace maq {

class DepthAiControls {
 public:
  DepthAiControls() = default;
  DepthAiControls(const DepthAiFeatures& features, double fps);

  // While the device chooses, what it chose for the newest image is the value.
  void note(const DepthAiFrame& newest);

  // Throws MAQ_ERROR_UNSUPPORTED for what the device does not have.
  maq_source_control_info info(maq_source_control which) const;
  // Throws MAQ_ERROR_INVALID_ARGUMENT out of range, and what the session throws; then nothing has changed here.
  void set(maq_source_control which, double value, DepthAiSession& session);

 private:
  bool has_autofocus_ = false;
  double longest_exposure_us_ = 0;
  bool auto_exposure_ = true, auto_focus_ = true, auto_white_balance_ = true;
  // Until a frame reports them.
  int exposure_us_ = 10000, gain_iso_ = 400, focus_ = 128, white_balance_k_ = 5000, brightness_ = 0;
};

}  // namespace maq
