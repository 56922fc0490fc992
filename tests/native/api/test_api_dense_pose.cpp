#include <gtest/gtest.h>
#include <sched.h>

#include <cstring>
#include <filesystem>
#include <maquette/maquette.hpp>
#include <memory>
#include <thread>
#include <vector>

#include "support/samples/bundle_copy.h"

namespace {

constexpr char kBundle[] = MAQ_TEST_DATA "/tiny_bundle";

// 320 x 256, black but for one red cell: one person (make_tiny_bundle.py).
struct RedCell {
  RedCell() : pixels(320 * 256 * 3) {
    for (int y = 100; y < 104; ++y) {
      for (int x = 80; x < 84; ++x) pixels[size_t(y * 320 + x) * 3] = 255;
    }
    maq_frame_desc_init(&desc, sizeof desc);
    desc.format = MAQ_PIXEL_RGB8;
    desc.width_px = 320;
    desc.height_px = 256;
    desc.planes[0] = pixels.data();
  }
  std::vector<uint8_t> pixels;
  maq_frame_desc desc;
};

TEST(ApiDensePose, GivesPeoplePlanesAndStats) {
  const maquette::Context context;
  maquette::DensePose densepose(context, kBundle);
  const RedCell image;
  const maquette::DensePoseResult result = densepose.run(maquette::Frame(context, image.desc));
  EXPECT_EQ(result.width_px(), 320);
  EXPECT_EQ(result.height_px(), 256);
  ASSERT_EQ(result.people().size(), 1u);
  EXPECT_NEAR(result.people()[0].box_px[0], 67.2, 1e-3);
  size_t stride = 0;
  int64_t body = 0;
  const uint8_t* person = result.plane(MAQ_DENSEPOSE_PLANE_PERSON, &stride);
  for (int y = 0; y < 256; ++y) {
    for (int x = 0; x < 320; ++x) body += person[size_t(y) * stride + size_t(x)] == 1;
  }
  const maq_densepose_stats stats = result.stats();
  EXPECT_GT(body, 500);
  EXPECT_EQ(stats.body_pixel_count, body);
  EXPECT_EQ(stats.person_count, 1);
  EXPECT_EQ(stats.network_width_px, 320);
  EXPECT_GT(stats.total_ms, 0);
  EXPECT_GE(stats.total_ms, stats.trunk_ms);
  EXPECT_EQ(stats.provider, MAQ_PROVIDER_CPU);
  const uint8_t* pixels = nullptr;
  EXPECT_EQ(maq_densepose_result_get_plane(result.get(), maq_densepose_plane(5), &pixels, &stride),
            MAQ_ERROR_INVALID_ARGUMENT);
}

maquette::DensePose with_threads(const maquette::Context& context, int threads) {
  maq_densepose_config config = maquette::default_densepose_config();
  config.model.bundle_path = kBundle;
  config.model.threads = threads;
  return maquette::DensePose(context, config);
}

TEST(ApiDensePose, KeypointsAreReadByPersonAndOnlyWhereTheyWereAskedFor) {
  const maquette::Context context;
  const RedCell image;
  maq_densepose_config config = maquette::default_densepose_config();
  config.model.bundle_path = kBundle;
  float flat[99];
  {
    maquette::DensePose densepose(context, config);
    const maquette::DensePoseResult result = densepose.run(maquette::Frame(context, image.desc));
    EXPECT_EQ(maq_densepose_result_get_keypoints(result.get(), 0, flat), MAQ_ERROR_NOT_FOUND);
    EXPECT_STREQ(maq_last_error(nullptr), "No keypoints were asked for; set has_keypoints in maq_densepose_config.");
  }
  config.has_keypoints = 1;
  maquette::DensePose densepose(context, config);
  const maquette::DensePoseResult result = densepose.run(maquette::Frame(context, image.desc));
  const auto keypoints = result.keypoints(0);
  EXPECT_GT(keypoints[MAQ_DENSEPOSE_KEYPOINT_NOSE][0], keypoints[MAQ_DENSEPOSE_KEYPOINT_LEFT_HEEL][0]);
  EXPECT_GT(keypoints[MAQ_DENSEPOSE_KEYPOINT_NOSE][2], 0.9f);
  EXPECT_LT(keypoints[MAQ_DENSEPOSE_KEYPOINT_RIGHT_FOOT_INDEX][2], 0.1f);
  EXPECT_EQ(maq_densepose_result_get_keypoints(result.get(), 1, flat), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(maq_densepose_result_get_keypoints(result.get(), 0, nullptr), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(maq_densepose_result_get_keypoints(nullptr, 0, flat), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_STREQ(maq_densepose_get_keypoint_name(MAQ_DENSEPOSE_KEYPOINT_LEFT_WRIST), "left_wrist");
  EXPECT_STREQ(maq_densepose_get_keypoint_name(MAQ_DENSEPOSE_KEYPOINT_COUNT), "unknown");
  EXPECT_STREQ(maq_densepose_get_keypoint_name(-1), "unknown");
}

TEST(ApiDensePose, MeasuredThreadsAreAFewAndGiveTheSame) {
  const maquette::Context context;
  const RedCell image;
  const maquette::Frame frame(context, image.desc);
  maquette::DensePose fixed = with_threads(context, 3), measured = with_threads(context, MAQ_THREADS_MEASURED);
  const maquette::DensePoseResult expected = fixed.run(frame), found = measured.run(frame);
  EXPECT_EQ(expected.stats().threads, 3);
  EXPECT_EQ(expected.stats().is_threads_measured, 0);
  EXPECT_GE(found.stats().threads, 1);
  EXPECT_LE(found.stats().threads, 4);
  EXPECT_EQ(found.stats().is_threads_measured, 1);
  ASSERT_EQ(found.people().size(), expected.people().size());
  EXPECT_EQ(found.people()[0].score, expected.people()[0].score);
  for (const maq_densepose_plane plane :
       {MAQ_DENSEPOSE_PLANE_PART, MAQ_DENSEPOSE_PLANE_U, MAQ_DENSEPOSE_PLANE_PERSON}) {
    size_t stride = 0;
    EXPECT_EQ(std::memcmp(found.plane(plane, &stride), expected.plane(plane, &stride), 320 * 256), 0);
  }
}

TEST(ApiDensePose, OnOneCoreOneThreadIsMeasured) {
  cpu_set_t all, one;
  ASSERT_EQ(sched_getaffinity(0, sizeof all, &all), 0);
  CPU_ZERO(&one);
  CPU_SET(sched_getcpu(), &one);
  ASSERT_EQ(sched_setaffinity(0, sizeof one, &one), 0);
  const maquette::Context context;
  maquette::DensePose densepose = with_threads(context, MAQ_THREADS_MEASURED);
  ASSERT_EQ(sched_setaffinity(0, sizeof all, &all), 0);
  const RedCell image;
  const maq_densepose_stats stats = densepose.run(maquette::Frame(context, image.desc)).stats();
  EXPECT_EQ(stats.threads, 1);
  EXPECT_EQ(stats.is_threads_measured, 1);
}

TEST(ApiDensePose, ALogCallbackThatThrowsFailsNothing) {
  maq_context_config config;
  ASSERT_EQ(maq_context_config_init(&config, sizeof config), MAQ_OK);
  config.log_level = MAQ_LOG_DEBUG;
  int lines = 0;
  config.log_user_data = &lines;
  config.log_callback = [](void* count, maq_log_level, const char*) { throw ++*static_cast<int*>(count); };
  const maquette::Context context(config);
  maquette::DensePose densepose(context, kBundle);
  const RedCell image;
  EXPECT_EQ(densepose.run(maquette::Frame(context, image.desc)).person_count(), 1u);
  EXPECT_GT(lines, 0);
}

TEST(ApiDensePose, ACancelEndsTheRunThatRunsOrElseTheNextAndNoOther) {
  const maquette::Context context;
  maquette::DensePose densepose(context, kBundle);
  const RedCell image;
  const maquette::Frame frame(context, image.desc);
  const auto run = [&] {
    maq_densepose_result* result = nullptr;
    const maq_status status = maq_densepose_run(densepose.get(), frame.get(), &result);
    EXPECT_EQ(result != nullptr, status == MAQ_OK);
    maq_densepose_result_release(result);
    return status;
  };
  for (int i = 0; i < 10; ++i) {
    densepose.cancel();
    densepose.cancel();
    EXPECT_EQ(run(), MAQ_CANCELLED);
    EXPECT_STREQ(maq_last_error(densepose.get()), "The app cancelled the run.");
    EXPECT_EQ(run(), MAQ_OK) << "no result of the pool is lost";
  }
  for (int i = 0; i < 20; ++i) {
    std::thread other([&] { densepose.cancel(); });
    int runs = 0;
    while (run() == MAQ_OK) ++runs;
    other.join();
    EXPECT_EQ(run(), MAQ_OK) << "after " << runs;
  }
}

TEST(ApiDensePose, PeopleAreReadByIndexAndHaveNoIdYet) {
  const maquette::Context context;
  maquette::DensePose densepose(context, kBundle);
  const RedCell image;
  const maquette::DensePoseResult result = densepose.run(maquette::Frame(context, image.desc));
  EXPECT_EQ(result.person_count(), 1u);
  EXPECT_EQ(result.person(0).id, 1);
  EXPECT_GT(result.person(0).score, 0);
  maq_densepose_person person{};
  person.struct_size = sizeof person;
  EXPECT_EQ(maq_densepose_result_get_person(result.get(), 1, &person), MAQ_ERROR_INVALID_ARGUMENT);
  person.struct_size = 20;
  EXPECT_EQ(maq_densepose_result_get_person(result.get(), 0, &person), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(maq_densepose_result_get_person_count(nullptr), 0u);
}

TEST(ApiDensePose, ABundleInMemoryIsCopiedAndGivesTheSame) {
  const maquette::Context context;
  const RedCell image;
  std::unique_ptr<maquette::DensePose> densepose;
  {
    std::vector<std::pair<std::string, std::string>> contents;
    for (const auto& entry : std::filesystem::directory_iterator(kBundle)) {
      contents.emplace_back(entry.path().filename().string(), read_text(entry.path().string()));
    }
    std::vector<maq_memory_file> files;
    for (const auto& [name, bytes] : contents) files.push_back({name.c_str(), bytes.data(), bytes.size()});
    maq_densepose_config config = maquette::default_densepose_config();
    config.model.bundle_files = files.data();
    config.model.bundle_file_count = uint32_t(files.size());
    densepose = std::make_unique<maquette::DensePose>(context, config);
    for (auto& [name, bytes] : contents) bytes.assign(bytes.size(), 'x');
  }
  maquette::DensePose from_folder(context, kBundle);
  const maquette::Frame frame(context, image.desc);
  const maq_densepose_person found = densepose->run(frame).person(0), expected = from_folder.run(frame).person(0);
  EXPECT_EQ(std::memcmp(&found, &expected, sizeof found), 0);
}

TEST(ApiDensePose, WithoutABundleTheInstalledOneIsUsed) {
  const maquette::Context context;
  maquette::DensePose densepose(context), named(context, MAQ_TEST_MODELS "/densepose-b-int8");
  EXPECT_EQ(densepose.surface()->nodes, named.surface()->nodes);
  maq_densepose* made = nullptr;
  ASSERT_EQ(maq_densepose_create(context.get(), nullptr, &made), MAQ_OK) << maq_last_error(nullptr);
  maq_densepose_destroy(made);
}

TEST(ApiDensePose, PartsHaveNamesAndColours) {
  EXPECT_STREQ(maq_densepose_get_part_name(0), "background");
  EXPECT_STREQ(maq_densepose_get_part_name(2), "torso, front");
  for (const int32_t part : {-1, 25}) {
    EXPECT_STREQ(maq_densepose_get_part_name(part), "unknown part");
    uint8_t rgb[3] = {1, 2, 3};
    maq_densepose_get_part_colour(part, rgb);
    EXPECT_TRUE(rgb[0] == 0 && rgb[1] == 0 && rgb[2] == 0);
  }
  uint8_t rgb[3] = {};
  maq_densepose_get_part_colour(2, rgb);
  EXPECT_TRUE(rgb[0] == 246 && rgb[1] == 198 && rgb[2] == 82);
  maq_densepose_get_part_colour(2, nullptr);
}

TEST(ApiDensePose, ResultsAreBoundedReusedAndOutliveEverything) {
  const RedCell image;
  std::vector<maquette::DensePoseResult> held;
  {
    const maquette::Context context;
    maquette::DensePose densepose(context, kBundle);
    const maquette::Frame frame(context, image.desc);
    for (int i = 0; i < 4; ++i) held.push_back(densepose.run(frame));
    maq_densepose_result* result = nullptr;
    EXPECT_EQ(maq_densepose_run(densepose.get(), frame.get(), &result), MAQ_ERROR_POOL_EMPTY);
    held.pop_back();
    held.push_back(densepose.run(frame));
  }
  EXPECT_EQ(held[3].people().size(), 1u);
}

TEST(ApiDensePose, EachThreadCanHaveItsOwnAndShareTheContext) {
  const maquette::Context context;
  const RedCell image;
  std::vector<std::thread> threads;
  for (int t = 0; t < 3; ++t) {
    threads.emplace_back([&] {
      maquette::DensePose densepose(context, kBundle);
      const maquette::Frame frame(context, image.desc);
      for (int i = 0; i < 5; ++i) EXPECT_EQ(densepose.run(frame).people().size(), 1u);
      maq_source* source = nullptr;
      EXPECT_EQ(maq_source_create(context.get(), "stub:people?", nullptr, &source), MAQ_ERROR_INVALID_ARGUMENT);
      EXPECT_NE(std::string(maq_last_error(context.get())), "");
    });
  }
  for (std::thread& thread : threads) thread.join();
}

TEST(ApiDensePose, ADamagedBundleIsAStatusOfTheContext) {
  const maquette::Context context;
  const BundleCopy bundle;
  bundle.flip_byte("trunk.onnx");
  maq_densepose_config config = maquette::default_densepose_config();
  const std::string path = bundle.path();
  config.model.bundle_path = path.c_str();
  maq_densepose* densepose = nullptr;
  EXPECT_EQ(maq_densepose_create(context.get(), &config, &densepose), MAQ_ERROR_BAD_BUNDLE);
  EXPECT_NE(std::string(maq_last_error(context.get())).find("trunk.onnx"), std::string::npos);
  config.model.bundle_path = "/no/such/bundle";
  EXPECT_EQ(maq_densepose_create(context.get(), &config, &densepose), MAQ_ERROR_NOT_FOUND);
  EXPECT_EQ(densepose, nullptr);
}

TEST(ApiDensePose, AMissingRuntimeLibraryIsAStatusAndCanBeMended) {
  maq_context_config config = maquette::default_context_config();
  config.onnxruntime_library = "/no/such/libonnxruntime.so.1";
  const maquette::Context named(config);
  const char* version = nullptr;
  EXPECT_EQ(maq_context_get_onnxruntime(named.get(), &version, nullptr), MAQ_ERROR_RUNTIME_LIBRARY);
  EXPECT_EQ(version, nullptr);

  const maquette::Context context;
  setenv("MAQ_ONNXRUNTIME_LIB", "/no/such/libonnxruntime.so.1", 1);
  EXPECT_EQ(maq_context_get_onnxruntime(context.get(), &version, nullptr), MAQ_ERROR_RUNTIME_LIBRARY);
  EXPECT_NE(std::string(maq_last_error(context.get())).find("MAQ_ONNXRUNTIME_LIB"), std::string::npos);
  unsetenv("MAQ_ONNXRUNTIME_LIB");
  EXPECT_EQ(context.onnxruntime_version().rfind("1.", 0), 0u);
}

TEST(ApiDensePose, TheLogHookHearsWhatIsLoadedAndNothingBelowItsLevel) {
  std::vector<std::string> lines;
  maq_context_config config = maquette::default_context_config();
  config.log_callback = [](void* user_data, maq_log_level, const char* text) {
    static_cast<std::vector<std::string>*>(user_data)->push_back(text);
  };
  config.log_user_data = &lines;
  {
    const maquette::Context quiet(config);
    maquette::DensePose densepose(quiet, kBundle);
  }
  EXPECT_TRUE(lines.empty()) << lines[0];
  config.log_level = MAQ_LOG_INFO;
  const maquette::Context context(config);
  maquette::DensePose densepose(context, kBundle);
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_NE(lines[1].find("Bundle tiny"), std::string::npos) << lines[1];
}

}  // namespace
