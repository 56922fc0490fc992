// Bodies of people: pose, shape, mesh, and files of clips, for C++17; a part of maquette.hpp.
#ifndef MAQUETTE_BODY_HPP_
#define MAQUETTE_BODY_HPP_

#include <string>
#include <vector>

#include "maquette/body.h"
#include "maquette/context.hpp"
#include "maquette/features.h"
#if MAQ_HAS_DENSEPOSE
#include "maquette/densepose.hpp"
#endif

namespace maquette {

inline maq_body_config default_body_config() {
  maq_body_config config;
  check(maq_body_config_init(&config, sizeof config));
  return config;
}

inline maq_body_input default_body_input() {
  maq_body_input input;
  check(maq_body_input_init(&input, sizeof input));
  return input;
}

class BodyResult {
 public:
  // Takes ownership of a result from the C API.
  explicit BodyResult(maq_body_result* result) : owner_(result) {}

  maq_body_result* get() const { return owner_.get(); }

  // Gets the sizes of the person at `index`. Throws maquette::Error for a person who was not fitted.
  maq_body_sizes sizes(uint32_t index) const {
    maq_body_sizes sizes{};
    sizes.struct_size = sizeof sizes;
    check(maq_body_result_get_sizes(get(), index, &sizes));
    return sizes;
  }

  // In the order of the input. The pointers are valid as long as this object.
  std::vector<maq_body_person> people() const {
    std::vector<maq_body_person> all(maq_body_result_get_person_count(get()));
    for (uint32_t i = 0; i < all.size(); ++i) {
      all[i].struct_size = sizeof(maq_body_person);
      check(maq_body_result_get_person(get(), i, &all[i]));
    }
    return all;
  }

 private:
  Owner<maq_body_result, maq_body_result_release> owner_;
};

class Body {
 public:
  explicit Body(const Context& context, const maq_body_config& config = default_body_config()) {
    maq_body* made = nullptr;
    check(maq_body_create(context.get(), &config, &made));
    owner_ = Owner<maq_body, maq_body_destroy>(made);
  }

  maq_body* get() const { return owner_.get(); }

  BodyResult run(const maq_body_input& input) {
    maq_body_result* result = nullptr;
    check(maq_body_run(get(), &input, &result));
    return BodyResult(result);
  }

#if MAQ_HAS_DENSEPOSE
  // Fits the people of a dense pose result; with its keypoints, if it has some. `frame`: of the result; its time, and
  // its intrinsics if it has some. heights_m: of each person, 0 for unknown; empty: all unknown.
  BodyResult run(const DensePoseResult& result, const maq_frame_desc& frame, const std::vector<float>& heights_m = {}) {
    maq_body_input input = default_body_input();
    input.width_px = result.width_px();
    input.height_px = result.height_px();
    const auto plane = [&](maq_densepose_plane which) {
      const uint8_t* pixels = nullptr;
      check(maq_densepose_result_get_plane(result.get(), which, &pixels, &input.stride_bytes));
      return pixels;
    };
    input.part = plane(MAQ_DENSEPOSE_PLANE_PART);
    input.u = plane(MAQ_DENSEPOSE_PLANE_U);
    input.v = plane(MAQ_DENSEPOSE_PLANE_V);
    input.person = plane(MAQ_DENSEPOSE_PLANE_PERSON);
    std::vector<int64_t> ids;
    for (const maq_densepose_person& person : result.people()) ids.push_back(person.id);
    input.person_count = uint32_t(ids.size());
    input.ids = ids.data();
    std::vector<float> keypoints(99 * ids.size());
    bool has_keypoints = !ids.empty();
    for (uint32_t i = 0; has_keypoints && i < ids.size(); ++i) {
      has_keypoints = maq_densepose_result_get_keypoints(result.get(), i, keypoints.data() + 99 * i) == MAQ_OK;
    }
    if (has_keypoints) input.keypoints = keypoints.data();
    std::vector<float> heights = heights_m;
    heights.resize(ids.size());
    input.heights_m = heights.data();
    if (frame.intrinsics.width_px > 0) input.intrinsics = &frame.intrinsics;
    input.timestamp_ns = frame.timestamp_ns;
    return run(input);
  }
#endif

  void reset() { check(maq_body_reset(get())); }

  // The pointers are valid as long as this object.
  maq_body_mesh mesh() const {
    maq_body_mesh mesh{};
    mesh.struct_size = sizeof mesh;
    check(maq_body_get_mesh(get(), &mesh));
    return mesh;
  }

 private:
  Owner<maq_body, maq_body_destroy> owner_;
};

// The bodies of a clip, and their files.
class BodyClip {
 public:
  explicit BodyClip(const Body& body) {
    maq_body_clip* made = nullptr;
    check(maq_body_clip_create(body.get(), &made));
    owner_ = Owner<maq_body_clip, maq_body_clip_destroy>(made);
  }

  maq_body_clip* get() const { return owner_.get(); }
  uint32_t person_count() const { return maq_body_clip_get_person_count(get()); }
  void add(const BodyResult& result) { check(maq_body_clip_add_result(get(), result.get())); }

  // Writes all people to a .glb file, or one of them to a .glb or .bvh file.
  void save(const std::string& path) { check(maq_body_clip_save(get(), path.c_str())); }
  void save_person(uint32_t index, const std::string& path) {
    check(maq_body_clip_save_person(get(), index, path.c_str()));
  }

 private:
  Owner<maq_body_clip, maq_body_clip_destroy> owner_;
};

}  // namespace maquette

#endif  // MAQUETTE_BODY_HPP_
