// The queue of a DepthAI device's frames, from threads of the vendor's library to the camera.
#pragma once

#include <mutex>
#include <optional>

#include "core/files/event_fd.h"
#include "sources/depthai/depthai_pairing.h"

namespace maq {

// The vendor's queues cannot be polled together with a file, and they call back before a message is in them: so the
// messages are taken in the call, and an event, which can be polled, says that there are some.
class DepthAiInbox : public DepthAiReceiver {
 public:
  explicit DepthAiInbox(const DepthAiPlan& plan) : plan_(plan), pairing_(plan.fps, plan.with_depth) {}

  // A frame that is not as agreed, or has fewer bytes than it claims, is dropped: the gap in the numbers shows it.
  void receive_colour(DepthAiFrame frame) noexcept override;
  void receive_depth(DepthAiFrame frame) noexcept override;

  // Like the functions of DepthAiPairing.
  std::optional<DepthAiPair> next(int64_t now_ns);
  int64_t due_ns();
  // Releases waiting images and drops later ones.
  void close();

  // Readable when frames have come; also signalled by the camera, when a buffer is free again.
  EventFd& event() { return event_; }

 private:
  void add(bool is_colour, DepthAiFrame frame) noexcept;

  const DepthAiPlan plan_;
  std::mutex mutex_;
  DepthAiPairing pairing_;
  bool open_ = true;
  EventFd event_;
};

}  // namespace maq
