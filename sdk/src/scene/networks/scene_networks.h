// The three networks of scenes, from a bundle (docs/reference/formats.md): the extractor makes features of photos, the
// view basis says how descriptors depend on the viewing direction, the refiner makes images of descriptor rasters.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "nn/bundle.h"
#include "nn/sized_sessions.h"
#include "scene/networks/view_basis.h"

namespace maq {

// Layout of the refiner's rasters and of its image; channels are last everywhere.
struct RefinerLayout {
  int levels = 0;  // it reads the rasters at 1, 1/2, …, 1 / 2^(levels - 1) of the size
  // The finest raster and the image are space-to-depth (pixel unshuffle): pixels (0, 0), (0, 1), (1, 0), (1, 1) of each
  // 2x2 are one, all channels of one before those of the next.
  bool is_space_to_depth = false;

  // Shapes of the rasters of an image of that size (sides multiples of kMultiple), and of the image.
  Shape raster_shape(int level, int width_px, int height_px) const;
  Shape picture_shape(int width_px, int height_px) const;
};

class SceneNetworks {
 public:
  static constexpr int kPhotoMultiple = 32;    // of the sides of photos
  static constexpr int kPictureMultiple = 16;  // of the sides of rendered images
  static constexpr int kRasterChannels = kFeatures + 1;
  // Maximum pixels of a photo or a rendered image. A photo takes some 400 bytes a pixel while the extractor works on
  // it.
  static constexpr int64_t kMaxPixels = int64_t(1) << 23;

  // Networks are made when they are needed first, the refiner for each size that it is needed for. Throws
  // MAQ_ERROR_UNSUPPORTED for a bundle of another task, and MAQ_ERROR_BAD_BUNDLE if a graph's inputs or outputs in the
  // manifest differ from the format.
  SceneNetworks(std::shared_ptr<const OnnxRuntimeLibrary> runtime, Bundle bundle, const SessionSettings& settings);
  SceneNetworks(const SceneNetworks&) = delete;
  SceneNetworks& operator=(const SceneNetworks&) = delete;

  const std::string& name() const { return bundle_.manifest.name; }
  const ViewBasis& basis() const { return basis_; }
  const RefinerLayout& refiner_layout() const { return layout_; }
  // SHA-256 of the SHA-256 digests of the three networks' files: extractor, refiner, basis.
  const std::array<uint8_t, 32>& sha256() const { return sha256_; }

  // Throws the errors of extract() for a photo of that size.
  static void check_photo_size(int width_px, int height_px);

  // Features [height][width][kFeatures] of a photo [height][width][3], RGB in 0..1, sides multiples of kPhotoMultiple.
  // They stay until the next photo. Not for two threads at once. Throws MAQ_ERROR_INVALID_ARGUMENT for other sides,
  // MAQ_ERROR_IMAGE_SIZE, MAQ_ERROR_BAD_BUNDLE if the graph contradicts the manifest, MAQ_ERROR_INFERENCE.
  const float* extract(const float* photo, int width_px, int height_px);

  // Computes the image, not clamped, from rasters of kRasterChannels (features, then 1 where there is a point): as many
  // and in the layout as refiner_layout() says, the finest first. It stays until the next. Sides are multiples of
  // kPictureMultiple. Not for two threads at once; beside extract() is fine. Throws as extract() does.
  const float* refine(const std::vector<const float*>& rasters, int width_px, int height_px);

  // Provider in use for the latest image.
  maq_provider provider() const { return provider_; }

  // Gives the extractor's memory back; it is made again when it is needed.
  void forget_extractor() { extractor_.reset(); }

 private:
  Bundle bundle_;
  ViewBasis basis_;
  RefinerLayout layout_;
  std::array<uint8_t, 32> sha256_{};
  std::shared_ptr<const OnnxRuntimeLibrary> runtime_;
  SessionSettings settings_;
  // With open sizes: gravity-aligned photos are of many, and a session for each takes longer to make than it saves.
  std::unique_ptr<Session> extractor_;
  SizedSessions refiner_;
  maq_provider provider_ = MAQ_PROVIDER_CPU;
  std::vector<TensorView> inputs_;
};

}  // namespace maq
