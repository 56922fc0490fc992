#include <xxhash.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>

#include "core/checked_arithmetic.h"
#include "core/error.h"
#include "core/files/file.h"
#include "core/files/file_calls.h"
#include "core/json/json_value.h"
#include "sources/recording/recording.h"
#include "sources/recording/recording_format.h"

namespace maq {
namespace {

bool is_allowed_size(int64_t width_px, int64_t height_px) {
  return width_px >= 1 && height_px >= 1 && width_px <= MAQ_MAX_SIDE_PX && height_px <= MAQ_MAX_SIDE_PX &&
         width_px * height_px <= MAQ_MAX_PIXELS;
}

// Later than `first`, and not so much that differences of times would not fit.
bool is_within_span(int64_t time_ns, int64_t first_ns) {
  return time_ns >= first_ns && uint64_t(time_ns) - uint64_t(first_ns) <= uint64_t(kMaxSpanNs);
}

// Whether this is the head of a frame, and its values agree.
bool is_valid(const FrameHead& head) {
  constexpr size_t kChecked = offsetof(FrameHead, timestamp_ns);
  if (head.magic != kFrameMagic) return false;
  if (head.head_check != uint32_t(XXH3_64bits(&head.timestamp_ns, sizeof head - kChecked))) return false;
  if (!is_allowed_size(head.width_px, head.height_px)) return false;
  const bool has_depth = head.depth_width_px != 0 || head.depth_height_px != 0;
  if (has_depth && !is_allowed_size(head.depth_width_px, head.depth_height_px)) return false;
  if (head.encoding == kJpegEncoding) return head.picture_bytes <= size_t(MAQ_MAX_PIXELS) * 4;
  if (head.encoding < MAQ_PIXEL_RGB8 || head.encoding > MAQ_PIXEL_DEPTH32F) return false;
  return head.picture_bytes == packed_bytes(maq_pixel_format(head.encoding), head.width_px, head.height_px);
}

size_t depth_bytes(const FrameHead& head) { return size_t(head.depth_width_px) * size_t(head.depth_height_px) * 2; }

size_t whole_bytes(const FrameHead& head) { return sizeof head + head.picture_bytes + depth_bytes(head); }

// Throws JsonError for a number that is missing.
double number_in(const JsonValue& from, const char* key) {
  const JsonValue* const value = from.find(key);
  const std::optional<double> number = value == nullptr ? std::nullopt : value->number();
  if (!number) throw JsonError(key);
  return *number;
}

std::optional<maq_intrinsics> intrinsics_of(const JsonValue& from) {
  const double width_px = number_in(from, "width_px"), height_px = number_in(from, "height_px");
  maq_intrinsics intrinsics{};
  intrinsics.fx_px = number_in(from, "fx_px");
  intrinsics.fy_px = number_in(from, "fy_px");
  intrinsics.cx_px = number_in(from, "cx_px");
  intrinsics.cy_px = number_in(from, "cy_px");
  const JsonValue* const distortion = from.find("distortion");
  if (distortion == nullptr || distortion->list() == nullptr) throw JsonError("distortion");
  bool is_sane = width_px <= MAQ_MAX_SIDE_PX && height_px <= MAQ_MAX_SIDE_PX &&
                 is_allowed_size(int64_t(std::max(width_px, 0.0)), int64_t(std::max(height_px, 0.0))) &&
                 distortion->list()->size() == std::size(intrinsics.distortion) && intrinsics.fx_px > 0 &&
                 intrinsics.fy_px > 0;
  for (size_t i = 0; i < std::size(intrinsics.distortion) && is_sane; ++i) {
    const std::optional<double> value = (*distortion->list())[i].number();
    if (!value) throw JsonError("distortion");
    intrinsics.distortion[i] = *value;
  }
  if (!is_sane) return {};
  intrinsics.width_px = int32_t(width_px);
  intrinsics.height_px = int32_t(height_px);
  return intrinsics;
}

}  // namespace

RecordingReader::RecordingReader(std::string path, const Log& log) : path_(std::move(path)) {
  OpenFile file = open_file(path_);
  file_ = std::move(file.fd);
  size_bytes_ = file.size_bytes;
  read_head();
  has_index_ = read_index();
  if (!has_index_) {
    scan_for_frames();
    log.write(MAQ_LOG_WARNING, path_, " has no valid index, as after a crash or a change: ", entries_.size(),
              " whole frames were found in it.");
  }
  if (entries_.empty()) throw Error(MAQ_ERROR_UNREADABLE, path_, " holds no whole frame.");
}

bool RecordingReader::read_at(uint64_t offset, void* bytes, size_t size_bytes) const {
  if (offset > size_bytes_ || size_bytes > size_bytes_ - offset) return false;
  auto* to = static_cast<uint8_t*>(bytes);
  while (size_bytes > 0) {
    const ptrdiff_t got = maq::read_at(file_.get(), offset, to, size_bytes);
    if (got <= 0) return false;  // also when the file became shorter meanwhile
    to += got;
    offset += uint64_t(got);
    size_bytes -= size_t(got);
  }
  return true;
}

void RecordingReader::read_head() {
  RecordingHead head{};
  if (!read_at(0, &head, sizeof head) || std::memcmp(head.magic, kRecordingMagic, sizeof head.magic) != 0) {
    throw Error(MAQ_ERROR_UNREADABLE, path_, " is no recording of Maquette.");
  }
  if (head.version != kRecordingVersion) {
    throw Error(MAQ_ERROR_UNSUPPORTED, path_, " is a recording of version ", head.version, ", but this SDK reads ",
                kRecordingVersion, "; use a newer one.");
  }
  std::string json(std::min(head.json_bytes, kMaxHeadBytes), '\0');
  if (head.json_bytes > kMaxHeadBytes || !read_at(sizeof head, json.data(), json.size()) ||
      head.json_check != XXH3_64bits(json.data(), json.size())) {
    throw Error(MAQ_ERROR_UNREADABLE, path_, " is damaged: its head is not what was written; copy it again.");
  }
  try {
    const JsonValue parsed = JsonValue::parse(json);
    const JsonValue* const source = parsed.find("source");
    if (source == nullptr || source->text() == nullptr) throw JsonError("source");
    info_.source = *source->text();
    info_.fps = number_in(parsed, "fps");
    if (!(info_.fps >= 0 && info_.fps <= 1000)) info_.fps = 0;
    if (const JsonValue* calibration = parsed.find("calibration")) info_.intrinsics = intrinsics_of(*calibration);
  } catch (const JsonError&) {
    throw Error(MAQ_ERROR_UNREADABLE, path_, " is damaged: its head says nothing of its frames.");
  }
  first_offset_ = sizeof head + json.size();
}

bool RecordingReader::read_index() {
  RecordingTail tail{};
  if (size_bytes_ < first_offset_ + sizeof tail || !read_at(size_bytes_ - sizeof tail, &tail, sizeof tail))
    return false;
  const uint64_t end = size_bytes_ - sizeof tail;
  if (std::memcmp(tail.magic, kRecordingEnd, sizeof tail.magic) != 0) return false;
  if (tail.index_offset < first_offset_ || tail.index_offset > end) return false;
  const uint64_t index_bytes = end - tail.index_offset;
  // A file with a hole has any length. A file over the limit is searched for frames, like one without an index.
  if (index_bytes % sizeof(RecordingEntry) != 0 || index_bytes > kMaxIndexBytes) return false;
  std::vector<RecordingEntry> entries(index_bytes / sizeof(RecordingEntry));
  if (!read_at(tail.index_offset, entries.data(), index_bytes)) return false;
  if (tail.index_check != XXH3_64bits(entries.data(), index_bytes)) return false;
  for (size_t i = 0; i < entries.size(); ++i) {
    const auto end_of_head = checked_sum<uint64_t>(entries[i].offset, sizeof(FrameHead));
    if (entries[i].offset < first_offset_ || !end_of_head || *end_of_head > tail.index_offset) return false;
    if (i > 0 && entries[i].offset <= entries[i - 1].offset) return false;
    if (i > 0 && entries[i].timestamp_ns <= entries[i - 1].timestamp_ns) return false;
    if (!is_within_span(entries[i].timestamp_ns, entries[0].timestamp_ns)) return false;
  }
  entries_ = std::move(entries);
  return true;
}

// Goes from head to head; where there is none, searches for the next.
void RecordingReader::scan_for_frames() {
  std::vector<uint8_t> window(1 << 20);
  uint64_t offset = first_offset_;
  while (offset + sizeof(FrameHead) <= size_bytes_) {
    FrameHead head{};
    if (!read_at(offset, &head, sizeof head)) return;
    if (is_valid(head) && whole_bytes(head) <= size_bytes_ - offset) {
      if (entries_.empty() || (head.timestamp_ns > entries_.back().timestamp_ns &&
                               is_within_span(head.timestamp_ns, entries_[0].timestamp_ns))) {
        entries_.push_back({offset, head.timestamp_ns});
      }
      offset += whole_bytes(head);
      continue;
    }
    // Nothing is in a hole of the file, which may be of any length.
    const uint64_t data = next_data(file_.get(), offset + 1);
    if (data == UINT64_MAX) return;
    if (data > offset + 1) {
      offset = data;
      continue;
    }
    const size_t size = size_t(std::min<uint64_t>(window.size(), size_bytes_ - offset - 1));
    if (!read_at(offset + 1, window.data(), size)) return;
    const auto* magic = reinterpret_cast<const uint8_t*>(&kFrameMagic);
    const auto found = std::search(window.begin(), window.begin() + ptrdiff_t(size), magic, magic + sizeof kFrameMagic);
    const size_t skipped = size_t(found - window.begin());
    // A magic that lies across the window's end is found from its last bytes on.
    offset += skipped < size ? 1 + skipped : 1 + size - std::min(size, sizeof kFrameMagic - 1);
    if (size < sizeof kFrameMagic) return;
  }
}

std::optional<RecordedFrame> RecordingReader::describe(size_t index) const {
  FrameHead head{};
  if (!read_at(entries_[index].offset, &head, sizeof head) || !is_valid(head)) return {};
  return RecordedFrame{head.width_px, head.height_px, head.sequence};
}

void RecordingReader::read(size_t index, Frame& frame) {
  const uint64_t offset = entries_[index].offset;
  FrameHead head{};
  bool is_whole = read_at(offset, &head, sizeof head) && is_valid(head) && whole_bytes(head) <= size_bytes_ - offset;
  if (is_whole) {
    payload_.resize(head.picture_bytes + depth_bytes(head));
    is_whole = read_at(offset + sizeof head, payload_.data(), payload_.size()) &&
               head.payload_check == XXH3_64bits(payload_.data(), payload_.size());
  }
  if (is_whole && head.encoding == kJpegEncoding) {
    is_whole = jpeg_.decode(payload_.data(), head.picture_bytes, MAQ_MAX_PIXELS, frame);
  } else if (is_whole) {
    uint8_t* pixels = frame.allocate(maq_pixel_format(head.encoding), head.width_px, head.height_px);
    std::memcpy(pixels, payload_.data(), head.picture_bytes);
  }
  if (!is_whole) {
    throw Error(MAQ_ERROR_UNREADABLE, "Frame ", index, " of ", path_, " is damaged; copy the recording again.");
  }
  if (depth_bytes(head) > 0) {
    frame.depth_storage.assign(payload_.begin() + ptrdiff_t(head.picture_bytes), payload_.end());
    frame.depth = packed_view(MAQ_PIXEL_DEPTH16, head.depth_width_px, head.depth_height_px, frame.depth_storage.data());
  }
  frame.timestamp_ns = head.timestamp_ns;
  frame.sequence = head.sequence;
  frame.origin = {};
  if (head.predicted_us > 0) {
    const int64_t horizon_ns = (int64_t(head.predicted_us) - 1) * 1000;
    int64_t captured_ns = 0;
    if (__builtin_sub_overflow(head.timestamp_ns, horizon_ns, &captured_ns)) captured_ns = INT64_MIN;
    frame.origin = {true, captured_ns, head.sequence, horizon_ns};
  }
}

}  // namespace maq
