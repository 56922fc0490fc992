#include <algorithm>
#include <cmath>
#include <string>

#include "api/body/body_handle.h"
#include "api/boundary.h"
#include "api/bundle_argument.h"
#include "api/model_options.h"
#include "body/model/body_file.h"

using namespace maq;

namespace {

constexpr uint32_t kBodyResults = 4, kMaxBodyResults = 64, kMaxBodies = 255;
constexpr int32_t kMaxPlaneSide_px = 16384;
constexpr float kMinHeight_m = 1.3f, kMaxHeight_m = 2.3f;  // what the shapes of the shipped body reach
constexpr const char* kAngleNames[] = {"left_elbow", "right_elbow", "left_knee",     "right_knee",
                                       "left_hip",   "right_hip",   "left_shoulder", "right_shoulder"};
static_assert(std::size(kAngleNames) == MAQ_BODY_ANGLE_COUNT && body::kAngles == MAQ_BODY_ANGLE_COUNT);
static_assert(body::kKeypoints == MAQ_BODY_KEYPOINT_COUNT);
// The enums of the engine and of the C API have the same values.
static_assert(int(body::FitStatus::kTooFewPixels) == MAQ_BODY_FIT_TOO_FEW_PIXELS &&
              int(body::FitStatus::kUnreliable) == MAQ_BODY_FIT_UNRELIABLE);

maq_body_config default_body_config() {
  maq_body_config config{};
  config.struct_size = sizeof config;
  return config;
}

maq_body_input default_body_input() {
  maq_body_input input{};
  input.struct_size = sizeof input;
  return input;
}

body::LabelImage labels_of(const maq_body_input& input) {
  require_range("input.width_px", input.width_px, 1, kMaxPlaneSide_px);
  require_range("input.height_px", input.height_px, 1, kMaxPlaneSide_px);
  require_argument(input.part, "input.part");
  require_argument(input.u, "input.u");
  require_argument(input.v, "input.v");
  require_range("input.person_count", input.person_count, 0u, kMaxBodies);
  if (input.person == nullptr) require_range("input.person_count without input.person", input.person_count, 0u, 1u);
  const size_t stride = input.stride_bytes == 0 ? size_t(input.width_px) : input.stride_bytes;
  if (stride < size_t(input.width_px)) {
    throw ArgumentError("input.stride_bytes is ", stride, ", but a row has ", input.width_px, " pixels.");
  }
  return {input.width_px, input.height_px, input.part, input.u, input.v, input.person, stride};
}

body::BodyCamera camera_of(const maq_body_input& input) {
  if (input.intrinsics == nullptr) return {};
  const maq_intrinsics& given = *input.intrinsics;
  if (given.width_px != input.width_px || given.height_px != input.height_px) {
    throw ArgumentError("input.intrinsics are of an image of ", given.width_px, " x ", given.height_px,
                        " pixels, but the planes have ", input.width_px, " x ", input.height_px, ".");
  }
  require_range("input.intrinsics.fx_px", given.fx_px, 1.0, 1e6);
  require_range("input.intrinsics.fy_px", given.fy_px, 1.0, 1e6);
  require_range("input.intrinsics.cx_px", given.cx_px, -1e6, 1e6);
  require_range("input.intrinsics.cy_px", given.cy_px, -1e6, 1e6);
  return {true, given.fx_px, given.fy_px, given.cx_px, given.cy_px};
}

// 0: unknown.
double height_of_person(const maq_body_input& input, size_t index) {
  const float height_m = input.heights_m == nullptr ? 0 : input.heights_m[index];
  if (height_m != 0) {
    require_range("input.heights_m[" + std::to_string(index) + "]", height_m, kMinHeight_m, kMaxHeight_m);
  }
  return double(height_m);
}

maq_body_size shown_size(const body::SizeEstimate& size) {
  return {float(size.value_m), float(size.low_m), float(size.high_m)};
}

void write_vector(float* to, Vec3 from) { to[0] = float(from.x), to[1] = float(from.y), to[2] = float(from.z); }

// Fills the numbers that the app reads. Vectors keep their memory.
void show(const maq_body& body, const body::BodyCamera& camera, BodyOfPerson& person) {
  const body::BodyModel& model = *body.model;
  const body::FittedBody& fitted = person.fitted;
  maq_body_person& shown = person.shown;
  shown = {};
  shown.fit = maq_body_fit(fitted.status);
  shown.id = person.id;
  if (fitted.status != body::FitStatus::kFitted) return;
  const body::BodyBones bones = bones_of(model, fitted.pose);
  shown.inlier_fraction = float(fitted.inlier_fraction);
  shown.error_px = float(fitted.error_px);
  shown.iteration_count = fitted.iterations;
  shown.seen_joints = fitted.seen_joints;
  shown.is_metric = camera.is_perspective ? 1 : 0;
  if (camera.is_perspective) write_vector(shown.pelvis_m, fitted.pose.place);
  const body::Projection pelvis = project(camera, fitted.pose.place, {});
  shown.pelvis_px[0] = float(pelvis.at.x), shown.pelvis_px[1] = float(pelvis.at.y);
  shown.scale_px_per_m = float(scale_at(camera, fitted.pose.place));
  for (size_t i = 0; i < 9; ++i) shown.orientation[i] = float(fitted.pose.orientation[i]);
  const auto angles = body.angle_joints.angles_deg(bones);
  for (size_t i = 0; i < angles.size(); ++i) shown.angles_deg[i] = float(angles[i]);
  for (size_t s = 0; s < model.shape_count; ++s) person.shape[s] = float(fitted.pose.shape[s]);
  for (size_t j = 0; j < model.joints.size(); ++j) {
    write_vector(person.joint_rotations.data() + 3 * j, j == 0 ? Vec3{} : fitted.pose.rotation[j]);
    write_vector(person.joints_m.data() + 3 * j, bones.place[j]);
  }
  for (size_t k = 0; k < body::kKeypoints; ++k) {
    write_vector(person.keypoints_m.data() + 3 * k, posed(model, bones, model.keypoints[k]));
  }
  for (size_t i = 0; i < model.vertices.size(); ++i) {
    write_vector(person.vertices_m.data() + 3 * i, posed(model, bones, model.vertices[i]));
  }
  shown.shape = person.shape.data();
  shown.joint_rotations = person.joint_rotations.data();
  shown.joints_m = person.joints_m.data();
  shown.keypoints_m = person.keypoints_m.data();
  shown.vertices_m = person.vertices_m.data();
}

void make_room(const body::BodyModel& model, BodyOfPerson& person) {
  person.shape.resize(model.shape_count);
  person.joint_rotations.resize(3 * model.joints.size());
  person.joints_m.resize(3 * model.joints.size());
  person.keypoints_m.resize(3 * body::kKeypoints);
  person.vertices_m.resize(3 * model.vertices.size());
}

}  // namespace

maq_body::maq_body(std::shared_ptr<const body::BodyModel> of, size_t pool_size)
    : model(std::move(of)),
      sizes(std::make_shared<body::BodySizes>(*model)),
      angle_joints(*model),
      fitter(*model),
      results(pool_size, "results") {
  for (const body::BodyJoint& joint : model->joints) {
    joint_names.push_back(joint.name.c_str());
    joint_parents.push_back(joint.parent);
  }
}

const char* maq_body_get_angle_name(int32_t angle) {
  return angle >= 0 && angle < MAQ_BODY_ANGLE_COUNT ? kAngleNames[angle] : "unknown";
}

maq_status maq_body_config_init(maq_body_config* config, uint32_t struct_size) {
  return init_config(__func__, config, struct_size, default_body_config());
}

maq_status maq_body_input_init(maq_body_input* input, uint32_t struct_size) {
  return init_config(__func__, input, struct_size, default_body_input(), "input");
}

maq_status maq_body_create(maq_context* context, const maq_body_config* given, maq_body** body) {
  return guarded(context, __func__, [&] {
    require_argument(context, "context");
    require_argument(body, "body");
    const maq_body_config config = read_config(given, "config", default_body_config());
    require_model_options("config.model", config.model);
    require_range("config.result_pool_size", config.result_pool_size, 0u, kMaxBodyResults);
    const Bundle bundle = read_bundle_argument(config.model, "config.model", kBodyBundle);
    *body = new maq_body(body::model_of_bundle(bundle),
                         config.result_pool_size == 0 ? kBodyResults : config.result_pool_size);
    context->state->log().write(MAQ_LOG_INFO, "Bundle ", bundle.manifest.name, " ", bundle.manifest.version, " loaded");
    return MAQ_OK;
  });
}

void maq_body_destroy(maq_body* body) { destroy(body, "body", __func__); }

maq_status maq_body_run(maq_body* body, const maq_body_input* given, maq_body_result** result) {
  return guarded_alone(body, "body", __func__, [&] {
    require_argument(given, "input");
    require_argument(result, "result");
    require_struct_size("input", given->struct_size, sizeof(maq_body_input));
    const maq_body_input& input = *given;
    const body::LabelImage labels = labels_of(input);
    const body::BodyCamera camera = camera_of(input);
    for (size_t i = 0; i < input.person_count; ++i) height_of_person(input, i);  // before anything is fitted
    BoundedPool<maq_body_result>::Pooled handle = body->results.acquire();
    handle->model = body->model;
    handle->sizes = body->sizes;
    handle->count = input.person_count;
    handle->timestamp_ns = input.timestamp_ns;
    if (handle->people.size() < handle->count) handle->people.resize(handle->count);
    body->fitter.begin_frame(labels, camera, input.timestamp_ns);
    for (size_t i = 0; i < handle->count; ++i) {
      BodyOfPerson& person = handle->people[i];
      make_room(*body->model, person);
      person.id = input.ids == nullptr ? 0 : std::max(input.ids[i], int64_t(0));
      const float* const keypoints = input.keypoints == nullptr ? nullptr : input.keypoints + 99 * i;
      person.height_m = height_of_person(input, i);
      person.fitted = body->fitter.fit({uint8_t(i + 1), person.id, keypoints, person.height_m});
      person.place_m = place_in_metres(camera, person.fitted.pose.place, input.width_px, input.height_px);
      show(*body, camera, person);
    }
    *result = lend<maq_body_result>(std::move(handle));
    return MAQ_OK;
  });
}

maq_status maq_body_reset(maq_body* body) {
  return guarded_alone(body, "body", __func__, [&] {
    body->fitter.reset();
    return MAQ_OK;
  });
}

maq_status maq_body_get_mesh(const maq_body* body, maq_body_mesh* mesh) {
  return guarded(body, __func__, [&] {
    require_argument(body, "body");
    maq_body_mesh filled{};
    filled.vertex_count = uint32_t(body->model->vertices.size());
    filled.triangle_count = uint32_t(body->model->triangles.size() / 3);
    filled.triangles = body->model->triangles.data();
    filled.joint_count = uint32_t(body->joint_names.size());
    filled.joint_names = body->joint_names.data();
    filled.joint_parents = body->joint_parents.data();
    filled.shape_count = uint32_t(body->model->shape_count);
    write_struct(mesh, "mesh", filled);
    return MAQ_OK;
  });
}

void maq_body_result_release(maq_body_result* result) {
  return_handle(result, "result", __func__, return_to_pool<maq_body_result>);
}

uint32_t maq_body_result_get_person_count(const maq_body_result* result) {
  return result == nullptr ? 0 : uint32_t(result->count);
}

maq_status maq_body_result_get_person(const maq_body_result* result, uint32_t index, maq_body_person* person) {
  return guarded(result, __func__, [&] {
    require_argument(result, "result");
    require_index("index", index, result->count);
    write_struct(person, "person", result->people[index].shown);
    return MAQ_OK;
  });
}

maq_status maq_body_result_get_sizes(const maq_body_result* result, uint32_t index, maq_body_sizes* sizes) {
  return guarded(result, __func__, [&] {
    require_argument(result, "result");
    require_argument(sizes, "sizes");
    require_struct_size("sizes", sizes->struct_size, sizeof(maq_body_sizes));
    require_index("index", index, result->count);
    const BodyOfPerson& person = result->people[index];
    if (person.fitted.status != body::FitStatus::kFitted) {
      throw Error(MAQ_ERROR_NOT_FOUND, "Person ", index,
                  " was not fitted, and has no sizes; check maq_body_person.fit.");
    }
    const auto found =
        estimate_sizes(*result->sizes, result->model->shape_count, person.fitted.size_shape, person.height_m);
    const auto of = [&](body::Size size) { return shown_size(found[size_t(size)]); };
    maq_body_sizes filled{};
    filled.is_height_known = person.height_m > 0 ? 1 : 0;
    filled.height = of(body::Size::kHeight);
    filled.chest = of(body::Size::kChest);
    filled.waist = of(body::Size::kWaist);
    filled.hip = of(body::Size::kHip);
    filled.inseam = of(body::Size::kInseam);
    write_struct(sizes, "sizes", filled);
    return MAQ_OK;
  });
}
