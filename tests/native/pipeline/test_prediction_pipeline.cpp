// Prediction and camera health on the pipeline's thread.
#include <gtest/gtest.h>

#include <cstddef>
#include <cstring>
#include <limits>
#include <maquette/maquette.hpp>
#include <mutex>
#include <string>
#include <vector>

#include "support/wait_until.h"

namespace {

constexpr char kWalkers[] = "stub:people?size=96x72&frames=10";
constexpr char kTinyNetworks[] = MAQ_TEST_DATA "/tiny_transformer/bundle";
constexpr int64_t kPatienceNs = 60000000000;

std::vector<uint8_t> pixels_of(const maquette::Frame& frame) {
  const maq_frame_desc desc = frame.desc();
  std::vector<uint8_t> pixels(size_t(desc.width_px) * size_t(desc.height_px) * 3);
  frame.copy_pixels(MAQ_PIXEL_BGR8, pixels.data(), 0, pixels.size());
  return pixels;
}

class PredictionPipeline : public testing::Test {
 protected:
  // A pipeline that keeps every result, none of which is dropped.
  struct Kept {
    explicit Kept(const maquette::Context& context) : pipeline(context, config()) {}
    maq_pipeline_config config() {
      maq_pipeline_config made = maquette::default_pipeline_config();
      made.result_pool_size = 32;
      made.result_user_data = this;
      made.result_callback = [](void* self, maq_pipeline_result* result) {
        auto* const kept = static_cast<Kept*>(self);
        const std::lock_guard<std::mutex> lock(kept->mutex);
        kept->results.emplace_back(result);
      };
      return made;
    }
    bool until_ended() {
      return wait_until([&] { return pipeline.info().state == MAQ_PIPELINE_ENDED; });
    }

    std::mutex mutex;
    std::vector<maquette::PipelineResult> results;
    maquette::Pipeline pipeline;  // last: its thread uses the others
  };

  maquette::Predictor predictor(maq_predictor_method method) const {
    maq_predictor_config config = maquette::default_predictor_config();
    config.method = method;
    config.model.bundle_path = kTinyNetworks;
    config.temperature = 1;
    config.model.threads = 1;
    return maquette::Predictor(context, config);
  }
  // Results equal a predictor and a check of the app.
  void expect_as_alone(maq_predictor_method method) const {
    Kept kept(context);
    {
      const maquette::Predictor lent = predictor(method);
      kept.pipeline.set_model(maquette::PredictionModel(context, lent, 0.15, true));
    }
    kept.pipeline.set_source(kWalkers);
    ASSERT_TRUE(kept.until_ended());
    ASSERT_EQ(kept.results.size(), 10u);
    maquette::Predictor own = predictor(method);
    maquette::CameraHealth own_health(context);
    for (const maquette::PipelineResult& result : kept.results) {
      own.push(result.frame);
      const auto predicted = maquette::predicted_frame_of(result);
      ASSERT_TRUE(predicted);
      EXPECT_EQ(pixels_of(*predicted), pixels_of(own.predict(0.15)));
      EXPECT_TRUE(predicted->is_predicted());
      EXPECT_EQ(predicted->origin().horizon_ns, 150000000);
      EXPECT_FALSE(result.frame.is_predicted());
      const maq_camera_health_result expected = own_health.push(result.frame);
      const auto health = maquette::camera_health_of(result);
      ASSERT_TRUE(health);
      EXPECT_EQ(health->unexplained, expected.unexplained);
      EXPECT_EQ(health->event, expected.event);
      EXPECT_EQ(health->is_stream_start, expected.is_stream_start);
      EXPECT_GT(result.run_ms, 0);
    }
    EXPECT_NE(pixels_of(*maquette::predicted_frame_of(kept.results.back())), pixels_of(kept.results.back().frame))
        << "they walk";
  }

  const maquette::Context context;
};

TEST_F(PredictionPipeline, ResultsEqualAPredictorAndACheckOfTheApp) { expect_as_alone(MAQ_PREDICTOR_MOTION); }

TEST_F(PredictionPipeline, NetworksAreSharedWithAPredictorThatIsGone) { expect_as_alone(MAQ_PREDICTOR_SAMPLED); }

TEST_F(PredictionPipeline, WithoutACheckThereIsNoResultAndAnotherSourceBeginsAnew) {
  Kept kept(context);
  kept.pipeline.set_model(maquette::PredictionModel(context, predictor(MAQ_PREDICTOR_MOTION), 0.1));
  for (size_t count : {10u, 20u}) {
    kept.pipeline.set_source(kWalkers);
    ASSERT_TRUE(wait_until([&] {
      const std::lock_guard<std::mutex> lock(kept.mutex);
      return kept.results.size() == count;
    }));
  }
  for (size_t i = 0; i < 10; ++i) {
    EXPECT_FALSE(maquette::camera_health_of(kept.results[i]));
    EXPECT_EQ(pixels_of(*maquette::predicted_frame_of(kept.results[i])),
              pixels_of(*maquette::predicted_frame_of(kept.results[10 + i])))
        << i;
  }
}

#if MAQ_HAS_DENSEPOSE
TEST_F(PredictionPipeline, ModelsTakeTurns) {
  maquette::Pipeline live(context);
  live.set_model(maquette::PredictionModel(context, predictor(MAQ_PREDICTOR_AUTO), 0.1));
  live.set_source("stub:people?size=96x72&live=1&fps=200");
  EXPECT_TRUE(maquette::predicted_frame_of(*live.next(kPatienceNs)));
  maq_densepose_config people = maquette::default_densepose_config();
  people.model.bundle_path = MAQ_TEST_DATA "/tiny_bundle";
  people.model.threads = 1;
  live.stop();
  live.set_model(maquette::DensePoseModel(context, people));
  live.set_source("stub:people?size=96x72&live=1&fps=200");
  const auto of_people = live.next(kPatienceNs);
  EXPECT_NE(maquette::densepose_of(*of_people).get(), nullptr);
  EXPECT_FALSE(maquette::predicted_frame_of(*of_people));
  EXPECT_FALSE(maquette::camera_health_of(*of_people));
  live.stop();
  live.set_model(maquette::PredictionModel(context, predictor(MAQ_PREDICTOR_LAST), 0, true));
  live.set_source("stub:people?size=96x72&live=1&fps=200&drop=0.2");
  for (int i = 0; i < 5; ++i) {
    const auto result = live.next(kPatienceNs);
    EXPECT_EQ(pixels_of(*maquette::predicted_frame_of(*result)), pixels_of(result->frame));
    EXPECT_GE(maquette::camera_health_of(*result)->unexplained, 0);
  }
}
#endif

TEST_F(PredictionPipeline, WhatCannotBePredictedFailsInASentence) {
  maquette::Pipeline live(context);
  live.set_model(maquette::PredictionModel(context, predictor(MAQ_PREDICTOR_AUTO), 0.1));
  live.set_source("image:" MAQ_TEST_MEDIA "/box_depth.png?depth_unit=0.001");
  try {
    while (live.next(kPatienceNs)) {
    }
    ADD_FAILURE() << "it did not fail";
  } catch (const maquette::Error& error) {
    EXPECT_EQ(error.status(), MAQ_ERROR_UNSUPPORTED);
    EXPECT_NE(std::strstr(error.what(), "epth"), nullptr) << error.what();
  }
  live.set_source(kWalkers);
  EXPECT_TRUE(maquette::predicted_frame_of(*live.next(kPatienceNs))) << "another source goes on";
}

TEST_F(PredictionPipeline, WrongArgumentsAreRefused) {
  const maquette::Predictor right = predictor(MAQ_PREDICTOR_AUTO);
  for (const double wrong : {-0.01, 10.01, std::numeric_limits<double>::quiet_NaN()}) {
    maq_model* model = nullptr;
    EXPECT_EQ(maq_prediction_model_create(context.get(), right.get(), wrong, 0, &model), MAQ_ERROR_INVALID_ARGUMENT);
    EXPECT_NE(std::strstr(maq_last_error(nullptr), "ahead_s is"), nullptr) << maq_last_error(nullptr);
  }
}

}  // namespace
