#include <dlfcn.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cmath>
#include <filesystem>
#include <maquette/maquette.hpp>
#include <set>
#include <vector>

#include "support/picture_files.h"
#include "support/pipe_writer.h"
#include "support/source_threads.h"
#include "support/temp_folder.h"

namespace {

TEST(ApiSources, EverySchemeOfTheListHasAnExampleThatIsKnown) {
  const maquette::Context context;
  std::set<std::string> names;
  for (uint32_t i = 0; i < maq_source_get_scheme_count(); ++i) {
    maq_source_scheme scheme{};
    scheme.struct_size = sizeof scheme;
    ASSERT_EQ(maq_source_get_scheme(i, &scheme), MAQ_OK);
    names.insert(scheme.name);
    maq_source* source = nullptr;
    const maq_status status = maq_source_create(context.get(), scheme.example, nullptr, &source);
    EXPECT_NE(status, MAQ_ERROR_UNSUPPORTED) << maq_last_error(context.get());
    maq_source_destroy(source);
  }
  EXPECT_EQ(names,
            (std::set<std::string>{"camera", "depthai", "file", "image", "libcamera", "rec", "stub", "v4l2", "video"}));
  maq_source_scheme scheme{};
  scheme.struct_size = sizeof scheme;
  EXPECT_EQ(maq_source_get_scheme(maq_source_get_scheme_count(), &scheme), MAQ_ERROR_INVALID_ARGUMENT);
}

TEST(ApiSources, CamerasAreListedAndWrongIndicesRefused) {
  const maquette::Context context;
  maq_camera_list* list = nullptr;
  ASSERT_EQ(maq_camera_list_create(context.get(), &list), MAQ_OK);
  maq_camera_info info{};
  info.struct_size = sizeof info;
  const uint32_t count = maq_camera_list_get_count(list);  // none on most machines that run tests
  for (uint32_t i = 0; i < count; ++i) {
    ASSERT_EQ(maq_camera_list_get_camera(list, i, &info), MAQ_OK);
    const std::string uri = info.uri;
    EXPECT_TRUE(uri.rfind("v4l2:/dev/video", 0) == 0 || uri.rfind("libcamera:", 0) == 0) << uri;
  }
  EXPECT_EQ(maq_camera_list_get_camera(list, count, &info), MAQ_ERROR_INVALID_ARGUMENT);
  maq_camera_mode mode{};
  mode.struct_size = sizeof mode;
  EXPECT_EQ(maq_camera_list_get_mode(list, count, 0, &mode), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(maq_camera_list_get_count(nullptr), 0u);
  maq_camera_list_destroy(list);
}

TEST(ApiSources, PipesWithoutAWriterAndDevicesAreRefused) {
  const maquette::Context context;
  const TempFolder folder;
  ASSERT_EQ(mkfifo(folder.file("pipe").c_str(), 0600), 0);
  std::filesystem::create_symlink("/dev/zero", folder.file("zeros"));
  for (const char* scheme : {"image:", "file:", "video:", "rec:"}) {
    for (const char* name : {"pipe", "zeros"}) {
      maq_source* source = nullptr;
      const std::string uri = scheme + folder.file(name);
      EXPECT_EQ(maq_source_create(context.get(), uri.c_str(), nullptr, &source), MAQ_ERROR_UNREADABLE) << uri;
      EXPECT_NE(std::string(maq_last_error(context.get())).find(" is "), std::string::npos);
    }
  }
}

TEST(ApiSources, AnImageComesThroughAPipe) {
  const maquette::Context context;
  const TempFolder folder;
  const std::string photo = std::string(MAQ_TEST_MEDIA) + "/photo.jpg";
  ASSERT_EQ(mkfifo(folder.file("pipe").c_str(), 0600), 0);
  for (const char* scheme : {"image:", "file:"}) {
    const PipeWriter writer(folder.file("pipe"), read_text(photo));
    EXPECT_EQ(rgb_of(*maquette::Source(context, scheme + folder.file("pipe")).next()), read_rgb(context, photo));
  }
}

TEST(ApiSources, NothingIsPrintedOfDamagedFiles) {
  const maquette::Context context;
  const TempFolder folder;
  const std::string media = MAQ_TEST_MEDIA;
  const maquette::Frame frame = *maquette::Source(context, "image:" + media + "/photo.jpg").next();
  frame.save(folder.file("a.png"));
  maquette::Clip clip(context, folder.file("b.mp4"), 10);
  for (int i = 0; i < 5; ++i) clip.add(frame);
  clip.finish();
  std::string bmp = std::string("BM\x36\x0c\0\0\0\0\0\0\x36\0\0\0\x28\0\0\0\x20\0\0\0\x20\0\0\0\1\0\x18\0", 30);
  bmp.resize(54 + 32 * 32 * 3);
  testing::internal::CaptureStderr();
  for (const std::string& whole : {read_text(media + "/photo.jpg"), read_text(folder.file("a.png")), bmp,
                                   read_text(media + "/clip.mp4"), read_text(folder.file("b.mp4"))}) {
    for (int i = 1; i < 16; ++i) {
      std::string damaged = i % 2 == 0 ? whole.substr(0, whole.size() * size_t(i) / 16) : whole;
      for (size_t k = damaged.size() * size_t(i) / 17; k < damaged.size(); k += 4999) damaged[k] = char(damaged[k] + i);
      write_text(folder.file("damaged"), damaged);
      for (const char* scheme : {"image:", "video:", "file:"}) {
        status_of([&] {
          maquette::Source source(context, scheme + folder.file("damaged"));
          while (source.next()) {
          }
        });
      }
    }
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(ApiSources, DescribeThemselvesAndDeliverUntilTheEnd) {
  const maquette::Context context;
  maquette::Source source(context, "stub:people?frames=2&size=64x48&fps=10");
  const maq_source_info info = source.info();
  EXPECT_EQ(info.width_px, 64);
  EXPECT_EQ(info.frame_count, 2);
  EXPECT_DOUBLE_EQ(info.fps, 10);
  EXPECT_EQ(info.is_live, 0);
  EXPECT_EQ(info.clock, MAQ_CLOCK_MEDIA);
  EXPECT_EQ(info.frame_pool_size, 4u);
  EXPECT_TRUE(source.next().has_value());
  EXPECT_EQ(source.next()->desc().timestamp_ns, 100000000);
  EXPECT_FALSE(source.next().has_value());
}

TEST(ApiSources, SayWhenEveryFrameIsHeldAndAFrameGivenBackIsNewToTheNext) {
  const maquette::Context context;
  maquette::Source source(context, "stub:pattern?size=16x16");
  std::vector<maquette::Frame> held;
  for (int i = 0; i < 4; ++i) held.push_back(*source.next());
  maq_frame* frame = nullptr;
  EXPECT_EQ(maq_source_acquire_frame(source.get(), 0, &frame), MAQ_ERROR_POOL_EMPTY);
  EXPECT_EQ(frame, nullptr);
  maq_frame_desc wrong{};
  EXPECT_EQ(maq_frame_get_desc(held.back().get(), &wrong), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_STRNE(maq_last_error(held.back().get()), "");
  held.pop_back();
  const std::optional<maquette::Frame> next = source.next();
  EXPECT_EQ(next->desc().sequence, 4u) << "a refused call takes no frame";
  EXPECT_STREQ(maq_last_error(next->get()), "");
}

TEST(ApiSources, WhatIsRecordedIsPlayedAgain) {
  const TempFolder folder;
  const maquette::Context context;
  maquette::Source source(context, "stub:pattern?frames=3&size=16x12&fps=10");
  maquette::Recorder recorder(context, folder.file("a.maqrec"), &source);
  std::vector<uint8_t> last(16 * 12 * 3), again(last.size());
  while (const auto frame = source.next()) {
    recorder.add(*frame);
    frame->copy_pixels(MAQ_PIXEL_BGR8, last.data(), 0, last.size());
  }
  recorder.finish();
  EXPECT_EQ(recorder.info().frame_count, 3u);
  EXPECT_EQ(recorder.info().size_bytes, std::filesystem::file_size(folder.file("a.maqrec")));
  maquette::Source player(context, "rec:" + folder.file("a.maqrec"));
  EXPECT_NEAR(player.info().fps, 10, 1e-9);
  EXPECT_FALSE(player.intrinsics().has_value());
  player.seek(200000000);
  const auto frame = player.next();
  EXPECT_FALSE(frame->depth().has_value());
  frame->copy_pixels(MAQ_PIXEL_BGR8, again.data(), 0, again.size());
  EXPECT_EQ(again, last);
  EXPECT_FALSE(player.next().has_value());
}

TEST(ApiSources, FilesAndStubsPlayAtTheirOwnPaceWhenTheConfigSaysSo) {
  const maquette::Context context;
  maq_source_config config = maquette::default_source_config();
  config.real_time = 1;
  config.loop = 1;
  const auto is_live = [&](const char* uri) { return maquette::Source(context, uri, &config).info().is_live == 1; };
  EXPECT_TRUE(is_live("stub:pattern?size=16x16"));
  EXPECT_FALSE(is_live("stub:pattern?size=16x16&live=0")) << "the URI has the last word";
  EXPECT_FALSE(is_live("image:" MAQ_TEST_MEDIA "/photo.jpg")) << "a photo has no pace";
  maquette::Source looping(context, "stub:pattern?frames=2&fps=100&size=16x16", &config);
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(looping.next().has_value());
  maquette::Source once(context, "stub:pattern?frames=2&fps=10&size=16x16&loop=0", &config);
  for (int i = 0; i < 2; ++i) EXPECT_TRUE(once.next().has_value());
  EXPECT_FALSE(once.next().has_value());
  config.real_time = 2;
  maq_source* source = nullptr;
  EXPECT_EQ(maq_source_create(context.get(), "stub:pattern", &config, &source), MAQ_ERROR_INVALID_ARGUMENT);
}

TEST(ApiSources, LargePicturesAreMadeSmallerWhenTheConfigSaysSo) {
  const maquette::Context context;
  maq_source_config config = maquette::default_source_config();
  config.max_side_px = 100;
  for (const int real_time : {0, 1}) {
    config.real_time = real_time;
    for (const std::string uri : {"image:" MAQ_TEST_MEDIA "/photo.jpg", "video:" MAQ_TEST_MEDIA "/clip.mp4",
                                  "stub:pattern?size=50x300", "stub:pattern?size=50x100"}) {
      maquette::Source source(context, uri, &config);
      const maq_frame_desc desc = source.next()->desc();
      EXPECT_EQ(std::max(desc.width_px, desc.height_px), 100) << uri;
      EXPECT_EQ(desc.width_px, source.info().width_px);
    }
  }
}

TEST(ApiSources, OnlyCamerasHaveControls) {
  const maquette::Context context;
  maquette::Source source(context, "stub:pattern?size=16x16");
  EXPECT_FALSE(source.control(MAQ_SOURCE_CONTROL_GAIN).has_value());
  maq_source* camera = nullptr;
  EXPECT_EQ(maq_source_create(context.get(), "v4l2:/no/such?gain=loud", nullptr, &camera), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_STREQ(maq_last_error(context.get()), "gain=loud in v4l2:/no/such?gain=loud must be a number or auto.");
}

// A copy of the SDK that lies alone.
class LoneCopy {
 public:
  LoneCopy() : path_(folder_.file("libmaquette.so")) {
    Dl_info info{};
    dladdr(reinterpret_cast<const void*>(&maq_source_create), &info);
    std::filesystem::copy_file(info.dli_fname, path_);
    // Its code stays: the thread of a camera may end a little later than its source.
    library_ = dlopen(path_.c_str(), RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
    EXPECT_NE(library_, nullptr) << dlerror();
    EXPECT_EQ(function<decltype(maq_context_create)>("maq_context_create")(MAQ_HEADER_VERSION, nullptr, &context_),
              MAQ_OK);
  }
  ~LoneCopy() {
    function<decltype(maq_context_destroy)>("maq_context_destroy")(context_);
    dlclose(library_);
  }

  std::string beside(const std::string& name) const { return folder_.file(name); }

  maq_status open(const char* uri) {
    maq_source* source = nullptr;
    const maq_status status =
        function<decltype(maq_source_create)>("maq_source_create")(context_, uri, nullptr, &source);
    function<decltype(maq_source_destroy)>("maq_source_destroy")(source);
    return status;
  }
  maq_status list_cameras() {
    maq_camera_list* list = nullptr;
    const maq_status status = function<decltype(maq_camera_list_create)>("maq_camera_list_create")(context_, &list);
    function<decltype(maq_camera_list_destroy)>("maq_camera_list_destroy")(list);
    return status;
  }
  template <class Use>
  void use(const char* uri, Use&& body) {
    maq_source* source = nullptr;
    ASSERT_EQ(function<decltype(maq_source_create)>("maq_source_create")(context_, uri, nullptr, &source), MAQ_OK)
        << last_error();
    body(source);
    function<decltype(maq_source_destroy)>("maq_source_destroy")(source);
  }
  // Statuses of the DepthAI devices in the list of cameras.
  std::vector<maq_status> depthai_listings() {
    maq_camera_list* list = nullptr;
    EXPECT_EQ(function<decltype(maq_camera_list_create)>("maq_camera_list_create")(context_, &list), MAQ_OK);
    std::vector<maq_status> found;
    for (uint32_t i = 0; i < function<decltype(maq_camera_list_get_count)>("maq_camera_list_get_count")(list); ++i) {
      maq_camera_info info{};
      info.struct_size = sizeof info;
      EXPECT_EQ(function<decltype(maq_camera_list_get_camera)>("maq_camera_list_get_camera")(list, i, &info), MAQ_OK);
      if (std::string(info.uri).rfind("depthai:", 0) == 0) found.push_back(info.status);
    }
    function<decltype(maq_camera_list_destroy)>("maq_camera_list_destroy")(list);
    return found;
  }
  std::string last_error() { return function<decltype(maq_last_error)>("maq_last_error")(context_); }
  template <typename Function>
  Function* function(const char* name) const {
    return reinterpret_cast<Function*>(dlsym(library_, name));
  }

 private:
  TempFolder folder_;
  std::string path_;
  void* library_ = nullptr;
  maq_context* context_ = nullptr;
};

TEST(ApiSources, ClipsNeedTheirProgramAndNothingElseDoes) {
  LoneCopy sdk;
  ASSERT_EQ(setenv("MAQ_FFMPEG", sdk.beside("ffmpeg").c_str(), 1), 0);
  for (const char* uri : {"stub:pattern", "image:" MAQ_TEST_MEDIA "/photo.jpg"}) {
    EXPECT_EQ(sdk.open(uri), MAQ_OK) << sdk.last_error();
  }
  EXPECT_EQ(sdk.open("video:" MAQ_TEST_MEDIA "/clip.mp4"), MAQ_ERROR_RUNTIME_LIBRARY);
  EXPECT_NE(sdk.last_error().find("needs the program " + sdk.beside("ffmpeg")), std::string::npos) << sdk.last_error();
  // A program that does not decode is one that found no frame.
  write_text(sdk.beside("ffmpeg"), "#!/bin/sh\necho nonsense\n");
  std::filesystem::permissions(sdk.beside("ffmpeg"), std::filesystem::perms::owner_all);
  EXPECT_EQ(sdk.open("video:" MAQ_TEST_MEDIA "/clip.mp4"), MAQ_ERROR_UNREADABLE) << sdk.last_error();
  // New versions of FFmpeg have another name for the file's time base.
  write_text(sdk.beside("ffmpeg"),
             "#!/bin/bash\n[[ \"$*\" == *'-enc_time_base demux'* ]] || { echo 'Invalid time base: -1' >&2; exit 1; }\n"
             "exec ffmpeg \"${@/#demux/-1}\"\n");
  std::filesystem::permissions(sdk.beside("ffmpeg"), std::filesystem::perms::owner_all);
  EXPECT_EQ(sdk.open("video:" MAQ_TEST_MEDIA "/clip.mp4"), MAQ_OK) << sdk.last_error();
  ASSERT_EQ(unsetenv("MAQ_FFMPEG"), 0);
  EXPECT_EQ(sdk.open("video:" MAQ_TEST_MEDIA "/clip.mp4"), MAQ_OK) << sdk.last_error();
  EXPECT_EQ(sdk.open("stub:people"), MAQ_ERROR_NOT_FOUND) << "an app does not carry the sprites";
  EXPECT_NE(sdk.last_error().find("share/maquette/stub/people.jpg"), std::string::npos) << sdk.last_error();
}

TEST(ApiSources, AClipThatCannotBeReadIsToldWithTheLastErrorOfItsProgram) {
  LoneCopy sdk;
  write_text(sdk.beside("text.mp4"), "no clip");
  EXPECT_EQ(sdk.open(("video:" + sdk.beside("text.mp4")).c_str()), MAQ_ERROR_UNREADABLE);
  const std::string said = "The program ffmpeg says: Invalid data found when processing input";
  EXPECT_NE(sdk.last_error().find(said), std::string::npos) << sdk.last_error();

  // A message may have any length and any bytes.
  write_text(sdk.beside("ffmpeg"),
             "#!/bin/bash\nprintf '[error] earlier\\n[mov @ 0x55] [fatal] no \\e[31matom \\xc3\\xbc %0999d\\nA "
             "hint.\\n' 0 >&2\n");
  std::filesystem::permissions(sdk.beside("ffmpeg"), std::filesystem::perms::owner_all);
  ASSERT_EQ(setenv("MAQ_FFMPEG", sdk.beside("ffmpeg").c_str(), 1), 0);
  EXPECT_EQ(sdk.open("video:" MAQ_TEST_MEDIA "/clip.mp4"), MAQ_ERROR_UNREADABLE);
  ASSERT_EQ(unsetenv("MAQ_FFMPEG"), 0);
  const std::string error = sdk.last_error();
  const size_t at = error.find("says: no ?[31matom ?? 000");
  ASSERT_NE(at, std::string::npos) << error;
  EXPECT_EQ(error.size() - at, std::string("says: ").size() + 200);
}

TEST(ApiSources, CamerasOfLibcameraNeedTheirLibraryAndTheListOfCamerasDoesNot) {
  LoneCopy sdk;
  EXPECT_EQ(sdk.open("libcamera:0"), MAQ_ERROR_RUNTIME_LIBRARY);
  EXPECT_NE(sdk.last_error().find("maquette/libmaquette_libcamera.so, which cannot be opened"), std::string::npos);
  EXPECT_NE(sdk.last_error().find("libcamera-dev"), std::string::npos) << sdk.last_error();
  EXPECT_EQ(sdk.list_cameras(), MAQ_OK) << sdk.last_error();

  std::filesystem::create_directory(sdk.beside("maquette"));
  std::filesystem::copy_file(sdk.beside("libmaquette.so"), sdk.beside("maquette/libmaquette_libcamera.so"));
  EXPECT_EQ(sdk.open("libcamera:0"), MAQ_ERROR_RUNTIME_LIBRARY);
  EXPECT_NE(sdk.last_error().find("install both from the same build"), std::string::npos) << sdk.last_error();
  EXPECT_EQ(sdk.list_cameras(), MAQ_OK) << sdk.last_error();
  EXPECT_EQ(sdk.open("libcamera:0?colour=red"), MAQ_ERROR_INVALID_ARGUMENT) << "before anything is opened";
}

TEST(ApiSources, DepthAiNeedsItsLibraryAndListingDoesNot) {
  LoneCopy sdk;
  EXPECT_EQ(sdk.open("depthai:"), MAQ_ERROR_RUNTIME_LIBRARY);
  for (const char* part : {"maquette/libmaquette_depthai.so", "-DMAQ_WITH_DEPTHAI=ON"}) {
    EXPECT_NE(sdk.last_error().find(part), std::string::npos) << sdk.last_error();
  }
  EXPECT_EQ(sdk.open("depthai:?depth=2"), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(sdk.open("depthai:?format=MJPG"), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(sdk.open("v4l2:"), MAQ_ERROR_INVALID_ARGUMENT) << "which has no first camera";
  EXPECT_EQ(sdk.depthai_listings(), std::vector<maq_status>());

  std::filesystem::create_directory(sdk.beside("maquette"));
  const std::string library = sdk.beside("maquette/libmaquette_depthai.so");
  std::filesystem::copy_file(sdk.beside("libmaquette.so"), library);
  EXPECT_EQ(sdk.open("depthai:"), MAQ_ERROR_RUNTIME_LIBRARY) << "the SDK itself is not the library of DepthAI";
  EXPECT_NE(sdk.last_error().find("install both from the same build"), std::string::npos) << sdk.last_error();
  EXPECT_EQ(sdk.depthai_listings(), std::vector<maq_status>{MAQ_ERROR_RUNTIME_LIBRARY});
}

TEST(ApiSources, DepthAiDeliversDepthAndCalibrationAcrossItsLibrary) {
  LoneCopy sdk;
  std::filesystem::create_directory(sdk.beside("maquette"));
  std::filesystem::copy_file(MAQ_TEST_FAKE_DEPTHAI, sdk.beside("maquette/libmaquette_depthai.so"));
  EXPECT_EQ(sdk.depthai_listings(), std::vector<maq_status>{MAQ_OK});
  EXPECT_EQ(sdk.open("depthai:no-such-device"), MAQ_ERROR_NOT_FOUND) << sdk.last_error();
  EXPECT_EQ(sdk.open("depthai:10.0.0.1"), MAQ_ERROR_NO_PERMISSION)
      << "an exception of the library: " << sdk.last_error();
  sdk.use("depthai:?size=64x48&fps=100", [&](maq_source* source) {
    maq_intrinsics intrinsics{};
    EXPECT_EQ(sdk.function<decltype(maq_source_get_intrinsics)>("maq_source_get_intrinsics")(source, &intrinsics),
              MAQ_OK);
    EXPECT_EQ(intrinsics.width_px, 64);
    EXPECT_EQ(intrinsics.fx_px, 500);
    maq_frame* frame = nullptr;
    ASSERT_EQ(sdk.function<decltype(maq_source_acquire_frame)>("maq_source_acquire_frame")(source, 5000000000, &frame),
              MAQ_OK);
    maq_frame_desc desc{};
    desc.struct_size = sizeof desc;
    EXPECT_EQ(sdk.function<decltype(maq_frame_get_desc)>("maq_frame_get_desc")(frame, &desc), MAQ_OK);
    EXPECT_EQ(desc.format, MAQ_PIXEL_NV12);
    EXPECT_EQ(desc.planes[0][0], 200);
    EXPECT_EQ(desc.clock, MAQ_CLOCK_MONOTONIC);
    EXPECT_EQ(sdk.function<decltype(maq_frame_get_depth)>("maq_frame_get_depth")(frame, &desc), MAQ_OK);
    EXPECT_EQ(desc.format, MAQ_PIXEL_DEPTH16);
    EXPECT_EQ(desc.width_px, 64);
    EXPECT_EQ(*reinterpret_cast<const uint16_t*>(desc.planes[0]), 1500);
    sdk.function<decltype(maq_frame_release)>("maq_frame_release")(frame);
  });
}

TEST(ApiSources, UnknownSchemesAndMissingFilesAreSentences) {
  const maquette::Context context;
  maq_source* source = nullptr;
  EXPECT_EQ(maq_source_create(context.get(), "rtsp:camera", nullptr, &source), MAQ_ERROR_UNSUPPORTED);
  EXPECT_STREQ(
      maq_last_error(context.get()),
      "\"rtsp:\" is not a kind of source of this build; there are file:, camera:, image:, video:, rec:, stub:, v4l2:, "
      "libcamera:, depthai:.");
  EXPECT_EQ(maq_source_create(context.get(), "image:/no/such.jpg", nullptr, &source), MAQ_ERROR_NOT_FOUND);
  EXPECT_STREQ(maq_last_error(context.get()), "/no/such.jpg does not exist; check the path.");
  EXPECT_EQ(source, nullptr);
}

}  // namespace
