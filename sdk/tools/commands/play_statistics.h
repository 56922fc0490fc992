// How a source delivers: rate, dropped frames, age of its frames and processor time.
#pragma once

#include <maquette/maquette.hpp>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

int64_t monotonic_ns();

class PlayStatistics {
 public:
  // Has room for so many frames, so that counting them takes nothing from the heap.
  explicit PlayStatistics(int64_t expected_frames);

  // As the source's state_callback, with the statistics as its user_data.
  static void note_state(void* self, maq_source_state state, const char* reason);
  // A frame that was just acquired.
  void add(const maq_frame_desc& desc);

  // Counts a predicted frame, apart from captured ones.
  void add_predicted() { ++predicted_; }
  // Results of the concealer at the end: frames that came too late, and the longest wait.
  void set_concealed(uint64_t late_count, float max_wait_ms) { concealed_ = Concealed{late_count, max_wait_ms}; }

  int64_t frames() const { return int64_t(timestamps_ns_.size()); }
  // Frames a second over the last second or so.
  double rate_now() const;
  // "frame 120  4.0 s  30.0 fps  0 dropped", for a line that changes.
  std::string line(uint64_t dropped_frames) const;
  // Closes the source, and says how long that took.
  void close(maquette::Source source);
  // Everything, at the end; `info` is what the source said last.
  nlohmann::ordered_json report(const maq_source_info& info) const;
  void print(const maq_source_info& info) const;

 private:
  struct Event {
    double at_s;
    maq_source_state state;
    std::string reason;
  };
  double seconds_since_first() const;

  int64_t begin_ns_;
  double processor_s_;
  double close_ms_ = 0;
  int64_t predicted_ = 0;
  struct Concealed {
    uint64_t late_count;
    float max_wait_ms;
  };
  std::optional<Concealed> concealed_;
  std::vector<int64_t> timestamps_ns_;
  std::vector<float> ages_ms_;  // of frames with times of the monotonic clock
  std::vector<double> arrivals_s_;
  uint64_t first_sequence_ = 0, last_sequence_ = 0;
  mutable std::mutex mutex_;
  std::vector<Event> events_;
};
