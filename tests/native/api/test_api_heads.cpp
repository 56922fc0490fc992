// Heads through the C API: from a photo to meshes and files, what is refused with which sentence, cancelling.
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <maquette/maquette.hpp>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>
#include <vector>

#include "support/file_size_limit.h"
#include "support/samples/round_heads.h"
#include "support/temp_folder.h"

namespace api_heads_tests {
namespace {

using namespace round_heads;  // NOLINT

constexpr float kNotANumber = std::numeric_limits<float>::quiet_NaN();

class ApiHeads : public RoundHeads {};

TEST_F(ApiHeads, APhotoBecomesAHeadWithAMeshAndLandmarks) {
  builder.add_photo(frame, known);
  std::vector<double> done;
  maquette::Head head = fit(0, [&](double fraction) {
    done.push_back(fraction);
    return true;
  });
  EXPECT_EQ(progress.last_stage, "The head is fitted.");
  ASSERT_GE(done.size(), 2u);
  EXPECT_EQ(done.front(), 0);
  EXPECT_EQ(done.back(), 1);
  const maq_head_info info = head.info();
  EXPECT_EQ(info.photo_count, 1u);
  EXPECT_EQ(info.scale, MAQ_HEAD_SCALE_PRIOR);
  EXPECT_NEAR(info.scale_sigma, 0.07 / std::sqrt(3.0), 0.005) << "three axes that differ by 7 %";
  EXPECT_EQ(head.landmark_names(),
            (std::vector<std::string>{"nose_tip", "chin", "crown", "pupil_left", "pupil_right"}));
  // On the prior's mean the pupils are 63.7 mm apart and the crown is at 121 mm. The encoder saw a head that is
  // narrower by 1.105 and taller by 1 / 0.895; no photo tells its size.
  const maq_head_landmark crown = head.landmark("crown"), left = head.landmark("pupil_left");
  EXPECT_NEAR(2 * left.point_m[0] / crown.point_m[1], 63.7 / 121 * 0.895 / 1.105, 0.015);
  // By the anchors it is 1 mm, and the photo leaves more of the depth than of the height (a fit in torch says as
  // much).
  EXPECT_NEAR(crown.sigma_m, 0.0021, 1e-4);
  EXPECT_NEAR(head.landmark("nose_tip").sigma_m, 0.0031, 1e-4);
  EXPECT_NEAR(left.point_m[0], -head.landmark("pupil_right").point_m[0], 1e-3);
  EXPECT_GT(left.point_m[0], 0.02) << "left is the person's";

  const float crown_m = float(crown.point_m[1]);
  const Mesh mesh(head, of_cell(0.004));
  ASSERT_GT(mesh.vertex_count, 1000u);
  EXPECT_EQ(mesh.triangle_count, 2 * (mesh.vertex_count - 2)) << "closed, of one piece without holes";
  for (uint32_t i = 0; i < mesh.vertex_count; ++i) {
    const float *p = mesh.positions_m + 3 * i, *n = mesh.normals + 3 * i, *t = mesh.template_points_m + 3 * i;
    ASSERT_LT(std::abs(p[0]) + std::abs(p[1]) + std::abs(p[2]), 0.3f);
    ASSERT_GE(p[1], -0.0951f) << "cut off below";
    ASSERT_NEAR(n[0] * n[0] + n[1] * n[1] + n[2] * n[2], 1, 1e-4);
    ASSERT_NEAR(t[1] * crown_m, p[1] * 0.121f, 1e-3f) << "on the template head the crown is at 121 mm";
  }
  for (uint32_t i = 0; i < 3 * mesh.triangle_count; ++i) ASSERT_LT(mesh.triangles[i], mesh.vertex_count);
  EXPECT_GT(Mesh(head, of_cell(0.002)).vertex_count, 3 * mesh.vertex_count);

  const maq_head_build_stats stats = builder.stats();
  EXPECT_EQ(stats.photo_count, 1u);
  EXPECT_EQ(stats.used_photo_count, 1u);
  EXPECT_GT(stats.encode_ms, 0);
  EXPECT_GT(stats.pose_ms, 0);
  EXPECT_GE(stats.total_ms, stats.pose_ms);
  EXPECT_EQ(stats.step_count, 0);
  EXPECT_GE(stats.threads, 1);
  const maq_head_photo_info photo = builder.photo(0);
  EXPECT_EQ(photo.is_used, 1);
  EXPECT_GT(photo.focal_px, 100);
  EXPECT_LT(photo.rms_px, 2);
  EXPECT_NEAR(photo.head_coverage, 0.22, 0.05);
  EXPECT_EQ(std::memcmp(photo.box_px, known.box_px, sizeof photo.box_px), 0);
}

TEST_F(ApiHeads, TheFitToThePixelsTakesTheColourOfThePhoto) {
  const maquette::Head seen = fitted();
  maquette::Head head = fitted(20);
  EXPECT_GT(builder.stats().step_count, 0);
  EXPECT_GT(builder.stats().fit_ms, 0);
  maquette::Head first = fitted();
  const auto reddest = [](const maquette::Head& of) {
    const Mesh mesh(of, of_cell(0.008));
    double sum = 0;
    for (uint32_t i = 0; i < mesh.vertex_count; ++i) sum += mesh.colours_rgb[3 * i];
    return sum / mesh.vertex_count;
  };
  EXPECT_NEAR(reddest(first), 178, 15) << "the prior's mean";
  EXPECT_LT(std::abs(reddest(head) - 140), std::abs(reddest(first) - 140));
}

TEST_F(ApiHeads, AKnownFocalLengthIsKept) {
  maq_head_photo photo = known;
  photo.focal_px = 777;
  builder.add_photo(frame, photo);
  builder.fit(0);
  EXPECT_FLOAT_EQ(builder.photo(0).focal_px, 777);
}

TEST_F(ApiHeads, WithoutABoxTheHeadIsLookedFor) {
  builder.add_photo(frame);
  const maq_head_photo_info found = builder.photo(0);
  // The encoder sees the head wherever it looks, smaller each time by the margin of its crop.
  EXPECT_GT(found.box_px[0], 0);
  EXPECT_LT(found.box_px[2] - found.box_px[0], found.box_px[3] - found.box_px[1]) << "heads are taller than wide";
  EXPECT_NEAR((found.box_px[0] + found.box_px[2]) / 2, 160, 15);
  EXPECT_NEAR((found.box_px[1] + found.box_px[3]) / 2, 120, 15);
  EXPECT_EQ(builder.fit(0).info().photo_count, 1u);
}

TEST_F(ApiHeads, PhotosWithoutAHeadAndThoseOfAnotherAreTold) {
  expect_refused(MAQ_ERROR_NOT_FOUND, "No head is seen in the box", black_frame.get(), known);
  expect_refused(MAQ_ERROR_NOT_FOUND, "No head is seen in the photo of 320 x 240", black_frame.get(),
                 maquette::default_head_photo());
  EXPECT_EQ(builder.stats().photo_count, 0u) << "it is as it was";
  builder.add_photo(frame, known);
  builder.add_photo(blue_frame, known);
  builder.add_photo(frame, with_box(100, 50, 190, 170));
  EXPECT_EQ(builder.fit(0).info().photo_count, 2u);
  EXPECT_EQ(builder.stats().used_photo_count, 2u);
  EXPECT_EQ(builder.photo(0).is_used, 1);
  EXPECT_EQ(builder.photo(1).is_used, 0) << "a mirrored head";
  EXPECT_EQ(builder.photo(1).focal_px, 0);
  EXPECT_EQ(builder.photo(2).is_used, 1);
  builder.clear();
  EXPECT_EQ(builder.stats().photo_count, 0u);
  builder.add_photo(blue_frame, known);
  maq_head* made = nullptr;
  EXPECT_EQ(maq_head_builder_fit(builder.get(), 0, &made), MAQ_ERROR_NOT_FOUND);
  EXPECT_EQ(made, nullptr);
  expect_text("does not show a head that can be fitted");
}

TEST_F(ApiHeads, WrongBoxesRollsAndFocalLengthsAreASentence) {
  const float far = std::numeric_limits<float>::infinity();
  for (const auto& [photo, text] : std::vector<std::pair<maq_head_photo, const char*>>{
           {with_box(400, 60, 500, 180), "outside of the photo"},
           {with_box(110, 260, 200, 380), "outside of the photo"},
           {with_box(-90, 60, -10, 180), "outside of the photo"},
           {with_box(200, 60, 110, 180), "empty"},
           {with_box(110, 60, 110, 180), "empty"},
           {with_box(110, kNotANumber, 200, 180), "not finite"},
           {with_box(110, 60, far, 180), "not finite"},
       }) {
    expect_refused(MAQ_ERROR_INVALID_ARGUMENT, text, frame.get(), photo);
  }
  for (const float focal_px : {-1.0f, kNotANumber, far, 1e-6f, 1e12f}) {
    maq_head_photo photo = known;
    photo.focal_px = focal_px;
    expect_refused(MAQ_ERROR_INVALID_ARGUMENT, "The focal length is", frame.get(), photo);
  }
  for (const float roll_rad : {kNotANumber, far, -8.0f}) {
    maq_head_photo photo = known;
    photo.roll_rad = roll_rad;
    expect_refused(MAQ_ERROR_INVALID_ARGUMENT, "The roll of the head is", frame.get(), photo);
  }
  maq_head_photo photo = known;
  photo.struct_size = 4;
  expect_refused(MAQ_ERROR_INVALID_ARGUMENT, "photo.struct_size is 4", frame.get(), photo);
  expect_refused(MAQ_ERROR_INVALID_ARGUMENT, "frame is NULL", nullptr, known);
  builder.add_photo(frame, with_box(-50, -40, 200, 180));
}

TEST_F(ApiHeads, PhotosOfOnePixelAndOfOneHundredMillionHaveAnAnswer) {
  const PlainPhoto dot(1, 1);
  const maquette::Frame tiny(context, dot.desc);
  const maq_status status = maq_head_builder_add_photo(builder.get(), tiny.get(), nullptr);
  EXPECT_TRUE(status == MAQ_OK || status == MAQ_ERROR_NOT_FOUND || status == MAQ_ERROR_INVALID_ARGUMENT)
      << maq_last_error(nullptr);
  builder.clear();
  maq_frame_desc desc;
  maq_frame_desc_init(&desc, sizeof desc);
  desc.format = MAQ_PIXEL_GREY8;
  desc.width_px = 12500;
  desc.height_px = 8000;
  std::vector<uint8_t> pixels(size_t(12500) * 8000, 130);
  desc.planes[0] = pixels.data();
  maq_frame* large = nullptr;
  if (maq_frame_wrap(context.get(), &desc, nullptr, nullptr, &large) != MAQ_OK) {
    expect_text("pixels");
    return;
  }
  EXPECT_EQ(maq_head_builder_add_photo(builder.get(), large, nullptr), MAQ_OK) << maq_last_error(nullptr);
  EXPECT_EQ(builder.fit(0).info().photo_count, 1u);
  maq_frame_release(large);
}

TEST_F(ApiHeads, TimesOutOfRangeAndFitsWithoutPhotosAreRefused) {
  maq_head* made = nullptr;
  EXPECT_EQ(maq_head_builder_fit(builder.get(), 1, &made), MAQ_ERROR_INVALID_ARGUMENT);
  expect_text("There are no photos");
  builder.add_photo(frame, known);
  for (const double seconds : {-1.0, 1e9, double(kNotANumber)}) {
    EXPECT_EQ(maq_head_builder_fit(builder.get(), seconds, &made), MAQ_ERROR_INVALID_ARGUMENT);
    expect_text("The time for the fit");
  }
  EXPECT_EQ(made, nullptr);
  for (int i = 1; i < 64; ++i) builder.add_photo(frame, known);
  expect_refused(MAQ_ERROR_INVALID_ARGUMENT, "There are 64 photos already", frame.get(), known);
}

TEST_F(ApiHeads, CancellingEndsWhatRunsOrElseTheNextAndNothingAfterThat) {
  builder.cancel();
  expect_refused(MAQ_CANCELLED, "", frame.get(), known);
  EXPECT_EQ(builder.stats().photo_count, 0u);
  builder.add_photo(frame, known);
  maq_head* made = nullptr;
  builder.cancel();
  EXPECT_EQ(maq_head_builder_fit(builder.get(), 0, &made), MAQ_CANCELLED);
  // By the callback, at each of its first calls. The fit may take an hour, so that a slow machine has these calls too.
  for (int wanted = 1; wanted <= 6; ++wanted) {
    int calls = 0;
    try {
      fit(3600, [&](double) { return ++calls != wanted; });
      ADD_FAILURE() << "call " << wanted << " of " << calls;
    } catch (const maquette::Error& error) {
      EXPECT_EQ(error.status(), MAQ_CANCELLED) << error.what();
      EXPECT_EQ(calls, wanted);
    }
  }
  // From another thread, once the fit has begun.
  std::atomic<bool> has_begun{false};
  std::thread other([&] {
    while (!has_begun) std::this_thread::yield();
    builder.cancel();
  });
  bool was_cancelled = false;
  try {
    fit(3600, [&](double) { return has_begun = true; });
  } catch (const maquette::Error& error) {
    was_cancelled = error.status() == MAQ_CANCELLED;
  }
  other.join();
  if (!was_cancelled) {  // the fit was faster
    EXPECT_EQ(maq_head_builder_fit(builder.get(), 0, &made), MAQ_CANCELLED);
  }
  EXPECT_EQ(builder.fit(0).info().photo_count, 1u);
}

TEST_F(ApiHeads, ABuilderHasOneCallAtATimeAndItsCallbackNone) {
  builder.add_photo(frame, known);
  maq_status inside = MAQ_OK;
  fit(0, [&](double) {
    inside = maq_head_builder_clear(builder.get());
    return true;
  });
  EXPECT_EQ(inside, MAQ_ERROR_INVALID_ARGUMENT);
  expect_text("builder is in use by another call");
}

TEST_F(ApiHeads, HeadsOutliveTheirBuilderAndAreSavedAndOpened) {
  const TempFolder folder;
  const std::string path = folder.file("a.maqh");
  maquette::Head head(nullptr);
  {
    const maquette::Context another;
    maquette::HeadBuilder made(another, kHeadsBundle);
    made.add_photo(frame, known);
    head = made.fit(0);
  }
  head.save(path);
  EXPECT_LT(std::filesystem::file_size(path), 65536u);
  maquette::Head opened = maquette::Head::open(context, path);
  EXPECT_EQ(opened.info().photo_count, 1u);
  EXPECT_EQ(opened.info().scale_sigma, head.info().scale_sigma);
  EXPECT_EQ(opened.landmark_names(), head.landmark_names());
  for (size_t axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(opened.landmark("chin").point_m[axis], head.landmark("chin").point_m[axis], 1e-4) << "as float16";
  }
  EXPECT_NEAR(Mesh(opened, of_cell(0.008)).vertex_count, Mesh(head, of_cell(0.008)).vertex_count, 30);
}

TEST_F(ApiHeads, PhotosAreAddedToAHeadFromAFile) {
  const TempFolder folder;
  fitted().scaled_by_distance("pupil_left", "pupil_right", 0.06).save(folder.file("a.maqh"));
  const maquette::Head first = maquette::Head::open(context, folder.file("a.maqh"));
  builder.clear();
  builder.add_head(first);
  maq_head* none = nullptr;
  EXPECT_EQ(maq_head_builder_fit(builder.get(), 0, &none), MAQ_ERROR_INVALID_ARGUMENT);
  expect_text("no photos");
  builder.add_photo(frame, with_box(100, 50, 210, 200));
  const maquette::Head both = builder.fit(0);
  EXPECT_EQ(both.info().photo_count, 2u);
  EXPECT_EQ(builder.stats().used_photo_count, 1u);
  EXPECT_EQ(both.camera(0).intrinsics.fx_px, first.camera(0).intrinsics.fx_px) << "that of its photo, as it was";
  EXPECT_EQ(both.info().scale, MAQ_HEAD_SCALE_GIVEN);
  EXPECT_NEAR(2 * both.landmark("pupil_left").point_m[0], 0.06, 0.001);
  EXPECT_LT(both.landmark("nose_tip").sigma_m, first.landmark("nose_tip").sigma_m);
  both.save(folder.file("a.maqh"));
  EXPECT_EQ(maquette::Head::open(context, folder.file("a.maqh")).info().photo_count, 2u) << "and so on";
  builder.clear();
  builder.add_photo(frame, known);
  EXPECT_EQ(builder.fit(0).info().photo_count, 1u) << "forgotten";

  builder.clear();
  builder.add_head(first);
  builder.add_photo(blue_frame, known);
  EXPECT_EQ(maq_head_builder_fit(builder.get(), 0, &none), MAQ_ERROR_NOT_FOUND) << "a mirrored head";
  maquette::HeadBuilder of_another_bundle(context, MAQ_TEST_MODELS "/heads-int8");
  EXPECT_EQ(maq_head_builder_add_head(of_another_bundle.get(), first.get()), MAQ_ERROR_UNSUPPORTED);
  expect_text("another bundle");
}

TEST_F(ApiHeads, MeshesHaveAsManyTrianglesAsAreAskedFor) {
  maquette::Head head = fitted();
  const auto count = [&](double cell_m, uint32_t triangles) {
    maq_head_mesh_config options = of_cell(cell_m);
    options.triangle_count = triangles;
    const Mesh mesh(head, options);
    EXPECT_EQ(mesh.triangle_count, 2 * (mesh.vertex_count - 2)) << "closed, of one piece without holes";
    return mesh.triangle_count;
  };
  const uint32_t full = count(0, MAQ_HEAD_ALL_TRIANGLES);
  maq_head_mesh_config many = maquette::default_head_mesh_config();
  many.triangle_count = 60000;
  const Mesh fewer(head, many);
  EXPECT_EQ(fewer.triangle_count, 60000u);
  EXPECT_GT(fewer.simplification_error_m, 0);
  EXPECT_LT(fewer.simplification_error_m, 2e-4f);
  EXPECT_EQ(Mesh(head).simplification_error_m, 0) << "the animatable head";
  EXPECT_GT(full, 60000u);
  EXPECT_EQ(count(0, 2000), 2000u);
  EXPECT_EQ(count(0.0016, 0), full) << "with a cell the default is all";
  EXPECT_EQ(Mesh(head, of_cell(0.0016)).simplification_error_m, 0);
  EXPECT_EQ(count(0, full + 1), full);
  maq_head_mesh* none = nullptr;
  maq_head_mesh_config config = maquette::default_head_mesh_config();
  config.triangle_count = 99;
  EXPECT_EQ(maq_head_mesh_create(head.get(), &config, &none), MAQ_ERROR_INVALID_ARGUMENT);
  expect_text("config.triangle_count is 99");
  config.struct_size = 1;
  EXPECT_EQ(maq_head_mesh_create(head.get(), &config, &none), MAQ_ERROR_INVALID_ARGUMENT);
  expect_text("config.struct_size");
  EXPECT_EQ(none, nullptr);
}

TEST_F(ApiHeads, AHeadHasATextureUnlessItIsSwitchedOff) {
  const TempFolder folder;
  maquette::Head plain = fitted();
  EXPECT_EQ(plain.info().texture_px, 0u);
  EXPECT_EQ(Mesh(plain, coarse).texture_jpeg, nullptr);
  EXPECT_EQ(Mesh(plain, coarse).texture_coordinates, nullptr);
  maq_head_builder_config config = maquette::default_head_builder_config();
  config.model.bundle_path = kHeadsBundle;
  config.texture_px = 256;
  maquette::HeadBuilder textured(context, config);
  textured.add_photo(frame, known);
  maquette::Head head = textured.fit(0);
  EXPECT_EQ(head.info().texture_px, 256u);
  const Mesh mesh(head, coarse);
  ASSERT_NE(mesh.texture_jpeg, nullptr);
  ASSERT_NE(mesh.texture_coordinates, nullptr);
  const std::string jpeg(reinterpret_cast<const char*>(mesh.texture_jpeg), mesh.texture_bytes);
  EXPECT_EQ(jpeg.substr(0, 2), "\xFF\xD8");
  EXPECT_GT(mesh.vertex_count, Mesh(plain, coarse).vertex_count) << "the cap's rim";
  for (uint32_t i = 0; i < 2 * mesh.vertex_count; ++i) {
    ASSERT_GE(mesh.texture_coordinates[i], 0);
    ASSERT_LE(mesh.texture_coordinates[i], 1);
  }
  // The photo is of one colour, (140, 130, 120); the nose of the plain head is redder.
  write_text(folder.file("texture.jpg"), jpeg);
  maquette::Source source(context, "image:" + folder.file("texture.jpg"));
  const std::optional<maquette::Frame> texture = source.next();
  ASSERT_TRUE(texture);
  EXPECT_EQ(texture->desc().width_px, 256);
  EXPECT_EQ(texture->desc().height_px, 256);
  const maq_frame_desc desc = texture->desc();
  const uint8_t* const row = desc.planes[0] + 190 * desc.stride_bytes[0];
  for (size_t c = 0; c < 3; ++c) EXPECT_NEAR(row[3 * 128 + c], 120 + 10 * int(c), 6) << "B, G, R of the face";
  maquette::HeadMesh(head, coarse).save(folder.file("a.glb"));
  EXPECT_NE(read_text(folder.file("a.glb")).find(jpeg), std::string::npos);
  maquette::HeadMesh(head, coarse).save(folder.file("a.obj"));
  EXPECT_EQ(read_text(folder.file("a.jpg")), jpeg);
  head.save(folder.file("a.maqh"));
  maquette::Head opened = maquette::Head::open(context, folder.file("a.maqh"));
  const Mesh again(opened, coarse);
  EXPECT_EQ(std::string(reinterpret_cast<const char*>(again.texture_jpeg), again.texture_bytes), jpeg);
  config.delight_texture = 2;
  maq_head_builder* none = nullptr;
  EXPECT_EQ(maq_head_builder_create(context.get(), &config, &none), MAQ_ERROR_INVALID_ARGUMENT);
  expect_text("config.delight_texture is 2");
  config.delight_texture = 1;
  for (const uint32_t side : {1u, 255u, 2049u}) {
    config.texture_px = side;
    maq_head_builder* made = nullptr;
    EXPECT_EQ(maq_head_builder_create(context.get(), &config, &made), MAQ_ERROR_INVALID_ARGUMENT);
    expect_text("config.texture_px is ");
  }
  config.texture = MAQ_HEAD_TEXTURE_OFF;
  config.texture_px = 256;
  EXPECT_EQ(maq_head_builder_create(context.get(), &config, &none), MAQ_ERROR_INVALID_ARGUMENT);
  expect_text("config.texture is MAQ_HEAD_TEXTURE_OFF");
}

TEST_F(ApiHeads, MeshesAreWrittenByTheirEnding) {
  const TempFolder folder;
  maquette::Head head = fitted();
  const maquette::HeadMesh mesh(head, of_cell(0.008));
  for (const char* name : {"a.glb", "a.obj", "a.ply"}) mesh.save(folder.file(name));
  EXPECT_EQ(read_text(folder.file("a.glb")).substr(0, 4), "glTF");
  EXPECT_EQ(read_text(folder.file("a.ply")).substr(0, 4), "ply\n");
  EXPECT_TRUE(std::filesystem::exists(folder.file("a.mtl")));
  for (const char* name : {"a.stl", "a", "a.GLB", ""}) {
    EXPECT_EQ(maq_head_mesh_save(mesh.get(), folder.file(name).c_str()), MAQ_ERROR_INVALID_ARGUMENT) << name;
  }
  EXPECT_EQ(maq_head_mesh_save(mesh.get(), "/nowhere/a.glb"), MAQ_ERROR_UNWRITABLE);
  EXPECT_EQ(maq_head_save(head.get(), "/nowhere/a.maqh"), MAQ_ERROR_UNWRITABLE);
}

TEST_F(ApiHeads, AFullDiskLeavesWhatWasThere) {
  const TempFolder folder;
  maquette::Head head = fitted();
  for (const char* name : {"a.glb", "a.ply", "a.maqh"}) write_text(folder.file(name), name);
  {
    const maquette::HeadMesh mesh(head, coarse);
    const FileSizeLimit limit(100);
    EXPECT_EQ(maq_head_mesh_save(mesh.get(), folder.file("a.glb").c_str()), MAQ_ERROR_UNWRITABLE);
    EXPECT_EQ(maq_head_mesh_save(mesh.get(), folder.file("a.ply").c_str()), MAQ_ERROR_UNWRITABLE);
    EXPECT_EQ(maq_head_save(head.get(), folder.file("a.maqh").c_str()), MAQ_ERROR_UNWRITABLE);
  }
  for (const char* name : {"a.glb", "a.ply", "a.maqh"}) EXPECT_EQ(read_text(folder.file(name)), name);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 3) << "nothing else is left";
}

TEST_F(ApiHeads, WhatIsAskedOfAHeadIsChecked) {
  maquette::Head head = fitted();
  maq_head_landmark landmark{};
  landmark.struct_size = sizeof landmark;
  EXPECT_EQ(maq_head_get_landmark(head.get(), "elbow", &landmark), MAQ_ERROR_NOT_FOUND);
  expect_text("no landmark named \"elbow\"");
  EXPECT_EQ(maq_head_get_landmark_name(head.get(), 5), nullptr);
}

TEST_F(ApiHeads, FilesThatAreNoHeadsAreASentence) {
  const TempFolder folder;
  const auto refused = [&](const std::string& path, maq_status status) {
    maq_head* opened = nullptr;
    EXPECT_EQ(maq_head_open(context.get(), path.c_str(), &opened), status) << path;
    EXPECT_EQ(opened, nullptr);
    expect_text(std::filesystem::path(path).filename().c_str());
  };
  refused(folder.file("none.maqh"), MAQ_ERROR_NOT_FOUND);
  write_text(folder.file("text.maqh"), "not a head");
  refused(folder.file("text.maqh"), MAQ_ERROR_UNREADABLE);
  fitted().save(folder.file("a.maqh"));
  const std::string bytes = read_text(folder.file("a.maqh"));
  write_text(folder.file("short.maqh"), bytes.substr(0, bytes.size() - 1));
  refused(folder.file("short.maqh"), MAQ_ERROR_UNREADABLE);
  maq_head* opened = nullptr;
  EXPECT_EQ(maq_head_open(context.get(), nullptr, &opened), MAQ_ERROR_INVALID_ARGUMENT);
}

TEST_F(ApiHeads, WrongBundlesAndSettingsAreASentence) {
  const auto refused = [&](const maq_head_builder_config& config, maq_status status, const char* text) {
    maq_head_builder* made = nullptr;
    EXPECT_EQ(maq_head_builder_create(context.get(), &config, &made), status);
    EXPECT_EQ(made, nullptr);
    expect_text(text);
  };
  maq_head_builder_config config = maquette::default_head_builder_config();
  config.model.bundle_path = MAQ_TEST_DATA "/tiny_bundle";
  refused(config, MAQ_ERROR_UNSUPPORTED, "densepose");
  config.model.bundle_path = "/nowhere";
  refused(config, MAQ_ERROR_NOT_FOUND, "/nowhere");
  const TempFolder folder;
  std::filesystem::copy(kHeadsBundle, folder.path());
  for (const char* name : {"prior.maqp", "encoder.onnx", "template.maqt"}) {
    const std::string before = read_text(folder.file(name));
    std::string bytes = before;
    bytes[bytes.size() / 2] = char(bytes[bytes.size() / 2] ^ 1);
    write_text(folder.file(name), bytes);
    const std::string path = folder.path().string();
    config.model.bundle_path = path.c_str();
    refused(config, MAQ_ERROR_BAD_BUNDLE, name);
    write_text(folder.file(name), before);
  }
}

TEST_F(ApiHeads, ABundleInMemoryAndAnyNumberOfThreadsGiveTheSame) {
  std::vector<std::pair<std::string, std::string>> contents;
  for (const char* name : {"manifest.json", "encoder.onnx", "prior.maqp", "template.maqt"}) {
    contents.emplace_back(name, read_text(std::string(kHeadsBundle) + "/" + name));
  }
  std::vector<maq_memory_file> files;
  for (const auto& [name, bytes] : contents) files.push_back({name.c_str(), bytes.data(), bytes.size()});
  maq_head_builder_config config = maquette::default_head_builder_config();
  config.model.bundle_files = files.data();
  config.model.bundle_file_count = uint32_t(files.size());
  config.model.threads = 3;
  config.texture = MAQ_HEAD_TEXTURE_OFF;  // as in fitted()
  maquette::HeadBuilder in_memory(context, config);
  for (auto& [name, bytes] : contents) bytes.assign(bytes.size(), 'x');
  in_memory.add_photo(frame, known);
  EXPECT_EQ(in_memory.stats().threads, 3);
  maquette::Head one = in_memory.fit(0), other = fitted();
  const Mesh a(one, of_cell(0.008)), b = Mesh(other, of_cell(0.008));
  ASSERT_EQ(a.vertex_count, b.vertex_count);
  EXPECT_EQ(std::memcmp(a.positions_m, b.positions_m, 12 * size_t(a.vertex_count)), 0);
}

TEST_F(ApiHeads, HeadsOfOneBuilderEachMayBeMadeByManyThreads) {
  std::vector<std::thread> threads;
  std::atomic<int> made{0};
  for (int i = 0; i < 3; ++i) {
    threads.emplace_back([&] {
      maquette::HeadBuilder own(context, kHeadsBundle);
      own.add_photo(frame, known);
      maquette::Head head = own.fit(0);
      made += Mesh(head, of_cell(0.008)).vertex_count > 100;
    });
  }
  const maquette::Head shared = fitted();
  for (int i = 0; i < 3; ++i) {
    threads.emplace_back([&] {  // "any thread"
      for (int k = 0; k < 50; ++k) made += shared.info().photo_count == 1 && shared.landmark("chin").sigma_m > 0;
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(made, 153);
}

TEST_F(ApiHeads, DensePoseGivesBoxesOfHeads) {
  maquette::DensePose densepose(context, MAQ_TEST_MODELS "/densepose-b-int8");
  maquette::Source people_source(context, "stub:people?count=3&seed=7&size=640x480");
  const maquette::DensePoseResult result = densepose.run(*people_source.next());
  ASSERT_GE(result.person_count(), 2u);
  size_t stride = 0;
  const uint8_t* const parts = result.plane(MAQ_DENSEPOSE_PLANE_PART, &stride);
  const uint8_t* const people = result.plane(MAQ_DENSEPOSE_PLANE_PERSON, &stride);
  int boxes = 0;
  for (uint32_t person = 0; person < result.person_count(); ++person) {
    const auto box = result.head_box_px(person);
    bool is_tight[4] = {}, has_head = false;
    for (int y = 0; y < result.height_px(); ++y) {
      for (int x = 0; x < result.width_px(); ++x) {
        const size_t at = size_t(y) * stride + size_t(x);
        if (parts[at] < 23 || people[at] != person + 1) continue;
        has_head = true;
        ASSERT_TRUE(box);
        const float left = float(x), top = float(y);
        ASSERT_TRUE(left >= (*box)[0] && top >= (*box)[1] && left + 1 <= (*box)[2] && top + 1 <= (*box)[3]);
        is_tight[0] |= left == (*box)[0], is_tight[1] |= top == (*box)[1];
        is_tight[2] |= left + 1 == (*box)[2], is_tight[3] |= top + 1 == (*box)[3];
      }
    }
    ASSERT_EQ(box.has_value(), has_head);
    if (!box) continue;
    ++boxes;
    EXPECT_TRUE(is_tight[0] && is_tight[1] && is_tight[2] && is_tight[3]);
  }
  EXPECT_GE(boxes, 2);
  float box_px[4];
  EXPECT_EQ(maq_densepose_result_get_head_box(result.get(), 99, box_px), MAQ_ERROR_INVALID_ARGUMENT);
}

}  // namespace
}  // namespace api_heads_tests
