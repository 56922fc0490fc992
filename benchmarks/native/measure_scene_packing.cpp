// Bytes a point of a scene against what packing changes: `measure_scene_packing CAPTURE BUNDLE`.
//
// The scene is built of the capture's photos with the networks of the bundle. Then, for each way to store coefficients
// and some thresholds of ScenePacking::min_view_dependence: the fraction of view-dependent points; bytes a point of the
// file; the error against the fitted descriptors, over the photos that saw each point and all features, in fractions of
// a feature's standard deviation over the points: RMS over all points, what 99 % of points stay below of, and the worst
// point's; and, where the capture holds photos out, PSNR of their views against the photos, and against views of the
// scene in floats.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "core/error.h"
#include "scene/assembly/descriptor_fitter.h"
#include "scene/capture/posed_view.h"
#include "scene/format/block_codec.h"
#include "scene/format/scene.h"
#include "scene/format/scene_packing.h"
#include "scene/render/scene_renderer.h"

namespace {

using maq::kBasis;
using maq::kFeatures;

// The root of the mean square, over features and the photos that a point was seen in, of what an error of its mean and
// linear_terms makes of its descriptor: known from the mean and the scatter R^T R of the basis values, without the
// photos.
double error_over_photos(const maq::DescriptorRegression& regression, const double* constant, const double* linear) {
  double sum = 0;
  const float* row = regression.triangle;
  for (int c = 0; c < kFeatures; ++c) {
    double off = constant[c];
    for (int j = 0; j < kBasis; ++j) off += double(regression.mean_h[j]) * linear[j * kFeatures + c];
    sum += off * off * regression.views;
  }
  for (int i = 0; i < kBasis; row += kBasis - i, ++i) {
    for (int c = 0; c < kFeatures; ++c) {
      double value = 0;
      for (int j = i; j < kBasis; ++j) value += double(row[j - i]) * linear[j * kFeatures + c];
      sum += value * value;
    }
  }
  return std::sqrt(sum / regression.views / kFeatures);
}

std::array<double, kFeatures> deviations(const maq::FittedPoints& points) {
  std::array<double, kFeatures> sums{}, squares{}, found{};
  for (size_t i = 0; i < points.constant_terms.size(); ++i) {
    sums[i % kFeatures] += points.constant_terms[i];
    squares[i % kFeatures] += double(points.constant_terms[i]) * points.constant_terms[i];
  }
  const auto count = double(points.count());
  for (size_t c = 0; c < kFeatures; ++c) {
    found[c] = std::sqrt(std::max(squares[c] / count - sums[c] / count * sums[c] / count, 1e-12));
  }
  return found;
}

// `order`: of the scene's points among the given, which are in the order of the regressions.
void print_errors(const maq::FittedPoints& points, const maq::RegressionStore& regressions, const maq::Scene& scene,
                  const std::vector<uint32_t>& order) {
  const std::array<double, kFeatures> deviation = deviations(points);
  std::vector<double> errors;
  double squares = 0;
  for (uint32_t b = 0; b < scene.block_count; ++b) {
    const maq::SceneBlock& block = scene.blocks[b];
    const maq::FittedPoints part = decode_block(scene, block);
    for (uint32_t k = 0; k < block.count; ++k) {
      const size_t point = order[block.first + k];
      double constant[kFeatures], linear[maq::kLinearTerms];
      for (size_t c = 0; c < kFeatures; ++c) {
        constant[c] = (double(part.constant_terms[k * kFeatures + c]) - points.constant_terms[point * kFeatures + c]) /
                      deviation[c];
      }
      for (size_t c = 0; c < maq::kLinearTerms; ++c) {
        const double off =
            double(part.linear_terms[k * maq::kLinearTerms + c]) - points.linear_terms[point * maq::kLinearTerms + c];
        linear[c] = off / deviation[c % kFeatures];
      }
      errors.push_back(error_over_photos(regressions.at(point), constant, linear));
      squares += errors.back() * errors.back();
    }
  }
  std::sort(errors.begin(), errors.end());
  std::printf("%9.5f %9.5f %9.5f", std::sqrt(squares / double(errors.size())),
              errors[size_t(0.99 * double(errors.size() - 1))], errors.back());
}

struct HeldOut {
  maq::PinholeCamera camera;
  std::vector<uint8_t> photo, in_floats;  // BGR
};

class Psnr {
 public:
  void add(const std::vector<uint8_t>& a, const std::vector<uint8_t>& b) {
    double squares = 0;
    for (size_t i = 0; i < a.size(); ++i) squares += (double(a[i]) - b[i]) * (double(a[i]) - b[i]);
    sum_db_ += 10 * std::log10(255.0 * 255.0 * double(a.size()) / std::max(squares, 1.0));
    ++count_;
  }
  double mean_db() const { return sum_db_ / count_; }

 private:
  double sum_db_ = 0;
  int count_ = 0;
};

void print_views(const maq::Scene& scene, const std::shared_ptr<maq::SceneNetworks>& networks,
                 std::vector<HeldOut>& views) {
  maq::SceneRenderer renderer(scene, networks, {});
  maq::RenderedImage picture;
  Psnr to_photo, to_floats;
  for (HeldOut& view : views) {
    renderer.render(view.camera, picture);
    if (view.in_floats.empty()) view.in_floats = picture.bgr;
    to_photo.add(picture.bgr, view.photo);
    to_floats.add(picture.bgr, view.in_floats);
  }
  if (!views.empty()) std::printf(" %9.3f %9.2f", to_photo.mean_db(), to_floats.mean_db());
}

int measure(const char* capture_folder, const char* bundle) {
  const auto runtime = std::make_shared<maq::OnnxRuntimeLibrary>(MAQ_TEST_ONNXRUNTIME, maq::Log());
  const auto networks = std::make_shared<maq::SceneNetworks>(runtime, maq::read_bundle(bundle), maq::SessionSettings());
  const maq::Capture capture = maq::open_capture(capture_folder);
  maq::DescriptorFitter fitter(capture.cloud, capture.up, *networks, {});
  std::vector<HeldOut> views;
  for (const maq::CaptureView& view : capture.views) {
    maq::PosedView photo;
    photo.load(view, 640);
    if (view.is_held_out) {
      const maq::ImageView& image = photo.image();
      views.push_back(
          {photo.camera(), std::vector<uint8_t>(maq::packed_bytes(image.format, image.width_px, image.height_px)), {}});
      maq::copy_packed(image, views.back().photo.data());
    } else {
      fitter.add_view(photo.image(), photo.valid(), photo.camera());
    }
  }
  const maq::FittedPoints points = fitter.finish();
  std::vector<float> view_dependence = points.view_dependence;
  std::sort(view_dependence.begin(), view_dependence.end());
  const auto quantile = [&](double fraction) {
    return double(view_dependence[size_t(fraction * double(view_dependence.size() - 1))]);
  };
  double photos = 0;
  for (const uint32_t count : points.views) photos += count;
  std::printf("%zu points, %.1f photos a point; view_dependence: median %.4f, 90 %% %.4f, 99 %% %.4f\n", points.count(),
              photos / double(points.count()), quantile(0.5), quantile(0.9), quantile(0.99));
  std::printf("constant_terms' standard deviation:");
  for (const double deviation : deviations(points)) std::printf(" %.3f", deviation);
  std::printf("\nstored threshold view_dependent  bytes       RMS      99 %%     worst  photos dB floats dB\n");
  for (const auto& [name, kind] : {std::pair("float", maq::CoefficientFormat::kFloat32),
                                   {"int16", maq::CoefficientFormat::kInt16},
                                   {"int8", maq::CoefficientFormat::kInt8}}) {
    for (const float min : {0.0f, 0.005f, 0.011f, 0.02f, 0.03f, 0.05f, 0.08f, 0.12f, 0.2f, 1e9f}) {
      const auto positions =
          kind == maq::CoefficientFormat::kFloat32 ? maq::PositionFormat::kFloat32 : maq::PositionFormat::kUint16;
      const maq::ScenePacking packing = {positions, kind, min};
      const maq::Scene scene = make_scene(points, packing);
      const size_t bytes =
          blocks_bytes(scene) + positions_bytes(scene) + constant_terms_bytes(scene) + linear_terms_bytes(scene);
      std::printf("%-6s %9.3g %7.3f %6.1f ", name, double(min), double(scene.view_dependent) / scene.points,
                  double(bytes) / scene.points);
      print_errors(points, fitter.regressions(), scene, order_points(points, packing).points);
      print_views(scene, networks, views);
      std::printf("\n");
    }
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return std::fputs("measure_scene_packing CAPTURE BUNDLE\n", stderr), 2;
  try {
    return measure(argv[1], argv[2]);
  } catch (const maq::Error& error) {
    return std::fprintf(stderr, "%s\n", error.what()), 1;
  }
}
