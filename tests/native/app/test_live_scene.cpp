// With the room of this repository and the shipped networks.
#include <app/live_scene.h>

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <mutex>
#include <set>
#include <thread>

#include <app/fly_camera.h>
#include "support/temp_folder.h"

namespace {

using Clock = std::chrono::steady_clock;

const std::string kRoom = MAQ_TEST_MEDIA "/room", kBundle = MAQ_TEST_MODELS "/scenes-int8";

double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

// Waits until `is_so`, looking every few milliseconds as a window does. False after two minutes.
template <class Condition>
bool wait_until(Condition is_so) {
  for (const auto start = Clock::now(); ms_since(start) < 120e3;) {
    if (is_so()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return false;
}

bool wait_until_open(const maquette::LiveScene& scene) {
  return wait_until([&] { return scene.state()->phase >= maquette::LiveSceneState::kReady; }) &&
         scene.state()->phase == maquette::LiveSceneState::kReady;
}

std::set<int> threads_of_this_process() {
  std::set<int> ids;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/task")) {
    ids.insert(std::stoi(entry.path().filename()));
  }
  return ids;
}

// The room of a few of its photos and points, as a file; made once.
const std::string& small_room() {
  static const TempFolder folder;
  static const std::string path = [] {
    const maquette::Context context;
    maq_scene_build_config config = maquette::default_scene_build_config();
    config.model.bundle_path = kBundle.c_str();
    config.max_views = 3;
    config.max_points = 20000;
    const std::string file = folder.file("room.maqs");
    maquette::Scene(context, config, maquette::Capture(context, kRoom)).save(file);
    return file;
  }();
  return path;
}

// From inside of the room, a small image.
maq_pinhole_camera small_camera(const maquette::LiveScene& scene) {
  maquette::FlyCamera fly(scene.state()->info, {});
  fly.move(0, 0, 1, 1, 0.7);
  return fly.camera(160, 120);
}

// An image that comes after this call.
const maquette::LiveSceneImage* render_at(maquette::LiveScene& scene, const maq_pinhole_camera& camera,
                                          int photo_index = -1) {
  scene.render(camera, photo_index);
  return wait_until([&] { return scene.images().take(); }) ? &scene.images().front() : nullptr;
}

// Nothing comes in the time in which a small image is rendered many times.
void expect_no_image(maquette::LiveScene& scene) {
  std::this_thread::sleep_for(std::chrono::milliseconds(400));
  EXPECT_FALSE(scene.images().take());
}

void copy_room(const TempFolder& folder) {
  std::filesystem::copy(kRoom, folder.path(), std::filesystem::copy_options::recursive);
}

// The room with every eighth point of its cloud, for tests of building that do not look at the scene; made once.
const std::string& thinned_room() {
  static const TempFolder folder;
  static const std::string path = [] {
    copy_room(folder);
    const std::string cloud = read_text(kRoom + "/cloud.ply"), count = "element vertex 317760", end = "end_header\n";
    std::string thinned = cloud.substr(0, cloud.find(end) + end.size());
    const size_t bytes = (cloud.size() - thinned.size()) / 317760, step = 8 * bytes;
    for (size_t at = thinned.size(); at < cloud.size(); at += step) thinned += cloud.substr(at, bytes);
    thinned.replace(thinned.find(count), count.size(), "element vertex 39720");
    write_text(folder.file("cloud.ply"), thinned);
    return folder.path().string();
  }();
  return path;
}

// Opens what is damaged; what the user reads about it.
std::string failure_of(maquette::LiveScene& scene, const std::string& path) {
  scene.open(path);
  EXPECT_TRUE(wait_until([&] { return scene.state()->phase >= maquette::LiveSceneState::kReady; }));
  EXPECT_EQ(scene.state()->phase, maquette::LiveSceneState::kFailed) << path;
  EXPECT_EQ(scene.state()->path, path);
  const std::string text = scene.state()->text;
  EXPECT_GT(text.size(), 20u);
  EXPECT_EQ(text.back(), '.') << text;
  return text;
}

TEST(LiveScene, BuildsACaptureAndComparesWithItsPhotos) {
  const maquette::Context context;
  maquette::LiveScene scene(context, kBundle, 2);
  EXPECT_EQ(scene.state()->phase, maquette::LiveSceneState::kClosed);
  scene.open(kRoom);
  EXPECT_EQ(scene.state()->phase, maquette::LiveSceneState::kOpening);
  EXPECT_EQ(scene.state()->path, kRoom);
  std::set<std::string> texts;
  double done = 0;
  ASSERT_TRUE(wait_until([&] {
    const auto state = scene.state();
    if (state->phase != maquette::LiveSceneState::kOpening) return true;
    EXPECT_GE(state->progress, done);
    EXPECT_LE(state->progress, 1);
    EXPECT_EQ(state->text.back(), '.');
    done = state->progress;
    texts.insert(state->text);
    return false;
  }));
  const auto state = scene.state();
  ASSERT_EQ(state->phase, maquette::LiveSceneState::kReady) << state->text;
  EXPECT_EQ(state->text, "");
  EXPECT_GT(texts.size(), 25u);
  EXPECT_GT(done, 0.9);
  EXPECT_GT(state->info.point_count, 100000u);
  ASSERT_EQ(state->photos.size(), 30u);
  ASSERT_EQ(state->photo_names.size(), 30u);
  size_t held_out = 0;
  for (const std::string& name : state->photo_names) held_out += name.find(" (held out)") != std::string::npos;
  EXPECT_EQ(held_out, 5u);

  for (size_t i = 0; i < 30; i += 5) {
    scene.render(state->photos[i], int(i));
    ASSERT_TRUE(wait_until([&] { return scene.images().take(); }));
    const maquette::LiveSceneImage& shown = scene.images().front();
    EXPECT_EQ(shown.photo_index, int(i));
    EXPECT_EQ(shown.number, i / 5 + 1);
    EXPECT_GT(shown.psnr_db, 25) << state->photo_names[i];
  }
}

TEST(LiveScene, ShowsTheErrorInColoursAndItsPsnr) {
  const maquette::Context context;
  maquette::LiveScene scene(context, kBundle, 2);
  scene.open(small_room(), kRoom);
  ASSERT_TRUE(wait_until_open(scene)) << scene.state()->text;
  const maq_pinhole_camera camera = scene.state()->photos[12];
  const maquette::LiveSceneImage* const shown = render_at(scene, camera, 12);
  ASSERT_NE(shown, nullptr);
  for (const maquette::RgbaImage* picture : {&shown->rendering, &shown->photo, &shown->error}) {
    ASSERT_EQ(picture->width_px, camera.intrinsics.width_px);
    ASSERT_EQ(picture->height_px, camera.intrinsics.height_px);
  }
  double squares = 0;
  size_t coloured = 0;
  for (size_t i = 0; i < shown->error.rgba.size(); i += 4) {
    double mean = 0;
    for (size_t c = i; c < i + 3; ++c) {
      const double difference = double(shown->rendering.rgba[c]) - double(shown->photo.rgba[c]);
      mean += std::abs(difference) / 3;
      squares += difference * difference;
    }
    // Red grows up to a third of 128, then green, then blue.
    const double third = 128.0 / 3;
    for (size_t c = 0; c < 3; ++c) {
      const double expected = 255 * std::min(1.0, std::max(0.0, mean - double(c) * third) / third);
      ASSERT_NEAR(shown->error.rgba[i + c], expected, 1) << i;
    }
    ASSERT_EQ(shown->error.rgba[i + 3], 255);
    ASSERT_EQ(shown->rendering.rgba[i + 3], 255);
    coloured += shown->error.rgba[i] > 20;
  }
  EXPECT_GT(coloured, 1000u);
  const double mean_square = squares / (3.0 * camera.intrinsics.width_px * camera.intrinsics.height_px);
  EXPECT_NEAR(shown->psnr_db, 10 * std::log10(255.0 * 255 / mean_square), 1e-6);
}

TEST(LiveScene, LargeImagesAreMadeSmallerAndShowTheSame) {
  const maquette::Context context;
  maquette::LiveScene scene(context, kBundle, 2);
  scene.open(small_room());
  ASSERT_TRUE(wait_until_open(scene)) << scene.state()->text;
  maq_pinhole_camera camera = small_camera(scene);
  for (const auto& [width, height, shown_width, shown_height] : {std::array<int, 4>{1280, 960, 1280, 960},
                                                                 {4000, 3000, 1280, 960},
                                                                 {2560, 800, 1280, 400},
                                                                 {500, 1920, 250, 960}}) {
    const maq_pinhole_camera large = maquette::FlyCamera(scene.state()->info, {camera}).camera(width, height);
    const maquette::LiveSceneImage* const shown = render_at(scene, large);
    ASSERT_NE(shown, nullptr);
    EXPECT_EQ(shown->rendering.width_px, shown_width);
    EXPECT_EQ(shown->rendering.height_px, shown_height);
    EXPECT_EQ(shown->camera.intrinsics.width_px, shown_width);
    EXPECT_NEAR(shown->camera.intrinsics.fx_px / shown_width, large.intrinsics.fx_px / width, 1e-9);
    EXPECT_NEAR((shown->camera.intrinsics.cy_px + 0.5) / shown_height, (large.intrinsics.cy_px + 0.5) / height, 1e-9);
    EXPECT_TRUE(std::isnan(shown->psnr_db));
    EXPECT_TRUE(shown->photo.empty() && shown->error.empty());
    EXPECT_EQ(shown->photo_index, -1);
  }
}

TEST(LiveScene, RendersOncePerRequestAndTheLatestWins) {
  const maquette::Context context;
  maquette::LiveScene scene(context, kBundle, 2);
  scene.open(small_room());
  ASSERT_TRUE(wait_until_open(scene)) << scene.state()->text;
  maq_pinhole_camera camera = small_camera(scene);
  const maquette::LiveSceneImage* shown = render_at(scene, camera);
  ASSERT_NE(shown, nullptr);
  EXPECT_EQ(shown->number, 1u);
  expect_no_image(scene);
  for (int i = 1; i <= 1000; ++i) {
    camera.intrinsics.fx_px = 100 + i;
    scene.render(camera, -1);
  }
  ASSERT_TRUE(
      wait_until([&] { return scene.images().take() && scene.images().front().camera.intrinsics.fx_px == 1100; }));
  EXPECT_LT(scene.images().front().number, 500u);
  expect_no_image(scene);
}

TEST(LiveScene, ARequestBeforeTheSceneIsOpenWaitsForIt) {
  const maquette::Context context;
  maquette::LiveScene scene(context, kBundle, 2);
  scene.open(small_room());
  ASSERT_TRUE(wait_until_open(scene));
  const maq_pinhole_camera camera = small_camera(scene);
  scene.open(small_room());
  ASSERT_NE(render_at(scene, camera), nullptr);
  EXPECT_EQ(scene.state()->phase, maquette::LiveSceneState::kReady);
}

TEST(LiveScene, AnInvalidCameraIsReportedAndForgotten) {
  const maquette::Context context;
  maquette::LiveScene scene(context, kBundle, 2);
  scene.open(small_room());
  ASSERT_TRUE(wait_until_open(scene));
  const maq_pinhole_camera good = small_camera(scene);
  const auto expect_refused = [&](auto change) {
    maq_pinhole_camera camera = good;
    change(camera);
    scene.render(camera, -1);
    EXPECT_TRUE(wait_until([&] { return !scene.state()->text.empty(); }));
    EXPECT_EQ(scene.state()->text.back(), '.') << scene.state()->text;
    EXPECT_EQ(scene.state()->phase, maquette::LiveSceneState::kReady);
    EXPECT_FALSE(scene.images().take());
    ASSERT_NE(render_at(scene, good), nullptr);
    EXPECT_EQ(scene.state()->text, "");
  };
  expect_refused([](maq_pinhole_camera& camera) { camera.rotation[0] = NAN; });
  expect_refused([](maq_pinhole_camera& camera) { camera.intrinsics.fx_px = 0; });
  expect_refused([](maq_pinhole_camera& camera) { camera.intrinsics.width_px = 0; });
  expect_refused([](maq_pinhole_camera& camera) { camera.intrinsics.height_px = -2000000000; });
  expect_refused([](maq_pinhole_camera& camera) { camera.struct_size = 3; });
}

TEST(LiveScene, WithoutItsCaptureASceneFileIsShownAllTheSame) {
  const maquette::Context context;
  maquette::LiveScene scene(context, kBundle, 2);
  scene.open(small_room(), "/nowhere/at all");
  ASSERT_TRUE(wait_until_open(scene));
  EXPECT_NE(scene.state()->text.find("/nowhere/at all"), std::string::npos) << scene.state()->text;
  EXPECT_EQ(scene.state()->text.back(), '.');
  EXPECT_TRUE(scene.state()->photos.empty());
  const maquette::LiveSceneImage* const shown = render_at(scene, small_camera(scene), 5);
  ASSERT_NE(shown, nullptr);
  EXPECT_EQ(shown->photo_index, -1);
  EXPECT_TRUE(shown->photo.empty());
}

TEST(LiveScene, APhotoThatCannotBeReadIsReportedAndTheRenderingShown) {
  const TempFolder folder;
  copy_room(folder);
  const maquette::Context context;
  maquette::LiveScene scene(context, kBundle, 2);
  scene.open(small_room(), folder.path().string());
  ASSERT_TRUE(wait_until_open(scene));
  ASSERT_EQ(scene.state()->photos.size(), 30u);
  write_text(folder.file("images/004.jpg"), "no photo any more");
  const auto photos = scene.state()->photos;
  ASSERT_NE(render_at(scene, photos[3], 3), nullptr);
  const maquette::LiveSceneImage* shown = render_at(scene, photos[4], 4);
  ASSERT_NE(shown, nullptr);
  EXPECT_EQ(shown->photo_index, -1);
  EXPECT_TRUE(shown->photo.empty() && shown->error.empty() && std::isnan(shown->psnr_db));
  EXPECT_FALSE(shown->rendering.empty());
  EXPECT_NE(scene.state()->text.find("004.jpg"), std::string::npos) << scene.state()->text;
  for (const int index : {30, 1000000}) {
    ASSERT_NE(render_at(scene, photos[4], index), nullptr);
    EXPECT_EQ(scene.images().front().photo_index, -1);
    EXPECT_NE(scene.state()->text, "");
  }
  shown = render_at(scene, photos[5], 5);
  ASSERT_NE(shown, nullptr);
  EXPECT_EQ(shown->photo_index, 5);
  EXPECT_EQ(scene.state()->text, "");
}

TEST(LiveScene, WhatCannotBeOpenedIsASentence) {
  const TempFolder folder;
  const maquette::Context context;
  maquette::LiveScene scene(context, kBundle, 2);
  const std::string whole = read_text(small_room());
  std::string changed = whole;
  changed[changed.size() / 2] = char(changed[changed.size() / 2] ^ 4);
  write_text(folder.file("changed.maqs"), changed);
  write_text(folder.file("cut.maqs"), whole.substr(0, whole.size() / 2));
  write_text(folder.file("none.maqs"), "");
  std::filesystem::create_directory(folder.path() / "empty");
  for (const char* name : {"changed.maqs", "cut.maqs", "none.maqs", "empty", "missing"}) {
    const std::string text = failure_of(scene, folder.file(name));
    EXPECT_NE(text.find(name), std::string::npos) << text;
  }
  scene.render(maq_pinhole_camera{}, -1);
  expect_no_image(scene);
  scene.open(small_room());
  ASSERT_TRUE(wait_until_open(scene)) << "after all of this: " << scene.state()->text;
  EXPECT_NE(render_at(scene, small_camera(scene)), nullptr);
}

TEST(LiveScene, WrongNetworksAreASentence) {
  for (const std::string& bundle : {std::string("/nowhere"), std::string(MAQ_TEST_MODELS "/densepose-b-int8")}) {
    const maquette::Context context;
    maquette::LiveScene scene(context, bundle, 2);
    failure_of(scene, small_room());
    failure_of(scene, kRoom);
  }
  const maquette::Context context;
  maquette::LiveScene scene(context, kBundle, 1000);
  EXPECT_NE(failure_of(scene, small_room()).find("1000"), std::string::npos);
}

TEST(LiveScene, CloseForgetsTheSceneAndItsImages) {
  const maquette::Context context;
  maquette::LiveScene scene(context, kBundle, 2);
  scene.open(small_room());
  ASSERT_TRUE(wait_until_open(scene));
  const maq_pinhole_camera camera = small_camera(scene);
  scene.render(camera, -1);
  std::this_thread::sleep_for(std::chrono::milliseconds(300));  // it waits to be taken, or comes just now
  scene.close();
  EXPECT_EQ(scene.state()->phase, maquette::LiveSceneState::kClosed);
  EXPECT_EQ(scene.state()->path, "");
  EXPECT_EQ(scene.state()->text, "");
  expect_no_image(scene);
  scene.render(camera, -1);
  expect_no_image(scene);
  EXPECT_EQ(scene.state()->phase, maquette::LiveSceneState::kClosed);
}

TEST(LiveScene, BuildingEndsWhenAnotherSceneIsOpenedOrNone) {
  const maquette::Context context;
  maquette::LiveScene scene(context, kBundle, 2);
  for (const double fraction : {0.0, 0.3}) {
    scene.open(thinned_room());
    ASSERT_TRUE(wait_until([&] { return scene.state()->progress > fraction; }));
    scene.open(small_room());
    EXPECT_EQ(scene.state()->path, small_room());
    ASSERT_TRUE(wait_until([&] {
      EXPECT_NE(scene.state()->path, thinned_room()) << "of the former scene nothing is heard any more";
      return scene.state()->phase != maquette::LiveSceneState::kOpening;
    }));
    EXPECT_EQ(scene.state()->phase, maquette::LiveSceneState::kReady);
    EXPECT_LT(scene.state()->info.point_count, 25000u) << "of the small room";
  }
  scene.open(thinned_room());
  ASSERT_TRUE(wait_until([&] { return scene.state()->progress > 0; }));
  scene.close();
  expect_no_image(scene);
  EXPECT_EQ(scene.state()->phase, maquette::LiveSceneState::kClosed) << "and stays closed";
}

TEST(LiveScene, TheDestructorCancelsBuilding) {
  for (const double fraction : {0.0, 0.5}) {
    const maquette::Context context;
    std::mutex held;
    std::atomic<maquette::LiveScene*> built{nullptr};
    std::atomic<bool> is_far_enough{false}, is_ready{false};
    auto scene = std::make_unique<maquette::LiveScene>(context, kBundle, 2, [&] {
      if (built == nullptr) return;
      const auto state = built.load()->state();
      if (state->phase == maquette::LiveSceneState::kReady) is_ready = true;
      if (state->progress <= fraction || is_far_enough.exchange(true)) return;
      const std::lock_guard<std::mutex> lock(held);
    });
    built = scene.get();
    std::unique_lock<std::mutex> lock(held);
    scene->open(thinned_room());
    ASSERT_TRUE(wait_until([&] { return is_far_enough.load(); }));
    // Building stands still until the destructor has begun.
    std::thread destroys([&] { scene.reset(); });
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    lock.unlock();
    destroys.join();
    EXPECT_FALSE(is_ready) << "it was built to its end: " << fraction;
  }
}

TEST(LiveScene, CallsReturnWhileItWorks) {
  const maquette::Context context;
  std::mutex held;
  std::atomic<bool> is_waiting{false};
  maquette::LiveScene scene(context, kBundle, 2, [&] {
    is_waiting = true;
    const std::lock_guard<std::mutex> lock(held);
  });
  std::unique_lock<std::mutex> lock(held);
  scene.open(thinned_room());
  ASSERT_TRUE(wait_until([&] { return is_waiting.load(); }));
  // Its thread stands still in the middle of building: a call that waited for it would never return.
  for (int i = 0; i < 3; ++i) {
    scene.render(maq_pinhole_camera{}, -1);
    EXPECT_EQ(scene.state()->phase, maquette::LiveSceneState::kOpening);
    EXPECT_FALSE(scene.images().take());
    scene.close();
    EXPECT_EQ(scene.state()->phase, maquette::LiveSceneState::kClosed);
    scene.open(small_room());
  }
  lock.unlock();
  EXPECT_TRUE(wait_until_open(scene));
}

TEST(LiveScene, WorksAtALowerPriorityThanTheWindow) {
  const int own = getpriority(PRIO_PROCESS, 0);
  const std::set<int> before = threads_of_this_process();  // this one, and those of a sanitizer
  const maquette::Context context;
  maquette::LiveScene scene(context, kBundle, 2);
  scene.open(small_room());
  ASSERT_TRUE(wait_until_open(scene));
  std::multiset<int> others;
  for (const int id : threads_of_this_process()) {
    if (before.count(id) == 0) others.insert(getpriority(PRIO_PROCESS, id_t(id)));
  }
  EXPECT_EQ(getpriority(PRIO_PROCESS, 0), own);
  EXPECT_GE(others.size(), 2u) << "its own and one of the networks";
  EXPECT_EQ(others.count(std::min(own + 5, 19)), others.size());
}

}  // namespace
