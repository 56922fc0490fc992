#include <gtest/gtest.h>

#include <app/edge_picture.h>

#include <cmath>

namespace {

constexpr int kWidth = 40, kHeight = 24;

// The tiny network on a depth image of this test's own.
class EdgePicture : public ::testing::Test {
 protected:
  template <class Depth>
  maquette::RgbaImage draw(maquette::EdgeLayer layer, Depth depth_m) {
    std::vector<float> metres;
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) metres.push_back(depth_m(x, y));
    }
    maq_frame_desc desc;
    maquette::check(maq_frame_desc_init(&desc, sizeof desc));
    desc.format = MAQ_PIXEL_DEPTH32F;
    desc.width_px = kWidth;
    desc.height_px = kHeight;
    desc.planes[0] = reinterpret_cast<const uint8_t*>(metres.data());
    maq_intrinsics& camera = desc.intrinsics;
    camera.width_px = kWidth, camera.height_px = kHeight;
    camera.fx_px = camera.fy_px = 40;
    camera.cx_px = (kWidth - 1) / 2.0, camera.cy_px = (kHeight - 1) / 2.0;
    result_.emplace(edges_.run(maquette::Frame(context_, desc)));
    maquette::RgbaImage picture;
    maquette::draw_edge_layer(*result_, layer, &picture);
    EXPECT_EQ(picture.width_px, kWidth);
    EXPECT_EQ(picture.height_px, kHeight);
    return picture;
  }
  static const uint8_t* pixel(const maquette::RgbaImage& picture, int x, int y) {
    return picture.rgba.data() + 4 * (size_t(y) * kWidth + size_t(x));
  }

  maquette::Context context_;
  maquette::Edges edges_{context_, MAQ_TEST_DATA "/tiny_edges/bundle"};
  std::optional<maquette::EdgesResult> result_;
};

TEST_F(EdgePicture, NearIsRedFarIsBlueAndUnknownIsBlack) {
  const auto picture = draw(maquette::EdgeLayer::kDepth, [](int x, int) {
    return x < 13 ? 1.0f : x < 26 ? 3.0f : 0.0f;
  });
  const uint8_t *const near = pixel(picture, 5, 12), *const far = pixel(picture, 20, 12);
  EXPECT_GT(near[0], near[2] + 50);
  EXPECT_GT(far[2], far[0]);
  for (int k = 0; k < 3; ++k) EXPECT_EQ(pixel(picture, 33, 12)[k], 0);
  EXPECT_EQ(near[3], 255);
}

TEST_F(EdgePicture, AFewFaultsOfTheSensorTakeNoColourFromTheRest) {
  const auto depth_m = [](int x, int) { return 1 + 0.01f * float(x); };
  const auto faulty = [&](int x, int y) { return y == 0 && x < 3 ? 0.05f : depth_m(x, y); };
  const auto clean = draw(maquette::EdgeLayer::kDepth, depth_m), with = draw(maquette::EdgeLayer::kDepth, faulty);
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(pixel(clean, 20, 12)[k], pixel(with, 20, 12)[k], 12);
}

TEST_F(EdgePicture, ThePlainLayerIsGreyAndBrightestTowardsTheLight) {
  const auto leaning = [](float slope) { return [slope](int x, int) { return 2 + slope * float(x) / kWidth; }; };
  const auto lit = draw(maquette::EdgeLayer::kPlain, leaning(-0.5f));
  const auto flat = draw(maquette::EdgeLayer::kPlain, leaning(0));
  const auto dark = draw(maquette::EdgeLayer::kPlain, leaning(0.8f));
  const auto grey = [](const maquette::RgbaImage& picture) {
    const uint8_t* const at = pixel(picture, 10, 10);
    EXPECT_EQ(at[0], at[1]);
    EXPECT_EQ(at[0], at[2]);
    return int(at[0]);
  };
  EXPECT_GT(grey(lit), grey(flat));
  EXPECT_GT(grey(flat), grey(dark));
}

TEST_F(EdgePicture, TheDistanceIsRedAtAnEdgeAndDarkBlueFarFromIt) {
  const auto picture = draw(maquette::EdgeLayer::kDistance, [](int x, int) { return x < 20 ? 1.0f : 1.4f; });
  const float* const distance_r = result_->distance_r();
  size_t nearest = 0;
  for (size_t i = 0; i < size_t(kWidth) * kHeight; ++i) {
    const uint8_t* const at = picture.rgba.data() + 4 * i;
    if (distance_r[i] < distance_r[nearest]) nearest = i;
    if (distance_r[i] == result_->field().eps_r) {
      EXPECT_LT(at[0], 60);
      EXPECT_LT(at[1], 60);
    }
  }
  ASSERT_LT(distance_r[nearest], 12) << "the tiny network finds something";
  EXPECT_GT(picture.rgba[4 * nearest] + picture.rgba[4 * nearest + 1], 150);
}

TEST_F(EdgePicture, CurvesAreConvexConcaveOrBoundaries) {
  const auto group = [](maq_edges_kind kind, maq_edges_convexity convexity) {
    maq_edges_curve curve{};
    curve.kind = kind;
    curve.convexity = convexity;
    return maquette::group_of(curve);
  };
  EXPECT_EQ(group(MAQ_EDGES_KIND_CREASE, MAQ_EDGES_CONVEXITY_CONVEX), maquette::EdgeGroup::kConvex);
  EXPECT_EQ(group(MAQ_EDGES_KIND_CREASE, MAQ_EDGES_CONVEXITY_UNKNOWN), maquette::EdgeGroup::kConvex);
  EXPECT_EQ(group(MAQ_EDGES_KIND_CREASE, MAQ_EDGES_CONVEXITY_CONCAVE), maquette::EdgeGroup::kConcave);
  EXPECT_EQ(group(MAQ_EDGES_KIND_BOUNDARY, MAQ_EDGES_CONVEXITY_UNKNOWN), maquette::EdgeGroup::kBoundary);
}

TEST_F(EdgePicture, ABoxHasItsTwelveEdgesAndEachLengthAtTheNearest) {
  maq_edges_box box{};
  const double sides[] = {0.5, 0.4, 0.3}, centre[] = {0.1, 0.2, 2};
  for (size_t k = 0; k < 3; ++k) {
    box.size_m[k] = sides[k];
    box.centre_m[k] = centre[k];
    box.axes[k][k] = 1;
  }
  const maquette::BoxLines lines = maquette::lines_of(box);
  for (size_t i = 0; i < lines.edges.size(); ++i) {
    const auto& [a, b] = lines.edges[i];
    EXPECT_NEAR(std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]), sides[i / 4], 1e-12) << i;
    for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(std::abs(a[k] - centre[k]), sides[k] / 2, 1e-12) << "at a corner";
    for (size_t j = 0; j < i; ++j) EXPECT_NE(lines.edges[i], lines.edges[j]);
  }
  EXPECT_NEAR(lines.labels[0][2], 1.85, 1e-12);
  EXPECT_NEAR(lines.labels[1][2], 1.85, 1e-12);
  EXPECT_NEAR(lines.labels[2][2], 2, 1e-12);
  EXPECT_NEAR(lines.labels[0][0], 0.1, 1e-12) << "in the middle of the edge";
}

}  // namespace
