#include <gtest/gtest.h>

#include <app/live_densepose.hpp>

#include "support/temp_folder.h"

namespace {

const std::string kTinyBundle = MAQ_TEST_DATA "/tiny_bundle";
const std::string kPhoto = "image:" MAQ_TEST_MEDIA "/photo.jpg";

maquette::LiveOptions as_fast_as_it_goes(uint64_t most_frames) {
  maquette::LiveOptions options;
  options.in_real_time = false;
  options.most_frames = most_frames;
  options.reconnect_ms = 300;
  return options;
}

// What came from the live thread, and how long it takes until something holds.
class Live {
 public:
  explicit Live(const maquette::LiveOptions& options = {}, const std::string& bundle = kTinyBundle)
      : live(
            context, config_of(bundle), [this](const maquette::LiveFrame& mapped) { keep(mapped); }, nullptr, options) {
  }

  static maq_densepose_config config_of(const std::string& bundle) {
    maq_densepose_config config = maquette::default_densepose_config();
    config.bundle_path = bundle.c_str();
    return config;
  }

  template <class Condition>
  bool until(Condition condition) {
    for (int i = 0; i < 3000; ++i) {
      if (condition()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return false;
  }
  bool until_ended() {
    return until([&] { return live.status().ended; });
  }
  uint64_t frames() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return numbers_.size();
  }
  std::vector<uint64_t> sequences() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return sequences_;
  }
  std::vector<int32_t> widths() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return widths_;
  }

  maquette::Context context;

 private:
  void keep(const maquette::LiveFrame& mapped) {
    std::lock_guard<std::mutex> lock(mutex_);
    numbers_.push_back(mapped.number);
    sequences_.push_back(mapped.frame.desc().sequence);
    widths_.push_back(mapped.frame.desc().width_px);
    EXPECT_EQ(mapped.number, numbers_.size());
    EXPECT_EQ(mapped.result->width_px(), mapped.frame.desc().width_px);
  }

  mutable std::mutex mutex_;
  std::vector<uint64_t> numbers_, sequences_;
  std::vector<int32_t> widths_;

 public:
  maquette::LiveDensePose live;  // last: it uses the others
};

TEST(LiveDensePose, MapsEveryFrameOfAClipWhenItNeedNotKeepTime) {
  Live people(as_fast_as_it_goes(0));
  people.live.open("stub:pattern?frames=7&size=64x48");
  ASSERT_TRUE(people.until_ended());
  EXPECT_EQ(people.sequences(), (std::vector<uint64_t>{0, 1, 2, 3, 4, 5, 6}));
  EXPECT_EQ(people.live.status().problem, "");
  EXPECT_FALSE(people.live.status().failed);
}

TEST(LiveDensePose, PlaysAClipInRealTimeAgainAndAgain) {
  Live people;
  people.live.open("stub:pattern?frames=5&fps=50&size=64x48");
  ASSERT_TRUE(people.until([&] { return people.frames() >= 12; }));
  EXPECT_NE(people.live.status().uri.find("&live=1&loop=1"), std::string::npos);
  EXPECT_FALSE(people.live.status().ended);
}

TEST(LiveDensePose, APhotoIsMappedAgainWithOtherSettings) {
  Live people;
  people.live.open(kPhoto + "?size=64x48");
  ASSERT_TRUE(people.until_ended());
  ASSERT_EQ(people.frames(), 1u);
  maq_densepose_config config = Live::config_of(kTinyBundle);
  config.detail = MAQ_DENSEPOSE_DETAIL_PART;
  people.live.set(config);
  ASSERT_TRUE(people.until([&] { return people.frames() == 2; }));
}

TEST(LiveDensePose, LargePicturesOfFilesAreMadeSmaller) {
  maquette::LiveOptions options;
  options.largest_side_px = 100;
  Live people(options);
  people.live.open(kPhoto);
  ASSERT_TRUE(people.until_ended());
  ASSERT_EQ(people.frames(), 1u);
  EXPECT_LE(people.widths()[0], 100);
  EXPECT_GT(people.widths()[0], 30);
}

TEST(LiveDensePose, TheCameraIsLostAndComesBack) {
  maquette::LiveOptions options;
  options.reconnect_ms = 10000;
  Live people(options);
  people.live.open("stub:pattern?fps=50&size=64x48&unplug=0.5s@20");
  ASSERT_TRUE(people.until([&] {
    const maquette::LiveStatus status = people.live.status();
    return !status.events.empty() && status.events.back() == "reconnecting";
  }));
  EXPECT_NE(people.live.status().problem.find("The camera is"), std::string::npos);
  const uint64_t before = people.frames();
  ASSERT_TRUE(people.until([&] { return people.frames() > before + 5; }));
  const maquette::LiveStatus status = people.live.status();
  EXPECT_EQ(status.events, (std::vector<std::string>{"started", "lost", "reconnecting", "back"}));
  EXPECT_EQ(status.problem, "");
  EXPECT_FALSE(status.ended);
}

TEST(LiveDensePose, ACameraThatStaysAwayEndsInASentence) {
  Live people(as_fast_as_it_goes(0));
  people.live.open("stub:pattern?fps=50&size=64x48&unplug@5");
  ASSERT_TRUE(people.until_ended());
  EXPECT_TRUE(people.live.status().failed);
  EXPECT_FALSE(people.live.status().problem.empty());
  // Another source goes on from there.
  people.live.open("stub:pattern?frames=2&size=32x32");
  ASSERT_TRUE(people.until([&] { return people.widths().back() == 32; }));
  EXPECT_EQ(people.live.status().problem, "");
}

TEST(LiveDensePose, WhatCannotBeOpenedIsSaidAndReplaced) {
  Live people(as_fast_as_it_goes(0));
  people.live.open("image:/none.jpg", "stub:pattern?frames=3&size=32x32");
  ASSERT_TRUE(people.until_ended());
  EXPECT_EQ(people.frames(), 3u);
  EXPECT_NE(people.live.status().problem.find("/none.jpg does not exist"), std::string::npos);
  EXPECT_FALSE(people.live.status().failed);

  people.live.open("image:/none.jpg");
  ASSERT_TRUE(people.until([&] { return people.live.status().failed; }));
  EXPECT_NE(people.live.status().problem.find("/none.jpg does not exist"), std::string::npos);
}

TEST(LiveDensePose, ABadModelIsSaidAndAGoodOneGoesOn) {
  Live people(as_fast_as_it_goes(0), "/no/bundle");
  people.live.open("stub:pattern?frames=3&size=32x32");
  ASSERT_TRUE(people.until([&] { return people.live.status().failed; }));
  EXPECT_NE(people.live.status().problem.find("/no/bundle"), std::string::npos);
  people.live.open("stub:pattern?frames=2&size=32x32");
  ASSERT_TRUE(people.until([&] { return people.live.status().uri == "stub:pattern?frames=2&size=32x32"; }));
  ASSERT_TRUE(people.until([&] { return people.live.status().failed; })) << "another source does not hide it";
  people.live.set(Live::config_of(kTinyBundle));
  people.live.open("stub:pattern?frames=3&size=32x32");
  ASSERT_TRUE(people.until([&] { return people.frames() == 3; }));
}

TEST(LiveDensePose, PausesAndGoesOn) {
  Live people;
  people.live.open("stub:pattern?fps=100&size=32x32");
  ASSERT_TRUE(people.until([&] { return people.frames() > 3; }));
  people.live.pause(true);
  uint64_t frames = 0;
  ASSERT_TRUE(people.until([&] {  // the frame in work may still come
    frames = people.frames();
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    return people.frames() == frames;
  }));
  people.live.pause(false);
  EXPECT_TRUE(people.until([&] { return people.frames() > frames + 3; }));
}

TEST(LiveDensePose, RecordsTheSource) {
  const TempFolder folder;
  Live people(as_fast_as_it_goes(0));
  people.live.record(folder.file("a.maqrec"));
  people.live.open("stub:pattern?frames=6&size=64x48");
  ASSERT_TRUE(people.until_ended());
  people.live.open("rec:" + folder.file("a.maqrec"));
  ASSERT_TRUE(people.until([&] { return people.frames() == 12; }));

  people.live.record("/no/folder/b.maqrec");
  people.live.open("stub:pattern?frames=6&size=64x48");
  ASSERT_TRUE(people.until([&] { return people.frames() == 18; })) << "frames go on without the recording";
  EXPECT_NE(people.live.status().problem.find("/no/folder"), std::string::npos);
}

TEST(LiveDensePose, ARecordingIsCompleteWhenItCloses) {
  const TempFolder folder;
  std::string warned;
  maq_context_config config = maquette::default_context_config();
  config.log_callback = [](void* text, maq_log_level, const char* line) { *static_cast<std::string*>(text) += line; };
  config.log_user_data = &warned;
  {
    Live people;
    people.live.record(folder.file("a.maqrec"));
    people.live.open("stub:pattern?fps=50&size=64x48");
    ASSERT_TRUE(people.until([&] { return people.frames() > 5; }));
  }
  const maquette::Context context(config);
  maquette::Source played(context, "rec:" + folder.file("a.maqrec"));
  EXPECT_GT(played.info().frame_count, 5);
  EXPECT_EQ(warned, "") << "it has its index";
}

TEST(LiveDensePose, ClosesSoonWhenACameraHangs) {
  const double before_s = [&] {
    Live people;
    people.live.open("stub:pattern?fps=50&size=64x48&hang=5s@10");
    EXPECT_TRUE(people.until([&] { return people.frames() >= 5; }));
    std::this_thread::sleep_for(std::chrono::milliseconds(400));
    return maquette::monotonic_s();
  }();
  EXPECT_LT(maquette::monotonic_s() - before_s, 1.5);
}

TEST(LiveDensePose, LoadsNoModelBeforeThereIsASource) {
  Live people({}, "/no/bundle");
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  EXPECT_EQ(people.live.status().problem, "");
  EXPECT_FALSE(people.live.status().failed);
}

TEST(LiveDensePose, NoCallWaitsForTheModelOrTheSource) {
  Live people;
  std::vector<double> times_s;
  for (int i = 0; i < 40; ++i) {
    const double before_s = maquette::monotonic_s();
    people.live.open("stub:people?seed=" + std::to_string(i) + "&size=64x48");
    people.live.set(Live::config_of(kTinyBundle));
    people.live.status();
    times_s.push_back(maquette::monotonic_s() - before_s);
    std::this_thread::sleep_for(std::chrono::milliseconds(7));
  }
  std::sort(times_s.begin(), times_s.end());
  EXPECT_LT(times_s[30], 0.005) << "a model takes longer to load; a few calls may be held up by the machine";
  EXPECT_TRUE(people.until([&] { return people.frames() > 0; }));
}

}  // namespace
