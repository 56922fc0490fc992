// The surface mapper alone on the tiny bundle.
#include "densepose/surface/surface_mapper.h"

#include <gtest/gtest.h>

#include "support/samples/tiny_dense_pose.h"

namespace {

class SurfaceMapper : public ::testing::Test {
 protected:
  // Features of `side` x `side` cells, all of that value.
  maq::FeatureMap features(float value) {
    const int side = 16;
    values_.push_back(std::vector<float>(size_t(side * side * kChannels), value));
    return {values_.back().data(), kChannels, side, side, tiny_.spec.dense_head.stride};
  }
  std::vector<float> answer(size_t index) {
    const maq::SurfaceAnswer from = mapper_.answer(index);
    std::vector<float> all(from.labels, from.labels + mapper_.labels_size());
    all.insert(all.end(), from.surface, from.surface + mapper_.surface_size());
    return all;
  }

  static constexpr int kChannels = 3;  // of the tiny bundle
  TinyDensePose tiny_;
  maq::SurfaceMapper mapper_{tiny_.networks, tiny_.spec, "dense_head", tiny_.spec.charts_file, kChannels};
  std::vector<std::vector<float>> values_;
};

TEST_F(SurfaceMapper, AnswersFollowEachOtherAndDoNotDependOnOtherPeople) {
  const maq::Box box{8, 8, 40, 40};
  const maq::FeatureMap dark = features(0), bright = features(1);
  mapper_.begin();
  mapper_.add(dark, box);
  mapper_.add(bright, box);
  mapper_.run(tiny_.cancel);
  const std::vector<float> first = answer(0), second = answer(1);
  EXPECT_EQ(mapper_.answer(1).labels - mapper_.answer(0).labels, std::ptrdiff_t(mapper_.labels_size()));
  EXPECT_EQ(mapper_.answer(1).surface - mapper_.answer(0).surface, std::ptrdiff_t(mapper_.surface_size()));
  EXPECT_EQ(first.size(), second.size());
  mapper_.begin();
  mapper_.add(bright, box);
  mapper_.run(tiny_.cancel);
  EXPECT_EQ(answer(0), second);
}

TEST_F(SurfaceMapper, LogitsDescribeTheAnswerAlsoOfACopy) {
  mapper_.begin();
  mapper_.add(features(0.5f), {0, 0, 48, 48});
  mapper_.run(tiny_.cancel);
  const maq::SurfaceAnswer answer = mapper_.answer(0);
  const maq::DenseLogits logits = mapper_.logits_of(answer);
  const maq::DenseHeadSpec& spec = tiny_.spec.dense_head;
  EXPECT_EQ(logits.labels, answer.labels);
  EXPECT_EQ(logits.size, spec.output_size);
  EXPECT_EQ(mapper_.labels_size(),
            size_t(logits.size * logits.size) * size_t(logits.coarse_classes + logits.index_classes));
  const maq::ChartPoint point = logits.charts->at(3, 5, 7);
  std::vector<float> labels_copy(answer.labels, answer.labels + mapper_.labels_size());
  std::vector<float> surface_copy(answer.surface, answer.surface + mapper_.surface_size());
  const maq::DenseLogits copied = mapper_.logits_of({labels_copy.data(), surface_copy.data()});
  EXPECT_EQ(copied.charts->at(3, 5, 7).u, point.u);
  EXPECT_EQ(copied.charts->at(3, 5, 7).v, point.v);
}

}  // namespace
