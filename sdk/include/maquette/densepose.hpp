// Dense pose of people, for C++17; a part of maquette.hpp.
#ifndef MAQUETTE_DENSEPOSE_HPP_
#define MAQUETTE_DENSEPOSE_HPP_

#include <array>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "maquette/densepose.h"
#include "maquette/frame.hpp"

namespace maquette {

inline maq_densepose_config default_densepose_config() {
  maq_densepose_config config;
  check(maq_densepose_config_init(&config, sizeof config));
  return config;
}

// A line of a drawn skeleton.
struct Bone {
  maq_densepose_keypoint from, to;
};

inline constexpr std::array<Bone, 22> kSkeleton = {{
    {MAQ_DENSEPOSE_KEYPOINT_LEFT_SHOULDER, MAQ_DENSEPOSE_KEYPOINT_RIGHT_SHOULDER},
    {MAQ_DENSEPOSE_KEYPOINT_LEFT_HIP, MAQ_DENSEPOSE_KEYPOINT_RIGHT_HIP},
    {MAQ_DENSEPOSE_KEYPOINT_LEFT_SHOULDER, MAQ_DENSEPOSE_KEYPOINT_LEFT_HIP},
    {MAQ_DENSEPOSE_KEYPOINT_RIGHT_SHOULDER, MAQ_DENSEPOSE_KEYPOINT_RIGHT_HIP},
    {MAQ_DENSEPOSE_KEYPOINT_LEFT_SHOULDER, MAQ_DENSEPOSE_KEYPOINT_LEFT_ELBOW},
    {MAQ_DENSEPOSE_KEYPOINT_RIGHT_SHOULDER, MAQ_DENSEPOSE_KEYPOINT_RIGHT_ELBOW},
    {MAQ_DENSEPOSE_KEYPOINT_LEFT_ELBOW, MAQ_DENSEPOSE_KEYPOINT_LEFT_WRIST},
    {MAQ_DENSEPOSE_KEYPOINT_RIGHT_ELBOW, MAQ_DENSEPOSE_KEYPOINT_RIGHT_WRIST},
    {MAQ_DENSEPOSE_KEYPOINT_LEFT_WRIST, MAQ_DENSEPOSE_KEYPOINT_LEFT_INDEX},
    {MAQ_DENSEPOSE_KEYPOINT_RIGHT_WRIST, MAQ_DENSEPOSE_KEYPOINT_RIGHT_INDEX},
    {MAQ_DENSEPOSE_KEYPOINT_LEFT_WRIST, MAQ_DENSEPOSE_KEYPOINT_LEFT_THUMB},
    {MAQ_DENSEPOSE_KEYPOINT_RIGHT_WRIST, MAQ_DENSEPOSE_KEYPOINT_RIGHT_THUMB},
    {MAQ_DENSEPOSE_KEYPOINT_LEFT_HIP, MAQ_DENSEPOSE_KEYPOINT_LEFT_KNEE},
    {MAQ_DENSEPOSE_KEYPOINT_RIGHT_HIP, MAQ_DENSEPOSE_KEYPOINT_RIGHT_KNEE},
    {MAQ_DENSEPOSE_KEYPOINT_LEFT_KNEE, MAQ_DENSEPOSE_KEYPOINT_LEFT_ANKLE},
    {MAQ_DENSEPOSE_KEYPOINT_RIGHT_KNEE, MAQ_DENSEPOSE_KEYPOINT_RIGHT_ANKLE},
    {MAQ_DENSEPOSE_KEYPOINT_LEFT_ANKLE, MAQ_DENSEPOSE_KEYPOINT_LEFT_FOOT_INDEX},
    {MAQ_DENSEPOSE_KEYPOINT_RIGHT_ANKLE, MAQ_DENSEPOSE_KEYPOINT_RIGHT_FOOT_INDEX},
    {MAQ_DENSEPOSE_KEYPOINT_NOSE, MAQ_DENSEPOSE_KEYPOINT_LEFT_EYE},
    {MAQ_DENSEPOSE_KEYPOINT_NOSE, MAQ_DENSEPOSE_KEYPOINT_RIGHT_EYE},
    {MAQ_DENSEPOSE_KEYPOINT_LEFT_EYE, MAQ_DENSEPOSE_KEYPOINT_LEFT_EAR},
    {MAQ_DENSEPOSE_KEYPOINT_RIGHT_EYE, MAQ_DENSEPOSE_KEYPOINT_RIGHT_EAR},
}};

class DensePoseResult {
 public:
  // Takes over a result of the C API.
  explicit DensePoseResult(maq_densepose_result* result) : owner_(result) {
    if (result != nullptr) check(maq_densepose_result_get_size(get(), &width_px_, &height_px_));
  }
  // Refers to the output in a pipeline's result.
  explicit DensePoseResult(PartOf<maq_densepose_result> part)
      : owner_(const_cast<maq_densepose_result*>(part.handle), {std::move(part.whole)}) {
    if (get() != nullptr) check(maq_densepose_result_get_size(get(), &width_px_, &height_px_));
  }

  maq_densepose_result* get() const { return owner_.get(); }
  int32_t width_px() const { return width_px_; }
  int32_t height_px() const { return height_px_; }

  uint32_t person_count() const { return maq_densepose_result_get_person_count(get()); }

  maq_densepose_person person(uint32_t index) const {
    maq_densepose_person person{};
    person.struct_size = sizeof person;
    check(maq_densepose_result_get_person(get(), index, &person));
    return person;
  }

  std::vector<maq_densepose_person> people() const {
    std::vector<maq_densepose_person> people;
    for (uint32_t i = 0; i < person_count(); ++i) people.push_back(person(i));
    return people;
  }

  // Left, top, right, bottom; nothing where none of the head is seen.
  std::optional<std::array<float, 4>> head_box_px(uint32_t index) const {
    std::array<float, 4> box_px{};
    const maq_status status = maq_densepose_result_get_head_box(get(), index, box_px.data());
    if (status == MAQ_ERROR_NOT_FOUND) return std::nullopt;
    check(status);
    return box_px;
  }

  // Indexed by maq_densepose_keypoint: x and y in pixels of the frame, and the confidence.
  std::array<std::array<float, 3>, MAQ_DENSEPOSE_KEYPOINT_COUNT> keypoints(uint32_t index) const {
    std::array<std::array<float, 3>, MAQ_DENSEPOSE_KEYPOINT_COUNT> found{};
    check(maq_densepose_result_get_keypoints(get(), index, found[0].data()));
    return found;
  }

  // height_px() rows of *stride_bytes.
  const uint8_t* plane(maq_densepose_plane plane, size_t* stride_bytes) const {
    const uint8_t* pixels = nullptr;
    check(maq_densepose_result_get_plane(get(), plane, &pixels, stride_bytes));
    return pixels;
  }

  maq_densepose_stats stats() const {
    maq_densepose_stats stats{};
    stats.struct_size = sizeof stats;
    check(maq_densepose_result_get_stats(get(), &stats));
    return stats;
  }

  // RGBA pixels of `drawing`, over `frame`, or on transparent ground where that is null.
  void draw(const Frame* frame, const maq_densepose_drawing& drawing, uint8_t* rgba, size_t stride_bytes,
            size_t size_bytes) const {
    check(maq_densepose_result_draw(get(), frame == nullptr ? nullptr : frame->get(), &drawing, rgba, stride_bytes,
                                    size_bytes));
  }

  // Writes <path>_IUV.png, <path>_INDS.png and <path>.json.
  void save(const std::string& path) const { check(maq_densepose_result_save(get(), path.c_str())); }

 private:
  Owner<maq_densepose_result, maq_densepose_result_release> owner_;
  int32_t width_px_ = 0;
  int32_t height_px_ = 0;
};

class DensePose {
 public:
  DensePose(const Context& context, const maq_densepose_config& config) { create(context, config); }
  // The bundle installed with the library.
  explicit DensePose(const Context& context) { create(context, default_densepose_config()); }
  DensePose(const Context& context, const std::string& bundle_path) {
    maq_densepose_config config = default_densepose_config();
    config.model.bundle_path = bundle_path.c_str();
    create(context, config);
  }

  maq_densepose* get() const { return owner_.get(); }

  DensePoseResult run(const Frame& frame) {
    maq_densepose_result* result = nullptr;
    check(maq_densepose_run(get(), frame.get(), &result));
    return DensePoseResult(result);
  }

  // From any thread: the run that runs, or else the next, throws Error with MAQ_CANCELLED.
  void cancel() { check(maq_densepose_cancel(get())); }

  // From any thread.
  void set_roll(float roll_rad) { check(maq_densepose_set_roll(get(), roll_rad)); }

  void reset() { check(maq_densepose_reset(get())); }

  // Nothing when the bundle has none. The points are this object's.
  std::optional<maq_densepose_surface> surface() const {
    maq_densepose_surface surface{};
    surface.struct_size = sizeof surface;
    const maq_status status = maq_densepose_get_surface(get(), &surface);
    if (status == MAQ_ERROR_UNSUPPORTED) return std::nullopt;
    check(status);
    return surface;
  }

 private:
  void create(const Context& context, const maq_densepose_config& config) {
    maq_densepose* made = nullptr;
    check(maq_densepose_create(context.get(), &config, &made));
    owner_.reset(made);
  }

  Owner<maq_densepose, maq_densepose_destroy> owner_;
};

}  // namespace maquette

#endif  // MAQUETTE_DENSEPOSE_HPP_
