// The crop pass alone on the tiny bundle, whose crops go through the networks of the whole image.
#include "densepose/crops/crop_pass.h"

#include <gtest/gtest.h>

#include <utility>

#include "support/samples/tiny_dense_pose.h"
#include "support/samples/tiny_people.h"

namespace {

constexpr maq::Point kUp{0, -1};

class CropPass : public ::testing::Test {
 protected:
  CropPass() : image_(black(320, 256)) {
    image_(cv::Rect(80, 100, 4, 4)) = kRed;
    tiny_.settings.crops = maq::PersonCrops::kAll;
  }

  // A person in this box, with the answer of the whole image.
  std::vector<maq::MappedPerson> mapped(const maq::Box& box) {
    std::vector<float> values(3 * 320 * 256, 0.1f);
    trunk_.run(values, 320, 256, tiny_.cancel);
    mapper_.begin();
    mapper_.add(trunk_.features()[0], box);
    mapper_.run(tiny_.cancel);
    maq::MappedPerson person;
    person.found = {box, 0.9f, 0};
    person.box = person.region = box;
    person.mapper = &mapper_;
    person.answer = mapper_.answer(0);
    return {person};
  }

  cv::Mat image_;
  TinyDensePose tiny_;
  maq::Trunk trunk_{tiny_.networks, tiny_.spec};
  maq::SurfaceMapper mapper_{tiny_.networks, tiny_.spec, "dense_head", tiny_.spec.charts_file, trunk_.channels()};
  maq::CropPass crops_{tiny_.networks, tiny_.spec, tiny_.settings, trunk_, mapper_};
  maq_provider provider_ = MAQ_PROVIDER_NNAPI;
};

TEST_F(CropPass, EverybodyGetsACropWhereAllAreAskedFor) {
  std::vector<maq::MappedPerson> people = mapped({40, 20, 240, 230});
  crops_.choose(people, kUp, nullptr);
  ASSERT_TRUE(people[0].crop);
  EXPECT_GT(people[0].crop->box.width(), 0);
  EXPECT_GE(people[0].confidence, 0);
}

TEST_F(CropPass, WithAutoOnlySmallAndLeaningPeopleGetACrop) {
  tiny_.settings.crops = maq::PersonCrops::kAuto;
  std::vector<maq::MappedPerson> small = mapped({64, 84, 96, 116});
  crops_.choose(small, kUp, nullptr);
  EXPECT_TRUE(small[0].crop);
}

TEST_F(CropPass, InAStreamAPersonWhoStaysKeepsTheCrop) {
  std::vector<maq::MappedPerson> before = mapped({40, 20, 240, 230});
  crops_.choose(before, kUp, nullptr);
  ASSERT_TRUE(before[0].crop);
  before[0].crop->to_image.shift_x += 0.5;  // as a crop of another frame
  std::vector<maq::MappedPerson> people = mapped({40, 20, 240, 230});
  const std::vector<maq::MappedPerson> nobody;
  for (const std::vector<maq::MappedPerson>* previous : {&std::as_const(before), &nobody}) {
    crops_.choose(people, kUp, previous);
    ASSERT_TRUE(people[0].crop);
    EXPECT_EQ(people[0].had_crop, previous == &before);
    EXPECT_EQ(people[0].crop->to_image.shift_x == before[0].crop->to_image.shift_x, previous == &before);
  }
  before[0].body = {250, 240, 300, 250};  // somebody else
  crops_.choose(people, kUp, &before);
  EXPECT_FALSE(people[0].had_crop);
}

TEST_F(CropPass, ACropIsRunAndItsAnswerKeptUnlessItIsLessConfident) {
  std::vector<maq::MappedPerson> people = mapped({64, 84, 96, 116});
  crops_.choose(people, kUp, nullptr);
  for (const float first : {0.0f, 1.0f}) {
    std::vector<maq::MappedPerson> again = people;
    again[0].confidence = first;
    EXPECT_EQ(crops_.run(TinyDensePose::view(image_), again, tiny_.cancel, &provider_), 1);
    EXPECT_EQ(provider_, MAQ_PROVIDER_CPU);
    ASSERT_NE(again[0].answer.labels, nullptr);
    const bool is_kept = again[0].crop.has_value();
    EXPECT_TRUE(is_kept || first == 1);
    EXPECT_TRUE(is_kept || again[0].confidence == first) << "the first answer stays";
    people = mapped({64, 84, 96, 116});  // the mapper's memory was used
    crops_.choose(people, kUp, nullptr);
  }
}

TEST_F(CropPass, WithoutCropsNothingRuns) {
  std::vector<maq::MappedPerson> people = mapped({64, 84, 96, 116});
  EXPECT_EQ(crops_.run(TinyDensePose::view(image_), people, tiny_.cancel, &provider_), 0);
  EXPECT_EQ(provider_, MAQ_PROVIDER_NNAPI);
}

TEST_F(CropPass, SurePartsRaiseTheScoreAndLowerTheBoxScoreThatIsNeeded) {
  maq::MappedPerson person;
  person.found.score = 0.5f;
  person.confidence = 0.4f;
  EXPECT_NEAR(crops_.score_of(person), 0.5f, 1e-6) << "the neutral confidence";
  person.confidence = 0.8f;
  EXPECT_GT(crops_.score_of(person), 0.8f);
  EXPECT_LT(crops_.min_box_score(0.6f), 0.35f);
  tiny_.settings.crops = maq::PersonCrops::kOff;
  EXPECT_EQ(crops_.min_box_score(0.6f), 0.6f);
}

}  // namespace
