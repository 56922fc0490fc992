#include <gtest/gtest.h>

#include <app/live_edges.h>

#include <mutex>

#include "support/wait_until.h"

namespace {

struct SeenEdges {
  int64_t network_pixels = 0;
  bool has_curves = false;
  size_t curves = 0, boxes = 0;
};

// Collects the pipeline's output.
class EdgesRun {
 public:
  explicit EdgesRun(const maquette::LiveEdgesOptions& model = shipped(), uint64_t max_results = 0)
      : live(
            context, model, [this](const maquette::PipelineResult& result, double) { keep(result); }, nullptr,
            options(max_results)) {}

  static maquette::LiveEdgesOptions shipped() {
    maquette::LiveEdgesOptions model;
    model.edges.model.bundle_path = MAQ_TEST_MODELS "/edges-int8";
    return model;
  }
  std::vector<SeenEdges> seen() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return seen_;
  }
  bool until_ended() {
    return wait_until([&] { return live.status().has_ended; });
  }

  maquette::Context context;

 private:
  static maquette::LiveOptions options(uint64_t max_results) {
    maquette::LiveOptions options;
    options.real_time = false;
    options.max_results = max_results;
    options.reconnect_ms = 300;
    return options;
  }
  void keep(const maquette::PipelineResult& result) {
    std::lock_guard<std::mutex> lock(mutex_);
    SeenEdges seen;
    seen.network_pixels = maquette::edges_of(result)->stats().network_pixel_count;
    const auto curves = maquette::curves_of(result);
    seen.has_curves = curves.has_value();
    if (seen.has_curves) seen.curves = curves->curves().size(), seen.boxes = curves->boxes().size();
    seen_.push_back(seen);
  }

  mutable std::mutex mutex_;
  std::vector<SeenEdges> seen_;

 public:
  maquette::LiveEdges live;  // last: it uses the others
};

const std::string kCarton = "image:" MAQ_TEST_MEDIA "/box_depth.png?depth_unit=0.001&fx=600";

TEST(LiveEdges, FindsCurvesInEveryFrame) {
  EdgesRun edges;
  edges.live.open("stub:solids?scene=box&frames=3");
  ASSERT_TRUE(edges.until_ended());
  EXPECT_EQ(edges.live.status().problem, "");
  ASSERT_EQ(edges.seen().size(), 3u);
  for (const SeenEdges& seen : edges.seen()) EXPECT_GT(seen.curves, 3u);
}

TEST(LiveEdges, ADepthImageIsLookedAtAgainWithWhatIsSwitchedOnAndOff) {
  EdgesRun edges;
  edges.live.open(kCarton);
  ASSERT_TRUE(edges.until_ended());
  ASSERT_EQ(edges.seen().size(), 1u);
  EXPECT_GT(edges.seen()[0].curves, 3u);
  EXPECT_EQ(edges.seen()[0].boxes, 1u);
  maquette::LiveEdgesOptions model = EdgesRun::shipped();
  model.finds_boxes = false;
  edges.live.set_model(model);
  ASSERT_TRUE(wait_until([&] { return edges.seen().size() == 2; }));
  EXPECT_GT(edges.seen()[1].curves, 3u);
  EXPECT_EQ(edges.seen()[1].boxes, 0u);
  model.finds_curves = false;
  edges.live.set_model(model);
  ASSERT_TRUE(wait_until([&] { return edges.seen().size() == 3; }));
  EXPECT_FALSE(edges.seen()[2].has_curves);
}

TEST(LiveEdges, StartsWithWhatItWasTold) {
  maquette::LiveEdgesOptions model = EdgesRun::shipped();
  model.finds_curves = false;
  model.edges.skip_planes = 1;
  EdgesRun edges(model);
  edges.live.open("stub:solids?scene=wall&frames=1");
  ASSERT_TRUE(edges.until_ended());
  ASSERT_EQ(edges.seen().size(), 1u);
  EXPECT_FALSE(edges.seen()[0].has_curves);
  EXPECT_EQ(edges.seen()[0].network_pixels, 0) << "a wall is a plane";
}

TEST(LiveEdges, ASourceWithoutDepthIsSaidInASentence) {
  EdgesRun edges;
  const auto failure_of = [&](const std::string& uri) {
    edges.live.open(uri);
    EXPECT_TRUE(wait_until([&] {
      const maquette::LiveStatus status = edges.live.status();
      return status.uri == uri && status.has_failed;
    }));
    return edges.live.status().problem;
  };
  const std::string photo = failure_of("image:" MAQ_TEST_MEDIA "/photo.jpg");
  EXPECT_NE(photo.find("without depth"), std::string::npos) << photo;
  EXPECT_EQ(photo.back(), '.');
  const std::string unknown = failure_of("image:" MAQ_TEST_MEDIA "/box_depth.png?depth_unit=0.001");
  EXPECT_NE(unknown.find("fov=60"), std::string::npos) << unknown;
  // A depth camera goes on from there.
  edges.live.open("stub:solids?frames=1");
  ASSERT_TRUE(wait_until([&] { return edges.seen().size() == 1; }));
  EXPECT_EQ(edges.live.status().problem, "");
}

TEST(LiveEdges, ADepthCameraThatStaysAwayEndsInASentence) {
  EdgesRun edges;
  edges.live.open("stub:solids?fps=10&size=160x120&unplug@10");
  ASSERT_TRUE(edges.until_ended());
  EXPECT_TRUE(edges.live.status().has_failed);
  EXPECT_FALSE(edges.live.status().problem.empty());
  EXPECT_GT(edges.seen().size(), 0u);
}

TEST(LiveEdges, WithoutADepthCameraSolidsPlay) {
  EdgesRun edges(EdgesRun::shipped(), 2);
  edges.live.open("image:/none.png?depth_unit=1&fov=60", "stub:solids");
  ASSERT_TRUE(edges.until_ended());
  EXPECT_EQ(edges.live.status().uri, "stub:solids");
  EXPECT_NE(edges.live.status().problem.find("/none.png"), std::string::npos);
  EXPECT_EQ(edges.seen().size(), 2u);
}

}  // namespace
