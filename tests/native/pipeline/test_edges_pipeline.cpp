// Edges of a depth camera on the pipeline's thread.
#include <gtest/gtest.h>

#include <atomic>
#include <cstddef>
#include <cstring>
#include <maquette/maquette.hpp>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace {

constexpr char kTinyEdges[] = MAQ_TEST_DATA "/tiny_edges/bundle";
constexpr char kStub[] = "stub:solids?scene=box&size=96x72&frames=20";
constexpr int64_t kLongEnoughNs = 60000000000;

maq_edges_config edges_config(const char* bundle = kTinyEdges) {
  maq_edges_config config = maquette::default_edges_config();
  config.bundle_path = bundle;
  config.threads = 1;
  config.allow_spinning = 0;
  return config;
}

class EdgesPipeline : public testing::Test {
 protected:
  maquette::Pipeline pipeline(bool with_curves, maq_pipeline_result_callback callback = nullptr, void* self = nullptr) {
    const maq_edges_config edges = edges_config();
    const maq_edges_curves_config curves = maquette::default_edges_curves_config();
    maq_pipeline_config config = maquette::default_pipeline_config();
    config.edges = &edges;
    config.curves = with_curves ? &curves : nullptr;
    config.result_callback = callback;
    config.result_user_data = self;
    return maquette::Pipeline(context, config);
  }
  // What it says when it cannot go on.
  static std::string failure(maquette::Pipeline& pipeline, maq_status status) {
    try {
      while (pipeline.next(kLongEnoughNs)) {
      }
    } catch (const maquette::Error& error) {
      EXPECT_EQ(error.status(), status);
      EXPECT_EQ(pipeline.info().state, MAQ_PIPELINE_FAILED);
      return error.what();
    }
    ADD_FAILURE() << "it did not fail";
    return {};
  }

  const maquette::Context context;
};

TEST_F(EdgesPipeline, GivesWhatARunOfTheFrameGives) {
  maquette::Pipeline live = pipeline(true);
  live.set_source(kStub);
  maquette::Edges edges(context, edges_config());
  maquette::Source source(context, kStub);
  int count = 0;
  while (const auto result = live.next(kLongEnoughNs)) {
    ++count;
    ASSERT_TRUE(result->edges);
    ASSERT_TRUE(result->curves);
    EXPECT_EQ(result->densepose.get(), nullptr);
    const maquette::EdgesResult expected = edges.run(result->frame, *source.intrinsics());
    ASSERT_EQ(result->edges->width_px(), 96);
    EXPECT_EQ(std::memcmp(result->edges->distance_r(), expected.distance_r(), 96 * 72 * sizeof(float)), 0);
    const std::vector<maq_edges_curve> found = result->curves->curves(), wanted = expected.find_curves().curves();
    ASSERT_EQ(found.size(), wanted.size());
    for (size_t i = 0; i < found.size(); ++i) EXPECT_EQ(found[i].length_m, wanted[i].length_m);
    EXPECT_EQ(result->edges->find_curves().curves().size(), wanted.size()) << "the result is as any other";
    EXPECT_GE(result->run_ms, double(result->edges->stats().total_ms));
  }
  EXPECT_GT(count, 0);
  EXPECT_EQ(live.stats().key_frame_interval, 0);
  EXPECT_FALSE(live.surface());
}

TEST_F(EdgesPipeline, CurvesAreFoundOnlyWhereTheyAreAskedFor) {
  maquette::Pipeline live = pipeline(false);
  live.set_source(kStub);
  const auto result = live.next(kLongEnoughNs);
  ASSERT_TRUE(result);
  EXPECT_TRUE(result->edges);
  EXPECT_FALSE(result->curves);
}

TEST_F(EdgesPipeline, ACallbackGetsEachFrameAndMayKeepSome) {
  struct Kept {
    std::vector<maquette::PipelineResult> results;
    std::atomic<int> count{0};
  } kept;
  {
    maquette::Pipeline live = pipeline(
        true,
        [](void* self, const maq_pipeline_result* result) {
          maquette::PipelineResult taken(*result);
          auto* const all = static_cast<Kept*>(self);
          if (++all->count % 8 == 0) all->results.push_back(std::move(taken));
        },
        &kept);
    live.set_source(kStub);
    while (live.info().state != MAQ_PIPELINE_ENDED) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  EXPECT_EQ(kept.count, 20);
  ASSERT_EQ(kept.results.size(), 2u) << "they outlive the pipeline";
  for (const maquette::PipelineResult& one : kept.results) {
    EXPECT_GT(one.edges->depth_m()[0], 0);
    for (const maq_edges_curve& curve : one.curves->curves()) EXPECT_GT(curve.length_m, 0);
  }
}

TEST_F(EdgesPipeline, ASourceWithoutDepthOrCalibrationFailsWithItsSentence) {
  maquette::Pipeline live = pipeline(true);
  live.set_source("stub:pattern?size=64x48");
  EXPECT_NE(failure(live, MAQ_ERROR_UNSUPPORTED).find("without depth"), std::string::npos);
  live.set_source("image:" MAQ_TEST_MEDIA "/box_depth.png?depth_unit=0.001");
  EXPECT_NE(failure(live, MAQ_ERROR_UNSUPPORTED).find("does not say how its camera"), std::string::npos);
  live.set_source("image:" MAQ_TEST_MEDIA "/photo.jpg?fov=60");
  EXPECT_NE(failure(live, MAQ_ERROR_UNSUPPORTED).find("without depth"), std::string::npos);
  live.set_source(kStub);
  EXPECT_TRUE(live.next(kLongEnoughNs)->edges) << "another source goes on";
}

TEST_F(EdgesPipeline, ModelsTakeTurns) {
  maquette::Pipeline live = pipeline(true);
  live.set_source("stub:solids?scene=box&size=96x72&live=1&fps=200");
  EXPECT_TRUE(live.next(kLongEnoughNs)->curves);
  maq_densepose_config people = maquette::default_densepose_config();
  people.model.bundle_path = MAQ_TEST_DATA "/tiny_bundle";
  people.model.threads = 1;
  live.stop();
  live.set_densepose(people);
  live.set_source("stub:pattern?size=96x72&live=1&fps=200");
  EXPECT_NE(live.next(kLongEnoughNs)->densepose.get(), nullptr);
  EXPECT_EQ(live.stats().key_frame_interval, 1);
  live.stop();
  live.set_edges(edges_config());
  live.set_source("stub:solids?scene=box&size=96x72&live=1&fps=200");
  const auto result = live.next(kLongEnoughNs);
  EXPECT_TRUE(result->edges);
  EXPECT_FALSE(result->curves);
}

TEST_F(EdgesPipeline, ThreadsThatWereMeasuredAreInTheLogAndTheStats) {
  struct Lines {
    std::mutex mutex;
    std::string text;
  } lines;
  maq_context_config of_context;
  ASSERT_EQ(maq_context_config_init(&of_context, sizeof of_context), MAQ_OK);
  of_context.log_level = MAQ_LOG_INFO;
  of_context.log_user_data = &lines;
  of_context.log_callback = [](void* to, maq_log_level, const char* text) {
    Lines& all = *static_cast<Lines*>(to);
    const std::lock_guard<std::mutex> lock(all.mutex);
    all.text += std::string(text) + "\n";
  };
  const maquette::Context logged(of_context);
  maq_edges_config edges = edges_config();
  edges.threads = MAQ_THREADS_MEASURED;
  maq_pipeline_config config = maquette::default_pipeline_config();
  config.edges = &edges;
  maquette::Pipeline live(logged, config);
  live.set_source(kStub);
  const auto result = live.next(kLongEnoughNs);
  ASSERT_TRUE(result && result->edges);
  const maq_edges_stats stats = result->edges->stats();
  EXPECT_GE(stats.threads, 1);
  EXPECT_LE(stats.threads, 4);
  EXPECT_EQ(stats.is_threads_measured, 1);
  const std::lock_guard<std::mutex> lock(lines.mutex);
  EXPECT_NE(lines.text.find("loaded, " + std::to_string(stats.threads) + " thread(s)"), std::string::npos)
      << lines.text;
}

TEST_F(EdgesPipeline, WrongArgumentsAreRefused) {
  const maq_edges_config edges = edges_config();
  maq_edges_curves_config curves = maquette::default_edges_curves_config();
  const maq_densepose_config densepose = maquette::default_densepose_config();
  const auto refused = [&](const maq_pipeline_config& config, const char* text) {
    maq_pipeline* made = nullptr;
    EXPECT_EQ(maq_pipeline_create(context.get(), &config, &made), MAQ_ERROR_INVALID_ARGUMENT);
    EXPECT_EQ(made, nullptr);
    EXPECT_NE(std::strstr(maq_last_error(nullptr), text), nullptr) << maq_last_error(nullptr);
  };
  maq_pipeline_config config = maquette::default_pipeline_config();
  config.edges = &edges;
  config.densepose = &densepose;
  refused(config, "config.densepose and config.edges");
  config.edges = nullptr;
  config.curves = &curves;
  refused(config, "config.curves is given without config.edges");
  config.densepose = nullptr;
  config.edges = &edges;
  curves.gap_r = -1;
  refused(config, "gap_r is -1");
  maq_edges_config wrong = edges;
  wrong.threads = 99;
  config.edges = &wrong;
  config.curves = nullptr;
  refused(config, "config.edges.threads is 99");
  maquette::Pipeline live = pipeline(false);
  EXPECT_EQ(maq_pipeline_set_edges(nullptr, &edges, nullptr), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(maq_pipeline_set_edges(live.get(), &wrong, nullptr), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(maq_pipeline_set_edges(live.get(), &edges, &curves), MAQ_ERROR_INVALID_ARGUMENT);
}

TEST_F(EdgesPipeline, ABundleOfAnotherTaskFailsAndTheRightOneGoesOn) {
  maquette::Pipeline live = pipeline(true);
  live.set_edges(edges_config(MAQ_TEST_DATA "/tiny_bundle"));
  live.set_source(kStub);
  EXPECT_NE(failure(live, MAQ_ERROR_UNSUPPORTED).find("densepose"), std::string::npos);
  live.set_edges(edges_config());
  EXPECT_TRUE(live.next(kLongEnoughNs)->edges);
}

TEST_F(EdgesPipeline, BearsCallsFromManyThreads) {
  maquette::Pipeline live = pipeline(true);
  live.set_source("stub:solids?scene=box&size=96x72&live=1&fps=500");
  std::atomic<bool> is_over{false};
  std::vector<std::thread> threads;
  for (int i = 0; i < 2; ++i) {
    threads.emplace_back([&] {
      while (!is_over) {
        try {
          const auto result = live.next(20000000);
          if (result && result->curves) result->curves->snap_to_pixel(40, 30, 20);
        } catch (const maquette::Error&) {  // in time, or while the model is loaded
        }
      }
    });
  }
  const maq_edges_curves_config curves = maquette::default_edges_curves_config();
  for (int i = 0; i < 6; ++i) {
    live.set_edges(edges_config(), i % 2 == 0 ? &curves : nullptr);
    live.stats();
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  is_over = true;
  for (std::thread& thread : threads) thread.join();
}

}  // namespace
