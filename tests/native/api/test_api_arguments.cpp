// The C API returns a status and a sentence for wrong arguments. It never crashes.
#include <gtest/gtest.h>
#include <maquette/maquette.h>

#include <string>
#include <thread>

namespace {

class ApiArguments : public ::testing::Test {
 protected:
  ApiArguments() { EXPECT_EQ(maq_context_create(MAQ_HEADER_VERSION, nullptr, &context_), MAQ_OK); }
  ~ApiArguments() override { maq_context_destroy(context_); }

  static void expect_error(maq_status actual, maq_status expected, const void* handle, const std::string& text) {
    EXPECT_EQ(actual, expected) << maq_last_error(handle);
    EXPECT_NE(std::string(maq_last_error(handle)).find(text), std::string::npos) << maq_last_error(handle);
  }

  maq_context* context_ = nullptr;
};

TEST_F(ApiArguments, HeadersOfAnotherVersionAreRefused) {
  maq_context* context = nullptr;
  for (const uint32_t version : {0u, MAQ_HEADER_VERSION + 100u, MAQ_HEADER_VERSION + 10000u, 0xFFFFFFFFu}) {
    expect_error(maq_context_create(version, nullptr, &context), MAQ_ERROR_VERSION_MISMATCH, nullptr,
                 "build the app again");
    EXPECT_EQ(context, nullptr);
  }
  EXPECT_EQ(maq_context_create(MAQ_HEADER_VERSION + 1, nullptr, &context), MAQ_OK) << "a patch release fits";
  maq_context_destroy(context);
}

TEST_F(ApiArguments, WhatOnlyCamerasOrRecordingsHaveIsRefusedOfOthers) {
  maq_source* source = nullptr;
  maq_frame* frame = nullptr;
  ASSERT_EQ(maq_source_create(context_, "stub:pattern?size=16x16", nullptr, &source), MAQ_OK);
  ASSERT_EQ(maq_source_acquire_frame(source, 0, &frame), MAQ_OK);
  maq_source_control_info control{};
  control.struct_size = sizeof control;
  maq_intrinsics intrinsics{};
  maq_frame_desc desc{};
  desc.struct_size = sizeof desc;
  int32_t fd = -5;
  expect_error(maq_source_get_control(source, MAQ_SOURCE_CONTROL_GAIN, &control), MAQ_ERROR_UNSUPPORTED, source,
               "no control");
  expect_error(maq_source_set_control(source, MAQ_SOURCE_CONTROL_GAIN, 1), MAQ_ERROR_UNSUPPORTED, source, "no control");
  expect_error(maq_source_set_control(source, MAQ_SOURCE_CONTROL_GAIN, 0.0 / 0.0), MAQ_ERROR_INVALID_ARGUMENT, source,
               "value");
  expect_error(maq_source_set_control(source, maq_source_control(0), 1), MAQ_ERROR_INVALID_ARGUMENT, source,
               "control is 0");
  expect_error(maq_source_get_control(source, MAQ_SOURCE_CONTROL_GAIN, nullptr), MAQ_ERROR_INVALID_ARGUMENT, source,
               "info");
  expect_error(maq_source_get_intrinsics(source, &intrinsics), MAQ_ERROR_UNSUPPORTED, source, "intrinsics");
  expect_error(maq_source_seek(source, -1), MAQ_ERROR_INVALID_ARGUMENT, source, "negative");
  expect_error(maq_frame_get_depth(frame, &desc), MAQ_ERROR_UNSUPPORTED, frame, "has no depth");
  expect_error(maq_frame_get_dma_buf(frame, &fd), MAQ_ERROR_UNSUPPORTED, frame, "dma-buf");
  expect_error(maq_frame_get_dma_buf(frame, nullptr), MAQ_ERROR_INVALID_ARGUMENT, frame, "fd is NULL");
  EXPECT_EQ(fd, -5);
  EXPECT_EQ(maq_source_seek(source, 1000000000), MAQ_OK);
  maq_frame_release(frame);
  ASSERT_EQ(maq_source_acquire_frame(source, 0, &frame), MAQ_OK);
  ASSERT_EQ(maq_frame_get_desc(frame, &desc), MAQ_OK);
  EXPECT_EQ(desc.sequence, 30u);
  maq_frame_release(frame);
  maq_source_destroy(source);
}

TEST_F(ApiArguments, ARecorderSaysWhatIsWrong) {
  maq_recorder* recorder = nullptr;
  expect_error(maq_recorder_create(context_, "/tmp", nullptr, nullptr, &recorder), MAQ_ERROR_UNWRITABLE, context_,
               "/tmp cannot be made");
  EXPECT_EQ(recorder, nullptr);
  maq_source* source = nullptr;
  ASSERT_EQ(maq_source_create(context_, "stub:pattern", nullptr, &source), MAQ_OK);
  maq_source_destroy(source);
  for (const void* wrong : {static_cast<const void*>(source), static_cast<const void*>(context_)}) {
    expect_error(
        maq_recorder_create(context_, "/tmp/no.maqrec", static_cast<const maq_source*>(wrong), nullptr, &recorder),
        MAQ_ERROR_INVALID_ARGUMENT, context_, "source ");
  }
}

TEST_F(ApiArguments, OnlyTheSizeOfTheStructIsAccepted) {
  maq_pipeline_config config;
  ASSERT_EQ(maq_pipeline_config_init(&config, sizeof config), MAQ_OK);
  maq_pipeline* pipeline = nullptr;
  for (uint32_t size = 0; size < 2 * sizeof config; ++size) {  // among them sizes that end amid a pointer
    if (size == sizeof config) continue;
    config.struct_size = size;
    EXPECT_EQ(maq_pipeline_create(context_, &config, &pipeline), MAQ_ERROR_INVALID_ARGUMENT) << size;
  }
}

TEST_F(ApiArguments, FilesOfABundleThatAreNoneAreRefused) {
  const auto expect_refused = [&](const char* name, auto change) {
    maq_densepose_config config;
    maq_densepose_config_init(&config, sizeof config);
    config.model.bundle_path = MAQ_TEST_DATA "/tiny_bundle";
    change(config);
    maq_densepose* densepose = nullptr;
    expect_error(maq_densepose_create(context_, &config, &densepose), MAQ_ERROR_INVALID_ARGUMENT, context_, name);
  };
  const maq_memory_file file{"manifest.json", nullptr, 1};
  expect_refused("both bundle_path and bundle_files", [&](auto& config) {
    config.model.bundle_files = &file;
    config.model.bundle_file_count = 1;
  });
  expect_refused("bundle_files[0] has no data", [&](auto& config) {
    config.model.bundle_path = nullptr;
    config.model.bundle_files = &file;
    config.model.bundle_file_count = 1;
  });
  expect_refused("bundle_files is NULL", [](auto& config) {
    config.model.bundle_path = nullptr;
    config.model.bundle_file_count = 1;
  });
}

TEST_F(ApiArguments, FieldsOfAConfigInAConfigAreNamedWithBoth) {
  const auto expect_refused = [&](const char* text, auto change) {
    maq_source_config source;
    maq_pipeline_config config;
    ASSERT_EQ(maq_source_config_init(&source, sizeof source), MAQ_OK);
    ASSERT_EQ(maq_pipeline_config_init(&config, sizeof config), MAQ_OK);
    config.source = &source;
    change(source);
    maq_pipeline* pipeline = nullptr;
    expect_error(maq_pipeline_create(context_, &config, &pipeline), MAQ_ERROR_INVALID_ARGUMENT, nullptr, text);
  };
  expect_refused("config.source.queue_length is 65", [](auto& source) { source.queue_length = 65; });
  expect_refused("config.source.struct_size is 1", [](auto& source) { source.struct_size = 1; });
}

TEST_F(ApiArguments, WhyNothingWasMadeIsFoundWithAndWithoutTheContext) {
  const auto expect_text = [&](maq_status status, const std::string& text) {
    EXPECT_NE(status, MAQ_OK);
    EXPECT_EQ(std::string(maq_last_error(nullptr)), std::string(maq_last_error(context_)));
    EXPECT_NE(std::string(maq_last_error(nullptr)).find(text), std::string::npos) << maq_last_error(nullptr);
  };
  maq_source* source = nullptr;
  expect_text(maq_source_create(context_, "image:/no/such/1.jpg", nullptr, &source), "/no/such/1.jpg");
  maq_densepose_config densepose_config;
  ASSERT_EQ(maq_densepose_config_init(&densepose_config, sizeof densepose_config), MAQ_OK);
  densepose_config.model.bundle_path = "/no/such/2";
  maq_densepose* densepose = nullptr;
  expect_text(maq_densepose_create(context_, &densepose_config, &densepose), "/no/such/2");
  maq_pipeline_config pipeline_config{};
  maq_pipeline* pipeline = nullptr;
  expect_text(maq_pipeline_create(context_, &pipeline_config, &pipeline), "config.struct_size is 0");
  maq_recorder* recorder = nullptr;
  expect_text(maq_recorder_create(context_, "/no/such/3", nullptr, nullptr, &recorder), "/no/such/3");
  maq_clip* clip = nullptr;
  expect_text(maq_clip_create(context_, "/no/such/4.mp4", 10, &clip), "/no/such/4.mp4");
  maq_frame_desc desc{};
  maq_frame* frame = nullptr;
  expect_text(maq_frame_wrap(context_, &desc, nullptr, nullptr, &frame), "desc.struct_size is 0");
  maq_capture* capture = nullptr;
  expect_text(maq_capture_open(context_, "/no/such/5", &capture), "/no/such/5");
  maq_scene* scene = nullptr;
  expect_text(maq_scene_open(context_, "/no/such/6", &scene), "/no/such/6");
  expect_text(maq_scene_open_memory(context_, "text", 4, &scene), "The scene in memory");
  maq_scene_builder* builder = nullptr;
  maq_point_cloud cloud{};
  expect_text(maq_scene_builder_create(context_, nullptr, &cloud, &builder), "cloud.struct_size is 0");
  maq_scene_renderer* renderer = nullptr;
  expect_text(maq_scene_renderer_create(context_, nullptr, nullptr, &renderer), "scene is NULL");
  expect_text(maq_scene_build(context_, nullptr, nullptr, &scene), "capture is NULL");
  maq_context* context = nullptr;
  EXPECT_EQ(maq_context_create(0, nullptr, &context), MAQ_ERROR_VERSION_MISMATCH);
  EXPECT_NE(std::string(maq_last_error(nullptr)).find("build the app again"), std::string::npos);
}

TEST_F(ApiArguments, ErrorsWithoutAHandleAreOfTheThread) {
  maq_context_create(0, nullptr, nullptr);
  EXPECT_NE(std::string(maq_last_error(nullptr)), "");
  std::thread([] { EXPECT_STREQ(maq_last_error(nullptr), ""); }).join();
}

TEST_F(ApiArguments, WithoutAHandleTheErrorIsTheThreadsLatestOnAnyHandle) {
  maq_source* source = nullptr;
  maq_context_create(0, nullptr, nullptr);
  expect_error(maq_source_create(context_, "image:/no/such.jpg", nullptr, &source), MAQ_ERROR_NOT_FOUND, nullptr,
               "/no/such.jpg");
  ASSERT_EQ(maq_source_create(context_, "stub:pattern?size=16x16", nullptr, &source), MAQ_OK);
  expect_error(maq_source_seek(source, -1), MAQ_ERROR_INVALID_ARGUMENT, nullptr, "negative");
  EXPECT_NE(std::string(maq_last_error(context_)).find("/no/such.jpg"), std::string::npos) << "and the handle's stays";
  std::thread([] { EXPECT_STREQ(maq_last_error(nullptr), ""); }).join();
  maq_source_destroy(source);
}

TEST_F(ApiArguments, EveryStatusHasItsName) {
  for (int status = MAQ_OK; status <= MAQ_CANCELLED; ++status) {
    EXPECT_EQ(std::string(maq_status_get_name(maq_status(status))).rfind("MAQ_", 0), 0u) << status;
  }
  EXPECT_STREQ(maq_status_get_name(maq_status(MAQ_CANCELLED + 1)), "unknown status");
}

TEST_F(ApiArguments, TheVersionOfHeadersAndLibraryAgree) {
  const std::string header = std::to_string(MAQ_VERSION_MAJOR) + "." + std::to_string(MAQ_VERSION_MINOR) + "." +
                             std::to_string(MAQ_VERSION_PATCH);
  EXPECT_EQ(maq_get_sdk_version(), header);
  EXPECT_STRNE(maq_get_git_commit(), "");
  EXPECT_STRNE(maq_get_build_options(), "");
}

// Sizes and values that bindings in other languages rely on.
static_assert(sizeof(maq_intrinsics) == 104, "");
static_assert(sizeof(maq_pixel_format) == 4 && sizeof(maq_status) == 4 && sizeof(maq_densepose_detail) == 4, "");
static_assert(MAQ_END_OF_STREAM == 13 && MAQ_ERROR_UNWRITABLE == 18 && MAQ_SOURCE_RECONNECTED == 5 &&
                  MAQ_PIXEL_DEPTH16 == 7 && MAQ_PIXEL_DEPTH32F == 8 && MAQ_DENSEPOSE_PLANE_PERSON == 4,
              "");

}  // namespace
