#include "scene/networks/scene_networks.h"

#include <cmath>
#include <cstring>

#include "core/error.h"
#include "nn/sha256.h"

namespace maq {
namespace {

constexpr size_t kRefinersKept = 3;
// Limit of the basis: its output stays a finite float when it is squared.
constexpr float kLargestWeight = 1000;
constexpr int kMaxLevels = 5, kSpaceToDepthPixels = 4, kColours = 3;

template <class... Parts>
[[noreturn]] void fail(const std::string& name, const Parts&... parts) {
  throw Error(MAQ_ERROR_BAD_BUNDLE, "Bundle ", name, ": ", parts..., ". Export the bundle again.");
}

// Channels of a tensor of the shape [1, h, w, channels]; 0 for other shapes.
int64_t channels_of(const TensorSpec& tensor) {
  const int64_t* channels = tensor.shape.size() == 4 ? std::get_if<int64_t>(&tensor.shape[3]) : nullptr;
  return channels == nullptr ? 0 : *channels;
}

void check_extractor(const Manifest& manifest) {
  const GraphSpec& spec = manifest.graphs.at("extractor");
  const bool is_right = spec.inputs.size() == 1 && spec.outputs.size() == 1 && spec.inputs[0].name == "image" &&
                        spec.outputs[0].name == "features" && channels_of(spec.inputs[0]) == kColours &&
                        channels_of(spec.outputs[0]) == kFeatures;
  if (!is_right) {
    fail(manifest.name, "graph extractor must have the input image [1, height, width, 3] and the output features ",
         "[1, height, width, ", kFeatures, "]");
  }
}

RefinerLayout layout_of(const Manifest& manifest) {
  const GraphSpec& spec = manifest.graphs.at("refiner");
  RefinerLayout layout;
  layout.levels = int(spec.inputs.size());
  if (layout.levels < 1 || layout.levels > kMaxLevels) {
    fail(manifest.name, "graph refiner has ", spec.inputs.size(), " inputs, but must have 1 to ", kMaxLevels);
  }
  for (int level = 0; level < layout.levels; ++level) {
    const TensorSpec& raster = spec.inputs[size_t(level)];
    const int64_t channels = channels_of(raster);
    if (level == 0) layout.is_space_to_depth = channels == kSpaceToDepthPixels * SceneNetworks::kRasterChannels;
    const bool is_right =
        channels == SceneNetworks::kRasterChannels * (level == 0 && layout.is_space_to_depth ? kSpaceToDepthPixels : 1);
    if (raster.name != "raster" + std::to_string(level) || !is_right) {
      fail(manifest.name, "input ", level, " of graph refiner is ", raster.name, " with ", channels,
           " channels, but must be raster", level, " with ", SceneNetworks::kRasterChannels,
           " (four times as many for a space-to-depth raster0)");
    }
  }
  const int64_t wanted = kColours * (layout.is_space_to_depth ? kSpaceToDepthPixels : 1);
  if (spec.outputs.size() != 1 || spec.outputs[0].name != "rgb" || channels_of(spec.outputs[0]) != wanted) {
    fail(manifest.name, "graph refiner must have one output, rgb with ", wanted, " channels");
  }
  return layout;
}

Bundle checked(Bundle bundle) {
  bundle.manifest.require_task("scenes");
  bundle.manifest.require_graphs({"extractor", "refiner"});
  return bundle;
}

std::string basis_file(const Manifest& manifest) { return manifest.listed_file(manifest.root.at("basis").at("file")); }

std::vector<float> basis_weights(const Bundle& bundle) {
  const std::string file = basis_file(bundle.manifest);
  const std::vector<uint8_t>& bytes = bundle.files.at(file);
  std::vector<float> weights(ViewBasis::kWeights);
  if (bytes.size() != weights.size() * sizeof(float)) {
    fail(bundle.manifest.name, file, " has ", bytes.size(), " bytes, but must have ", weights.size() * sizeof(float));
  }
  std::memcpy(weights.data(), bytes.data(), bytes.size());
  for (const float weight : weights) {
    if (!(std::abs(weight) <= kLargestWeight)) {
      fail(bundle.manifest.name, file, " has the weight ", weight, ", but none may be over ", kLargestWeight);
    }
  }
  return weights;
}

std::array<uint8_t, 32> identity_of(const Manifest& manifest) {
  std::string digests;
  for (const std::string& file :
       {manifest.graphs.at("extractor").file, manifest.graphs.at("refiner").file, basis_file(manifest)}) {
    digests += manifest.files.at(file).sha256;
  }
  const std::string hex = sha256_hex(digests.data(), digests.size());
  std::array<uint8_t, 32> identity{};
  for (size_t i = 0; i < identity.size(); ++i) identity[i] = uint8_t(std::stoi(hex.substr(2 * i, 2), nullptr, 16));
  return identity;
}

void check_size(int width_px, int height_px, int multiple, const char* what) {
  if (width_px < 1 || height_px < 1 || width_px % multiple != 0 || height_px % multiple != 0) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, what, " is ", width_px, " x ", height_px,
                " pixels, but its sides must be multiples of ", multiple, ".");
  }
  if (int64_t(width_px) * height_px > SceneNetworks::kMaxPixels) {
    throw Error(MAQ_ERROR_IMAGE_SIZE, what, " is ", width_px, " x ", height_px, " pixels, over the limit of ",
                SceneNetworks::kMaxPixels, " for the networks; use a smaller one.");
  }
}

}  // namespace

Shape RefinerLayout::raster_shape(int level, int width_px, int height_px) const {
  if (level == 0 && is_space_to_depth) {
    return {1, height_px / 2, width_px / 2, kSpaceToDepthPixels * SceneNetworks::kRasterChannels};
  }
  return {1, height_px >> level, width_px >> level, SceneNetworks::kRasterChannels};
}

Shape RefinerLayout::picture_shape(int width_px, int height_px) const {
  if (is_space_to_depth) return {1, height_px / 2, width_px / 2, kSpaceToDepthPixels * kColours};
  return {1, height_px, width_px, kColours};
}

SceneNetworks::SceneNetworks(std::shared_ptr<const OnnxRuntimeLibrary> runtime, Bundle bundle,
                             const SessionSettings& settings)
    : bundle_(checked(std::move(bundle))),
      basis_(basis_weights(bundle_)),
      layout_(layout_of(bundle_.manifest)),
      sha256_(identity_of(bundle_.manifest)),
      runtime_(runtime),
      settings_(settings),
      refiner_(runtime, bundle_.files.at(bundle_.manifest.graphs.at("refiner").file),
               bundle_.manifest.graphs.at("refiner"), bundle_.path_of(bundle_.manifest.graphs.at("refiner").file),
               settings, kRefinersKept) {
  check_extractor(bundle_.manifest);
}

void SceneNetworks::check_photo_size(int width_px, int height_px) {
  check_size(width_px, height_px, kPhotoMultiple, "The photo");
}

const float* SceneNetworks::extract(const float* photo, int width_px, int height_px) {
  check_photo_size(width_px, height_px);
  if (extractor_ == nullptr) {
    const GraphSpec& spec = bundle_.manifest.graphs.at("extractor");
    SessionSettings settings = settings_;
    settings.plans_memory = false;
    settings.provider = MAQ_PROVIDER_CPU;  // others want to know the sizes
    extractor_ = open_session(runtime_, bundle_.files.at(spec.file), spec, bundle_.path_of(spec.file), settings);
  }
  return extractor_->run({{photo, {1, height_px, width_px, kColours}}}, {{1, height_px, width_px, kFeatures}})[0].data;
}

const float* SceneNetworks::refine(const std::vector<const float*>& rasters, int width_px, int height_px) {
  check_size(width_px, height_px, kPictureMultiple, "The picture");
  if (rasters.size() != size_t(layout_.levels)) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The refiner takes ", layout_.levels, " rasters, but ", rasters.size(),
                " are given.");
  }
  inputs_.clear();
  for (int level = 0; level < layout_.levels; ++level) {
    inputs_.push_back({rasters[size_t(level)], layout_.raster_shape(level, width_px, height_px)});
  }
  Session& refiner = refiner_.at(width_px, height_px);
  provider_ = refiner.provider();
  return refiner.run(inputs_, {layout_.picture_shape(width_px, height_px)})[0].data;
}

}  // namespace maq
