// A child of fork() can do nothing with the objects of its parent, and gets an error that says so.
#include <gtest/gtest.h>

#include <maquette/maquette.hpp>

#include "support/child_process.h"
#include "support/samples/api_tiny_scene.h"

namespace {

constexpr unsigned kLimit_s = 30;  // for calls that return at once

maq_densepose_config two_threads() {
  maq_densepose_config config = maquette::default_densepose_config();
  config.model.bundle_path = MAQ_TEST_DATA "/tiny_bundle";
  config.model.threads = 2;
  return config;
}

// Counts the calls that were not refused as they must be.
struct Refusals {
  int wrong = 0;
  void expect(maq_status status) {
    const std::string said = maq_last_error(nullptr);
    if (status != MAQ_ERROR_INVALID_ARGUMENT || said.find("fork()") == std::string::npos) ++wrong;
  }
};

TEST(ForkedChildren, AreRefusedEachObjectOfTheirParentAndGiveThemBackWithoutWaiting) {
  const TempFolder folder;
  const maquette::Context context;
  maq_densepose_config config = two_threads();
  maquette::DensePose densepose(context, config);
  maquette::Source live(context, "stub:people?live=1");
  std::optional<maquette::Frame> frame = live.next();
  maquette::DensePoseResult result = densepose.run(*frame);
  maquette::Pipeline pipeline(context);
  pipeline.set_model(maquette::DensePoseModel(context, config));
  const maquette::Scene scene = api_tiny_scene::ball_scene(context);
  maq_scene_renderer_config render_config = api_tiny_scene::renderer_config();
  render_config.model.threads = 2;
  maquette::SceneRenderer renderer(context, render_config, scene);
  renderer.run(api_tiny_scene::camera_at(0));
  maquette::Recorder recorder(context, folder.file("a.maqrec"), nullptr);
  recorder.add(*frame);

  const ChildOutcome outcome = run_in_child(
      [&](int) {
        Refusals refused;
        maq_densepose_result* made = nullptr;
        refused.expect(maq_densepose_run(densepose.get(), frame->get(), &made));
        maq_frame* next = nullptr;
        refused.expect(maq_source_acquire_frame(live.get(), MAQ_WAIT_FOREVER, &next));
        refused.expect(maq_pipeline_set_source(pipeline.get(), "stub:people"));
        maq_image* image = nullptr;
        const maq_pinhole_camera camera = api_tiny_scene::camera_at(1);
        refused.expect(maq_scene_renderer_run(renderer.get(), &camera, &image));
        maq_densepose* another = nullptr;
        refused.expect(maq_densepose_create(context.get(), nullptr, &another));
        refused.expect(maq_recorder_finish(recorder.get()));
        maq_densepose_result_release(result.get());
        maq_frame_release(frame->get());
        maq_recorder_destroy(recorder.get());
        maq_scene_renderer_destroy(renderer.get());
        maq_scene_destroy(scene.get());
        maq_pipeline_destroy(pipeline.get());
        maq_source_destroy(live.get());
        maq_densepose_destroy(densepose.get());
        maq_context_destroy(context.get());
        return refused.wrong;
      },
      kLimit_s);
  EXPECT_EQ(outcome.trouble, "");

  // The parent does not notice.
  frame = live.next();
  recorder.add(*frame);
  recorder.finish();
  EXPECT_TRUE(std::filesystem::exists(folder.file("a.maqrec")));
  densepose.run(*frame);
  renderer.run(api_tiny_scene::camera_at(0));
}

TEST(ForkedChildren, WorkWithObjectsOfTheirOwn) {
  const maquette::Context context;
  const maq_densepose_config config = two_threads();
  maquette::DensePose densepose(context, config);
  maquette::Source source(context, "stub:people");
  const maquette::Frame frame = *source.next();
  densepose.run(frame);
  const ChildOutcome outcome = run_in_child([&](int) {
    const maquette::Context own;
    maquette::DensePose model(own, config);
    maquette::Source live(own, "stub:people?live=1");
    for (int i = 0; i < 3; ++i) model.run(*live.next());
    // Its own children are refused what is its own.
    return run_in_child([&](int) {
             maq_frame* next = nullptr;
             return maq_source_acquire_frame(live.get(), 0, &next) == MAQ_ERROR_INVALID_ARGUMENT ? 0 : 1;
           }).trouble.empty()
               ? 0
               : 1;
  });
  EXPECT_EQ(outcome.trouble, "");
}

}  // namespace
