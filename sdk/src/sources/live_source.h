// A camera as a source: a thread takes its frames, keeps the newest, and opens the camera again when it was lost.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sources/calibration_options.h"
#include "sources/camera_backend.h"
#include "sources/source.h"

namespace maq {

class LiveSource : public Source {
 public:
  // Opens the camera at once and sets `controls`, and throws their errors. `name` begins error texts. A calibration
  // that is given goes before the camera's own.
  LiveSource(CameraOpener open, std::string name, const SourceSettings& settings,
             const std::vector<ControlSetting>& controls = {}, const CalibrationOptions& calibration = {});
  // Blocks at most 50 ms, also when the device hangs in a system call: the thread then ends by itself later.
  ~LiveSource() override;

  const SourceInfo& info() const override { return info_; }
  uint64_t drops() const override;
  const maq_intrinsics* intrinsics() const override { return intrinsics_ ? &*intrinsics_ : nullptr; }
  // Controls of the camera, from any thread. Throw MAQ_ERROR_DEVICE_LOST while it is lost. Controls that were set are
  // restored when it is back.
  maq_source_control_info control(maq_source_control which) override;
  void set_control(maq_source_control which, double value) override;
  // Moves a replayed source. Waiting frames are dropped.
  void seek(int64_t time_ns) override;
  // The thread closes the camera as soon as that answers.
  void stop() override;
  void wait_for_report() override;
  int event_fd() override;

 private:
  struct State;

  // Throws MAQ_ERROR_DEVICE_LOST when the camera was lost and did not come back in time.
  NextFrame read(int64_t timeout_ns, Frame& frame) override;

  std::shared_ptr<State> state_;
  SourceInfo info_;
  std::optional<maq_intrinsics> intrinsics_;
};

}  // namespace maq
