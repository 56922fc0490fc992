// Misuse: told with a status or a sentence, without harm to what the app holds.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <string>
#include <thread>

#include "support/samples/api_tiny_scene.h"

namespace {

std::string text() { return maq_last_error(nullptr); }

class ApiMisuse : public ::testing::Test {
 protected:
  maq_source* open(const char* uri) {
    maq_source* source = nullptr;
    EXPECT_EQ(maq_source_create(context_.get(), uri, nullptr, &source), MAQ_OK) << text();
    return source;
  }
  static maq_frame* acquire(maq_source* source) {
    maq_frame* frame = nullptr;
    EXPECT_EQ(maq_source_acquire_frame(source, MAQ_WAIT_FOREVER, &frame), MAQ_OK) << text();
    return frame;
  }
  // Forgets the text of before, gives back, and expects a sentence that ends so.
  template <class Handle>
  static void expect_told(void (*give_back)(Handle*), Handle* handle, const std::string& end) {
    maq_context_create(0, nullptr, nullptr);
    give_back(handle);
    EXPECT_NE(text().find(end), std::string::npos) << text();
  }
  template <class Handle>
  static void expect_told_twice(void (*give_back)(Handle*), Handle* handle, const std::string& end) {
    maq_context_create(0, nullptr, nullptr);
    const std::string before = text();
    give_back(handle);
    EXPECT_EQ(text(), before) << "the first time is right";
    expect_told(give_back, handle, end);
    expect_told(give_back, handle, end);
  }

  const maquette::Context context_;
};

TEST_F(ApiMisuse, WhatIsGivenBackTwiceIsTold) {
  maq_source* const source = open("stub:pattern?size=320x256");
  maq_frame* const frame = acquire(source);
  maq_densepose* densepose = nullptr;
  maq_densepose_config config = maquette::default_densepose_config();
  config.model.bundle_path = MAQ_TEST_DATA "/tiny_bundle";
  ASSERT_EQ(maq_densepose_create(context_.get(), &config, &densepose), MAQ_OK) << text();
  maq_densepose_result* result = nullptr;
  ASSERT_EQ(maq_densepose_run(densepose, frame, &result), MAQ_OK) << text();
  expect_told_twice(maq_densepose_result_release, result,
                    "result is a maq_densepose_result that was given back before");
  expect_told_twice(maq_densepose_destroy, densepose, "densepose is a maq_densepose that was given back before");
  EXPECT_EQ(maq_densepose_reset(densepose), MAQ_ERROR_INVALID_ARGUMENT);
  expect_told_twice(maq_frame_release, frame, "frame is a maq_frame that was given back before");
  expect_told_twice(maq_source_destroy, source, "source is a maq_source that was given back before");
  expect_told(maq_frame_release, frame, "frame is a maq_frame that was given back before");
  expect_told(maq_densepose_result_release, result, "result is a maq_densepose_result that was given back before");
  EXPECT_NE(std::string(maq_last_error(source)).find("given back"), std::string::npos);
  maq_camera_list* list = nullptr;
  ASSERT_EQ(maq_camera_list_create(context_.get(), &list), MAQ_OK);
  expect_told_twice(maq_camera_list_destroy, list, "list is a maq_camera_list that was given back before");
  maq_context* context = nullptr;
  ASSERT_EQ(maq_context_create(MAQ_HEADER_VERSION, nullptr, &context), MAQ_OK);
  expect_told_twice(maq_context_destroy, context, "context is a maq_context that was given back before");
  maq_capture* capture = nullptr;
  ASSERT_EQ(maq_capture_open(context_.get(), api_tiny_scene::kCapture.c_str(), &capture), MAQ_OK);
  expect_told_twice(maq_capture_destroy, capture, "capture is a maq_capture that was given back before");
}

TEST_F(ApiMisuse, APoolHasAFrameThatWasReleasedTwiceOnce) {
  maq_source_config config = maquette::default_source_config();
  config.frame_pool_size = 1;
  maq_source* source = nullptr;
  ASSERT_EQ(maq_source_create(context_.get(), "stub:pattern?size=16x16", &config, &source), MAQ_OK);
  for (int i = 0; i < 100; ++i) {
    maq_frame* const frame = acquire(source);
    std::thread other([&] { maq_frame_release(frame); });
    maq_frame_release(frame);
    other.join();
    maq_frame* const only = acquire(source);
    maq_frame* second = nullptr;
    ASSERT_EQ(maq_source_acquire_frame(source, 0, &second), MAQ_ERROR_POOL_EMPTY);
    maq_frame_release(only);
  }
  maq_source_destroy(source);
}

TEST_F(ApiMisuse, ASecondThreadInOneCallIsToldAndTheFirstGoesOn) {
  // The second frame comes after 100 s.
  maq_source* const source = open("stub:pattern?size=16x16&fps=0.01&live=1");
  maq_frame_release(acquire(source));
  std::atomic<bool> is_told{false};
  std::thread waiting([&] {
    maq_frame* frame = nullptr;
    maq_status status = MAQ_ERROR_INVALID_ARGUMENT;
    while (!is_told || status == MAQ_ERROR_INVALID_ARGUMENT) {
      status = maq_source_acquire_frame(source, 20000000, &frame);
    }
    EXPECT_EQ(status, MAQ_TIMEOUT);
  });
  maq_frame* frame = nullptr;
  const auto limit = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (!is_told && std::chrono::steady_clock::now() < limit) {
    is_told = maq_source_acquire_frame(source, 0, &frame) == MAQ_ERROR_INVALID_ARGUMENT;
  }
  EXPECT_TRUE(is_told);
  EXPECT_EQ(text(),
            "maq_source_acquire_frame: source is in use by another call; let that return first, or make one for "
            "each thread.");
  is_told = true;
  waiting.join();
  EXPECT_EQ(maq_source_acquire_frame(source, 0, &frame), MAQ_TIMEOUT) << "and it can be used again";
  maq_source_destroy(source);
}

TEST_F(ApiMisuse, ACallbackThatCallsItsBuilderIsTold) {
  struct Call {
    maq_scene_builder* builder = nullptr;
    int calls = 0;
  } call;
  maq_scene_build_config config = api_tiny_scene::build_config();
  config.progress_user_data = &call;
  config.progress_callback = [](void* user_data, double, const char*) -> int32_t {
    Call& from = *static_cast<Call*>(user_data);
    ++from.calls;
    maq_scene_build_stats stats{};
    stats.struct_size = sizeof stats;
    EXPECT_EQ(maq_scene_builder_get_stats(from.builder, &stats), MAQ_ERROR_INVALID_ARGUMENT);
    EXPECT_NE(text().find("builder is in use by another call"), std::string::npos) << text();
    maq_scene* scene = nullptr;
    EXPECT_EQ(maq_scene_builder_finish(from.builder, &scene), MAQ_ERROR_INVALID_ARGUMENT);
    expect_told(maq_scene_builder_destroy, from.builder, "builder is in use by another call, so it was not freed");
    return 1;
  };
  const std::vector<float> places = api_tiny_scene::capture_places();
  const maq_point_cloud cloud = api_tiny_scene::cloud_of(places);
  ASSERT_EQ(maq_scene_builder_create(context_.get(), &config, &cloud, &call.builder), MAQ_OK) << text();
  const maquette::Capture capture(context_, api_tiny_scene::kCapture);
  maq_frame* photo = nullptr;
  ASSERT_EQ(maq_capture_load_view(capture.get(), 0, &photo), MAQ_OK) << text();
  const maq_pinhole_camera camera = capture.view(0).camera;
  EXPECT_EQ(maq_scene_builder_add_view(call.builder, photo, &camera, nullptr), MAQ_OK) << text();
  EXPECT_GT(call.calls, 0);
  maq_frame_release(photo);
  expect_told_twice(maq_scene_builder_destroy, call.builder, "builder is a maq_scene_builder that was given back");
}

}  // namespace
