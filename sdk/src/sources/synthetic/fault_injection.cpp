#include "sources/synthetic/fault_injection.h"

#include <algorithm>
#include <chrono>
#include <climits>
#include <mutex>
#include <random>
#include <thread>

#include "core/clock.h"
#include "core/error.h"
#include "core/files/event_fd.h"

namespace maq {
namespace {

using Clock = MonotonicClock;
using std::chrono::nanoseconds;

constexpr int64_t kIndefinitely = INT64_MAX;

// State that outlives a camera that is lost and opened again: each event happens once, and the random numbers continue.
struct FaultTimeline {
  explicit FaultTimeline(const FaultPlan& of) : plan(of), random(of.seed) {}

  // Whether the event is due now.
  bool is_due(std::optional<FaultEvent>& event) const {
    if (!event) return false;
    return event->frame >= 0 ? frames >= event->frame : Clock::now() - begin >= nanoseconds(event->at_ns);
  }
  bool chance(double probability) {
    return probability > 0 && std::uniform_real_distribution<>(0, 1)(random) < probability;
  }

  FaultPlan plan;
  std::mt19937_64 random;
  Clock::time_point begin = Clock::now();
  int64_t frames = 0;
  std::optional<Clock::time_point> absent_until;
};

Clock::time_point after(int64_t lasts_ns) {
  return lasts_ns == kIndefinitely ? Clock::time_point::max() : Clock::now() + nanoseconds(lasts_ns);
}

class FaultyCamera : public Camera {
 public:
  FaultyCamera(std::shared_ptr<Camera> camera, std::shared_ptr<FaultTimeline> timeline)
      : camera_(std::move(camera)), timeline_(std::move(timeline)) {}

  const CameraFormat& format() const override { return camera_->format(); }
  const std::string& identity() const override { return camera_->identity(); }
  const maq_intrinsics* intrinsics() const override { return camera_->intrinsics(); }
  maq_source_control_info control(maq_source_control which) override { return camera_->control(which); }
  void set_control(maq_source_control which, double value) override { camera_->set_control(which, value); }
  void seek(int64_t time_ns) override { camera_->seek(time_ns); }
  void close() override { camera_->close(); }
  int dma_buf(int slot) override { return slot < kOwnSlots ? camera_->dma_buf(slot) : -1; }

  void give_back(int slot) override {
    if (slot < kOwnSlots) return camera_->give_back(slot);
    std::lock_guard<std::mutex> lock(mutex_);
    copies_[size_t(slot - kOwnSlots)].is_free = true;
  }

  Event wait(int wake_fd, int timeout_ms, CameraBuffer& buffer, std::string& reason) override {
    const auto deadline = Clock::now() + std::chrono::milliseconds(timeout_ms);
    FaultTimeline& timeline = *timeline_;
    for (;;) {
      if (const auto lasts_ns = due(timeline.plan.hang)) {
        std::this_thread::sleep_for(nanoseconds(*lasts_ns));
      }
      if (const auto lasts_ns = due(timeline.plan.unplug)) {
        timeline.absent_until = after(*lasts_ns);
        reason = "unplugged, as its URI asks";
        return Event::kLost;
      }
      if (const auto lasts_ns = due(timeline.plan.stall)) stalled_until_ = after(*lasts_ns);

      // Checks for due faults every few milliseconds, also when no frame comes.
      const auto now = Clock::now();
      const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - now).count();
      const Event event = camera_->wait(wake_fd, int(std::clamp<int64_t>(left, 0, kCheckEveryMs)), buffer, reason);
      if (event == Event::kTimeout && Clock::now() < deadline) continue;
      if (event != Event::kFrame) return event;
      ++timeline.frames;
      if (Clock::now() < stalled_until_ || timeline.chance(timeline.plan.drop)) {
        camera_->give_back(buffer.slot);
        buffer = {};
        continue;
      }
      if (timeline.chance(timeline.plan.corrupt)) damage(buffer);
      if (timeline.plan.jitter_ns > 0 && delay(wake_fd)) {
        give_back(buffer.slot);
        return Event::kWoken;
      }
      return Event::kFrame;
    }
  }

 private:
  static constexpr int kOwnSlots = 1 << 16;
  static constexpr int kCheckEveryMs = 5;
  struct Copy {
    std::vector<uint8_t> pixels;
    bool is_free = true;
  };

  std::optional<int64_t> due(std::optional<FaultEvent>& event) {
    if (!timeline_->is_due(event)) return {};
    const int64_t lasts_ns = event->lasts_ns;
    event.reset();
    return lasts_ns;
  }

  // Delays by a random time; true when woken before.
  bool delay(int wake_fd) {
    const int64_t late_ns = std::uniform_int_distribution<int64_t>(0, timeline_->plan.jitter_ns)(timeline_->random);
    return wait_for_event(wake_fd, late_ns);
  }

  void damage(CameraBuffer& buffer) {
    if (buffer.jpeg != nullptr) {
      buffer.jpeg_bytes /= 2;
      return;
    }
    // The camera's own memory may be read-only. Depth is dropped too: it is in the same buffer.
    std::lock_guard<std::mutex> lock(mutex_);
    const auto found = std::find_if(copies_.begin(), copies_.end(), [](const Copy& copy) { return copy.is_free; });
    Copy& copy = found == copies_.end() ? copies_.emplace_back() : *found;
    copy.is_free = false;
    const ImageView& image = buffer.image;
    copy.pixels.resize(packed_bytes(image.format, image.width_px, image.height_px));
    copy_packed(image, copy.pixels.data());
    const size_t slot = size_t(&copy - copies_.data());
    const size_t begin = std::uniform_int_distribution<size_t>(0, copy.pixels.size() / 2)(timeline_->random);
    const size_t end = begin + copy.pixels.size() / 4;
    for (size_t i = begin; i < end; ++i) copy.pixels[i] = uint8_t(timeline_->random());
    camera_->give_back(buffer.slot);
    buffer.depth.width_px = 0;
    buffer.image = packed_view(image.format, image.width_px, image.height_px, copy.pixels.data());
    buffer.slot = kOwnSlots + int(slot);
  }

  std::shared_ptr<Camera> camera_;
  std::shared_ptr<FaultTimeline> timeline_;
  Clock::time_point stalled_until_ = Clock::time_point::min();
  std::mutex mutex_;  // guards copies_
  std::vector<Copy> copies_;
};

// Parses "2s" or "20ms".
std::optional<int64_t> duration_ns(const std::string& text) {
  size_t digits = text.find_first_not_of("0123456789.");
  if (digits == 0 || digits == std::string::npos) return {};
  const std::string unit = text.substr(digits);
  const auto number = read_number(text.substr(0, digits));
  if (!number || *number > 1e6 || (unit != "s" && unit != "ms")) return {};
  return int64_t(*number * (unit == "s" ? 1e9 : 1e6));
}

std::optional<FaultEvent> take_event(SourceUri& uri, const std::string& key, bool may_be_endless) {
  if (uri.options.count(key) == 0) return {};
  const std::string text = uri.take_text(key);
  const size_t at = text.find('@');
  FaultEvent event;
  if (at != std::string::npos) {
    const std::string lasts = text.substr(0, at), when = text.substr(at + 1);
    const auto lasts_ns = lasts.empty() && may_be_endless ? kIndefinitely : duration_ns(lasts);
    const auto at_ns = duration_ns(when);
    const auto frame = read_number(when);
    if (at_ns) event.at_ns = *at_ns;
    if (frame && *frame >= 0 && *frame < 1e15) event.frame = int64_t(*frame);
    if (lasts_ns && (at_ns || event.frame >= 0)) {
      event.lasts_ns = *lasts_ns;
      return event;
    }
  }
  throw Error(MAQ_ERROR_INVALID_ARGUMENT, key, " in ", uri.text, " is not understood; write ", key,
              "=2s@10s (for 2 s after 10 s), or ", key, "=2s@100 (at frame 100)",
              may_be_endless ? concatenate(", or ", key, "@10s (indefinitely).") : ".");
}

}  // namespace

bool FaultPlan::is_empty() const { return drop == 0 && corrupt == 0 && jitter_ns == 0 && !stall && !unplug && !hang; }

FaultPlan take_faults(SourceUri& uri) {
  FaultPlan plan;
  plan.drop = uri.take_number("drop", 0, 0, 1);
  plan.corrupt = uri.take_number("corrupt", 0, 0, 1);
  plan.stall = take_event(uri, "stall", true);
  plan.unplug = take_event(uri, "unplug", true);
  plan.hang = take_event(uri, "hang", false);
  plan.seed = uint64_t(uri.take_integer("fault_seed", 1, 0, INT64_MAX));
  const std::string jitter = uri.take_text("jitter");
  if (!jitter.empty()) {
    const auto jitter_ns = duration_ns(jitter);
    if (!jitter_ns || *jitter_ns > 10000000000) {
      throw Error(MAQ_ERROR_INVALID_ARGUMENT, "jitter=", jitter, " in ", uri.text,
                  " is not understood; write jitter=20ms, at most 10s.");
    }
    plan.jitter_ns = *jitter_ns;
  }
  return plan;
}

CameraOpener with_faults(CameraOpener open, const FaultPlan& plan) {
  return
      [open = std::move(open), plan, timeline = std::shared_ptr<FaultTimeline>()]() mutable -> std::shared_ptr<Camera> {
        if (timeline == nullptr) timeline = std::make_shared<FaultTimeline>(plan);
        if (timeline->absent_until && Clock::now() < *timeline->absent_until) {
          throw Error(MAQ_ERROR_NOT_FOUND, "It is unplugged, as its URI asks.");
        }
        return std::make_shared<FaultyCamera>(open(), timeline);
      };
}

}  // namespace maq
