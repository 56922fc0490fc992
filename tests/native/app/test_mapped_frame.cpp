#include <gtest/gtest.h>

#include <app/mapped_frame.h>

#include <numeric>

namespace {

constexpr size_t kCells = maquette::MappedFrame::kSeenCells;

// The photo of the tests through the tiny networks.
class MappedFrame : public ::testing::Test {
 protected:
  maquette::PipelineResult mapped() {
    maq_densepose_config densepose = maquette::default_densepose_config();
    densepose.model.bundle_path = MAQ_TEST_DATA "/tiny_bundle";
    maquette::Pipeline pipeline(context_);
    pipeline.set_model(maquette::DensePoseModel(context_, densepose));
    pipeline.set_source("image:" MAQ_TEST_MEDIA "/photo.jpg");
    return std::move(*pipeline.next());
  }

  maquette::Context context_;
  std::vector<uint8_t> seen_;
};

TEST_F(MappedFrame, HasTheFrameAndItsPlanesPixelByPixel) {
  maquette::PipelineResult from = mapped();
  const maquette::DensePoseResult densepose = maquette::densepose_of(from);
  maquette::RgbaImage camera;
  camera.copy_from(from.frame);
  const size_t pixels = camera.rgba.size() / 4;
  std::vector<uint8_t> wanted(pixels * 4);
  const maq_densepose_plane planes[] = {MAQ_DENSEPOSE_PLANE_PART, MAQ_DENSEPOSE_PLANE_U, MAQ_DENSEPOSE_PLANE_V,
                                        MAQ_DENSEPOSE_PLANE_PERSON};
  for (size_t channel = 0; channel < 4; ++channel) {
    size_t stride_bytes = 0;
    const uint8_t* const rows = densepose.plane(planes[channel], &stride_bytes);
    for (size_t i = 0; i < pixels; ++i) {
      const size_t x = i % size_t(camera.width_px), y = i / size_t(camera.width_px);
      wanted[4 * i + channel] = rows[y * stride_bytes + x];
    }
  }
  const uint32_t people = densepose.person_count();
  ASSERT_GT(people, 0u);
  const uint64_t number = from.number;

  maquette::MappedFrame frame;
  EXPECT_EQ(frame.number, 0u);
  frame.copy_from(std::move(from), 12.5, &seen_);
  EXPECT_EQ(frame.camera.rgba, camera.rgba);
  EXPECT_EQ(frame.iuv, wanted);
  EXPECT_EQ(frame.people.size(), people);
  EXPECT_EQ(frame.result->person_count(), people);
  EXPECT_EQ(frame.number, number);
  EXPECT_EQ(frame.results_per_second, 12.5);
  EXPECT_GE(frame.copying_ms, 0);
}

TEST_F(MappedFrame, WhatIsSeenOfTheBodyIsTheCellsOfItsLabels) {
  maquette::MappedFrame frame;
  frame.copy_from(mapped(), 1, &seen_);
  std::vector<uint8_t> wanted(24 * kCells * kCells);
  for (size_t at = 0; at < frame.iuv.size(); at += 4) {
    const size_t part = frame.iuv[at], u = frame.iuv[at + 1] * kCells / 256, v = frame.iuv[at + 2] * kCells / 256;
    if (part > 0) wanted[((part - 1) * kCells + v) * kCells + u] = 255;
  }
  EXPECT_GT(std::accumulate(wanted.begin(), wanted.end(), 0), 0);
  EXPECT_EQ(frame.seen, wanted);
  EXPECT_EQ(seen_, wanted);
}

TEST_F(MappedFrame, HasTheColoursOfThePersonWhoIsFollowed) {
  maquette::GrowingTexture growing(context_);
  maquette::MappedFrame frame;
  frame.copy_from(mapped(), 1, &seen_, &growing);
  ASSERT_NE(frame.texture, nullptr);
  const std::shared_ptr<const maquette::RgbaImage> first = frame.texture;
  EXPECT_EQ(first->width_px * 6, first->height_px * 4);
  // These are the colours of the largest person.
  maquette::PipelineResult again = mapped();
  const maquette::DensePoseResult densepose = maquette::densepose_of(again);
  const std::vector<maq_densepose_person> people = densepose.people();
  const auto area = [](const maq_densepose_person& person) {
    return (person.box_px[2] - person.box_px[0]) * (person.box_px[3] - person.box_px[1]);
  };
  uint32_t largest = 0;
  for (uint32_t i = 0; i < people.size(); ++i) largest = area(people[i]) > area(people[largest]) ? i : largest;
  maquette::DensePoseTexture alone(context_);
  alone.add_person(densepose, largest, again.frame);
  EXPECT_EQ(first->rgba, alone.draw());
  // It is drawn anew after eight frames only, and begins again with another source.
  frame.copy_from(std::move(again), 1, &seen_, &growing);
  EXPECT_EQ(frame.texture, first);
  growing.set_source("");
  frame.copy_from(mapped(), 1, &seen_, &growing);
  EXPECT_EQ(frame.texture, first);
  growing.set_source("another");
  frame.copy_from(mapped(), 1, &seen_, &growing);
  EXPECT_NE(frame.texture, first);
  EXPECT_EQ(frame.texture->rgba, first->rgba);
  frame.copy_from(mapped(), 1, &seen_);
  EXPECT_EQ(frame.texture, nullptr);
}

TEST_F(MappedFrame, WhatWasSeenBeforeFades) {
  seen_.assign(24 * kCells * kCells, 160);
  maquette::MappedFrame frame;
  frame.copy_from(mapped(), 1, &seen_);
  size_t faded = 0;
  for (const uint8_t cell : frame.seen) {
    EXPECT_TRUE(cell == 255 || cell == 150) << int(cell);
    faded += cell == 150 ? 1 : 0;
  }
  EXPECT_GT(faded, 0u);
  EXPECT_LT(faded, frame.seen.size());
}

}  // namespace
