// Heads that form beside a photo, with the bundle whose heads are known: progress, previews, cancelling, failures.
#include <app/live_head.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <thread>

namespace live_head_tests {
namespace {

const std::string kRoundHeads = MAQ_TEST_DATA "/round_heads/bundle";

// Looks every few milliseconds, as a window does. False after two minutes.
template <class Condition>
bool comes(Condition is_so) {
  for (int i = 0; i < 60000; ++i) {
    if (is_so()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return false;
}

// The encoder sees a head in what is not black, and another one in blue.
maquette::LiveHeadPhoto plain_photo(uint8_t red = 140, uint8_t green = 130, uint8_t blue = 120) {
  maquette::LiveHeadPhoto photo;
  photo.image.resize(320, 240);
  for (size_t i = 0; i < photo.image.rgba.size(); i += 4) {
    photo.image.rgba[i] = red, photo.image.rgba[i + 1] = green, photo.image.rgba[i + 2] = blue;
    photo.image.rgba[i + 3] = 255;
  }
  photo.box_px = {110, 60, 200, 180};
  return photo;
}

maquette::LiveHeadView small_view() {
  maquette::LiveHeadView view;
  view.width_px = 80, view.height_px = 60;
  return view;
}

bool is_ready(const maquette::LiveHead& head) {
  return comes([&] { return head.state()->phase >= maquette::LiveHeadState::kReady; }) &&
         head.state()->phase == maquette::LiveHeadState::kReady;
}

// An image that comes after this call.
const maquette::LiveHeadImage* image_of(maquette::LiveHead& head, const maquette::LiveHeadView& view) {
  head.images().take();
  head.render(view);
  return comes([&] { return head.images().take(); }) ? &head.images().front() : nullptr;
}

int covered(const maquette::RgbaImage& image) {
  int count = 0;
  for (size_t i = 0; i < image.rgba.size(); i += 4) {
    count += !std::equal(&image.rgba[i], &image.rgba[i] + 4, &image.rgba[0]) ? 1 : 0;
  }
  return count;
}

TEST(LiveHead, APhotoBecomesAHeadThatIsTurnedAndLaidOverThePhoto) {
  const maquette::Context context;
  std::atomic<int> changes{0};
  maquette::LiveHead head(context, kRoundHeads, 2, [&] { ++changes; });
  EXPECT_EQ(head.state()->phase, maquette::LiveHeadState::kNone);
  EXPECT_EQ(head.fitted(), nullptr);
  head.fit(plain_photo(), 0.5, false);
  EXPECT_EQ(head.state()->phase, maquette::LiveHeadState::kFitting);
  ASSERT_TRUE(is_ready(head)) << head.state()->text;
  const auto state = head.state();
  EXPECT_EQ(state->text, "");
  EXPECT_EQ(state->photo->width_px, 320);
  EXPECT_EQ(state->used_photo_count, 1u);
  EXPECT_EQ(state->triangle_count, 664u);
  EXPECT_GT(state->pupil_distance_m, 0.03);
  EXPECT_GT(state->seconds, 0);
  EXPECT_GT(changes, 3);
  ASSERT_NE(head.fitted(), nullptr);
  EXPECT_EQ(head.fitted()->head->info().photo_count, 1u);

  maquette::LiveHeadView view = small_view();
  const maquette::LiveHeadImage* image = image_of(head, view);
  ASSERT_NE(image, nullptr);
  EXPECT_TRUE(image->photo.empty());
  EXPECT_EQ(image->rendering.width_px, 80);
  const maquette::RgbaImage front = image->rendering;
  const int size = covered(front);
  EXPECT_GT(size, 300);
  view.zoom = 1.5;
  EXPECT_GT(covered(image_of(head, view)->rendering), size * 3 / 2);
  view.yaw_rad = 1.5;
  EXPECT_NE(image_of(head, view)->rendering.rgba, front.rgba);
  const uint64_t number = head.images().front().number;
  view.shading = MAQ_HEAD_SHADING_NORMALS, view.yaw_rad = 0;
  image = image_of(head, view);
  EXPECT_GT(image->rendering.rgba[4 * (30 * 80 + 40) + 2], 240) << "it looks to the camera: blue";
  EXPECT_GT(image->number, number);

  view.is_over_photo = true;
  image = image_of(head, view);
  ASSERT_EQ(image->photo.width_px, 80) << "of the photo's shape";
  ASSERT_EQ(image->photo.height_px, 60);
  EXPECT_EQ(image->photo.rgba[0], 140);
  EXPECT_EQ(image->rendering.rgba[0], 140) << "the photo beside the head";
  EXPECT_GT(image->rendering.rgba[4 * (30 * 80 + 38) + 2], 200) << "the head on it, where the box is";
}

TEST(LiveHead, WhatThereIsOfAHeadIsShownWhileItIsFittedAndStaysWhenCancelled) {
  const maquette::Context context;
  maquette::LiveHead head(context, kRoundHeads, 2);
  head.render(small_view());
  head.fit(plain_photo(), 3600, false);
  ASSERT_TRUE(comes([&] { return head.images().take() || head.state()->phase != maquette::LiveHeadState::kFitting; }));
  // The bundle's heads are fitted soon, so it may be over by now; cancelling is fine then, too.
  EXPECT_GT(covered(head.images().front().rendering), 300);
  EXPECT_TRUE(head.state()->has_head);
  head.cancel();
  ASSERT_TRUE(is_ready(head)) << head.state()->text;
  ASSERT_NE(head.fitted(), nullptr);
  EXPECT_EQ(head.state()->triangle_count, 664u);
}

TEST(LiveHead, PhotosAreAddedAndThoseOfAnotherHeadAreTold) {
  const maquette::Context context;
  maquette::LiveHead head(context, kRoundHeads, 2);
  head.fit(plain_photo(), 0, false);
  ASSERT_TRUE(is_ready(head)) << head.state()->text;
  head.fit(plain_photo(), 0, true);
  ASSERT_TRUE(is_ready(head));
  EXPECT_EQ(head.state()->used_photo_count, 2u);
  head.fit(plain_photo(20, 60, 200), 0, true);
  ASSERT_TRUE(is_ready(head));
  EXPECT_EQ(head.state()->photo_count, 3u);
  EXPECT_EQ(head.state()->used_photo_count, 2u);
  EXPECT_NE(head.state()->text.find("was rejected"), std::string::npos) << head.state()->text;
  head.fit(plain_photo(), 0, false);
  ASSERT_TRUE(is_ready(head));
  EXPECT_EQ(head.state()->photo_count, 1u) << "another head";
}

TEST(LiveHead, FailuresAreSentencesAndTheHeadBeforeStays) {
  const maquette::Context context;
  maquette::LiveHead missing(context, "/nowhere");
  missing.fit(plain_photo(), 0, false);
  ASSERT_TRUE(comes([&] { return missing.state()->phase == maquette::LiveHeadState::kFailed; }));
  EXPECT_NE(missing.state()->text.find("/nowhere"), std::string::npos) << missing.state()->text;

  maquette::LiveHead head(context, kRoundHeads, 2);
  head.fit(plain_photo(0, 0, 0), 0, false);
  ASSERT_TRUE(comes([&] { return head.state()->phase == maquette::LiveHeadState::kFailed; }));
  EXPECT_NE(head.state()->text.find("No head is seen"), std::string::npos) << head.state()->text;
  EXPECT_FALSE(head.state()->has_head);
  head.fit(plain_photo(), 0, false);
  ASSERT_TRUE(is_ready(head)) << head.state()->text;
  head.fit(plain_photo(0, 0, 0), 0, false);
  ASSERT_TRUE(is_ready(head));
  EXPECT_NE(head.state()->text.find("No head is seen"), std::string::npos);
  EXPECT_NE(head.fitted(), nullptr);
}

TEST(LiveHead, EndsWhileItFits) {
  const maquette::Context context;
  for (int i = 0; i < 3; ++i) {
    maquette::LiveHead head(context, kRoundHeads, 2);
    head.render(small_view());
    head.fit(plain_photo(), 3600, false);
    head.fit(plain_photo(), 3600, false);
    if (i > 0) comes([&] { return head.state()->progress > 0 || i < 2; });
  }
}

}  // namespace
}  // namespace live_head_tests
