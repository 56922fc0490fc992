// Bodies: their file, and fits to planes of labels that no network would give.
#include <fstream>
#include <iterator>
#include <memory>

#include "body/files/body_bvh.h"
#include "body/files/body_glb.h"
#include "body/fit/people_fitter.h"
#include "body/model/body_file.h"
#include "body/pose/joint_angles.h"
#include "body/sizes/size_intervals.h"
#include "checked_file.h"

using namespace maq::body;

namespace {

constexpr int kPlaneSide_px = 24;

// Planes of one person, whose bytes lie one behind the other: part, U, V and person.
struct Planes {
  explicit Planes(fuzz::Bytes given) : bytes(std::move(given)) { bytes.resize(4 * kPixels); }

  LabelImage labels() const {
    const uint8_t* const at = bytes.data();
    return {kPlaneSide_px, kPlaneSide_px, at, at + kPixels, at + 2 * kPixels, at + 3 * kPixels, size_t(kPlaneSide_px)};
  }

  static constexpr size_t kPixels = size_t(kPlaneSide_px) * kPlaneSide_px;
  fuzz::Bytes bytes;
};

void require_sane(const BodyModel& model, const FittedBody& fitted) {
  fuzz::require(is_finite(fitted.pose, model.joints.size()), "a pose that is not finite");
  for (const double shape : fitted.pose.shape) fuzz::require(std::abs(shape) <= 3, "a shape beyond its bounds");
  if (fitted.status != FitStatus::kFitted) return;
  for (const double part : fitted.size_shape.covariance)
    fuzz::require(std::isfinite(part), "a covariance that is not finite");
}

// Uses a body as a run of the C API does.
void use_body(const BodyModel& model) {
  fuzz::Bytes labels(4 * Planes::kPixels);
  for (size_t i = 0; i < labels.size(); ++i) labels[i] = uint8_t(i < Planes::kPixels ? 1 + i / 3 % 24 : i * 37);
  std::fill(labels.begin() + 3 * Planes::kPixels, labels.end(), uint8_t(1));
  const Planes planes(labels);
  PeopleFitter fitter(model);
  BodyClip clip;
  for (int frame = 0; frame < 2; ++frame) {
    fitter.begin_frame(planes.labels(), {frame == 1, 20, 20, 12, 12}, frame);
    const FittedBody fitted = fitter.fit({1, 1, nullptr, frame == 1 ? 1.8 : 0});
    require_sane(model, fitted);
    clip.add(1, {frame, fitted.pose});
  }
  fuzz::require(!people_as_glb(model, clip.people()).empty(), "a .glb without bytes");
  fuzz::require(!person_as_bvh(model, *clip.people()[0]).empty(), "a .bvh without text");
  fuzz::run_or_refuse({MAQ_ERROR_BAD_BUNDLE},
                      [&] { AngleJoints(model).angles_deg(bones_of(model, mean_pose(model))); });
  fuzz::run_or_refuse({MAQ_ERROR_BAD_BUNDLE}, [&] {
    for (const SizeEstimate& size : estimate_sizes(BodySizes(model), model.shape_count, SizeShape{}, 0)) {
      fuzz::require(std::isfinite(size.value_m) && size.low_m <= size.high_m, "an invalid interval");
    }
  });
}

const BodyModel& small_body() {
  static const auto model = [] {
    std::ifstream file(MAQ_TEST_DATA "/tiny_body/body.maqb", std::ios::binary);
    const fuzz::Bytes bytes{std::istreambuf_iterator<char>(file), {}};
    return std::make_unique<BodyModel>(read_body(bytes.data(), bytes.size(), "body.maqb"));
  }();
  return *model;
}

std::vector<fuzz::Bytes> planes_of_a_person() {
  fuzz::Writer seed;
  seed.add(float(20)).add(float(12)).add(float(1.7)).add(uint8_t(1));
  for (int k = 0; k < 33; ++k) seed.add(float(k % 24)).add(float(k / 2)).add(float(0.9));
  for (size_t i = 0; i < 4 * Planes::kPixels; ++i) {
    const size_t pixel = i % Planes::kPixels, plane = i / Planes::kPixels;
    const size_t values[] = {1 + pixel / 50 % 12, pixel * 10, pixel * 7, 1};
    seed.add(uint8_t(values[plane]));
  }
  return {seed.bytes};
}

}  // namespace

FUZZ(body_file) {
  const fuzz::Bytes file = fuzz::repaired(bytes);
  fuzz::run_or_refuse({MAQ_ERROR_BAD_BUNDLE, MAQ_ERROR_UNSUPPORTED}, [&] {
    const BodyModel model = read_body(file.data(), file.size(), "body.maqb");
    fuzz::require(model_fault(model).empty(), "a body with a fault");
    use_body(model);
  });
}

// A camera, a height, keypoints, then two frames of planes of the same person.
SEEDED_FUZZ(body_planes, planes_of_a_person) {
  fuzz::Numbers numbers(bytes);
  const auto within = [&](double low, double high) {
    const double number = double(numbers.take<float>());
    return number >= low && number <= high ? number : low;
  };
  BodyCamera camera{true, within(1, 1e6), 0, within(-1e6, 1e6), 12};
  camera.fy_px = camera.fx_px;
  const double height_m = within(1.3, 2.3);
  const bool is_height_known = numbers.take<uint8_t>() % 2 == 1;
  const std::vector<float> keypoints = numbers.floats(3 * kKeypoints);
  PeopleFitter fitter(small_body());
  for (int frame = 0; frame < 3; ++frame) {
    const Planes planes(numbers.bytes(4 * Planes::kPixels));
    fitter.begin_frame(planes.labels(), frame == 2 ? BodyCamera{} : camera, frame);
    require_sane(small_body(), fitter.fit({1, 7, keypoints.data(), is_height_known ? height_m : 0}));
    require_sane(small_body(), fitter.fit({2, 0, nullptr, 0}));
  }
}
