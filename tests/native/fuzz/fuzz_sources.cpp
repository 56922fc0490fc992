// URIs of sources, recordings, and the images that ffmpeg sends.
#include <fcntl.h>

#include "checked_file.h"
#include "core/files/unique_fd.h"
#include "image/clips/nut_stream.h"
#include "sources/calibration_options.h"
#include "sources/control_options.h"
#include "sources/recording/recording.h"
#include "sources/recording/recording_format.h"
#include "sources/registry.h"
#include "sources/uri.h"
#include "support/temp_folder.h"

using namespace maq;

namespace {

std::vector<fuzz::Bytes> uri_seeds() {
  std::vector<fuzz::Bytes> seeds;
  for (const char* text :
       {"stub:pattern?size=16x16&fps=10&live=1&drop=0.1", "stub:people?size=64x48&count=3&seed=7&stall=300ms@3s",
        "stub:solids?size=32x32&scene=shelf&noise=tof", "image:depth.png?depth_unit=0.001&fov=60",
        "video:clip%20a.mp4?fps=10&size=64x48", "rec:take.maqrec?from=2&to=5&speed=0.5",
        "v4l2:/dev/video0?exposure=10ms", "image:a.png?fx=380&fy=380&cx=160&cy=120",
        "stub:people?size=16x16&unplug=3s@5s"}) {
    seeds.push_back(fuzz::bytes_of(text));
  }
  return seeds;
}

std::vector<fuzz::Bytes> recording_seeds() {
  std::vector<fuzz::Bytes> seeds;
  const TempFolder folder;
  for (const int quality : {0, 80}) {
    RecordingInfo info{"stub:pattern", 30, {}};
    if (quality == 0) {
      info.intrinsics.emplace();
      info.intrinsics->width_px = info.intrinsics->height_px = 6;
      info.intrinsics->fx_px = info.intrinsics->fy_px = 5;
    }
    const std::string path = folder.file("a.maqrec");
    {
      RecordingWriter writer(path, info, quality, true);
      Frame frame;
      for (int i = 0; i < 3; ++i) {
        std::memset(frame.allocate_bgr(6, 6), 40 * i, 6 * 6 * 3);
        frame.depth_storage.assign(2 * 2 * 2, 9);
        frame.depth = packed_view(MAQ_PIXEL_DEPTH16, 2, 2, frame.depth_storage.data());
        frame.timestamp_ns = 33'000'000 * i;
        frame.sequence = uint64_t(i);
        writer.add(frame);
      }
      writer.finish();
    }
    seeds.push_back(fuzz::bytes_of(read_text(path)));
    unlink(path.c_str());
  }
  return seeds;
}

// With true checksums, as far as heads lead to them.
fuzz::Bytes repaired_recording(fuzz::Bytes bytes) {
  RecordingHead head;
  if (bytes.size() < sizeof head) return bytes;
  std::memcpy(&head, bytes.data(), sizeof head);
  size_t at = sizeof head + std::min<size_t>(head.json_bytes, bytes.size() - sizeof head);
  head.json_check = XXH3_64bits(bytes.data() + sizeof head, at - sizeof head);
  std::memcpy(bytes.data(), &head, sizeof head);
  FrameHead frame;
  while (bytes.size() - at >= sizeof frame) {
    std::memcpy(&frame, bytes.data() + at, sizeof frame);
    if (frame.magic != kFrameMagic) break;
    const uint64_t depth = uint64_t(uint16_t(frame.depth_width_px)) * uint16_t(frame.depth_height_px) * 2;
    const size_t left = bytes.size() - at - sizeof frame;
    const size_t payload = std::min<uint64_t>(std::min<uint64_t>(frame.picture_bytes, left) + depth, left);
    frame.payload_check = XXH3_64bits(bytes.data() + at + sizeof frame, payload);
    frame.head_check = uint32_t(XXH3_64bits(&frame.timestamp_ns, sizeof frame - offsetof(FrameHead, timestamp_ns)));
    std::memcpy(bytes.data() + at, &frame, sizeof frame);
    at += sizeof frame + payload;
  }
  RecordingTail tail;
  if (bytes.size() - at < sizeof tail) return bytes;
  uint8_t* const end = bytes.data() + bytes.size() - sizeof tail;
  std::memcpy(&tail, end, sizeof tail);
  if (tail.index_offset <= bytes.size() - sizeof tail) {
    const uint8_t* const index = bytes.data() + tail.index_offset;
    tail.index_check = XXH3_64bits(index, size_t(end - index));
    std::memcpy(end, &tail, sizeof tail);
  }
  return bytes;
}

}  // namespace

SEEDED_FUZZ(uri, uri_seeds) {
  fuzz::run_or_refuse(
      {MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_IMAGE_SIZE, MAQ_ERROR_UNSUPPORTED, MAQ_ERROR_NOT_FOUND}, [&] {
        const std::string text = fuzz::text_of(bytes);
        SourceUri uri = parse_source_uri(text);
        // A small one without threads is opened.
        const bool is_small = uri.width_px > 0 && uri.width_px <= 64 && uri.height_px > 0 && uri.height_px <= 64;
        if (uri.scheme == "stub" && is_small && text.find("live") == std::string::npos) {
          Frame frame;
          open_source(text)->next(0, frame);
        }
        take_depth_unit(uri);
        CalibrationOptions(uri).intrinsics(64, 48);
        take_control_options(uri);
        uri.expect_no_more_options("none");
      });
}

SEEDED_FUZZ(recording, recording_seeds) {
  const fuzz::MemoryFile file(repaired_recording(bytes));
  fuzz::run_or_refuse({MAQ_ERROR_UNREADABLE, MAQ_ERROR_UNSUPPORTED}, [&] {
    RecordingReader reader(file.path(), {});
    for (size_t i = 0; i < std::min<size_t>(reader.frame_count(), 8); ++i) {
      const auto described = reader.describe(i);
      if (described && int64_t(described->width_px) * described->height_px > 1 << 18) continue;
      fuzz::run_or_refuse({MAQ_ERROR_UNREADABLE}, [&] {
        Frame frame;
        reader.read(i, frame);
        fuzz::Bytes copy(packed_bytes(frame.image.format, frame.image.width_px, frame.image.height_px));
        copy_packed(frame.image, copy.data());
      });
    }
  });
}

FUZZ(nut) {
  const fuzz::MemoryFile file(bytes);
  const UniqueFd opened(open(file.path().c_str(), O_RDONLY | O_CLOEXEC));
  NutStream stream(opened.get());
  if (!stream.is_open() || int64_t(stream.width_px()) * stream.height_px() > 1 << 18) return;
  std::vector<uint8_t> pixels;
  int64_t time_ns = 0;
  for (int frames = 0; frames < 8 && stream.read(pixels, time_ns); ++frames) {
    fuzz::require(pixels.size() == size_t(stream.width_px()) * size_t(stream.height_px()) * 3, "the size of an image");
  }
}
