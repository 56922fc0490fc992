// The C API returns a status and a sentence for wrong arguments. It never crashes.
#include <gtest/gtest.h>
#include <maquette/maquette.h>

#include <cstring>
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

TEST_F(ApiArguments, NullHandlesAreRefusedByName) {
  maq_source* source = nullptr;
  maq_densepose* densepose = nullptr;
  maq_densepose_result* result = nullptr;
  maq_frame* frame = nullptr;
  maq_frame_desc desc{};
  maq_source_info info{};
  maq_densepose_stats stats{};
  maq_densepose_config config{};
  maq_densepose_person person{};
  const uint8_t* pixels = nullptr;
  size_t stride = 0;
  uint8_t byte = 0;
  expect_error(maq_context_create(MAQ_HEADER_VERSION, nullptr, nullptr), MAQ_ERROR_INVALID_ARGUMENT, nullptr,
               "maq_context_create: context is NULL");
  expect_error(maq_context_get_onnxruntime(nullptr, nullptr, nullptr), MAQ_ERROR_INVALID_ARGUMENT, nullptr, "context");
  expect_error(maq_source_create(nullptr, "stub:people", nullptr, &source), MAQ_ERROR_INVALID_ARGUMENT, nullptr,
               "maq_source_create: context is NULL");
  expect_error(maq_source_get_info(nullptr, &info), MAQ_ERROR_INVALID_ARGUMENT, nullptr, "source is NULL");
  expect_error(maq_source_acquire_frame(nullptr, 0, &frame), MAQ_ERROR_INVALID_ARGUMENT, nullptr, "source is NULL");
  expect_error(maq_frame_wrap(nullptr, &desc, nullptr, nullptr, &frame), MAQ_ERROR_INVALID_ARGUMENT, nullptr,
               "context is NULL");
  expect_error(maq_frame_get_desc(nullptr, &desc), MAQ_ERROR_INVALID_ARGUMENT, nullptr, "frame is NULL");
  expect_error(maq_frame_copy_pixels(nullptr, MAQ_PIXEL_RGB8, &byte, 0, 1), MAQ_ERROR_INVALID_ARGUMENT, nullptr,
               "frame is NULL");
  expect_error(maq_densepose_create(nullptr, &config, &densepose), MAQ_ERROR_INVALID_ARGUMENT, nullptr,
               "context is NULL");
  expect_error(maq_densepose_reset(nullptr), MAQ_ERROR_INVALID_ARGUMENT, nullptr, "densepose is NULL");
  expect_error(maq_densepose_set_roll(nullptr, 0), MAQ_ERROR_INVALID_ARGUMENT, nullptr, "densepose is NULL");
  expect_error(maq_densepose_run(nullptr, nullptr, &result), MAQ_ERROR_INVALID_ARGUMENT, nullptr, "densepose is NULL");
  expect_error(maq_densepose_result_get_size(nullptr, nullptr, nullptr), MAQ_ERROR_INVALID_ARGUMENT, nullptr, "result");
  expect_error(maq_densepose_result_get_person(nullptr, 0, &person), MAQ_ERROR_INVALID_ARGUMENT, nullptr, "result");
  expect_error(maq_densepose_result_get_plane(nullptr, MAQ_DENSEPOSE_PLANE_PART, &pixels, &stride),
               MAQ_ERROR_INVALID_ARGUMENT, nullptr, "result");
  expect_error(maq_densepose_result_get_stats(nullptr, &stats), MAQ_ERROR_INVALID_ARGUMENT, nullptr, "result");
  EXPECT_EQ(source, nullptr);
  EXPECT_EQ(densepose, nullptr);
  EXPECT_EQ(frame, nullptr);
}

TEST_F(ApiArguments, NullOutputsAreRefusedAndTheTextIsTheHandles) {
  maq_frame_desc desc{};
  maq_densepose_config config{};
  expect_error(maq_source_create(context_, nullptr, nullptr, nullptr), MAQ_ERROR_INVALID_ARGUMENT, context_, "uri");
  expect_error(maq_source_create(context_, "stub:people", nullptr, nullptr), MAQ_ERROR_INVALID_ARGUMENT, context_,
               "source is NULL");
  expect_error(maq_frame_wrap(context_, nullptr, nullptr, nullptr, nullptr), MAQ_ERROR_INVALID_ARGUMENT, context_,
               "desc is NULL");
  expect_error(maq_frame_wrap(context_, &desc, nullptr, nullptr, nullptr), MAQ_ERROR_INVALID_ARGUMENT, context_,
               "frame is NULL");
  expect_error(maq_densepose_create(context_, &config, nullptr), MAQ_ERROR_INVALID_ARGUMENT, context_, "densepose");
}

TEST_F(ApiArguments, DestroyingNullIsFine) {
  maq_context_destroy(nullptr);
  maq_source_destroy(nullptr);
  maq_frame_release(nullptr);
  maq_densepose_destroy(nullptr);
  maq_densepose_result_release(nullptr);
  maq_recorder_destroy(nullptr);
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
  for (const maq_status status :
       {maq_source_get_control(nullptr, MAQ_SOURCE_CONTROL_GAIN, &control),
        maq_source_set_control(nullptr, MAQ_SOURCE_CONTROL_GAIN, 1), maq_source_get_intrinsics(nullptr, &intrinsics),
        maq_source_seek(nullptr, 0), maq_frame_get_depth(nullptr, &desc), maq_frame_get_dma_buf(nullptr, &fd)}) {
    EXPECT_EQ(status, MAQ_ERROR_INVALID_ARGUMENT);
  }
}

TEST_F(ApiArguments, ARecorderSaysWhatIsWrong) {
  maq_recorder* recorder = nullptr;
  maq_recorder_info info{};
  info.struct_size = sizeof info;
  maq_recorder_config config;
  ASSERT_EQ(maq_recorder_config_init(&config, sizeof config), MAQ_OK);
  config.jpeg_quality = 101;
  expect_error(maq_recorder_create(context_, "/tmp", nullptr, &config, &recorder), MAQ_ERROR_INVALID_ARGUMENT, context_,
               "config.jpeg_quality is 101");
  expect_error(maq_recorder_create(context_, "/tmp", nullptr, nullptr, &recorder), MAQ_ERROR_UNWRITABLE, context_,
               "/tmp cannot be made");
  expect_error(maq_recorder_create(context_, nullptr, nullptr, nullptr, &recorder), MAQ_ERROR_INVALID_ARGUMENT,
               context_, "path is NULL");
  expect_error(maq_recorder_create(nullptr, "/tmp", nullptr, nullptr, &recorder), MAQ_ERROR_INVALID_ARGUMENT, nullptr,
               "context is NULL");
  EXPECT_EQ(recorder, nullptr);
  expect_error(maq_recorder_add_frame(nullptr, nullptr), MAQ_ERROR_INVALID_ARGUMENT, nullptr, "recorder is NULL");
  expect_error(maq_recorder_finish(nullptr), MAQ_ERROR_INVALID_ARGUMENT, nullptr, "recorder is NULL");
  expect_error(maq_recorder_get_info(nullptr, &info), MAQ_ERROR_INVALID_ARGUMENT, nullptr, "recorder is NULL");
}

// first_size: of the struct's first release, which apps that were built then still give.
template <class Config>
void expect_size_checked(maq_status (*init)(Config*, uint32_t)) {
  Config config;
  EXPECT_EQ(init(nullptr, sizeof config), MAQ_ERROR_INVALID_ARGUMENT);
  for (const size_t wrong : {size_t(0), sizeof config - 1, sizeof config + 8, size_t(0xFFFFFFFF)}) {
    std::memset(static_cast<void*>(&config), 0xAB, sizeof config);
    EXPECT_EQ(init(&config, uint32_t(wrong)), MAQ_ERROR_INVALID_ARGUMENT) << wrong;
    EXPECT_EQ(*reinterpret_cast<unsigned char*>(&config), 0xAB) << "nothing is written";
  }
  EXPECT_EQ(init(&config, sizeof config), MAQ_OK);
  EXPECT_EQ(config.struct_size, sizeof config);
}

TEST_F(ApiArguments, InitFunctionsCheckTheSizeAndSetIt) {
  expect_size_checked(maq_context_config_init);
  expect_size_checked(maq_source_config_init);
  expect_size_checked(maq_densepose_config_init);
  expect_size_checked(maq_frame_desc_init);
}

TEST_F(ApiArguments, StructsOfUnknownSizeAreRefused) {
  for (const uint32_t wrong : {0u, 3u, 100000u}) {
    maq_context_config context_config;
    maq_context_config_init(&context_config, sizeof context_config);
    context_config.struct_size = wrong;
    maq_context* context = nullptr;
    expect_error(maq_context_create(MAQ_HEADER_VERSION, &context_config, &context), MAQ_ERROR_INVALID_ARGUMENT, nullptr,
                 "config.struct_size is " + std::to_string(wrong));
    maq_source_config source_config{};
    source_config.struct_size = wrong;
    maq_source* source = nullptr;
    expect_error(maq_source_create(context_, "stub:people", &source_config, &source), MAQ_ERROR_INVALID_ARGUMENT,
                 context_, "config.struct_size");
    maq_densepose_config densepose_config{};
    densepose_config.struct_size = wrong;
    maq_densepose* densepose = nullptr;
    expect_error(maq_densepose_create(context_, &densepose_config, &densepose), MAQ_ERROR_INVALID_ARGUMENT, context_,
                 "config.struct_size");
    maq_source_scheme scheme{};
    scheme.struct_size = wrong;
    expect_error(maq_source_get_scheme(0, &scheme), MAQ_ERROR_INVALID_ARGUMENT, nullptr, "scheme.struct_size");
  }
}

TEST_F(ApiArguments, ValuesOutOfRangeAreRefusedByName) {
  maq_source_config source_config;
  maq_source_config_init(&source_config, sizeof source_config);
  maq_source* source = nullptr;
  for (const uint32_t pool : {65u, 100u}) {
    source_config.frame_pool_size = pool;
    expect_error(maq_source_create(context_, "stub:people", &source_config, &source), MAQ_ERROR_INVALID_ARGUMENT,
                 context_, "config.frame_pool_size is " + std::to_string(pool));
  }
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
  expect_refused("config.model.threads is -2, but must be 0 to 64, or MAQ_THREADS_MEASURED (-1).",
                 [](auto& config) { config.model.threads = -2; });
  expect_refused("threads", [](auto& config) { config.model.threads = 65; });
  expect_refused("long_side_px", [](auto& config) { config.long_side_px = 31; });
  expect_refused("long_side_px", [](auto& config) { config.long_side_px = 2049; });
  expect_refused("score_threshold", [](auto& config) { config.score_threshold = 1.5f; });
  expect_refused("score_threshold", [](auto& config) { config.score_threshold = std::stof("nan"); });
  expect_refused("max_people", [](auto& config) { config.max_people = 256; });
  expect_refused("result_pool_size", [](auto& config) { config.result_pool_size = 65; });
  expect_refused("max_proposals", [](auto& config) { config.max_proposals = 1001; });
  expect_refused("key_frame_interval", [](auto& config) { config.key_frame_interval = -1; });
  expect_refused("min_person_height_px", [](auto& config) { config.min_person_height_px = -1; });
  expect_refused("detail", [](auto& config) { reinterpret_cast<int32_t&>(config.detail) = 2; });
  expect_refused("model.spinning", [](auto& config) { reinterpret_cast<int32_t&>(config.model.spinning) = 3; });
  expect_refused("score_threshold", [](auto& config) { config.score_threshold = -0.1f; });
  expect_refused("person_crops", [](auto& config) { reinterpret_cast<int32_t&>(config.person_crops) = 3; });
  expect_refused("person_crop_px", [](auto& config) { config.person_crop_px = 63; });
  expect_refused("person_crop_px", [](auto& config) { config.person_crop_px = 513; });
  expect_refused("provider", [](auto& config) { reinterpret_cast<int32_t&>(config.model.provider) = 3; });
}

TEST_F(ApiArguments, ErrorsNameTheParameterOfTheHeader) {
  maq_frame_desc desc{};
  expect_error(maq_frame_desc_init(nullptr, sizeof desc), MAQ_ERROR_INVALID_ARGUMENT, nullptr,
               "maq_frame_desc_init: desc is NULL");
  expect_error(maq_frame_desc_init(&desc, 1), MAQ_ERROR_INVALID_ARGUMENT, nullptr,
               "maq_frame_desc_init: struct_size is 1,");
  maq_source_config init;
  expect_error(maq_source_config_init(&init, 0), MAQ_ERROR_INVALID_ARGUMENT, nullptr,
               "maq_source_config_init: struct_size is 0,");
  ASSERT_EQ(maq_frame_desc_init(&desc, sizeof desc), MAQ_OK);
  desc.format = MAQ_PIXEL_GREY8;
  desc.width_px = desc.height_px = 8;
  maq_frame* frame = nullptr;
  expect_error(maq_frame_wrap(context_, &desc, nullptr, nullptr, &frame), MAQ_ERROR_INVALID_ARGUMENT, nullptr,
               "desc.planes[0] is NULL");
}

TEST_F(ApiArguments, FieldsOfAConfigInAConfigAreNamedWithBoth) {
  const auto expect_refused = [&](const char* text, auto change) {
    maq_densepose_config densepose;
    ASSERT_EQ(maq_densepose_config_init(&densepose, sizeof densepose), MAQ_OK);
    change(densepose);
    maq_model* model = nullptr;
    expect_error(maq_densepose_model_create(context_, &densepose, &model), MAQ_ERROR_INVALID_ARGUMENT, nullptr, text);
  };
  expect_refused("config.model.threads is -2", [](auto& densepose) { densepose.model.threads = -2; });
  expect_refused("config.model.bundle_files is NULL", [](auto& densepose) { densepose.model.bundle_file_count = 1; });
  const auto expect_source_refused = [&](const char* text, auto change) {
    maq_source_config source;
    maq_pipeline_config config;
    ASSERT_EQ(maq_source_config_init(&source, sizeof source), MAQ_OK);
    ASSERT_EQ(maq_pipeline_config_init(&config, sizeof config), MAQ_OK);
    config.source = &source;
    change(source);
    maq_pipeline* pipeline = nullptr;
    expect_error(maq_pipeline_create(context_, &config, &pipeline), MAQ_ERROR_INVALID_ARGUMENT, nullptr, text);
  };
  expect_source_refused("config.source.queue_length is 65", [](auto& source) { source.queue_length = 65; });
  expect_source_refused("config.source.struct_size is 1", [](auto& source) { source.struct_size = 1; });
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
