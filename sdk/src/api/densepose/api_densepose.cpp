#include <algorithm>

#include "api/boundary.h"
#include "api/bundle_argument.h"
#include "api/densepose/densepose_handle.h"
#include "api/frame_handle.h"
#include "api/model_options.h"
#include "core/worker_threads.h"
#include "densepose/body_parts.h"
#include "densepose/painting.h"
#include "densepose/result_files.h"
#include "image/convert.h"

using namespace maq;

namespace {

maq_densepose_config default_densepose_config() {
  maq_densepose_config config{};
  config.struct_size = sizeof config;
  return config;
}

constexpr int32_t kDefaultOpacity = 180;
constexpr int kPhotoCropSidePx = 256;
constexpr uint32_t kDefaultResultPoolSize = 4;

PersonCrops crops_of(const maq_densepose_config& config) {
  switch (config.person_crops) {
    case MAQ_DENSEPOSE_CROPS_AUTO: return PersonCrops::kAuto;
    case MAQ_DENSEPOSE_CROPS_ALL: return PersonCrops::kAll;
    case MAQ_DENSEPOSE_CROPS_OFF: return PersonCrops::kOff;
    case MAQ_DENSEPOSE_CROPS_DEFAULT: break;
  }
  return config.preset == MAQ_DENSEPOSE_PRESET_PHOTO ? PersonCrops::kAll : PersonCrops::kOff;
}

// NULL for a number that is not a part's.
const BodyPart* body_part(int32_t part) {
  return part >= 0 && size_t(part) < kBodyParts.size() ? &kBodyParts[size_t(part)] : nullptr;
}

}  // namespace

namespace maq {

maq_densepose_config read_densepose_config(const maq_densepose_config* given, const char* name) {
  return read_config(given, name, default_densepose_config());
}

DensePoseSettings densepose_settings(const maq_densepose_config& config, const char* name) {
  const auto field = [name](const char* member) { return concatenate(name, ".", member); };
  require_model_options(field("model"), config.model);
  require_range(field("preset"), number_in(config.preset), int32_t(MAQ_DENSEPOSE_PRESET_STREAM),
                int32_t(MAQ_DENSEPOSE_PRESET_PHOTO));
  if (config.long_side_px != 0) require_range(field("long_side_px"), config.long_side_px, 32, 2048);
  require_range(field("score_threshold"), config.score_threshold, 0.0f, 1.0f);
  if (config.max_people != 0) require_range(field("max_people"), config.max_people, 1, 255);
  require_range(field("result_pool_size"), config.result_pool_size, 0u, 64u);
  if (config.max_proposals != 0) require_range(field("max_proposals"), config.max_proposals, 1, 1000);
  require_range(field("key_frame_interval"), config.key_frame_interval, 0, 1000);
  require_range(field("min_person_height_px"), config.min_person_height_px, 0, 100000);
  require_range(field("detail"), number_in(config.detail), int32_t(MAQ_DENSEPOSE_DETAIL_SURFACE),
                int32_t(MAQ_DENSEPOSE_DETAIL_PART));
  require_range(field("person_crops"), number_in(config.person_crops), int32_t(MAQ_DENSEPOSE_CROPS_DEFAULT),
                int32_t(MAQ_DENSEPOSE_CROPS_OFF));
  if (config.person_crop_px != 0) require_range(field("person_crop_px"), config.person_crop_px, 64, 512);
  require_range(field("has_keypoints"), config.has_keypoints, 0, 1);
  if (config.steadiness != -1) require_range(field("steadiness"), config.steadiness, 0.0f, 0.95f);
  DensePoseSettings settings;
  settings.threads = config.model.threads != 0 ? config.model.threads : default_threads();
  settings.long_side_px = config.long_side_px;
  settings.score_threshold = config.score_threshold > 0 ? config.score_threshold : -1;
  settings.max_people = config.max_people;
  settings.max_proposals = config.max_proposals;
  settings.key_frame_interval = std::max(config.key_frame_interval, 1);
  if (config.steadiness != 0) settings.steadiness = std::max(config.steadiness, 0.0f);
  settings.min_person_height_px = config.min_person_height_px;
  settings.surface = config.detail == MAQ_DENSEPOSE_DETAIL_SURFACE;
  settings.crops = crops_of(config);
  settings.crop_side_px = config.person_crop_px;
  if (settings.crop_side_px == 0 && config.preset == MAQ_DENSEPOSE_PRESET_PHOTO)
    settings.crop_side_px = kPhotoCropSidePx;
  settings.keypoints = config.has_keypoints == 1;
  settings.provider = config.model.provider;
  return settings;
}

void require_frame_of(const DensePlanes& planes, const ImageView& image) {
  if (image.width_px == planes.width_px && image.height_px == planes.height_px) return;
  throw ArgumentError("frame has ", image.width_px, " x ", image.height_px, " pixels, but result is of a frame of ",
                      planes.width_px, " x ", planes.height_px, "; give the frame that it was computed from.");
}

float require_roll(float roll_rad) {
  require_range("roll_rad", roll_rad, -7.0f, 7.0f);
  return roll_rad;
}

}  // namespace maq

const char* maq_densepose_get_part_name(int32_t part) {
  const BodyPart* const known = body_part(part);
  return known == nullptr ? "unknown part" : known->name;
}

void maq_densepose_get_part_colour(int32_t part, uint8_t rgb[3]) {
  if (rgb == nullptr) return;
  const BodyPart* const known = body_part(part);
  for (size_t i = 0; i < 3; ++i) rgb[i] = known == nullptr ? uint8_t(0) : known->rgb[i];
}

const char* maq_densepose_get_keypoint_name(int32_t keypoint) {
  return keypoint >= 0 && size_t(keypoint) < kKeypoints ? kKeypointNames[size_t(keypoint)] : "unknown";
}

maq_status maq_densepose_config_init(maq_densepose_config* config, uint32_t struct_size) {
  return init_config(__func__, config, struct_size, default_densepose_config());
}

maq_status maq_densepose_create(maq_context* context, const maq_densepose_config* given, maq_densepose** densepose) {
  return guarded(context, __func__, [&] {
    require_argument(context, "context");
    require_argument(densepose, "densepose");
    const maq_densepose_config config = read_densepose_config(given, "config");
    const DensePoseSettings settings = densepose_settings(config, "config");
    const Bundle bundle = read_bundle_argument(config.model, "config.model", kDensePoseBundle);
    auto networks = std::make_unique<DensePose>(context->state->onnxruntime(), bundle, settings);
    context->state->log().write(MAQ_LOG_INFO, "Bundle ", bundle.manifest.name, " ", bundle.manifest.version, " (",
                                bundle.manifest.precision, ") loaded, ", networks->threads(), " thread(s)");
    *densepose = new maq_densepose(context->state, std::move(networks),
                                   config.result_pool_size != 0 ? config.result_pool_size : kDefaultResultPoolSize);
    return MAQ_OK;
  });
}

void maq_densepose_destroy(maq_densepose* densepose) { destroy(densepose, "densepose", __func__); }

maq_status maq_densepose_run(maq_densepose* densepose, const maq_frame* frame, maq_densepose_result** result) {
  return guarded_alone(densepose, "densepose", __func__, [&] {
    require_argument(frame, "frame");
    require_argument(result, "result");
    BoundedPool<maq_densepose_result>::Pooled handle = densepose->results.acquire();
    const StreamPlace place{frame->frame.sequence > 0, frame->frame.timestamp_ns};
    densepose->densepose->run(frame->frame.image, handle->result, place);
    *result = lend<maq_densepose_result>(std::move(handle));
    return MAQ_OK;
  });
}

maq_status maq_densepose_cancel(maq_densepose* densepose) {
  return guarded(densepose, __func__, [&] {
    require_argument(densepose, "densepose");
    densepose->densepose->cancel();
    return MAQ_OK;
  });
}

maq_status maq_densepose_set_roll(maq_densepose* densepose, float roll_rad) {
  return guarded(densepose, __func__, [&] {
    require_argument(densepose, "densepose");
    densepose->densepose->set_roll(require_roll(roll_rad));
    return MAQ_OK;
  });
}

maq_status maq_densepose_reset(maq_densepose* densepose) {
  return guarded_alone(densepose, "densepose", __func__, [&] {
    densepose->densepose->reset();
    return MAQ_OK;
  });
}

void maq_densepose_result_release(maq_densepose_result* result) {
  return_handle(result, "result", __func__, return_to_pool<maq_densepose_result>);
}

maq_status maq_densepose_result_get_size(const maq_densepose_result* result, int32_t* width_px, int32_t* height_px) {
  return guarded(result, __func__, [&] {
    require_argument(result, "result");
    if (width_px != nullptr) *width_px = result->result.planes.width_px;
    if (height_px != nullptr) *height_px = result->result.planes.height_px;
    return MAQ_OK;
  });
}

uint32_t maq_densepose_result_get_person_count(const maq_densepose_result* result) {
  return result == nullptr ? 0 : uint32_t(result->result.people.size());
}

maq_status maq_densepose_result_get_person(const maq_densepose_result* result, uint32_t index,
                                           maq_densepose_person* person) {
  return guarded(result, __func__, [&] {
    require_argument(result, "result");
    require_index("index", index, result->result.people.size());
    const Person& from = result->result.people[index];
    const maq_densepose_person filled{0, from.score, {from.box.x0, from.box.y0, from.box.x1, from.box.y1}, from.id};
    write_struct(person, "person", filled);
    return MAQ_OK;
  });
}

maq_status maq_densepose_result_get_head_box(const maq_densepose_result* result, uint32_t index, float box_px[4]) {
  return guarded(result, __func__, [&] {
    require_argument(result, "result");
    require_argument(box_px, "box_px");
    require_index("index", index, result->result.people.size());
    const std::optional<Box> box = head_bounds(result->result.planes, uint8_t(index + 1));
    if (!box) throw Error(MAQ_ERROR_NOT_FOUND, "Person ", index, " shows no part of the head; choose another person.");
    const float sides[] = {box->x0, box->y0, box->x1, box->y1};
    std::copy_n(sides, 4, box_px);
    return MAQ_OK;
  });
}

maq_status maq_densepose_result_get_keypoints(const maq_densepose_result* result, uint32_t index, float keypoints[99]) {
  static_assert(3 * MAQ_DENSEPOSE_KEYPOINT_COUNT == 99 && kKeypoints == MAQ_DENSEPOSE_KEYPOINT_COUNT);
  return guarded(result, __func__, [&] {
    require_argument(result, "result");
    require_argument(keypoints, "keypoints");
    require_index("index", index, result->result.people.size());
    if (result->result.keypoints.empty())
      throw Error(MAQ_ERROR_NOT_FOUND, "No keypoints were asked for; set has_keypoints in maq_densepose_config.");
    for (const Keypoint& keypoint : result->result.keypoints[index]) {
      *keypoints++ = keypoint.x_px;
      *keypoints++ = keypoint.y_px;
      *keypoints++ = keypoint.confidence;
    }
    return MAQ_OK;
  });
}

maq_status maq_densepose_result_get_plane(const maq_densepose_result* result, maq_densepose_plane plane,
                                          const uint8_t** pixels, size_t* stride_bytes) {
  return guarded(result, __func__, [&] {
    require_argument(result, "result");
    require_argument(pixels, "pixels");
    require_argument(stride_bytes, "stride_bytes");
    require_range("plane", number_in(plane), int32_t(MAQ_DENSEPOSE_PLANE_PART), int32_t(MAQ_DENSEPOSE_PLANE_PERSON));
    const DensePlanes& planes = result->result.planes;
    const std::vector<uint8_t>* all[] = {&planes.part, &planes.u, &planes.v, &planes.person};
    *pixels = all[plane - MAQ_DENSEPOSE_PLANE_PART]->data();
    *stride_bytes = size_t(planes.width_px);
    return MAQ_OK;
  });
}

maq_status maq_densepose_result_get_stats(const maq_densepose_result* result, maq_densepose_stats* stats) {
  return guarded(result, __func__, [&] {
    require_argument(result, "result");
    const DensePoseStats& from = result->result.stats;
    maq_densepose_stats filled{};
    filled.preprocess_ms = from.preprocess_ms;
    filled.trunk_ms = from.trunk_ms;
    filled.proposals_ms = from.proposals_ms;
    filled.box_head_ms = from.box_head_ms;
    filled.dense_head_ms = from.dense_head_ms;
    filled.crops_ms = from.crops_ms;
    filled.decode_ms = from.decode_ms;
    filled.keypoints_ms = from.keypoints_ms;
    filled.total_ms = from.total_ms;
    filled.network_width_px = from.network_width_px;
    filled.network_height_px = from.network_height_px;
    filled.proposal_count = from.proposals;
    filled.person_count = int32_t(result->result.people.size());
    filled.crop_count = from.crops;
    filled.dropped_box_count = from.dropped_boxes;
    filled.body_pixel_count = from.decoded.body_pixels;
    filled.clamped_pixel_count = from.decoded.clamped_uv;
    filled.is_key_frame = from.key_frame ? 1 : 0;
    filled.provider = from.provider;
    filled.threads = from.threads;
    filled.is_threads_measured = from.is_threads_measured ? 1 : 0;
    write_struct(stats, "stats", filled);
    return MAQ_OK;
  });
}

maq_status maq_densepose_drawing_init(maq_densepose_drawing* drawing, uint32_t struct_size) {
  return init_config(__func__, drawing, struct_size, maq_densepose_drawing{}, "drawing");
}

maq_status maq_densepose_result_draw(const maq_densepose_result* result, const maq_frame* frame,
                                     const maq_densepose_drawing* given, uint8_t* rgba, size_t stride_bytes,
                                     size_t size_bytes) {
  return guarded(result, __func__, [&] {
    require_argument(result, "result");
    require_argument(rgba, "rgba");
    if (frame != nullptr) require_argument(frame, "frame");
    maq_densepose_drawing drawing = read_config(given, "drawing", maq_densepose_drawing{});
    const DensePlanes& planes = result->result.planes;
    const ImageView* const image = frame == nullptr ? nullptr : &frame->frame.image;
    if (image != nullptr) require_frame_of(planes, *image);
    if (drawing.width_px == 0) drawing.width_px = planes.width_px - std::max(drawing.x_px, 0);
    if (drawing.height_px == 0) drawing.height_px = planes.height_px - std::max(drawing.y_px, 0);
    const auto is_inside = [](int begin, int size, int limit) {
      return begin >= 0 && begin < limit && size >= 1 && size <= limit - begin;
    };
    if (!is_inside(drawing.x_px, drawing.width_px, planes.width_px) ||
        !is_inside(drawing.y_px, drawing.height_px, planes.height_px)) {
      throw ArgumentError("drawing asks for ", drawing.width_px, " x ", drawing.height_px, " pixels at (", drawing.x_px,
                          ", ", drawing.y_px, "), which are not inside the frame of ", planes.width_px, " x ",
                          planes.height_px, ".");
    }
    require_range("drawing.opacity", drawing.opacity, MAQ_DENSEPOSE_INVISIBLE, 255);
    const int opacity = drawing.opacity == 0 ? kDefaultOpacity : std::max(drawing.opacity, 0);
    require_range("drawing.is_mirrored", drawing.is_mirrored, 0, 1);
    require_range("drawing.colours", int(drawing.colours), 0, int(MAQ_DENSEPOSE_COLOURS_MAGICANIMATE));
    const size_t stride =
        checked_stride(MAQ_PIXEL_RGBA8, drawing.width_px, drawing.height_px, stride_bytes, size_bytes);
    paint_people(planes, image,
                 {drawing.x_px, drawing.y_px, drawing.width_px, drawing.height_px, opacity, drawing.is_mirrored == 1,
                  PartColours(drawing.colours)},
                 rgba, stride);
    return MAQ_OK;
  });
}

maq_status maq_densepose_result_save(const maq_densepose_result* result, const char* path) {
  return guarded(result, __func__, [&] {
    require_argument(result, "result");
    require_argument(path, "path");
    const std::string given = path;
    const size_t stem_begin = given.rfind('/') + 1;
    if (stem_begin == given.size()) {
      throw ArgumentError("path is \"", path, "\", but must end with the beginning of a file name.");
    }
    write_result_files(result->result, given.substr(0, stem_begin), given.substr(stem_begin));
    return MAQ_OK;
  });
}

maq_status maq_densepose_get_surface(maq_densepose* densepose, maq_densepose_surface* surface) {
  return guarded(densepose, __func__, [&] {
    require_argument(densepose, "densepose");
    require_argument(surface, "surface");
    const SurfaceGrid& grid = densepose->densepose->surface();
    write_struct(surface, "surface", maq_densepose_surface{0, grid.nodes, grid.points_m.data()});
    return MAQ_OK;
  });
}
