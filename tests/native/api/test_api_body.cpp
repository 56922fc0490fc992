// Bodies through the C API: people of a photo, what is refused with which sentence, files.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <maquette/maquette.hpp>
#include <vector>

#include "support/temp_folder.h"

namespace {

class ApiBody : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    const maquette::Context context;
    const maquette::DensePose densepose(context, MAQ_TEST_MODELS "/densepose-b-int8");
    maquette::Source source(context, "image:" MAQ_TEST_MEDIA "/photo.jpg");
    frame_ = new maquette::Frame(std::move(*source.next()));
    people_ = new maquette::DensePoseResult(const_cast<maquette::DensePose&>(densepose).run(*frame_));
  }
  static void TearDownTestSuite() {
    delete people_;
    delete frame_;
  }

  maq_body_input input() const {
    maq_body_input made = maquette::default_body_input();
    made.width_px = people_->width_px(), made.height_px = people_->height_px();
    const auto plane = [&](maq_densepose_plane which) {
      const uint8_t* pixels = nullptr;
      EXPECT_EQ(maq_densepose_result_get_plane(people_->get(), which, &pixels, &made.stride_bytes), MAQ_OK);
      return pixels;
    };
    made.part = plane(MAQ_DENSEPOSE_PLANE_PART);
    made.u = plane(MAQ_DENSEPOSE_PLANE_U);
    made.v = plane(MAQ_DENSEPOSE_PLANE_V);
    made.person = plane(MAQ_DENSEPOSE_PLANE_PERSON);
    made.person_count = 1;
    return made;
  }

  void expect_refused(const maq_body_input& given, const char* text) {
    maq_body_result* result = nullptr;
    EXPECT_EQ(maq_body_run(body.get(), &given, &result), MAQ_ERROR_INVALID_ARGUMENT) << text;
    EXPECT_EQ(result, nullptr);
    EXPECT_NE(std::strstr(maq_last_error(body.get()), text), nullptr) << maq_last_error(body.get());
  }

  static maquette::Frame* frame_;
  static maquette::DensePoseResult* people_;
  const maquette::Context context;
  maquette::Body body{context, [] {
                        maq_body_config config = maquette::default_body_config();
                        config.model.bundle_path = MAQ_TEST_MODELS "/body";
                        config.result_pool_size = 2;
                        return config;
                      }()};
};

maquette::Frame* ApiBody::frame_ = nullptr;
maquette::DensePoseResult* ApiBody::people_ = nullptr;

TEST_F(ApiBody, GivesMeshJointsKeypointsAndAnglesOfAPerson) {
  const maq_body_mesh mesh = body.mesh();
  EXPECT_GE(mesh.vertex_count, 1500u);
  EXPECT_EQ(mesh.joint_count, 19u);
  EXPECT_STREQ(mesh.joint_names[0], "pelvis");
  EXPECT_EQ(mesh.joint_parents[0], -1);
  EXPECT_EQ(mesh.shape_count, 10u);
  const maquette::BodyResult result = body.run(*people_, frame_->desc());
  const std::vector<maq_body_person> people = result.people();
  ASSERT_EQ(people.size(), people_->people().size());
  const maq_body_person& person = people[0];
  ASSERT_EQ(person.fit, MAQ_BODY_FIT_FITTED);
  EXPECT_EQ(person.id, people_->people()[0].id);
  EXPECT_GT(person.inlier_fraction, 0.6f);
  EXPECT_EQ(person.is_metric, 0);
  EXPECT_GT(person.scale_px_per_m, 100);
  for (const float angle : person.angles_deg) EXPECT_TRUE(angle >= -180 && angle <= 180) << angle;
  // The photo shows a person upright and from the front: the nose is above the pelvis, and nearer than an ear.
  const auto at = [&](int keypoint) { return person.keypoints_m + 3 * keypoint; };
  EXPECT_LT(at(0)[1], -0.4f);
  EXPECT_LT(at(0)[2], at(7)[2]);
  EXPECT_GT(at(11)[0], at(12)[0] + 0.15f);  // the left shoulder is at the right
  for (uint32_t i = 0; i < 3 * mesh.vertex_count; ++i) ASSERT_LT(std::abs(person.vertices_m[i]), 2.0f);
  for (uint32_t s = 0; s < mesh.shape_count; ++s) EXPECT_LE(std::abs(person.shape[s]), 3.0f);
  // The seen nose lies where the image shows it.
  const float x = person.pelvis_px[0] + person.scale_px_per_m * at(0)[0];
  EXPECT_NEAR(x, 224, 25);
}

TEST_F(ApiBody, WithIntrinsicsThePelvisHasAPlaceInMetres) {
  maq_body_input given = input();
  const maq_intrinsics camera = {given.width_px, given.height_px, 700, 700, 255.5, 255.5, {}};
  given.intrinsics = &camera;
  const std::vector<maq_body_person> people = body.run(given).people();
  ASSERT_EQ(people[0].fit, MAQ_BODY_FIT_FITTED);
  EXPECT_EQ(people[0].is_metric, 1);
  EXPECT_GT(people[0].pelvis_m[2], 0.5f);
  EXPECT_LT(people[0].pelvis_m[2], 3.0f);
  EXPECT_NEAR(people[0].scale_px_per_m, 700 / people[0].pelvis_m[2], 1);
}

TEST_F(ApiBody, SizesHaveIntervalsAndAHeightSetsTheScale) {
  maq_body_input given = input();
  const maq_intrinsics camera = {given.width_px, given.height_px, 700, 700, 255.5, 255.5, {}};
  given.intrinsics = &camera;
  const maquette::BodyResult unknown = body.run(given);
  const maq_body_sizes wide = unknown.sizes(0);
  EXPECT_EQ(wide.is_height_known, 0);
  for (const maq_body_size& size : {wide.height, wide.chest, wide.waist, wide.hip, wide.inseam}) {
    EXPECT_GT(size.low_m, 0.3f);
    EXPECT_LT(size.low_m, size.value_m);
    EXPECT_LT(size.value_m, size.high_m);
    EXPECT_LT(size.high_m, 2.8f);
  }
  const float height_m = 1.5f;
  given.heights_m = &height_m;
  const maquette::BodyResult known = body.run(given);
  const maq_body_sizes sizes = known.sizes(0);
  EXPECT_EQ(sizes.is_height_known, 1);
  EXPECT_FLOAT_EQ(sizes.height.value_m, 1.5f);
  EXPECT_EQ(sizes.height.low_m, sizes.height.high_m);
  EXPECT_LT(sizes.inseam.high_m - sizes.inseam.low_m, wide.inseam.high_m - wide.inseam.low_m);
  EXPECT_NEAR(known.people()[0].pelvis_m[2] / unknown.people()[0].pelvis_m[2], 1.5f / wide.height.value_m, 0.06f);
  // The mesh at rest is 1.5 m tall, so its trunk in this pose is shorter than that of the taller body.
  EXPECT_GT(known.people()[0].keypoints_m[1], unknown.people()[0].keypoints_m[1]);  // the nose, y down
}

TEST_F(ApiBody, SizesOfPeopleWhoWereNotFittedAndHeightsOutOfRangeAreRefused) {
  maq_body_input given = input();
  given.person_count = 3;
  const maquette::BodyResult result = body.run(given);
  maq_body_sizes sizes{};
  sizes.struct_size = sizeof sizes;
  EXPECT_EQ(maq_body_result_get_sizes(result.get(), 2, &sizes), MAQ_ERROR_NOT_FOUND);
  EXPECT_NE(std::strstr(maq_last_error(result.get()), "was not fitted"), nullptr);
  EXPECT_EQ(maq_body_result_get_sizes(result.get(), 3, &sizes), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(maq_body_result_get_sizes(result.get(), 0, nullptr), MAQ_ERROR_INVALID_ARGUMENT);
  sizes.struct_size = 4;
  EXPECT_EQ(maq_body_result_get_sizes(result.get(), 0, &sizes), MAQ_ERROR_INVALID_ARGUMENT);
  for (const float wrong : {1.29f, 2.31f, -1.7f, 178.0f, std::numeric_limits<float>::quiet_NaN()}) {
    const float heights_m[] = {0, 1.7f, wrong};
    given.heights_m = heights_m;
    expect_refused(given, "input.heights_m[2] is ");
  }
  for (const float right : {1.3f, 2.3f}) {
    const float heights_m[] = {right, 0, 0};
    given.heights_m = heights_m;
    const maquette::BodyResult bounds = body.run(given);
    EXPECT_FLOAT_EQ(bounds.sizes(0).height.value_m, right);
  }
}

TEST_F(ApiBody, PeopleWithoutPixelsAreAStatusWithoutPointers) {
  maq_body_input given = input();
  given.person_count = 3;
  const maquette::BodyResult result = body.run(given);
  const std::vector<maq_body_person> people = result.people();
  ASSERT_EQ(people.size(), 3u);
  EXPECT_EQ(people[2].fit, MAQ_BODY_FIT_TOO_FEW_PIXELS);
  EXPECT_EQ(people[2].vertices_m, nullptr);
  EXPECT_EQ(people[2].keypoints_m, nullptr);
  given.person_count = 0;
  EXPECT_TRUE(body.run(given).people().empty());
}

TEST_F(ApiBody, WrongInputIsRefusedWithASentence) {
  const maq_body_input right = input();
  const auto refuse = [&](const char* text, auto&& change) {
    maq_body_input wrong = right;
    change(wrong);
    expect_refused(wrong, text);
  };
  maq_intrinsics camera = {right.width_px, right.height_px, 700, 700, 255.5, 255.5, {}};
  refuse("input.struct_size is 0", [](auto& w) { w.struct_size = 0; });
  refuse("input.width_px is 0", [](auto& w) { w.width_px = 0; });
  refuse("input.height_px is 20000", [](auto& w) { w.height_px = 20000; });
  refuse("input.part is NULL", [](auto& w) { w.part = nullptr; });
  refuse("input.v is NULL", [](auto& w) { w.v = nullptr; });
  refuse("input.stride_bytes is 5", [](auto& w) { w.stride_bytes = 5; });
  refuse("input.person_count is 256", [](auto& w) { w.person_count = 256; });
  refuse("without input.person is 2", [](auto& w) { w.person = nullptr, w.person_count = 2; });
  refuse("input.intrinsics are of an image", [&](auto& w) { w.intrinsics = &camera, camera.width_px = 100; });
  camera.width_px = right.width_px;
  camera.fx_px = std::numeric_limits<double>::quiet_NaN();
  refuse("input.intrinsics.fx_px", [&](auto& w) { w.intrinsics = &camera; });
  maq_body_result* result = nullptr;
  EXPECT_EQ(maq_body_run(body.get(), nullptr, &result), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(maq_body_run(nullptr, &right, &result), MAQ_ERROR_INVALID_ARGUMENT);
}

TEST_F(ApiBody, ResultsComeFromAPoolAndOutliveTheBody) {
  const maq_body_input given = input();
  const maquette::BodyResult first = body.run(given), second = body.run(given);
  maq_body_result* third = nullptr;
  EXPECT_EQ(maq_body_run(body.get(), &given, &third), MAQ_ERROR_POOL_EMPTY);
  const maq_body_person before = first.people()[0];
  body = maquette::Body(context, [] {
    maq_body_config config = maquette::default_body_config();
    config.model.bundle_path = MAQ_TEST_MODELS "/body";
    return config;
  }());
  EXPECT_EQ(first.people()[0].vertices_m, before.vertices_m);
  maquette::BodyClip clip(body);
  maq_body_person person{};
  EXPECT_EQ(maq_body_result_get_person(first.get(), 1, &person), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(maq_body_clip_add_result(clip.get(), first.get()), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(std::strstr(maq_last_error(clip.get()), "two bodies"), nullptr);
}

TEST_F(ApiBody, ClipsAreWrittenWholeOrNotAtAll) {
  const TempFolder folder;
  maquette::BodyClip clip(body);
  EXPECT_EQ(maq_body_clip_save(clip.get(), folder.file("none.glb").c_str()), MAQ_ERROR_NOT_FOUND);
  maq_body_input given = input();
  const int64_t id = 3;
  given.ids = &id;
  for (int frame = 0; frame < 4; ++frame) {
    given.timestamp_ns = frame * 33'000'000;
    clip.add(body.run(given));
  }
  EXPECT_EQ(clip.person_count(), 1u);
  clip.save(folder.file("a.glb"));
  clip.save_person(0, folder.file("a.bvh"));
  EXPECT_EQ(read_text(folder.file("a.glb")).substr(0, 4), "glTF");
  const std::string bvh = read_text(folder.file("a.bvh"));
  EXPECT_EQ(bvh.substr(0, 9), "HIERARCHY");
  EXPECT_NE(bvh.find("Frames: 4\n"), std::string::npos);
  EXPECT_EQ(maq_body_clip_save(clip.get(), folder.file("a.bvh").c_str()), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(std::strstr(maq_last_error(clip.get()), "maq_body_clip_save_person"), nullptr);
  EXPECT_EQ(maq_body_clip_save_person(clip.get(), 0, folder.file("a.obj").c_str()), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(maq_body_clip_save_person(clip.get(), 1, folder.file("b.bvh").c_str()), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(maq_body_clip_save(clip.get(), folder.file("no/folder.glb").c_str()), MAQ_ERROR_UNWRITABLE);
  EXPECT_FALSE(std::filesystem::exists(folder.file("b.bvh")));
}

TEST_F(ApiBody, BundlesOfAnotherTaskAndDamagedOnesAreRefused) {
  maq_body_config config = maquette::default_body_config();
  maq_body* made = nullptr;
  config.model.bundle_path = MAQ_TEST_DATA "/tiny_edges/bundle";
  EXPECT_EQ(maq_body_create(context.get(), &config, &made), MAQ_ERROR_UNSUPPORTED);
  config.model.bundle_path = MAQ_TEST_DATA "/tiny_body";
  EXPECT_EQ(maq_body_create(context.get(), &config, &made), MAQ_ERROR_NOT_FOUND);
  const TempFolder folder;
  std::filesystem::copy(MAQ_TEST_MODELS "/body", folder.path(), std::filesystem::copy_options::recursive);
  std::filesystem::resize_file(folder.file("body.maqb"), 1000);
  const std::string path = folder.path().string();
  config.model.bundle_path = path.c_str();
  EXPECT_EQ(maq_body_create(context.get(), &config, &made), MAQ_ERROR_BAD_BUNDLE);
  config.result_pool_size = 65;
  EXPECT_EQ(maq_body_create(context.get(), &config, &made), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(made, nullptr);
}

TEST_F(ApiBody, AnglesHaveNames) {
  EXPECT_STREQ(maq_body_get_angle_name(MAQ_BODY_ANGLE_LEFT_ELBOW), "left_elbow");
  EXPECT_STREQ(maq_body_get_angle_name(MAQ_BODY_ANGLE_RIGHT_SHOULDER), "right_shoulder");
  EXPECT_STREQ(maq_body_get_angle_name(8), "unknown");
  EXPECT_STREQ(maq_body_get_angle_name(-1), "unknown");
}

}  // namespace
