// Where the frames of a DepthAI device arrive, from threads of the vendor's library, and wait for the camera.
#pragma once

#include <mutex>
#include <optional>

#include "sources/depthai/depthai_pairing.h"

namespace maq {

int64_t monotonic_now_ns();

// The vendor's queues cannot be polled together with a file, and they call back before a message is in them: so the
// messages are taken in the call, and an event, which can be polled, says that there are some.
class DepthAiInbox : public DepthAiReceiver {
 public:
  // Throws MAQ_ERROR_INTERNAL when the system gives no event.
  explicit DepthAiInbox(const DepthAiPlan& plan);
  ~DepthAiInbox() override;

  // A frame that is not as agreed, or has fewer bytes than it claims, is dropped: the gap in the numbers tells.
  void receive_colour(DepthAiFrame frame) noexcept override;
  void receive_depth(DepthAiFrame frame) noexcept override;

  // As those of DepthAiPairing.
  std::optional<DepthAiPair> next(int64_t now_ns);
  int64_t due_ns();
  // What waits is given up, what comes later is dropped.
  void close();

  int event_fd() const { return event_fd_; }
  void signal() noexcept;
  void drain() noexcept;

 private:
  void add(bool is_colour, DepthAiFrame frame) noexcept;

  const DepthAiPlan plan_;
  std::mutex mutex_;
  DepthAiPairing pairing_;
  bool open_ = true;
  int event_fd_;
};

}  // namespace maq
