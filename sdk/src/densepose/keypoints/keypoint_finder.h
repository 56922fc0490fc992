// Finds the keypoints of people by the bundle's network of keypoints.
#pragma once

#include <memory>
#include <vector>

#include "densepose/bundle/manifest.h"
#include "densepose/bundle/networks.h"
#include "densepose/keypoints/keypoint_decode.h"
#include "nn/session.h"

namespace maq {

class KeypointFinder {
 public:
  // `surface_channels`: of the dense head's output `surface`. Throws MAQ_ERROR_UNSUPPORTED for a bundle that has no
  // keypoints, or has none for its own networks of crops; MAQ_ERROR_BAD_BUNDLE.
  KeypointFinder(const DensePoseNetworks& networks, const DensePoseSpec& spec, int surface_channels);

  // Begins a frame.
  void begin();
  // Adds a person: the features of the surface [pool, pool, channels], and the map from cells of the dense head's
  // output to the image.
  void add(const float* surface, const AffineMap& to_image);
  // Finds the keypoints of all people, in the order of add().
  const std::vector<Keypoints>& run(RunCancel& cancel);

 private:
  const int pool_, channels_;
  std::unique_ptr<Session> network_;
  std::vector<float> surfaces_;
  std::vector<AffineMap> maps_;
  std::vector<TensorView> inputs_;
  std::vector<Shape> shapes_;
  std::vector<Keypoints> found_;
};

}  // namespace maq
