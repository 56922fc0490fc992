#include <xxhash.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstring>

#include "core/build_info.h"
#include "core/error.h"
#include "core/files/file_calls.h"
#include "core/json/json_text.h"
#include "sources/recording/recording.h"
#include "sources/recording/recording_format.h"

namespace maq {
namespace {

constexpr const char* kPredictedRefused =
    "The frame was predicted: no camera took it. Leave it out, or make the recorder with "
    "keep_predicted = 1, which marks it.";

// In the order of the alphabet. A name that is not UTF-8 does not prevent a recording.
std::string head_json(const RecordingInfo& info) {
  JsonText json(1);
  json.begin_object();
  if (info.intrinsics) {
    const maq_intrinsics& from = *info.intrinsics;
    json.key("calibration").begin_object().member("cx_px", from.cx_px).member("cy_px", from.cy_px);
    json.key("distortion").begin_list();
    for (const double value : from.distortion) json.value(value);
    json.end_list().member("fx_px", from.fx_px).member("fy_px", from.fy_px);
    json.member("height_px", from.height_px).member("width_px", from.width_px).end_object();
  }
  json.member("fps", info.fps).member("made_by", std::string("maquette ") + sdk_version());
  return json.member("source", info.source).end_object().text();
}

}  // namespace

RecordingWriter::RecordingWriter(std::string path, const RecordingInfo& info, int jpeg_quality, bool keeps_predicted)
    : path_(std::move(path)),
      file_(make_new_file(path_)),
      jpeg_quality_(jpeg_quality),
      keeps_predicted_(keeps_predicted) {
  if (!file_.is_open()) {
    const char* remedy = errno == EEXIST ? " Recordings are never written over: give another name, or remove it." : "";
    throw Error(MAQ_ERROR_UNWRITABLE, path_, " cannot be made: ", std::strerror(errno), ".", remedy);
  }
  const std::string json = head_json(info);
  RecordingHead head{};
  std::memcpy(head.magic, kRecordingMagic, sizeof head.magic);
  head.version = kRecordingVersion;
  head.json_bytes = uint32_t(json.size());
  head.json_check = XXH3_64bits(json.data(), json.size());
  try {
    append(&head, sizeof head, json.data(), json.size());
  } catch (...) {
    file_.reset();
    remove_file(path_);  // the destructor does not run
    throw;
  }
}

RecordingWriter::~RecordingWriter() {
  // A file without a frame cannot be played, and its name would be taken.
  if (!file_.is_open() || !entries_.empty()) return;
  file_.reset();
  remove_file(path_);
}

void RecordingWriter::append(const void* header, size_t header_bytes, const void* payload, size_t payload_bytes) {
  if (!write_parts(file_.get(), header, header_bytes, payload, payload_bytes)) {
    const int error = errno;
    // Removes the incomplete frame, so that the file ends with a whole frame and the next try begins there.
    cut_file(file_.get(), size_bytes_);
    throw Error(MAQ_ERROR_UNWRITABLE, path_, " cannot be written: ", std::strerror(error), ". The ", entries_.size(),
                " frames before are whole.");
  }
  size_bytes_ += header_bytes + payload_bytes;
}

void RecordingWriter::add(const Frame& frame) {
  if (finished_) throw Error(MAQ_ERROR_INVALID_ARGUMENT, path_, " is finished: nothing can be added.");
  if (!entries_.empty() && frame.timestamp_ns <= entries_.back().timestamp_ns) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The frame is of ", frame.timestamp_ns, " ns, but the one before it of ",
                entries_.back().timestamp_ns, " ns: frames must get later.");
  }
  if (!entries_.empty() && uint64_t(frame.timestamp_ns) - uint64_t(entries_[0].timestamp_ns) > uint64_t(kMaxSpanNs)) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The frame is of ", frame.timestamp_ns, " ns, but the first of ", path_,
                " of ", entries_[0].timestamp_ns, " ns: a recording spans at most ", kMaxSpanNs, " ns.");
  }
  if (frame.origin.is_predicted && !keeps_predicted_) {
    throw Error(MAQ_ERROR_UNSUPPORTED, kPredictedRefused);
  }
  const ImageView& image = frame.image;
  FrameHead head{};
  head.magic = kFrameMagic;
  head.timestamp_ns = frame.timestamp_ns;
  head.sequence = frame.sequence;
  head.width_px = image.width_px;
  head.height_px = image.height_px;
  if (frame.origin.is_predicted) {
    head.predicted_us = uint32_t(1 + std::clamp<int64_t>(frame.origin.horizon_ns / 1000, 0, kMaxHorizonUs));
  }
  if (frame.jpeg != nullptr) {
    head.encoding = kJpegEncoding;
    payload_.assign(frame.jpeg, frame.jpeg + frame.jpeg_bytes);
  } else if (jpeg_quality_ > 0 && !is_depth(image.format)) {
    head.encoding = kJpegEncoding;
    jpeg_.encode(image, jpeg_quality_, payload_);
  } else {
    head.encoding = uint32_t(image.format);
    payload_.resize(packed_bytes(image.format, image.width_px, image.height_px));
    copy_packed(image, payload_.data());
  }
  head.picture_bytes = payload_.size();
  const ImageView& depth = frame.depth;
  if (depth.width_px > 0) {
    head.depth_width_px = depth.width_px;
    head.depth_height_px = depth.height_px;
    payload_.resize(payload_.size() + packed_bytes(depth.format, depth.width_px, depth.height_px));
    copy_packed(depth, payload_.data() + head.picture_bytes);
  }
  head.payload_check = XXH3_64bits(payload_.data(), payload_.size());
  constexpr size_t kChecked = offsetof(FrameHead, timestamp_ns);
  head.head_check = uint32_t(XXH3_64bits(&head.timestamp_ns, sizeof head - kChecked));
  entries_.reserve(entries_.size() + 1);  // a written frame must also be in the index
  const uint64_t offset = size_bytes_;
  append(&head, sizeof head, payload_.data(), payload_.size());
  entries_.push_back({offset, frame.timestamp_ns});
}

void RecordingWriter::finish() {
  if (finished_) return;
  const size_t index_bytes = entries_.size() * sizeof(RecordingEntry);
  RecordingTail tail{};
  tail.index_offset = size_bytes_;
  tail.index_check = XXH3_64bits(entries_.data(), index_bytes);
  std::memcpy(tail.magic, kRecordingEnd, sizeof tail.magic);
  append(entries_.data(), index_bytes, &tail, sizeof tail);
  finished_ = true;
  if (!synchronise(file_.get())) {
    throw Error(MAQ_ERROR_UNWRITABLE, path_, " did not reach the disk: ", std::strerror(errno), ".");
  }
  file_.reset();
}

}  // namespace maq
