// Recordings: what goes in comes out, also after a crash, and nothing that was changed is believed.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <xxhash.h>

#include <cstring>

#include "sources/recording/recording.h"
#include "sources/recording/recording_format.h"
#include "sources/registry.h"
#include "support/expect_error.h"
#include "support/file_size_limit.h"
#include "support/temp_folder.h"

namespace {

using maq::NextFrame;

// A frame whose bytes tell its number.
maq::Frame frame_of(int number, maq_pixel_format format = MAQ_PIXEL_NV12, int width = 33, int height = 17) {
  maq::Frame frame;
  uint8_t* pixels = frame.allocate(format, width, height);
  for (size_t i = 0; i < frame.storage.size(); ++i) pixels[i] = uint8_t(i * 7 + size_t(number));
  frame.timestamp_ns = 5000000000 + int64_t(number) * 100000000;
  frame.clock = MAQ_CLOCK_MONOTONIC;
  frame.sequence = uint64_t(40 + number);
  return frame;
}

class Recordings : public ::testing::Test {
 protected:
  std::string path_of(const std::string& name = "take.maqrec") const { return folder_.file(name); }

  // So many frames; returns where each begins, and the end of the last.
  std::vector<uint64_t> record(int count, bool finish = true, int quality = 0) {
    std::filesystem::remove(path_of());
    maq::RecordingWriter writer(path_of(), {"stub:test", 10, {}}, quality);
    std::vector<uint64_t> ends = {writer.size_bytes()};
    for (int i = 0; i < count; ++i) {
      writer.add(frame_of(i));
      ends.push_back(writer.size_bytes());
    }
    if (finish) writer.finish();
    return ends;
  }
  std::unique_ptr<maq::Source> play(const std::string& options = "") {
    return maq::open_source("rec:" + path_of() + options);
  }
  void expect_frame(maq::Source& source, int number, int first = 0) {
    maq::Frame frame;
    ASSERT_EQ(source.next(0, frame), NextFrame::kFrame);
    EXPECT_EQ(frame.storage, frame_of(number).storage);
    EXPECT_EQ(frame.image.format, MAQ_PIXEL_NV12);
    EXPECT_EQ(frame.image.planes[1].data, frame.storage.data() + 33 * 17);
    EXPECT_EQ(frame.timestamp_ns, int64_t(number - first) * 100000000);
    EXPECT_EQ(frame.clock, MAQ_CLOCK_MEDIA);
    EXPECT_EQ(frame.sequence, uint64_t(number - first));
  }

  const TempFolder folder_;
};

TEST_F(Recordings, GiveBackEachFrameAsItWas) {
  record(5);
  const auto source = play();
  EXPECT_EQ(source->info().width_px, 33);
  EXPECT_EQ(source->info().frame_count, 5);
  EXPECT_NEAR(source->info().fps, 10, 1e-9);
  EXPECT_EQ(source->intrinsics(), nullptr);
  for (int i = 0; i < 5; ++i) expect_frame(*source, i);
  maq::Frame frame;
  EXPECT_EQ(source->next(0, frame), NextFrame::kEnd);
  source->seek(250000000);
  expect_frame(*source, 3);
  source->seek(0);
  expect_frame(*source, 0);
  source->seek(INT64_MAX);
  EXPECT_EQ(source->next(0, frame), NextFrame::kEnd);
}

TEST_F(Recordings, KeepEveryFormatDepthAndCalibration) {
  maq::RecordingInfo info{"a source\xff", 30, maq_intrinsics{}};
  info.intrinsics->width_px = 64;
  info.intrinsics->height_px = 48;
  info.intrinsics->fx_px = 50.25;
  info.intrinsics->fy_px = 51;
  info.intrinsics->cx_px = -1e-7;
  info.intrinsics->distortion[7] = 0.1;
  maq::RecordingWriter writer(path_of(), info, 0);
  for (int format = MAQ_PIXEL_RGB8; format <= MAQ_PIXEL_DEPTH32F; ++format) {
    maq::Frame frame = frame_of(format, maq_pixel_format(format), 31 + format, 5);
    if (format % 2 == 0) {
      frame.depth_storage.assign(size_t(7 * 3 * 2), uint8_t(format));
      frame.depth = maq::packed_view(MAQ_PIXEL_DEPTH16, 7, 3, frame.depth_storage.data());
    }
    writer.add(frame);
  }
  writer.finish();
  const auto source = play();
  ASSERT_NE(source->intrinsics(), nullptr);
  EXPECT_EQ(source->intrinsics()->fx_px, 50.25);
  EXPECT_EQ(source->intrinsics()->cx_px, -1e-7);
  EXPECT_EQ(source->intrinsics()->distortion[7], 0.1);
  maq::Frame frame;
  for (int format = MAQ_PIXEL_RGB8; format <= MAQ_PIXEL_DEPTH32F; ++format) {
    frame.clear();
    ASSERT_EQ(source->next(0, frame), NextFrame::kFrame);
    EXPECT_EQ(frame.image.format, format);
    EXPECT_EQ(frame.image.width_px, 31 + format);
    EXPECT_EQ(frame.storage, frame_of(format, maq_pixel_format(format), 31 + format, 5).storage);
    EXPECT_EQ(frame.depth.width_px, format % 2 == 0 ? 7 : 0);
    if (format % 2 == 0) {
      EXPECT_EQ(frame.depth.planes[0].data[41], format);
    }
  }
  EXPECT_EQ(play("?size=20x10")->intrinsics(), nullptr) << "it is of pictures of another size";
}

TEST_F(Recordings, CompressOnlyWhenAsked) {
  maq::Frame smooth;
  uint8_t* pixels = smooth.allocate_bgr(160, 120);
  for (size_t i = 0; i < smooth.storage.size(); ++i) pixels[i] = uint8_t(i / 480);
  maq::RecordingWriter writer(path_of(), {}, 90);
  writer.add(smooth);
  writer.finish();
  EXPECT_LT(writer.size_bytes(), smooth.storage.size() / 5);
  const auto source = play();
  maq::Frame frame;
  ASSERT_EQ(source->next(0, frame), NextFrame::kFrame);
  ASSERT_EQ(frame.storage.size(), smooth.storage.size());
  for (size_t i = 0; i < frame.storage.size(); ++i) EXPECT_NEAR(frame.storage[i], smooth.storage[i], 4);
}

TEST_F(Recordings, KeepTheJpegImagesOfACameraAsTheyCame) {
  maq::Frame decoded = frame_of(0, MAQ_PIXEL_BGR8, 32, 16);
  std::vector<uint8_t> jpeg;
  maq::JpegEncoder().encode(decoded.image, 80, jpeg);
  decoded.jpeg = jpeg.data();
  decoded.jpeg_bytes = jpeg.size();
  maq::RecordingWriter writer(path_of(), {}, 0);
  writer.add(decoded);
  writer.finish();
  const std::string file = read_text(path_of());
  EXPECT_NE(file.find(std::string(jpeg.begin(), jpeg.end())), std::string::npos);
}

TEST_F(Recordings, PartsAndThinnedOnesKeepTheirTimes) {
  record(20);
  const auto part = play("?from=0.5&to=0.75");
  EXPECT_EQ(part->info().frame_count, 3);
  for (const int i : {5, 6, 7}) expect_frame(*part, i, 5);
  maq::Frame frame;
  EXPECT_EQ(part->next(0, frame), NextFrame::kEnd);
  const auto thinned = play("?fps=2&size=20x10");
  for (const int64_t ms : {0, 500, 1000, 1500}) {
    ASSERT_EQ(thinned->next(0, frame), NextFrame::kFrame);
    EXPECT_EQ(frame.timestamp_ns, ms * 1000000);
    EXPECT_EQ(frame.image.width_px, 20);
  }
  EXPECT_EQ(thinned->next(0, frame), NextFrame::kEnd);
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "the recording lasts 1.9 s", [&] { play("?from=2"); });
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "is not after", [&] { play("?from=1&to=1"); });
}

TEST_F(Recordings, FramesMustGetLater) {
  maq::RecordingWriter writer(path_of(), {}, 0);
  writer.add(frame_of(3));
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "frames must get later", [&] { writer.add(frame_of(3)); });
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "frames must get later", [&] { writer.add(frame_of(2)); });
  writer.add(frame_of(4));
  writer.finish();
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "is finished", [&] { writer.add(frame_of(5)); });
  EXPECT_EQ(play()->info().frame_count, 2);
}

TEST_F(Recordings, SpanAtMost31Years) {
  constexpr int64_t kYearNs = int64_t(365) * 24 * 3600 * 1000000000;
  maq::RecordingWriter writer(path_of(), {}, 0);
  maq::Frame frame = frame_of(0);
  for (const int64_t time_ns : {INT64_MIN, INT64_MIN + 31 * kYearNs}) {
    frame.timestamp_ns = time_ns;
    writer.add(frame);
  }
  for (const int64_t time_ns : {INT64_MIN + 32 * kYearNs, int64_t(0), INT64_MAX}) {
    frame.timestamp_ns = time_ns;
    expect_error(MAQ_ERROR_INVALID_ARGUMENT, "a recording spans at most", [&] { writer.add(frame); });
  }
  writer.finish();
  const auto source = play();
  EXPECT_EQ(source->info().frame_count, 2);
  ASSERT_EQ(source->next(0, frame), NextFrame::kFrame);
  ASSERT_EQ(source->next(0, frame), NextFrame::kFrame);
  EXPECT_EQ(frame.timestamp_ns, 31 * kYearNs);
}

TEST_F(Recordings, AreNeverWrittenOver) {
  record(1);
  const std::string before = read_text(path_of());
  expect_error(MAQ_ERROR_UNWRITABLE, "never written over", [&] { maq::RecordingWriter(path_of(), {}, 0); });
  EXPECT_EQ(read_text(path_of()), before);
  expect_error(MAQ_ERROR_UNWRITABLE, "cannot be made", [&] { maq::RecordingWriter("/no/such/folder/a", {}, 0); });
}

TEST_F(Recordings, CutAnywhereKeepEveryWholeFrame) {
  const std::vector<uint64_t> ends = record(4);
  const std::string whole = read_text(path_of());
  for (uint64_t size = 0; size < whole.size(); ++size) {
    write_text(path_of(), whole.substr(0, size));
    const auto left = std::upper_bound(ends.begin(), ends.end(), size) - ends.begin() - 1;  // whole frames
    if (left <= 0) {
      expect_error(MAQ_ERROR_UNREADABLE, path_of(), [&] { play(); });
      continue;
    }
    const auto source = play();
    ASSERT_EQ(source->info().frame_count, left) << size;
    for (int i = 0; i < left; ++i) expect_frame(*source, i);
  }
}

TEST_F(Recordings, WithAnyByteChangedGiveOnlyWhatWasRecorded) {
  record(3);
  const std::string whole = read_text(path_of());
  int lost = 0;
  for (size_t at = 0; at < whole.size(); ++at) {
    std::string changed = whole;
    changed[at] = char(changed[at] ^ 0x41);
    write_text(path_of(), changed);
    try {
      const auto source = play();
      for (int i = 0; i < 10; ++i) {
        maq::Frame frame;
        try {
          if (source->next(0, frame) == NextFrame::kEnd) break;
        } catch (const maq::Error& error) {
          EXPECT_EQ(error.status(), MAQ_ERROR_UNREADABLE);
          ++lost;
          continue;
        }
        bool is_one = false;
        // Numbers and times count from the first frame that can be read, which may be the second.
        for (int64_t k = 0; k < 3; ++k) {
          const int64_t number = int64_t(frame.sequence), time_ns = frame.timestamp_ns;
          is_one = is_one || (frame.storage == frame_of(int(k)).storage && number <= k && number >= k - 2 &&
                              time_ns % 100000000 == 0 && time_ns <= k * 100000000 && time_ns >= (k - 2) * 100000000);
        }
        EXPECT_TRUE(is_one) << "byte " << at;
      }
    } catch (const maq::Error& error) {
      EXPECT_TRUE(error.status() == MAQ_ERROR_UNREADABLE || error.status() == MAQ_ERROR_UNSUPPORTED) << error.what();
    }
  }
  EXPECT_GT(lost, 500) << "changed pixels are noticed";
}

TEST_F(Recordings, AChangedFrameIsReportedOnceAndTheNextOnesFollow) {
  const std::vector<uint64_t> begins = record(3);
  std::string changed = read_text(path_of());
  changed[begins[1] + 200] ^= 1;
  write_text(path_of(), changed);
  const auto source = play();
  expect_frame(*source, 0);
  maq::Frame frame;
  expect_error(MAQ_ERROR_UNREADABLE, "Frame 1 of", [&] { source->next(0, frame); });
  expect_frame(*source, 2);
}

TEST_F(Recordings, ThatHaveLostTheirIndexAreLookedThroughAndSaySo) {
  const std::vector<uint64_t> begins = record(4, false);
  std::string text;
  const auto note = [](void* to, maq_log_level, const char* line) { *static_cast<std::string*>(to) = line; };
  maq::SourceSettings settings;
  settings.log = maq::Log(MAQ_LOG_WARNING, note, &text);
  auto source = maq::open_source("rec:" + path_of(), settings);
  EXPECT_NE(text.find("4 whole frames were found"), std::string::npos) << text;
  for (int i = 0; i < 4; ++i) expect_frame(*source, i);
  // Something strange in between, longer than the window that is looked through at a time.
  std::string changed = read_text(path_of());
  changed.insert(begins[2], std::string((1 << 20) + 12345, 'M'));
  write_text(path_of(), changed);
  source = maq::open_source("rec:" + path_of(), settings);
  for (int i = 0; i < 4; ++i) expect_frame(*source, i);
}

TEST_F(Recordings, WithAHoleTakeNeitherItsMemoryNorItsTime) {
  const std::vector<uint64_t> ends = record(3, /*finish=*/false);
  constexpr uint64_t kHole = uint64_t(1) << 40;
  std::filesystem::resize_file(path_of(), ends.back() + kHole);
  maq::RecordingTail tail{};  // of an index that is the hole
  tail.index_offset = ends.back();
  std::memcpy(tail.magic, maq::kRecordingEnd, sizeof tail.magic);
  std::ofstream(path_of(), std::ios::binary | std::ios::app).write(reinterpret_cast<const char*>(&tail), sizeof tail);
  const auto source = play();
  EXPECT_EQ(source->info().frame_count, 3);
  for (int i = 0; i < 3; ++i) expect_frame(*source, i);
}

TEST_F(Recordings, OfHostileHeadsAreRefused) {
  expect_error(MAQ_ERROR_NOT_FOUND, "does not exist", [&] { play(); });
  expect_error(MAQ_ERROR_UNREADABLE, "is not a file but a folder",
               [&] { maq::open_source("rec:" + folder_.path().string()); });
  for (const std::string& text : {std::string(), std::string(1000, '\0'), std::string("MAQREC\r\n")}) {
    write_text(path_of(), text);
    expect_error(MAQ_ERROR_UNREADABLE, "is no recording", [&] { play(); });
  }
  record(1);
  const std::string whole = read_text(path_of());
  const auto with_head = [&](auto change) {
    maq::RecordingHead head;
    std::memcpy(&head, whole.data(), sizeof head);
    change(head);
    std::string changed = whole;
    std::memcpy(changed.data(), &head, sizeof head);
    write_text(path_of(), changed);
  };
  with_head([](auto& head) { head.version = 2; });
  expect_error(MAQ_ERROR_UNSUPPORTED, "version 2", [&] { play(); });
  with_head([](auto& head) { head.json_bytes = 0xffffffff; });
  expect_error(MAQ_ERROR_UNREADABLE, "its head is not what was written", [&] { play(); });
}

TEST_F(Recordings, WithoutAFrameLeaveNoFileInTheWayOfTheNextTry) {
  for (const rlim_t most : {0, 10, 1000}) {  // no room for a head, for half of it, for a frame
    const FileSizeLimit full(most);
    expect_error(MAQ_ERROR_UNWRITABLE, "cannot be written", [&] {
      maq::RecordingWriter writer(path_of(), {"stub:test", 10, {}}, 0);
      writer.add(frame_of(0));
    });
    EXPECT_FALSE(std::filesystem::exists(path_of())) << most;
  }
  EXPECT_EQ(record(2).size(), 3u);
}

// Made to do harm: its checks are right.
TEST_F(Recordings, WithAnIndexWhoseNumbersWrapAreLookedThrough) {
  const std::vector<uint64_t> begins = record(3);
  const std::string whole = read_text(path_of());
  const auto with_last_entry = [&](uint64_t offset, int64_t timestamp_ns) {
    std::string changed = whole;
    std::vector<maq::RecordingEntry> entries(3);
    std::memcpy(entries.data(), whole.data() + begins[3], 3 * sizeof entries[0]);
    entries[2] = {offset, timestamp_ns};
    maq::RecordingTail tail;
    std::memcpy(&tail, whole.data() + whole.size() - sizeof tail, sizeof tail);
    tail.index_check = XXH3_64bits(entries.data(), 3 * sizeof entries[0]);
    std::memcpy(changed.data() + begins[3], entries.data(), 3 * sizeof entries[0]);
    std::memcpy(changed.data() + changed.size() - sizeof tail, &tail, sizeof tail);
    write_text(path_of(), changed);
    const auto source = play();
    EXPECT_EQ(source->info().frame_count, 3);
    for (int i = 0; i < 3; ++i) expect_frame(*source, i);
  };
  const int64_t right_time_ns = frame_of(2).timestamp_ns;
  with_last_entry(begins[2], right_time_ns);
  with_last_entry(UINT64_MAX - sizeof(maq::FrameHead) + 1, right_time_ns);
  with_last_entry(UINT64_MAX, right_time_ns);
  with_last_entry(begins[2], INT64_MAX);
}

TEST_F(Recordings, OnAFullDiskEndWithAWholeFrameAndCanGoOn) {
  const std::vector<uint64_t> ends = record(3);
  std::filesystem::remove(path_of());
  maq::RecordingWriter writer(path_of(), {"stub:test", 10, {}}, 0);
  writer.add(frame_of(0));
  {
    const FileSizeLimit full(ends[2] + 100);
    writer.add(frame_of(1));
    expect_error(MAQ_ERROR_UNWRITABLE, "The 2 frames before are whole", [&] { writer.add(frame_of(2)); });
  }
  EXPECT_EQ(std::filesystem::file_size(path_of()), ends[2]);
  writer.add(frame_of(3));
  writer.finish();
  EXPECT_EQ(play()->info().frame_count, 3);
}

}  // namespace
