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
  config.model.bundle_path = bundle;
  config.model.threads = 1;
  return config;
}

class EdgesPipeline : public testing::Test {
 protected:
  maquette::Pipeline pipeline(bool with_curves, maq_pipeline_result_callback callback = nullptr, void* self = nullptr) {
    maq_pipeline_config config = maquette::default_pipeline_config();
    config.result_callback = callback;
    config.result_user_data = self;
    maquette::Pipeline made(context, config);
    made.set_model(model(edges_config(), with_curves));
    return made;
  }
  maquette::EdgesModel model(const maq_edges_config& edges, bool with_curves = false) {
    const maq_edges_curves_config curves = maquette::default_edges_curves_config();
    return maquette::EdgesModel(context, edges, with_curves ? &curves : nullptr);
  }
  // The pipeline's problem text when it fails.
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
  int count = 0;
  while (const auto result = live.next(kLongEnoughNs)) {
    ++count;
    const auto found_edges = maquette::edges_of(*result);
    const auto found_curves = maquette::curves_of(*result);
    ASSERT_TRUE(found_edges);
    ASSERT_TRUE(found_curves);
    const maquette::EdgesResult expected = edges.run(result->frame);
    ASSERT_EQ(found_edges->width_px(), 96);
    EXPECT_EQ(std::memcmp(found_edges->distance_r(), expected.distance_r(), 96 * 72 * sizeof(float)), 0);
    const std::vector<maq_edges_curve> found = found_curves->curves(), wanted = expected.find_curves().curves();
    ASSERT_EQ(found.size(), wanted.size());
    for (size_t i = 0; i < found.size(); ++i) EXPECT_EQ(found[i].length_m, wanted[i].length_m);
    EXPECT_EQ(found_edges->find_curves().curves().size(), wanted.size()) << "the result is as any other";
    EXPECT_GE(result->run_ms, double(found_edges->stats().total_ms));
  }
  EXPECT_GT(count, 0);
}

TEST_F(EdgesPipeline, CurvesAreFoundOnlyWhereTheyAreAskedFor) {
  maquette::Pipeline live = pipeline(false);
  live.set_source(kStub);
  const auto result = live.next(kLongEnoughNs);
  ASSERT_TRUE(result);
  EXPECT_TRUE(maquette::edges_of(*result));
  EXPECT_FALSE(maquette::curves_of(*result));
}

TEST_F(EdgesPipeline, ACallbackGetsEachFrameAndMayKeepSome) {
  struct Kept {
    std::vector<maquette::PipelineResult> results;
    std::atomic<int> count{0};
  } kept;
  {
    maquette::Pipeline live = pipeline(
        true,
        [](void* self, maq_pipeline_result* result) {
          maquette::PipelineResult taken(result);
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
    EXPECT_GT(maquette::edges_of(one)->depth_m()[0], 0);
    const auto curves = maquette::curves_of(one);
    for (const maq_edges_curve& curve : curves->curves()) EXPECT_GT(curve.length_m, 0);
  }
}

TEST_F(EdgesPipeline, ASourceWithoutDepthOrCalibrationFailsWithItsSentence) {
  maquette::Pipeline live = pipeline(true);
  live.set_source("stub:pattern?size=64x48");
  EXPECT_NE(failure(live, MAQ_ERROR_UNSUPPORTED).find("without depth"), std::string::npos);
  live.set_source("image:" MAQ_TEST_MEDIA "/box_depth.png?depth_unit=0.001");
  EXPECT_NE(failure(live, MAQ_ERROR_UNSUPPORTED).find("does not carry the intrinsics"), std::string::npos);
  live.set_source("image:" MAQ_TEST_MEDIA "/photo.jpg?fov=60");
  EXPECT_NE(failure(live, MAQ_ERROR_UNSUPPORTED).find("without depth"), std::string::npos);
  live.set_source(kStub);
  EXPECT_TRUE(maquette::edges_of(*live.next(kLongEnoughNs))) << "another source goes on";
}

#if MAQ_HAS_DENSEPOSE
#endif

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
  edges.model.threads = MAQ_THREADS_MEASURED;
  maquette::Pipeline live(logged);
  live.set_model(maquette::EdgesModel(logged, edges));
  live.set_source(kStub);
  const auto result = live.next(kLongEnoughNs);
  ASSERT_TRUE(result && maquette::edges_of(*result));
  const maq_edges_stats stats = maquette::edges_of(*result)->stats();
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
  curves.min_length_px = -1;
  maq_model* made = nullptr;
  EXPECT_EQ(maq_edges_model_create(context.get(), &edges, &curves, &made), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(made, nullptr);
  EXPECT_NE(std::strstr(maq_last_error(nullptr), "min_length_px is -1"), nullptr) << maq_last_error(nullptr);
}

}  // namespace
