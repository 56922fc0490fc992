// Recordings (.maqrec): frames as a camera gave them, with their times, depth and intrinsics. docs/reference/formats.md
// has the layout. Each frame carries its own checksum and lies whole in the file once add() has returned, so that after
// a crash every frame but the one being written can be read; an index at the end, when there is one, saves looking for
// them.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/files/unique_fd.h"
#include "core/frame.h"
#include "core/log.h"
#include "image/files/jpeg.h"
#include "maquette/source.h"
#include "sources/source.h"
#include "sources/uri.h"

namespace maq {

struct RecordingInfo {
  std::string source;  // the URI of the recorded source
  double fps = 0;      // 0: not known
  std::optional<maq_intrinsics> intrinsics;
};

struct RecordingEntry {
  uint64_t offset;
  int64_t timestamp_ns;
};

class RecordingWriter {
 public:
  // Makes the file, which must not be there yet. `jpeg_quality` 0 keeps pixels as they are, 1 to 100 compresses them;
  // JPEG images of a camera are never changed. Predicted frames are kept, with a mark, where
  // `keeps_predicted` is set. Throws MAQ_ERROR_UNWRITABLE.
  RecordingWriter(std::string path, const RecordingInfo& info, int jpeg_quality, bool keeps_predicted = false);
  // Without finish() the file has no index; without finish() and a frame it is removed.
  ~RecordingWriter();

  // Throws MAQ_ERROR_INVALID_ARGUMENT unless the frame is later than the one before, MAQ_ERROR_UNSUPPORTED for a
  // predicted frame that is not kept, MAQ_ERROR_UNWRITABLE when the disk is full; the file then holds the frames
  // before.
  void add(const Frame& frame);
  // Writes the index; nothing can be added afterwards. Throws MAQ_ERROR_UNWRITABLE.
  void finish();

  uint64_t frame_count() const { return entries_.size(); }
  uint64_t size_bytes() const { return size_bytes_; }

 private:
  void append(const void* header, size_t header_bytes, const void* payload, size_t payload_bytes);

  std::string path_;
  UniqueFd file_;
  int jpeg_quality_;
  bool keeps_predicted_;
  JpegEncoder jpeg_;
  std::vector<RecordingEntry> entries_;
  std::vector<uint8_t> payload_;
  uint64_t size_bytes_ = 0;
  bool finished_ = false;
};

struct RecordedFrame {
  int width_px, height_px;
  uint64_t sequence;
};

class RecordingReader {
 public:
  // Throws the errors of open_file(), MAQ_ERROR_UNREADABLE (not a recording, or no whole frame in it), and
  // MAQ_ERROR_UNSUPPORTED (of a newer version). A recording without a valid index is searched for frames; the log says
  // so.
  RecordingReader(std::string path, const Log& log);

  const RecordingInfo& info() const { return info_; }
  size_t frame_count() const { return entries_.size(); }
  bool has_index() const { return has_index_; }
  // The camera's timestamp, which increases from frame to frame.
  int64_t timestamp_ns(size_t index) const { return entries_[index].timestamp_ns; }
  // From the frame's head alone; nothing when that was changed.
  std::optional<RecordedFrame> describe(size_t index) const;

  // Throws MAQ_ERROR_UNREADABLE for a frame that was changed; others can be read still.
  void read(size_t index, Frame& frame);

 private:
  bool read_at(uint64_t offset, void* bytes, size_t size_bytes) const;
  void read_head();
  bool read_index();
  void scan_for_frames();

  std::string path_;
  UniqueFd file_;
  uint64_t size_bytes_ = 0;
  uint64_t first_offset_ = 0;
  RecordingInfo info_;
  std::vector<RecordingEntry> entries_;
  bool has_index_ = false;
  std::vector<uint8_t> payload_;
  JpegDecoder jpeg_;
};

// For "rec:take.maqrec": the frames at their times, from `from` to `to` seconds, with seek(). next() throws
// MAQ_ERROR_UNREADABLE for a damaged frame, and goes on after it. Throws the errors of RecordingReader.
std::unique_ptr<Source> open_recording_source(SourceUri uri, const Log& log);

}  // namespace maq
