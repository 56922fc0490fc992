#include "densepose/keypoints/keypoint_finder.h"

#include "core/error.h"

namespace maq {
namespace {

constexpr const char* kGraph = "keypoints";

std::unique_ptr<Session> open_network(const DensePoseNetworks& networks, const DensePoseSpec& spec, int64_t channels) {
  const Manifest& manifest = networks.bundle().manifest;
  if (spec.keypoints == 0) {
    throw Error(MAQ_ERROR_UNSUPPORTED, "Bundle ", manifest.name,
                " has no keypoints. Use the bundle that is installed with the library, or leave them off.");
  }
  if (!spec.crop_charts_file.empty()) {
    throw Error(MAQ_ERROR_UNSUPPORTED, "Bundle ", manifest.name,
                " has networks of its own for crops, but no keypoints for them. Leave keypoints off.");
  }
  if (spec.keypoints != int(kKeypoints)) {
    throw Error(MAQ_ERROR_BAD_BUNDLE, "Bundle ", manifest.name, " has ", spec.keypoints, " keypoints, but must have ",
                kKeypoints, ". Export the bundle again.");
  }
  const int64_t pool = spec.dense_head.pool_size;
  return networks.open(kGraph, graph_with(manifest, kGraph, {"surface"}, {"keypoints"}),
                       {kAnySize, pool, pool, channels}, {{kAnySize, pool, pool, int64_t(4 * kKeypoints)}},
                       networks.on_provider());
}

}  // namespace

KeypointFinder::KeypointFinder(const DensePoseNetworks& networks, const DensePoseSpec& spec, int surface_channels)
    : pool_(spec.dense_head.pool_size),
      channels_(surface_channels),
      network_(open_network(networks, spec, surface_channels)) {}

void KeypointFinder::begin() {
  surfaces_.clear();
  maps_.clear();
}

void KeypointFinder::add(const float* surface, const AffineMap& to_image) {
  surfaces_.insert(surfaces_.end(), surface, surface + size_t(pool_) * size_t(pool_) * size_t(channels_));
  maps_.push_back(to_image);
}

const std::vector<Keypoints>& KeypointFinder::run(RunCancel& cancel) {
  found_.clear();
  if (maps_.empty()) return found_;
  const int64_t people = int64_t(maps_.size());
  inputs_.assign(1, {surfaces_.data(), {people, pool_, pool_, channels_}});
  shapes_.assign(1, {people, pool_, pool_, int64_t(4 * kKeypoints)});
  const float* logits = network_->run(inputs_, shapes_, &cancel)[0].data;
  const size_t logits_of_person = size_t(pool_) * size_t(pool_) * 4 * kKeypoints;
  for (const AffineMap& to_image : maps_) {
    found_.push_back(decode_keypoints(logits, 2 * pool_, to_image));
    logits += logits_of_person;
  }
  return found_;
}

}  // namespace maq
