// Configurations that several native methods read: bundles of networks, dense pose, sources, cameras.
#pragma once

#include <algorithm>
#include <iterator>

#include "jni_call.h"

namespace maq_jni {

// Networks in a folder, or in direct buffers by file name. Must live until the C API has been called.
class Bundle {
 public:
  Bundle(JNIEnv* env, jbyteArray folder, jobjectArray names, jobjectArray buffers)
      : has_folder_(folder != nullptr), folder_(text(env, folder)) {
    if (names == nullptr || buffers == nullptr) return;
    const jsize count = env->GetArrayLength(names);
    if (env->GetArrayLength(buffers) != count) refuse("a bundle needs a name for each buffer");
    names_.reserve(size_t(count));  // `files_` points into them
    for (jsize i = 0; i < count; ++i) {
      const auto name = static_cast<jbyteArray>(env->GetObjectArrayElement(names, i));
      jobject buffer = env->GetObjectArrayElement(buffers, i);
      check_pending(env);
      names_.push_back(text(env, name));
      const Memory memory = memory_of(env, buffer);
      files_.push_back({names_.back().c_str(), memory.data, memory.size_bytes});
      env->DeleteLocalRef(name);
      env->DeleteLocalRef(buffer);
    }
  }
  Bundle(const Bundle&) = delete;
  Bundle& operator=(const Bundle&) = delete;

  // Of any config with bundle_path, bundle_files and bundle_file_count.
  template <typename Config>
  void put_into(Config& config) const {
    if (has_folder_) config.bundle_path = folder_.c_str();
    config.bundle_files = files_.data();
    config.bundle_file_count = uint32_t(files_.size());
  }

 private:
  bool has_folder_;
  std::string folder_;
  std::vector<std::string> names_;
  std::vector<maq_memory_file> files_;
};

// Counts cross as doubles that hold a Kotlin Int; negative ones are refused by the C API as too large.
inline uint32_t count_of(jdouble value) { return uint32_t(int32_t(value)); }

// `values` as in DensePose.Config.
inline maq_densepose_config densepose_config(JNIEnv* env, const Bundle& bundle, jdoubleArray values) {
  const std::vector<jdouble> from = numbers(env, values, 13);
  maq_densepose_config config;
  check(maq_densepose_config_init(&config, sizeof config));
  bundle.put_into(config.model);
  config.model.threads = int32_t(from[0]);
  config.long_side_px = int32_t(from[1]);
  config.score_threshold = float(from[2]);
  config.max_people = int32_t(from[3]);
  config.result_pool_size = count_of(from[4]);
  config.max_proposals = int32_t(from[5]);
  config.key_frame_interval = int32_t(from[6]);
  config.min_person_height_px = int32_t(from[7]);
  config.detail = maq_densepose_detail(int32_t(from[8]));
  config.model.spinning = from[9] != 0 ? MAQ_SPINNING_ON : MAQ_SPINNING_OFF;
  config.person_crops = maq_densepose_crops(int32_t(from[10]));
  config.person_crop_px = int32_t(from[11]);
  config.model.provider = maq_provider(int32_t(from[12]));
  return config;
}

// `values` as in Source.Config.
inline maq_source_config source_config(JNIEnv* env, jdoubleArray values) {
  const std::vector<jdouble> from = numbers(env, values, 7);
  maq_source_config config;
  check(maq_source_config_init(&config, sizeof config));
  config.frame_pool_size = count_of(from[0]);
  config.queue_length = count_of(from[1]);
  config.stall_ms = int32_t(from[2]);
  config.reconnect_ms = int32_t(from[3]);
  config.real_time = int32_t(from[4]);
  config.loop = int32_t(from[5]);
  config.max_side_px = int32_t(from[6]);
  return config;
}

inline std::vector<jdouble> values_of(const maq_intrinsics& from) {
  std::vector<jdouble> values = {
      double(from.width_px), double(from.height_px), from.fx_px, from.fy_px, from.cx_px, from.cy_px};
  values.insert(values.end(), std::begin(from.distortion), std::end(from.distortion));
  return values;
}

// Values of the intrinsics, then of the pose.
inline std::vector<jdouble> values_of(const maq_pinhole_camera& from) {
  std::vector<jdouble> values = values_of(from.intrinsics);
  values.insert(values.end(), std::begin(from.rotation), std::end(from.rotation));
  values.insert(values.end(), std::begin(from.centre), std::end(from.centre));
  return values;
}

// From the first 14 values, which are as in Intrinsics.
inline maq_intrinsics intrinsics_of(const std::vector<jdouble>& values) {
  maq_intrinsics intrinsics{};
  intrinsics.width_px = int32_t(values[0]);
  intrinsics.height_px = int32_t(values[1]);
  intrinsics.fx_px = values[2];
  intrinsics.fy_px = values[3];
  intrinsics.cx_px = values[4];
  intrinsics.cy_px = values[5];
  std::copy_n(&values[6], 8, intrinsics.distortion);
  return intrinsics;
}

// `values` as in Intrinsics.
inline maq_intrinsics intrinsics(JNIEnv* env, jdoubleArray values) { return intrinsics_of(numbers(env, values, 14)); }

// `values` as in PinholeCamera.
inline maq_pinhole_camera pinhole_camera(JNIEnv* env, jdoubleArray values) {
  const std::vector<jdouble> from = numbers(env, values, 26);
  maq_pinhole_camera camera{};
  camera.struct_size = sizeof camera;
  camera.intrinsics = intrinsics_of(from);
  std::copy_n(&from[14], 9, camera.rotation);
  std::copy_n(&from[23], 3, camera.centre);
  return camera;
}

}  // namespace maq_jni
