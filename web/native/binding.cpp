// The functions that JavaScript calls (web/src/engine.js): the C API of dense pose by plain numbers, so that no struct
// is laid out in JavaScript. Functions that can fail return a maq_status; error_text() has the sentence.
#include <emscripten/emscripten.h>
#include <maquette/densepose.h>

#include <cstring>
#include <string>
#include <vector>

namespace {

// Files of the bundle until the networks are opened.
std::vector<std::string> file_names;
std::vector<std::vector<uint8_t>> file_bytes;

struct DensePose {
  maq_context* context = nullptr;
  maq_densepose* densepose = nullptr;
  maq_densepose_result* result = nullptr;
  std::vector<uint8_t> pixels;  // RGBA
  int width_px = 0, height_px = 0;
};

// Fields of the config in the order of engine.js.
enum Option {
  kPreset,
  kLongSide,
  kScoreThreshold,
  kMaxPeople,
  kMaxProposals,
  kKeyFrameInterval,
  kMinPersonHeight,
  kDetail,
  kPersonCrops,
  kPersonCropSide,
  kHasKeypoints,
  kSteadiness,
  kThreads
};

void close(DensePose* self) {
  maq_densepose_result_release(self->result);
  maq_densepose_destroy(self->densepose);
  maq_context_destroy(self->context);
  delete self;
}

}  // namespace

extern "C" {

EMSCRIPTEN_KEEPALIVE const char* maq_web_error_text() { return maq_last_error(nullptr); }

EMSCRIPTEN_KEEPALIVE const char* maq_web_status_name(int status) { return maq_status_get_name(maq_status(status)); }

EMSCRIPTEN_KEEPALIVE const char* maq_web_version() { return maq_get_sdk_version(); }

EMSCRIPTEN_KEEPALIVE const char* maq_web_part_name(int part) { return maq_densepose_get_part_name(part); }

EMSCRIPTEN_KEEPALIVE const char* maq_web_keypoint_name(int keypoint) {
  return maq_densepose_get_keypoint_name(keypoint);
}

EMSCRIPTEN_KEEPALIVE void maq_web_part_colour(int part, uint8_t* rgb) { maq_densepose_get_part_colour(part, rgb); }

// Adds a file of the bundle for the next maq_web_create() and returns memory for its bytes.
EMSCRIPTEN_KEEPALIVE uint8_t* maq_web_add_file(const char* name, int size_bytes) {
  file_names.emplace_back(name);
  file_bytes.emplace_back(size_t(size_bytes));
  return file_bytes.back().data();
}

EMSCRIPTEN_KEEPALIVE int maq_web_create(const double* options, DensePose** made) {
  std::vector<std::string> names;
  std::vector<std::vector<uint8_t>> bytes;
  names.swap(file_names);
  bytes.swap(file_bytes);
  std::vector<maq_memory_file> files;
  for (size_t i = 0; i < names.size(); ++i) files.push_back({names[i].c_str(), bytes[i].data(), bytes[i].size()});

  maq_densepose_config config;
  maq_densepose_config_init(&config, sizeof config);
  config.model.bundle_files = files.data();
  config.model.bundle_file_count = uint32_t(files.size());
  config.preset = maq_densepose_preset(options[kPreset]);
  config.long_side_px = int32_t(options[kLongSide]);
  config.score_threshold = float(options[kScoreThreshold]);
  config.max_people = int32_t(options[kMaxPeople]);
  config.max_proposals = int32_t(options[kMaxProposals]);
  config.key_frame_interval = int32_t(options[kKeyFrameInterval]);
  config.min_person_height_px = int32_t(options[kMinPersonHeight]);
  config.detail = maq_densepose_detail(options[kDetail]);
  config.person_crops = maq_densepose_crops(options[kPersonCrops]);
  config.person_crop_px = int32_t(options[kPersonCropSide]);
  config.has_keypoints = int32_t(options[kHasKeypoints]);
  config.steadiness = float(options[kSteadiness]);
  config.model.threads = int32_t(options[kThreads]);

  auto* const self = new DensePose;
  maq_status status = maq_context_create(MAQ_HEADER_VERSION, nullptr, &self->context);
  if (status == MAQ_OK) status = maq_densepose_create(self->context, &config, &self->densepose);
  if (status == MAQ_OK) {
    *made = self;
  } else {
    close(self);
  }
  return status;
}

EMSCRIPTEN_KEEPALIVE void maq_web_destroy(DensePose* self) { close(self); }

// Returns memory for an image of that size, in RGBA without padding; null where there is too little.
EMSCRIPTEN_KEEPALIVE uint8_t* maq_web_pixels(DensePose* self, int width_px, int height_px) {
  self->width_px = width_px;
  self->height_px = height_px;
  self->pixels.resize(size_t(width_px) * size_t(height_px) * 4);
  return self->pixels.data();
}

// Runs on the pixels. Frame 0 begins a stream. The result stays until the next run.
EMSCRIPTEN_KEEPALIVE int maq_web_run(DensePose* self, double frame, double time_ms) {
  maq_densepose_result_release(self->result);
  self->result = nullptr;
  maq_frame_desc desc;
  maq_frame_desc_init(&desc, sizeof desc);
  desc.format = MAQ_PIXEL_RGBA8;
  desc.width_px = self->width_px;
  desc.height_px = self->height_px;
  desc.planes[0] = self->pixels.data();
  desc.timestamp_ns = int64_t(time_ms * 1e6);
  desc.sequence = uint64_t(frame);
  maq_frame* wrapped = nullptr;
  maq_status status = maq_frame_wrap(self->context, &desc, nullptr, nullptr, &wrapped);
  if (status == MAQ_OK) status = maq_densepose_run(self->densepose, wrapped, &self->result);
  maq_frame_release(wrapped);
  return status;
}

EMSCRIPTEN_KEEPALIVE int maq_web_person_count(DensePose* self) {
  return int(maq_densepose_result_get_person_count(self->result));
}

// person: id, score, box (4), and with keypoints 33 times x, y, confidence.
EMSCRIPTEN_KEEPALIVE int maq_web_person(DensePose* self, int index, double* person, int has_keypoints) {
  maq_densepose_person read;
  read.struct_size = sizeof read;
  maq_status status = maq_densepose_result_get_person(self->result, uint32_t(index), &read);
  if (status != MAQ_OK) return status;
  *person++ = double(read.id);
  *person++ = double(read.score);
  for (const float side : read.box_px) *person++ = double(side);
  if (has_keypoints == 0) return MAQ_OK;
  float keypoints[3 * MAQ_DENSEPOSE_KEYPOINT_COUNT];
  status = maq_densepose_result_get_keypoints(self->result, uint32_t(index), keypoints);
  if (status != MAQ_OK) return status;
  for (const float value : keypoints) *person++ = double(value);
  return MAQ_OK;
}

// A plane of the result, as large as the image.
EMSCRIPTEN_KEEPALIVE const uint8_t* maq_web_plane(DensePose* self, int plane) {
  const uint8_t* pixels = nullptr;
  size_t stride_bytes = 0;
  maq_densepose_result_get_plane(self->result, maq_densepose_plane(plane), &pixels, &stride_bytes);
  return pixels;
}

// Times of the stages in milliseconds, and counts, in the order of engine.js.
EMSCRIPTEN_KEEPALIVE int maq_web_stats(DensePose* self, double* stats) {
  maq_densepose_stats read;
  read.struct_size = sizeof read;
  const maq_status status = maq_densepose_result_get_stats(self->result, &read);
  if (status != MAQ_OK) return status;
  const double values[] = {double(read.preprocess_ms),    double(read.trunk_ms),         double(read.proposals_ms),
                           double(read.box_head_ms),      double(read.dense_head_ms),    double(read.crops_ms),
                           double(read.decode_ms),        double(read.keypoints_ms),     double(read.total_ms),
                           double(read.network_width_px), double(read.network_height_px)};
  std::memcpy(stats, values, sizeof values);
  return MAQ_OK;
}

}  // extern "C"
