// The library works when the system starts fewer threads than requested (ulimit -u, limits of containers). It is its
// own program because it replaces pthread_create: root's threads have no limit.
#include <dlfcn.h>
#include <sys/resource.h>

#include <gtest/gtest.h>
#include <pthread.h>

#include <atomic>
#include <cerrno>
#include <climits>
#include <maquette/maquette.hpp>

#include "support/child_process.h"
#include "support/samples/api_tiny_scene.h"

namespace {

std::atomic<int> threads_left{INT_MAX};

}  // namespace

extern "C" int pthread_create(pthread_t* thread, const pthread_attr_t* attributes, void* (*body)(void*),
                              void* argument) noexcept {
  static const auto real = reinterpret_cast<decltype(&pthread_create)>(dlsym(RTLD_NEXT, "pthread_create"));
  if (threads_left.fetch_sub(1) <= 0) {
    ++threads_left;
    return EAGAIN;
  }
  return real(thread, attributes, body, argument);
}

namespace {

const char* const kRemedy = "ulimit -u";

struct Log {
  std::string text;
  static void add(void* self, maq_log_level, const char* line) { static_cast<Log*>(self)->text += line; }
};

maquette::Context logging_context(Log& log) {
  maq_context_config config = maquette::default_context_config();
  config.log_callback = Log::add;
  config.log_user_data = &log;
  return maquette::Context(config);
}

int say(int pipe, const std::string& text) {
  return write(pipe, text.data(), text.size()) == ssize_t(text.size()) ? 0 : 1;
}

TEST(ThreadLimits, ADensePoseModelRunsOnTheThreadsThereAreAndWarns) {
  const int threads = 3, sessions = 5, wanted = (threads - 1) * sessions;
  for (int given = 0; given <= wanted; ++given) {
    const ChildOutcome outcome = run_in_child([&](int pipe) {
      Log log;
      const maquette::Context context = logging_context(log);
      maq_densepose_config config = maquette::default_densepose_config();
      config.model.bundle_path = MAQ_TEST_DATA "/tiny_bundle";
      config.model.threads = threads;
      threads_left = given;
      maquette::DensePose densepose(context, config);
      maquette::Source source(context, "stub:people");
      densepose.run(*source.next());
      return say(pipe, log.text);
    });
    EXPECT_EQ(outcome.trouble, "") << given << " threads";
    EXPECT_EQ(outcome.said.find(kRemedy) != std::string::npos, given < wanted) << given << ": " << outcome.said;
  }
}

TEST(ThreadLimits, WhereALimitOfMemoryIsNearNetworksRunOnOneThreadAndSaySo) {
#if defined(__SANITIZE_ADDRESS__)
  GTEST_SKIP() << "sanitizers take terabytes of address space";
#endif
  for (const bool is_near : {true, false}) {
    const ChildOutcome outcome = run_in_child([&](int pipe) {
      const rlim_t mebibyte = rlim_t(1) << 20;
      const rlimit limit = {is_near ? 900 * mebibyte : 64 * 1024 * mebibyte, RLIM_INFINITY};
      if (setrlimit(RLIMIT_AS, &limit) != 0) return 1;
      Log log;
      const maquette::Context context = logging_context(log);
      maq_densepose_config config = maquette::default_densepose_config();
      config.model.bundle_path = MAQ_TEST_DATA "/tiny_bundle";
      config.model.threads = 4;
      maquette::DensePose densepose(context, config);
      maquette::Source source(context, "stub:people");
      densepose.run(*source.next());
      return say(pipe, log.text);
    });
    EXPECT_EQ(outcome.trouble, "");
    EXPECT_EQ(outcome.said.find("runs on 1 of 4 threads") != std::string::npos, is_near) << outcome.said;
  }
}

TEST(ThreadLimits, AScenePassesThroughBuilderAndRendererOnTheThreadsThereAre) {
  for (int given = 0; given < 6; ++given) {
    const ChildOutcome outcome = run_in_child([&](int) {
      const maquette::Context context;
      threads_left = given;
      const std::vector<float> places = api_tiny_scene::ball(2000);
      maq_scene_build_config build = api_tiny_scene::build_config();
      build.model.threads = 4;
      maquette::SceneBuilder builder(context, build, api_tiny_scene::cloud_of(places));
      const api_tiny_scene::Photo photo;
      for (int i = 0; i < 4; ++i) {
        builder.add_view(maquette::Frame(context, photo.desc), api_tiny_scene::camera_at(1.5 * i));
      }
      const maquette::Scene scene = builder.finish();
      maq_scene_renderer_config render = api_tiny_scene::renderer_config();
      render.model.threads = 4;
      maquette::SceneRenderer renderer(context, render, scene);
      renderer.run(api_tiny_scene::camera_at(0));
      return 0;
    });
    EXPECT_EQ(outcome.trouble, "") << given << " threads";
  }
}

TEST(ThreadLimits, WhatNeedsAThreadOfItsOwnIsRefusedWithTheRemedy) {
  const ChildOutcome outcome = run_in_child([](int pipe) {
    const maquette::Context context;
    threads_left = 0;
    maq_source* source = nullptr;
    if (maq_source_create(context.get(), "stub:people?live=1", nullptr, &source) != MAQ_ERROR_OUT_OF_MEMORY) return 1;
    std::string said = maq_last_error(nullptr);
    maq_pipeline* pipeline = nullptr;
    const maq_pipeline_config config = maquette::default_pipeline_config();
    const maq_status status = maq_pipeline_create(context.get(), &config, &pipeline);
    if (status != MAQ_ERROR_OUT_OF_MEMORY || said != maq_last_error(nullptr)) {
      say(pipe, maq_last_error(nullptr));
      return 2;
    }
    // Once there are threads again, both work.
    threads_left = INT_MAX;
    if (maq_source_create(context.get(), "stub:people?live=1", nullptr, &source) != MAQ_OK) return 4;
    if (maq_pipeline_create(context.get(), &config, &pipeline) != MAQ_OK) return 5;
    maq_pipeline_destroy(pipeline);
    maq_source_destroy(source);
    return say(pipe, said);
  });
  EXPECT_EQ(outcome.trouble, "") << outcome.said;
  EXPECT_NE(outcome.said.find(kRemedy), std::string::npos) << outcome.said;
}

TEST(ThreadLimits, AClipWhoseDecoderHasNoThreadsIsNotCalledDamaged) {
  const ChildOutcome outcome = run_in_child([](int pipe) {
    const maquette::Context context;
    threads_left = 0;
    maq_source* source = nullptr;
    const maq_status status = maq_source_create(context.get(), "video:" MAQ_TEST_MEDIA "/clip.mp4", nullptr, &source);
    maq_source_destroy(source);
    if (status == MAQ_OK) return say(pipe, kRemedy);  // decoded without threads, as on one processor
    return status == MAQ_ERROR_OUT_OF_MEMORY ? say(pipe, maq_last_error(nullptr)) : 1;
  });
  EXPECT_EQ(outcome.trouble, "") << outcome.said;
  EXPECT_NE(outcome.said.find(kRemedy), std::string::npos) << outcome.said;
}

}  // namespace
