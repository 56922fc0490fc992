// A clip whose frames are shown at other times: the tables of an MP4 file (ISO/IEC 14496-12, 8.6.1) are written anew,
// and the encoded frames, some of which are reordered, stay as they are.
#pragma once

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

// Reads a file with one track, with its index before its frames and the times of frames as differences (stts, ctts).
class VariableRateClip {
 public:
  // `steps`: from each frame to the next, in units of the track, in turns.
  VariableRateClip(std::string mp4, const std::vector<uint32_t>& steps) : bytes_(std::move(mp4)) {
    const std::vector<int64_t> decoding = times_of(table("stts"));
    std::vector<int64_t> shown(decoding.size());
    const std::vector<uint32_t> offsets = expanded(table("ctts"));
    for (size_t i = 0; i < shown.size(); ++i) shown[i] = decoding[i] + offsets[i];
    std::vector<size_t> order(shown.size());
    std::iota(order.begin(), order.end(), size_t(0));
    std::sort(order.begin(), order.end(), [&](size_t a, size_t b) { return shown[a] < shown[b]; });

    times_.assign(1, 0);
    for (size_t i = 0; i + 1 < shown.size(); ++i) times_.push_back(times_.back() + steps[i % steps.size()]);
    for (size_t rank = 0; rank < order.size(); ++rank) shown[order[rank]] = times_[rank];
    // A frame is decoded when it is shown, or, where that is too late for another, all begin to be shown so much later.
    int64_t delay = 0;
    for (size_t i = 0; i < shown.size(); ++i) delay = std::max(delay, times_[i] - shown[i]);
    std::vector<uint32_t> new_steps, new_offsets;
    for (size_t i = 0; i < shown.size(); ++i) {
      new_steps.push_back(i + 1 < times_.size() ? uint32_t(times_[i + 1] - times_[i]) : steps[0]);
      new_offsets.push_back(uint32_t(shown[i] + delay - times_[i]));
    }
    const int64_t duration = times_.back() + steps[0];
    unit_s_ = 1.0 / number(box("mdhd") + 20);
    put(box("mdhd") + 24, uint32_t(duration));
    put(box("elst") + 20, uint32_t(delay));  // where the presentation begins
    put(box("elst") + 16, uint32_t(double(duration) * unit_s_ * number(box("mvhd") + 20)));
    replace("ctts", new_offsets);
    replace("stts", new_steps);
  }

  const std::string& bytes() const { return bytes_; }
  // Times of the frames in their order.
  std::vector<double> times_s() const {
    std::vector<double> seconds;
    for (const int64_t time : times_) seconds.push_back(double(time) * unit_s_);
    return seconds;
  }

 private:
  uint32_t number(size_t at) const {
    uint32_t value = 0;
    for (size_t i = 0; i < 4; ++i) value = value << 8 | uint8_t(bytes_[at + i]);
    return value;
  }
  void put(size_t at, uint32_t value) {
    for (size_t i = 0; i < 4; ++i) bytes_[at + i] = char(value >> (24 - 8 * i));
  }
  // Where the box begins: its size, then its name.
  size_t box(const char* name) const { return bytes_.find(name) - 4; }

  // Pairs of a count and a value.
  std::vector<uint32_t> table(const char* name) const {
    const size_t at = box(name);
    std::vector<uint32_t> numbers;
    for (uint32_t i = 0; i < 2 * number(at + 12); ++i) numbers.push_back(number(at + 16 + 4 * i));
    return numbers;
  }
  static std::vector<uint32_t> expanded(const std::vector<uint32_t>& pairs) {
    std::vector<uint32_t> values;
    for (size_t i = 0; i < pairs.size(); i += 2) values.insert(values.end(), pairs[i], pairs[i + 1]);
    return values;
  }
  static std::vector<int64_t> times_of(const std::vector<uint32_t>& pairs) {
    std::vector<int64_t> times;
    int64_t time = 0;
    for (const uint32_t step : expanded(pairs)) times.push_back(std::exchange(time, time + step));
    return times;
  }

  // A value for each frame in place of the table; what lies behind it moves.
  void replace(const char* name, const std::vector<uint32_t>& values) {
    const size_t at = box(name);
    const uint32_t old_bytes = number(at);
    const uint32_t more = uint32_t(16 + 8 * values.size()) - old_bytes;
    for (const char* around : {"moov", "trak", "mdia", "minf", "stbl"}) put(box(around), number(box(around)) + more);
    const size_t chunks = box("stco");
    for (uint32_t i = 0; i < number(chunks + 12); ++i) put(chunks + 16 + 4 * i, number(chunks + 16 + 4 * i) + more);
    std::string entries(8 * values.size(), '\0');
    bytes_.replace(at + 16, old_bytes - 16, entries);
    put(at, old_bytes + more);
    put(at + 12, uint32_t(values.size()));
    for (size_t i = 0; i < values.size(); ++i) {
      put(at + 16 + 8 * i, 1);
      put(at + 20 + 8 * i, values[i]);
    }
  }

  std::string bytes_;
  std::vector<int64_t> times_;
  double unit_s_ = 0;
};
