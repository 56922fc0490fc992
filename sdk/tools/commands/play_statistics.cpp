#include "commands/play_statistics.h"

#include <algorithm>
#include <cinttypes>
#include <cstdio>
#include <ctime>

#include "machine.h"
#include "print.h"

namespace {

const char* name_of(maq_source_state state) {
  switch (state) {
    case MAQ_SOURCE_STARTED: return "started";
    case MAQ_SOURCE_STALLED: return "stalled";
    case MAQ_SOURCE_LOST: return "lost";
    case MAQ_SOURCE_RECONNECTING: return "reconnecting";
    case MAQ_SOURCE_RECONNECTED: return "reconnected";
  }
  return "unknown";
}

template <class T>
double quantile(std::vector<T> values, double fraction) {
  if (values.empty()) return 0;
  const auto at = values.begin() + ptrdiff_t(double(values.size() - 1) * fraction);
  std::nth_element(values.begin(), at, values.end());
  return double(*at);
}

}  // namespace

int64_t monotonic_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return int64_t(now.tv_sec) * 1000000000 + now.tv_nsec;
}

PlayStatistics::PlayStatistics(int64_t expected_frames)
    : begin_ns_(monotonic_ns()), processor_s_(own_processor_seconds()) {
  const size_t room = size_t(std::min<int64_t>(expected_frames, 1 << 20));
  timestamps_ns_.reserve(room);
  ages_ms_.reserve(room);
  arrivals_s_.reserve(room);
}

void PlayStatistics::note_state(void* self, maq_source_state state, const char* reason) {
  auto* statistics = static_cast<PlayStatistics*>(self);
  std::lock_guard<std::mutex> lock(statistics->mutex_);
  statistics->events_.push_back({double(monotonic_ns() - statistics->begin_ns_) / 1e9, state, reason});
}

void PlayStatistics::add(const maq_frame_desc& desc) {
  const int64_t now_ns = monotonic_ns();
  if (timestamps_ns_.empty()) first_sequence_ = desc.sequence;
  last_sequence_ = desc.sequence;
  timestamps_ns_.push_back(desc.timestamp_ns);
  arrivals_s_.push_back(double(now_ns - begin_ns_) / 1e9);
  if (desc.clock == MAQ_CLOCK_MONOTONIC) ages_ms_.push_back(float(now_ns - desc.timestamp_ns) / 1e6f);
}

double PlayStatistics::rate_now() const {
  if (arrivals_s_.size() < 2) return 0;
  const size_t last = arrivals_s_.size() - 1;
  size_t first = last;
  while (first > 0 && arrivals_s_[last] - arrivals_s_[first] < 1) --first;
  const double lasted_s = arrivals_s_[last] - arrivals_s_[first];
  return lasted_s > 0 ? double(last - first) / lasted_s : 0;
}

double PlayStatistics::seconds_since_first() const {
  return timestamps_ns_.size() < 2 ? 0 : double(timestamps_ns_.back() - timestamps_ns_.front()) / 1e9;
}

std::string PlayStatistics::line(uint64_t dropped_frames) const {
  char text[128];
  std::snprintf(text, sizeof text, "frame %" PRIu64 "  %.1f s  %.1f fps  %" PRIu64 " dropped", last_sequence_,
                seconds_since_first(), rate_now(), dropped_frames);
  return text;
}

void PlayStatistics::close(maquette::Source source) {
  const int64_t before_ns = monotonic_ns();
  { const maquette::Source closed = std::move(source); }
  close_ms_ = double(monotonic_ns() - before_ns) / 1e6;
}

nlohmann::ordered_json PlayStatistics::report(const maq_source_info& info) const {
  std::vector<double> intervals_ms;
  int64_t backwards = 0;
  for (size_t i = 1; i < timestamps_ns_.size(); ++i) {
    intervals_ms.push_back(double(timestamps_ns_[i] - timestamps_ns_[i - 1]) / 1e6);
    backwards += timestamps_ns_[i] <= timestamps_ns_[i - 1] ? 1 : 0;
  }
  const double wall_s = double(monotonic_ns() - begin_ns_) / 1e9;
  nlohmann::ordered_json report = {
      {"schema", "maquette-play-2"},
      {"width_px", info.width_px},
      {"height_px", info.height_px},
      {"nominal_fps", info.fps},
      {"frames", frames()},
      {"seconds", seconds_since_first()},
      {"fps", seconds_since_first() > 0 ? double(frames() - 1) / seconds_since_first() : 0.0},
      {"dropped_frames", info.dropped_frame_count},
      {"missing_sequence_numbers", frames() == 0 ? 0 : int64_t(last_sequence_ - first_sequence_) + 1 - frames()},
      {"non_increasing_timestamps", backwards},
      {"interval_ms", {{"median", quantile(intervals_ms, .5)}, {"p99", quantile(intervals_ms, .99)}}},
      {"start_monotonic_s", double(begin_ns_) / 1e9},
      {"wall_seconds", wall_s},
      {"close_ms", close_ms_},
      {"cpu_utilization", (own_processor_seconds() - processor_s_) / wall_s},
      {"events", nlohmann::ordered_json::array()},
  };
  if (!ages_ms_.empty()) {
    report["age_ms"] = {{"median", quantile(ages_ms_, .5)}, {"p99", quantile(ages_ms_, .99)}};
  }
  if (concealed_) {
    report["concealed"] = {{"predicted_frames", predicted_},
                           {"late_frames", concealed_->late_count},
                           {"max_wait_ms", concealed_->max_wait_ms}};
  }
  double last_frame_s = 0;
  std::lock_guard<std::mutex> lock(mutex_);
  for (const Event& event : events_) {
    // How long the app had no frame: from the last before the event to the first after it.
    const auto next = std::lower_bound(arrivals_s_.begin(), arrivals_s_.end(), event.at_s);
    if (next != arrivals_s_.begin()) last_frame_s = *(next - 1);
    nlohmann::ordered_json entry = {{"state", name_of(event.state)}, {"reason", event.reason}, {"at_s", event.at_s}};
    if (last_frame_s > 0) entry["after_last_frame_s"] = event.at_s - last_frame_s;
    if (next != arrivals_s_.end()) entry["before_next_frame_s"] = *next - event.at_s;
    report["events"].push_back(entry);
  }
  return report;
}

void PlayStatistics::print(const maq_source_info& info) const {
  const auto all = report(info);
  print_output("%" PRId64 " frames of %d x %d in %.1f s: %.2f fps, %" PRIu64 " dropped\n", frames(), info.width_px,
               info.height_px, all["seconds"].get<double>(), all["fps"].get<double>(), info.dropped_frame_count);
  print_output("  frame interval       %.2f ms (median), %.2f ms (p99)\n", all["interval_ms"]["median"].get<double>(),
               all["interval_ms"]["p99"].get<double>());
  if (all.contains("age_ms")) {
    print_output("  age at delivery      %.2f ms (median), %.2f ms (p99)\n", all["age_ms"]["median"].get<double>(),
                 all["age_ms"]["p99"].get<double>());
  }
  if (concealed_) {
    print_output("  predicted frames     %" PRId64 ", there %.2f ms after they were due at most; %" PRIu64
                 " frames came after them, too late\n",
                 predicted_, double(concealed_->max_wait_ms), concealed_->late_count);
  }
  print_output("  CPU                  %.1f %% of one core\n", all["cpu_utilization"].get<double>() * 100);
  for (const auto& event : all["events"]) {
    print_output("  %7.2f s  %s: %s\n", event["at_s"].get<double>(), event["state"].get<std::string>().c_str(),
                 event["reason"].get<std::string>().c_str());
  }
}
