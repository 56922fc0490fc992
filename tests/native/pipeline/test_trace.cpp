// Sections in Android's traces, with its library in memory: each stage of a frame, and nothing while none is recorded.
#include <gtest/gtest.h>

#include <maquette/maquette.hpp>
#include <string>

#include "support/fakes/fake_trace.h"

namespace {

// Each frame once, as there is time for all.
void run_frames(const maquette::Context& context, maq_densepose_crops crops, int key_frame_interval) {
  maq_densepose_config config;
  maq_densepose_config_init(&config, sizeof config);
  config.model.bundle_path = MAQ_TEST_MODELS "/densepose-b-int8";
  config.long_side_px = 256;
  config.person_crops = crops;
  config.key_frame_interval = key_frame_interval;
  maquette::DensePose densepose(context, config);
  maquette::Source source(context, "stub:people?size=256x192&frames=2");
  while (const auto frame = source.next()) densepose.run(*frame);
}

constexpr char kFrame[] = "maquette resize\nmaquette detector\nmaquette boxes\nmaquette dense head\n";

TEST(Trace, EachStageOfAFrameIsASection) {
  const maquette::Context context;
  fake_trace_record(true);
  fake_trace_sections();
  run_frames(context, MAQ_DENSEPOSE_CROPS_OFF, 1);
  const std::string one = std::string(kFrame) + "maquette decode\nmaquette ids\n";
  EXPECT_EQ(fake_trace_sections(), one + one);
  run_frames(context, MAQ_DENSEPOSE_CROPS_ALL, 2);
  EXPECT_EQ(fake_trace_sections(),
            std::string(kFrame) +
                "maquette crops\nmaquette decode\nmaquette ids\nmaquette crops\nmaquette decode\nmaquette ids\n");
  fake_trace_record(false);
}

TEST(Trace, APipelineAlsoWaitsForFrames) {
  const maquette::Context context;
  fake_trace_record(true);
  fake_trace_sections();
  maq_densepose_config densepose;
  maq_densepose_config_init(&densepose, sizeof densepose);
  densepose.model.bundle_path = MAQ_TEST_MODELS "/densepose-b-int8";
  densepose.long_side_px = 256;
  {
    maquette::Pipeline pipeline(context);
    pipeline.set_model(maquette::DensePoseModel(context, densepose));
    pipeline.set_source("stub:people?size=256x192&frames=1");
    while (pipeline.next()) {
    }
  }
  const std::string one = std::string("maquette acquire\n") + kFrame + "maquette decode\nmaquette ids\n";
  EXPECT_EQ(fake_trace_sections(), one + "maquette acquire\n");
  fake_trace_record(false);
}

TEST(Trace, WithoutARecordingNothingIsWritten) {
  const maquette::Context context;
  fake_trace_record(false);
  fake_trace_sections();
  run_frames(context, MAQ_DENSEPOSE_CROPS_OFF, 1);
  EXPECT_EQ(fake_trace_sections(), "");
}

}  // namespace
