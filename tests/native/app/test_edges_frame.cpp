#include <gtest/gtest.h>

#include <app/edges_frame.h>

namespace {

// A rendered carton through the shipped network.
class EdgesFrame : public ::testing::Test {
 protected:
  maquette::PipelineResult found(const char* uri, bool finds_curves) {
    maq_edges_config edges = maquette::default_edges_config();
    edges.model.bundle_path = MAQ_TEST_MODELS "/edges-int8";
    const maq_edges_curves_config curves = maquette::default_edges_curves_config();
    maquette::Pipeline pipeline(context_);
    pipeline.set_model(maquette::EdgesModel(context_, edges, finds_curves ? &curves : nullptr));
    pipeline.set_source(uri);
    return std::move(*pipeline.next());
  }
  maquette::EdgesFrame frame(bool finds_curves, maquette::EdgeLayer layer = maquette::EdgeLayer::kDepth) {
    maquette::EdgesFrame made;
    made.take(found("stub:solids?scene=box&seed=1&size=640x480&frames=1", finds_curves), 12.5, layer);
    return made;
  }

  maquette::Context context_;
};

TEST_F(EdgesFrame, HasThePictureOfItsLayerAndWhatWasFound) {
  const maquette::EdgesFrame made = frame(true, maquette::EdgeLayer::kPlain);
  maquette::RgbaImage wanted;
  maquette::draw_edge_layer(*made.result, maquette::EdgeLayer::kPlain, &wanted);
  EXPECT_EQ(made.picture.rgba, wanted.rgba);
  EXPECT_EQ(made.layer, maquette::EdgeLayer::kPlain);
  EXPECT_EQ(made.picture.width_px, 640);
  EXPECT_EQ(made.curves.size(), made.found->curves().size());
  EXPECT_GT(made.curves.size(), 3u);
  EXPECT_GT(made.corners.size(), 0u);
  EXPECT_EQ(made.number, 1u);
  EXPECT_EQ(made.results_per_second, 12.5);
  EXPECT_EQ(made.stats.network_pixel_count, 640 * 480);
  EXPECT_GT(made.curves_stats.curves_ms, 0);
}

TEST_F(EdgesFrame, ThePointerIsAtTheCornerTheCurveOrTheNothingThatIsThere) {
  const maquette::EdgesFrame made = frame(true);
  const maq_intrinsics& camera = made.result->field().intrinsics;
  const maq_edges_corner& corner = made.corners[0];
  const maquette::Pixel at = maquette::pixel_of(camera, corner.point_m);
  const maquette::EdgesPick pick = made.pick(at[0] + 1, at[1], 6);
  EXPECT_EQ(pick.snap.target, MAQ_EDGES_SNAP_CORNER);
  EXPECT_EQ(pick.snap.index, 0);
  ASSERT_GE(pick.curve, 0) << "a curve ends there";
  EXPECT_LE(pick.curve_away_px, 3);

  for (size_t i = 0; i < made.curves.size(); ++i) {
    if (made.curves[i].type != MAQ_EDGES_CURVE_LINE || made.curves[i].length_m < 0.2) continue;
    const double* const ends = made.curves[i].points_m;
    const double middle[] = {(ends[0] + ends[3]) / 2, (ends[1] + ends[4]) / 2, (ends[2] + ends[5]) / 2};
    const maquette::Pixel seen = maquette::pixel_of(camera, middle);
    const maquette::EdgesPick of_line = made.pick(seen[0], seen[1], 2);
    EXPECT_EQ(of_line.curve, int(i));
    EXPECT_EQ(of_line.snap.target, MAQ_EDGES_SNAP_CURVE);
    EXPECT_EQ(of_line.snap.index, int(i));
    EXPECT_LT(of_line.curve_away_px, 0.1);
  }
  const maquette::EdgesPick outside = made.pick(-500, -500, 8);
  EXPECT_EQ(outside.curve, -1);
  EXPECT_EQ(outside.snap.target, MAQ_EDGES_SNAP_NOTHING);
}

TEST_F(EdgesFrame, WithoutCurvesThereIsNothingAtThePointer) {
  maquette::EdgesFrame made = frame(false);
  EXPECT_EQ(made.found, nullptr);
  EXPECT_TRUE(made.curves.empty() && made.corners.empty() && made.boxes.empty());
  EXPECT_EQ(made.pick(320, 240, 1000).curve, -1);
  EXPECT_EQ(made.pick(320, 240, 1000).snap.target, MAQ_EDGES_SNAP_NOTHING);
  EXPECT_FALSE(made.picture.empty());
}

TEST_F(EdgesFrame, NothingOfAnEarlierFrameIsKept) {
  maquette::EdgesFrame made = frame(true);
  ASSERT_FALSE(made.curves.empty());
  made.take(found("stub:solids?scene=wall&size=160x120&frames=1", false), 1, maquette::EdgeLayer::kDepth);
  EXPECT_TRUE(made.curves.empty() && made.corners.empty() && made.boxes.empty());
  EXPECT_EQ(made.found, nullptr);
  EXPECT_EQ(made.picture.width_px, 160);
}

}  // namespace
